"""Build the pages of the lab, each a single file in docs: python lab/build.py.

The modules of a page are joined into one script, each after those that it imports: lines that
import are dropped, and the word "export" is; imported JSON becomes a constant. So each module can
also be imported as it is, by Node and by a type checker. Fonts and WebAssembly are embedded in
base64; the pages need no network.
"""

from __future__ import annotations

import base64
import json
import re
import runpy
import sys
from functools import partial
from pathlib import Path

from taichi_ants.live.server import PARTS
from taichi_ants.viewer.page import assemble, part

LAB = Path(__file__).resolve().parent
DOCS = LAB.parent / "docs"


_LESSONS = ["article/article.css", "lessons/lessons.css"]
# Markup, styles after the common ones, and the module that imports all others.
PAGES = {
    "lab.html": ("page/page.html", ["page/style.css"], "page/main.js"),
    "article.html": ("article/article.html", ["article/article.css"], "article/article.js"),
    "lessons.html": ("lessons/lessons.html", _LESSONS, "lessons/lessons.js"),
}
BINARIES = ("colony.wasm", "ant.wasm")
MOST_BYTES = 400_000  # that a visitor should wait for
FONTS = LAB / "page" / "fonts"
_IMPORT = re.compile(r"^import\b[^;]*;\n", re.M)
_MODULE = re.compile(r'^import\b[^;]* from "([^"]+\.js)";$', re.M)
_DATA = re.compile(r'^(import (\w+) from "([^"]+)" with { type: "json" };)$', re.M)
# Names at the start of a line, also several in a row: const A = 1, B = 2;
_NAMES = re.compile(r"^(?:async )?(?:const|let|function|class) ((?:\w+ = [^,(\[{\n]+, )*\w+)", re.M)


def base64_of(path: Path) -> str:
    """Return the content of a file in base64."""
    return base64.b64encode(path.read_bytes()).decode()


def modules_of(path: Path) -> list[Path]:
    """Return a module after those that it imports, each once."""
    names = _MODULE.findall(path.read_text("utf-8"))
    imported = [one for name in names for one in modules_of((path.parent / name).resolve())]
    return list(dict.fromkeys((*imported, path)))


def script(name: str) -> str:
    """Return a module with all that it imports; ValueError if two of them declare the same name."""
    parts = []
    for path in modules_of(LAB / name):
        text = path.read_text("utf-8")
        for line, constant, data in _DATA.findall(text):
            content = (path.parent / data).read_text("utf-8")
            text = text.replace(line, f"const {constant} = {content};")
        parts.append(_IMPORT.sub("", text))
    text = re.sub(r"^export ", "", "\n".join(parts), flags=re.M)
    names = [re.sub(" = .*", "", one) for row in _NAMES.findall(text) for one in row.split(", ")]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two modules declare {twice[0]}; rename it in one of them")
    return text


def page(name: str) -> str:
    """Return a whole page; raise ValueError if it is larger than a visitor should wait for."""
    markup, styles, module = PAGES[name]
    style = "\n".join((LAB / one).read_text("utf-8") for one in ("page/base.css", *styles))
    for font in FONTS.glob("*.woff2"):
        style = style.replace(f"url({font.name})", f"url(data:font/woff2;base64,{base64_of(font)})")
    code = script(module)
    found = {one: base64_of(LAB / "engine" / one) for one in BINARIES if f'"{one}"' in code}
    head, body = (LAB / markup).read_text("utf-8").split("<body>\n")
    parts = {
        "HEAD": head,
        "BODY": body,
        "STYLE": style,
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
    texts = {
        "WORKER": script("live/worker.js") + "\nserve();",
        "COLONY": base64_of(LAB / "engine" / "colony.wasm"),
    }
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
