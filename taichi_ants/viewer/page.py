"""Recordings, and their pages: markup, style, script and a recording in a single file."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import zlib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.errors import expect
from taichi_ants.rendering.writers import check_file

# The parts of the script, in this order: each part uses only those before it.
SCRIPTS = ("history.js", "stage.js", "panel.js", "timeline.js", "viewer.js")
STYLES = ("colours.css", "viewer.css")
_NOTEBOOK_HEIGHT = 720  # pixels


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording of a colony, which a page can play.

    Attributes:
        header: Facts about all frames, JSON-compatible, see `Recorder.header`.
        frames: The first snapshot, then the changes up to each later one.
    """

    header: dict[str, Any]
    frames: list[bytes]

    def __len__(self) -> int:
        return len(self.frames)

    def to_bytes(self) -> bytes:
        """Return the compressed recording for a page: its header as JSON, then all frames."""
        header = json.dumps(self.header, separators=(",", ":")).encode()
        header += b" " * (-(len(header) + 4) % 8)  # frames begin at a multiple of eight
        length = len(header).to_bytes(4, "little")
        return zlib.compress(b"".join([length, header, *self.frames]), 9)

    def _repr_html_(self) -> str:
        """Return the page inside an HTML frame, for notebooks."""
        whole, title = html.escape(page(self)), html.escape(self.header["title"])
        size = f'width="100%" height="{_NOTEBOOK_HEIGHT}" style="border: 0"'
        return f'<iframe title="{title}" {size} srcdoc="{whole}"></iframe>'


@cache
def part(name: str, package: str = "taichi_ants.viewer") -> str:
    """Return the text of a part of a page, which is a file in a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def page(recording: Recording) -> str:
    """Return the HTML page that plays a recording; raise AntsError if it is not a recording.

    >>> viewer.page(viewer.record_colony(colony, ticks=2))[:15]
    '<!doctype html>'
    """
    expect("recording", recording, Recording)
    return assemble(
        recording.header["title"], recording=base64.b64encode(recording.to_bytes()).decode()
    )


def content_policy(script: str, style: str, connect: str = "") -> str:
    """Return the Content-Security-Policy of a page with one inline script and one inline style.

    It forbids any other script, style, file or connection, except to the address `connect` ("" for
    none). Style attributes are allowed, because they position and colour bars and drawings.
    """
    digests = [hashlib.sha256(text.encode()).digest() for text in (script, style)]
    scripts, styles = (f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    rules = [
        *("default-src 'none'", f"script-src {scripts}", f"style-src-elem {styles}"),
        *("style-src-attr 'unsafe-inline'", "img-src data:", "base-uri 'none'"),
        "form-action 'none'",
    ]
    return "; ".join([*rules, f"connect-src {connect}"] if connect else rules)


def assemble(
    title: str,
    *,
    recording: str = "",
    controls: str = "",
    style: str = "",
    script: str = "",
    connect: str = "",
) -> str:
    """Return the page with a recording, or with the parts of the live page.

    `recording` is in base64, `controls` is markup for the side of the world. `style` and `script`
    follow those of the viewer; `connect` is as in `content_policy`.
    """
    styles = "\n".join([*map(part, STYLES), style])
    scripts = "\n".join([*map(part, SCRIPTS), script])
    parts = {
        "POLICY": content_policy(f"\n{scripts}\n", f"\n{styles}\n", connect),
        "TITLE": html.escape(title),
        "STYLE": styles,
        "CONTROLS": controls,
        "RECORDING": recording,
        "SCRIPT": scripts,
    }
    whole = part("page.html")
    for name, text in parts.items():
        whole = whole.replace(f"<!-- {name} -->", text)
    return whole


def check_page(path: files.PathLike) -> Path:
    """Return the path of a page after checking that `save_page` can write it."""
    return check_file(path, "a page", ".html", ".htm")


def save_page(path: files.PathLike, recording: Recording) -> None:
    """Write the page that plays a recording; an existing file is replaced.

    Raises AntsError if the file does not end in .html, or is not writable.

    >>> viewer.save_page("ants.html", viewer.record_colony(colony, ticks=2))
    """
    files.write_bytes(check_page(path), page(recording).encode())
