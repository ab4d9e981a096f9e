"""The lab's modules in Node."""

import json
import subprocess
from pathlib import Path
from typing import Any

from command_lines import ROOT

ENGINE = ROOT / "lab" / "engine"


class Node:
    """Node, which answers questions; see answer.js."""

    def __init__(self, folder: Path) -> None:
        command = ["node", ROOT / "tests" / "lab" / "answer.js", folder]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __call__(self, name: str, /, question: Any = None, **more: Any) -> Any:
        to, back = self.process.stdin, self.process.stdout
        assert to is not None
        assert back is not None
        to.write(json.dumps([name, more if question is None else question]) + "\n")
        to.flush()
        return json.loads(back.readline())

    def close(self) -> None:
        """End the process."""
        self.process.communicate()
