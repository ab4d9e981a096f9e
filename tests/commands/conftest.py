"""The command `sweep`, called in the process of the test."""

from pathlib import Path

import pytest
from command_lines import call

from taichi_ants.measures.measure import MEASURES


@pytest.fixture
def sweep(tmp_path, capsys, monkeypatch):
    """Calls the command on a file of this text, in a new folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(MEASURES, "yours", {})

    def called(text, *more):
        Path("my.toml").write_text(text, "utf-8")
        return call("sweep", ["my.toml", *more], capsys)

    return called
