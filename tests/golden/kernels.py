"""Compare compiled kernels with those recorded: python tests/golden/kernels.py [--write]

Taichi names each file of its cache by a hash of the kernel, so equal names are equal kernels. They
do not depend on the version of Python or the place of files. A commit that moves code keeps
them, and with them results and speed. Where kernels change, record the names anew with `--write`,
and let the golden hashes show that results stay. This takes 20 s of processor time.
"""

import json
import os
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parent
ROOT, RECORDED = HERE.parents[1], HERE / "kernels.json"
# Models that use each kernel of the engines and of the rasteriser at least once.
MODELS = """
import record
record.section("nests", 1)
record.section("castes_fields", 1)
record.section("labour_traces", 1)
record.section("planning", 1)
record.section("n_step_sarsa", 1)
record.section("frames")
"""


def compiled() -> list[str]:
    """Return the names of the kernels that the models compile into an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        variables = {"XDG_CACHE_HOME": folder, "TI_ADVANCED_OPTIMIZATION": "0"}
        variables["PYTHONPATH"] = os.pathsep.join(map(str, (ROOT, HERE)))
        others = {name: value for name, value in os.environ.items() if not name.startswith("TI_")}
        command = [sys.executable, "-c", MODELS]
        subprocess.run(command, env=others | variables, check=True, cwd=folder)
        names = (path.stem for path in Path(folder, "taichi_ants", "kernels").glob("*.tic"))
        return sorted(name[:12] for name in names)


def recorded() -> dict[str, list[str]]:
    """Return the recorded names of kernels, by what they depend on besides the kernels."""
    return json.loads(RECORDED.read_text()) if RECORDED.exists() else {}


def version() -> str:
    """Return what the names depend on besides the kernels."""
    return f"Taichi {metadata.version('taichi')}"


if __name__ == "__main__":
    found, expected = compiled(), recorded().get(version(), [])
    gone, new = sorted({*expected} - {*found}), sorted({*found} - {*expected})
    print(f"{len(found)} kernels; {len(gone)} of those recorded are gone, {len(new)} are new")
    if "--write" in sys.argv:
        RECORDED.write_text(json.dumps({version(): found}, indent=1) + "\n")
    elif found != expected:
        raise SystemExit(1)
