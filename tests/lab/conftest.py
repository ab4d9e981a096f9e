"""The lab's modules in Node, and its colony in C for this processor."""

from __future__ import annotations

import shutil

import pytest
from lab_engines import ENGINE, Node, native_colony
from throughput import compiler


@pytest.fixture(scope="session")
def ask():
    """Node with the committed .wasm files."""
    if shutil.which("node") is None:
        pytest.skip("there is no Node")
    node = Node(ENGINE)
    yield node
    node.close()


@pytest.fixture(scope="session")
def native(tmp_path_factory):
    """The colony of page.c, compiled for this processor."""
    if (command := compiler(1)) is None:
        pytest.skip("there is no C compiler")
    return native_colony(command, tmp_path_factory.mktemp("c"))
