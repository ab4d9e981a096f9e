"""Build docs/lab.html, the lab as a single file: python lab/build.py.

The modules of lab/page are joined in the order of MODULES into one script: lines that import are
dropped, and the word "export" is. So each module can also be imported as it is, by Node and by a
type checker. Fonts and WebAssembly are embedded in base64; the page needs no network.
"""

from __future__ import annotations

import base64
import json
import re
import sys
from pathlib import Path

LAB = Path(__file__).parent
PAGE = LAB / "page"
BUILT = LAB.parent / "docs" / "lab.html"
MOST_BYTES = 400_000
# In this order: each module uses only those before it while it is loaded.
MODULES = (
    *("worlds", "engine", "link", "geometry", "looks", "run", "story", "shapes", "draw", "plot"),
    *("mind", "scenes", "daily", "brush", "controls", "train", "address", "film", "embed", "main"),
)
FONTS = (("Newsreader", "500", "newsreader.woff2"), ("Inter", "400 650", "inter.woff2"))
BINARIES = {"COLONY_WASM": "colony.wasm", "ANT_WASM": "ant.wasm"}
_IMPORT = re.compile(r"^import\b[^;]*;\n", re.M)
_NAME = re.compile(r"^(?:async )?(?:const|let|function|class) (\w+)", re.M)


def base64_of(path: Path) -> str:
    """Return the content of a file in base64."""
    return base64.b64encode(path.read_bytes()).decode()


def script() -> str:
    """Return the modules as one script; raise ValueError if two of them declare the same name."""
    parts = [_IMPORT.sub("", (PAGE / f"{name}.js").read_text("utf-8")) for name in MODULES]
    text = re.sub(r"^export ", "", "\n".join(parts), flags=re.M)
    names = _NAME.findall(text)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"two modules declare {twice[0]}; rename it in one of them")
    return text


def page() -> str:
    """Return the whole page; raise ValueError if it is larger than a visitor should wait for."""
    faces = "".join(
        f'@font-face {{ font-family: "{name}"; font-weight: {weight}; font-display: swap; '
        f'src: url(data:font/woff2;base64,{base64_of(PAGE / "fonts" / file)}) format("woff2"); }}\n'
        for name, weight, file in FONTS
    )
    binaries = {name: base64_of(LAB / "engine" / file) for name, file in BINARIES.items()}
    parts = {
        "STYLE": faces + (PAGE / "style.css").read_text("utf-8"),
        "SCRIPT": f"const BINARIES = {json.dumps(binaries)};\n{script()}",
    }
    whole = (PAGE / "page.html").read_text("utf-8")
    for name, text in parts.items():
        whole = whole.replace(f"/* {name} */", text)
    if (size := len(whole.encode())) > MOST_BYTES:
        raise ValueError(f"the page has {size} bytes, at most {MOST_BYTES} are allowed")
    return whole


if __name__ == "__main__":
    BUILT.write_text(page(), encoding="utf-8")
    sys.stdout.write(f"{BUILT}: {len(page().encode()):,} bytes\n")
