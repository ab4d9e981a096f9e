"""Pages: markup, style, script and a recording in a single file."""

from __future__ import annotations

import base64
import hashlib
import html
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from taichi_ants import files
from taichi_ants.engines.colony.colony import Colony
from taichi_ants.engines.runs.results import Trace
from taichi_ants.errors import expect
from taichi_ants.rendering.snapshots import picture
from taichi_ants.rendering.writers import check_file, png, write
from taichi_ants.viewer.frames import Recording
from taichi_ants.viewer.recorder import record_colony, record_trace
from taichi_ants.worlds.world import World

# The parts of the script, in this order: each part uses only those before it.
SCRIPTS = ("history.js", "stage.js", "panel.js", "timeline.js", "viewer.js")
STYLES = ("colours.css", "viewer.css")
_NOTEBOOK_HEIGHT = 720  # pixels
# Above these limits, notebooks show text, because a page would be too slow or too large.
_MOST_CELLS, _MOST_ANTS, _MOST_STEPS = 200_000, 20_000, 10_000


@cache
def part(name: str, package: str = "taichi_ants.viewer") -> str:
    """Return the text of a part of a page, which is a file in a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def page(recording: Recording) -> str:
    """Return the HTML page that plays a recording; raise AntsError if it is not a recording."""
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

    Raises:
        AntsError: The file does not end in .html, or is not writable.
    """
    write(check_page(path), page(recording).encode())


def frame(recording: Recording) -> str:
    """Return the page inside an HTML frame, for notebooks; raises as `page` does."""
    whole, title = html.escape(page(recording)), html.escape(recording.header["title"])
    size = f'width="100%" height="{_NOTEBOOK_HEIGHT}" style="border: 0"'
    return f'<iframe title="{title}" {size} srcdoc="{whole}"></iframe>'


def notebook(media: Any) -> str | None:
    """Return HTML that shows a world, recording, trace or colony; None if it is too large.

    IPython calls this function, see `taichi_ants.__init__`.
    """
    if isinstance(media, Recording):
        return frame(media)
    if isinstance(media, World):
        if media.grid.size > _MOST_CELLS:
            return None
        # The alternative text is for screen readers.
        content = base64.b64encode(png(picture(media), optimize=True)).decode()
        return f'<img alt="{html.escape(repr(media))}" src="data:image/png;base64,{content}">'
    if isinstance(media, Trace):
        small = media.arguments is not None and len(media) <= _MOST_STEPS
        return frame(record_trace(media)) if small else None
    expect("the object", media, Colony)
    if media.grid.size > _MOST_CELLS or media.ants > _MOST_ANTS or media.episode < 0:
        return None
    return frame(record_colony(media))
