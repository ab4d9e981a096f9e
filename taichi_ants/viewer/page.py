"""The page: markup, style, script and a recording, put together into one file."""

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
from taichi_ants.engines.runs.traces import Trace
from taichi_ants.errors import expect
from taichi_ants.rendering.writers import check_single, write
from taichi_ants.viewer.frames import Recording
from taichi_ants.viewer.recorder import record_colony, record_trace

# The parts of one script, in this order: what a part uses stands in those before it.
SCRIPTS = ("history.js", "stage.js", "panel.js", "timeline.js", "viewer.js")
STYLES = ("colours.css", "viewer.css")
_NOTEBOOK_HEIGHT = 720  # pixels
# Notebooks show what is larger as text: a page inside of them would be too slow, or too large.
_MOST_CELLS, _MOST_ANTS, _MOST_STEPS = 200_000, 20_000, 10_000


@cache
def part(name: str) -> str:
    """The text of a part of the page, also for other pages that play a recording."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def page(recording: Recording) -> str:
    """The page that plays a recording, with all that it needs, as HTML; AntsError if it is none."""
    expect("recording", recording, Recording)
    return assemble(
        recording.header["title"], recording=base64.b64encode(recording.to_bytes()).decode()
    )


def content_policy(script: str, style: str, connect: str = "") -> str:
    """Return the Content-Security-Policy of a page with one inline script and one inline style.

    Nothing else runs or loads, and it connects to the address `connect` alone, "" for none. Style
    attributes are allowed, because bars and drawings have their places and colours there.
    """
    digests = [hashlib.sha256(text.encode()).digest() for text in (script, style)]
    scripts, styles = (f"'sha256-{base64.b64encode(one).decode()}'" for one in digests)
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
    """The page with a recording, or with what is needed besides to show what runs now.

    `recording` is in base64, `controls` the markup at the side of the world; `style` and `script`
    stand behind those of the viewer, and `connect` is as in `content_policy`.
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
    """Make sure, before the work begins, that `save_page` can write a page there."""
    return check_single(path, "a page", ".html", ".htm")


def save_page(path: files.PathLike, recording: Recording) -> None:
    """Write the page that plays a recording; a file that exists is replaced.

    Raises:
        AntsError: The file does not end in .html, or cannot be written.
    """
    write(check_page(path), page(recording).encode())


def frame(recording: Recording) -> str:
    """The page inside a frame, for notebooks; raises as `page` does."""
    whole, title = html.escape(page(recording)), html.escape(recording.header["title"])
    size = f'width="100%" height="{_NOTEBOOK_HEIGHT}" style="border: 0"'
    return f'<iframe title="{title}" {size} srcdoc="{whole}"></iframe>'


def notebook(shown: Any) -> str | None:
    """Return what notebooks show of a recording, trace or colony; None if they show text.

    IPython calls it, see `taichi_ants.__init__`.
    """
    if isinstance(shown, Recording):
        return frame(shown)
    if isinstance(shown, Trace):
        small = shown.made is not None and len(shown) <= _MOST_STEPS
        return frame(record_trace(shown)) if small else None
    expect("what is shown", shown, Colony)
    small = shown.grid.size <= _MOST_CELLS and shown.ants <= _MOST_ANTS
    return frame(record_colony(shown)) if small and shown.episode >= 0 else None
