"""Build the pages of the lab, each a single file in docs: python lab/build.py.

The modules of a page are joined in the order given into one script: lines that import are dropped,
and the word "export" is; imported JSON becomes a constant. So each module can also be imported as
it is, by Node and by a type checker. Fonts and WebAssembly are embedded in base64; the pages need
no network.
"""

from __future__ import annotations

import base64
import json
import re
import runpy
import sys
from functools import partial
from pathlib import Path
from typing import NamedTuple

from taichi_ants.live.server import PARTS
from taichi_ants.viewer.page import assemble, part

LAB = Path(__file__).parent
DOCS = LAB.parent / "docs"


class Page(NamedTuple):
    """A page: its markup, styles and modules. Each module uses only those before it at first."""

    markup: str
    styles: tuple[str, ...]
    modules: tuple[str, ...]


_ENGINE = ("worlds", "engine", "link")
_SHARED = (*_ENGINE, "geometry", "looks", "run", "story", "shapes", "draw")
_LAB = (
    *("plot", "mind", "scenes", "daily", "brush", "controls", "figures", "train", "address"),
    *("film", "embed", "main"),
)
PAGES = {
    "lab.html": Page(
        "page/page.html",
        ("page/base.css", "page/style.css"),
        tuple(f"page/{name}.js" for name in (*_SHARED, *_LAB)),
    ),
    "article.html": Page(
        "article/article.html",
        ("page/base.css", "article/article.css"),
        (
            *(f"page/{name}.js" for name in (*_SHARED, "scenes")),
            *(f"article/{name}.js" for name in ("pieces", "world", "article")),
        ),
    ),
    "lessons.html": Page(
        "lessons/lessons.html",
        ("page/base.css", "article/article.css", "lessons/lessons.css"),
        (
            *(f"page/{name}.js" for name in (*_SHARED, "mind", "scenes", "figures")),
            *(f"article/{name}.js" for name in ("pieces", "world")),
            *("../docs/lessons/page/random.js", "../docs/lessons/page/room.js"),
            *("../docs/lessons/page/experiments.js", "lessons/lessons.js"),
        ),
    ),
}
BINARIES = {"COLONY_WASM": "colony.wasm", "ANT_WASM": "ant.wasm"}
MOST_BYTES = 400_000  # that a visitor should wait for
FONTS = LAB / "page" / "fonts"
FACES = (("Newsreader", "500", "newsreader.woff2"), ("Inter", "400 650", "inter.woff2"))
_IMPORT = re.compile(r"^import\b[^;]*;\n", re.M)
_DATA = re.compile(r'^import (\w+) from "([^"]+)" with { type: "json" };$', re.M)
# Names at the start of a line, also several in a row: const A = 1, B = 2;
_NAMES = re.compile(r"^(?:async )?(?:const|let|function|class) ((?:\w+ = [^,(\[{\n]+, )*\w+)", re.M)


def base64_of(path: Path) -> str:
    """Return the content of a file in base64."""
    return base64.b64encode(path.read_bytes()).decode()


def with_data(path: Path) -> str:
    """Return a module in which imported JSON is a constant."""
    data = lambda found: f"const {found[1]} = {(path.parent / found[2]).read_text('utf-8')};"  # noqa: E731
    return _DATA.sub(data, path.read_text("utf-8"))


def script(modules: tuple[str, ...]) -> str:
    """Return the modules as one script; raise ValueError if two of them declare the same name."""
    parts = [_IMPORT.sub("", with_data(LAB / name)) for name in modules]
    text = re.sub(r"^export ", "", "\n".join(parts), flags=re.M)
    names = [re.sub(" = .*", "", one) for row in _NAMES.findall(text) for one in row.split(", ")]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two modules declare {twice[0]}; rename it in one of them")
    return text


def page(name: str) -> str:
    """Return a whole page; raise ValueError if it is larger than a visitor should wait for."""
    one = PAGES[name]
    faces = "".join(
        f'@font-face {{ font-family: "{family}"; font-weight: {weight}; font-display: swap; '
        f'src: url(data:font/woff2;base64,{base64_of(FONTS / file)}) format("woff2"); }}\n'
        for family, weight, file in FACES
    )
    code = script(one.modules)
    found = {key: base64_of(LAB / "engine" / BINARIES[key]) for key in BINARIES if key in code}
    head, body = (LAB / one.markup).read_text("utf-8").split("<body>\n")
    parts = {
        "HEAD": head,
        "BODY": body,
        "STYLE": faces + "\n".join((LAB / style).read_text("utf-8") for style in one.styles),
        "SCRIPT": f"const BINARIES = {json.dumps(found)};\n{code}",
    }
    if name == "lessons.html":
        text = runpy.run_path(str(DOCS / "lessons" / "page" / "text.py"))
        parts["CONTENTS"], parts["LESSONS"] = text["lessons"](DOCS / "lessons")
    whole = (LAB / "page" / "frame.html").read_text("utf-8")
    for key, text in parts.items():
        whole = whole.replace(f"/* {key} */\n", f"{text}\n")
    if (size := len(whole.encode())) > MOST_BYTES:
        raise ValueError(f"{name} has {size} bytes, at most {MOST_BYTES} are allowed")
    return whole


def live_page() -> str:
    """Return the live page of the package with a worker in place of the server."""
    controls, style, _socket, *scripts = (part(name, "taichi_ants.live") for name in PARTS)
    worker = script((*(f"page/{name}.js" for name in _ENGINE), "live/worker.js"))
    texts = {"WORKER": f"{worker}\nserve();", "COLONY": base64_of(LAB / "engine" / "colony.wasm")}
    lines = (f"const {name} = {json.dumps(text)};" for name, text in texts.items())
    scripts = [(LAB / "live" / "transport.js").read_text("utf-8"), *lines, *scripts]
    whole = assemble("Taichi Ants, live", controls=controls, style=style, script="\n".join(scripts))
    # The worker is a part of the page, and compiles WebAssembly.
    return whole.replace("script-src '", "worker-src blob:; script-src 'wasm-unsafe-eval' '", 1)


BUILDS = {**{name: partial(page, name) for name in PAGES}, "live.html": live_page}

if __name__ == "__main__":
    for name, build in BUILDS.items():
        (DOCS / name).write_text(build(), encoding="utf-8")
        sys.stdout.write(f"{DOCS / name}: {(DOCS / name).stat().st_size:,} bytes\n")
