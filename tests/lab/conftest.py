"""The lab's modules in Node."""

import shutil

import pytest
from lab_engines import ENGINE, Node


@pytest.fixture(scope="session")
def ask():
    """Node with the committed .wasm files."""
    if shutil.which("node") is None:
        pytest.skip("there is no Node")
    node = Node(ENGINE)
    yield node
    node.close()
