"""The live page: the viewer, with controls beside the world."""

from __future__ import annotations

from functools import cache
from importlib import resources

from taichi_ants.viewer.page import assemble

SCRIPTS = (
    "token.js",
    "source.js",
    "tools.js",
    "controls.js",
)  # what a part uses stands in those before it
PARTS = ("controls.html", "live.css", *SCRIPTS)


@cache
def _text(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


@cache
def live_page(server: str) -> str:
    """The page that shows what runs now, as HTML.

    Args:
        server: The only address to which it connects, as "ws://127.0.0.1:8000".
    """
    return assemble(
        "Taichi Ants, live",
        controls=_text("controls.html"),
        style=_text("live.css"),
        script="\n".join(map(_text, SCRIPTS)),
        connect=server,
    )
