"""Build colony.wasm and ant.wasm from C, with clang and lld: python lab/engine/build.py

It also writes what pages need from the package: lab/page/followers.json (the hand-written policy)
and lab/live/headers.json (facts about the frames of each set of rules).

The files are committed, with their checksums and the compiler in built.json, so that a page needs
no compiler. Other compilers make other bytes with the same results, which tests compare.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from taichi_ants.lab import RULES, decoded, played
from taichi_ants.learners.policies import trail_follower
from taichi_ants.viewer.frames import SECTIONS
from taichi_ants.viewer.recorder import Recorder

ENGINE = Path(__file__).resolve().parent
CELLS = [name for name, kind in SECTIONS.items() if kind == "cell"]
FIRST_SCREEN = "AQAPVUAeZIQHAQrYBAEC"  # its code
SOURCES = {"colony.wasm": "page.c", "ant.wasm": "ant_page.c"}
FLAGS = (
    *("-O3", "-std=c11", "-ffp-contract=off", "-fno-vectorize", "-fno-slp-vectorize"),
    *("-fvisibility=hidden", "-Wall", "-Wno-unknown-pragmas", "-Wno-unused-function"),
)
WASM = (
    *("--target=wasm32", "-nostdlib", "-ffreestanding", "-mbulk-memory", "-msimd128"),
    *("-isystem", str(ENGINE / "wasm"), "-Wl,--no-entry", "-Wl,--export-dynamic"),
    *("-Wl,--strip-all", "-Wl,-z,stack-size=65536"),
)


def build(folder: Path = ENGINE, clang: str = "clang") -> dict[str, str]:
    """Write the .wasm files into a folder, and return their SHA-256 by name, and the compiler."""
    built = {}
    for name, source in SOURCES.items():
        subprocess.run([clang, *FLAGS, *WASM, "-o", folder / name, ENGINE / source], check=True)
        built[name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    version = subprocess.run([clang, "--version"], capture_output=True, text=True, check=True)
    return {"compiler": version.stdout.splitlines()[0], **built}


def followers() -> dict[int, str]:
    """Return the best actions of the hand-written policy by number of states, a letter for each.

    They are the bits of its place after "@".
    """
    tables = [trail_follower(observation) for observation in ("paper", "ants", "queues")]
    best = [[sum(1 << int(a) for a in row.nonzero()[0]) for row in rows] for rows in tables]
    return {len(bits): "".join(chr(64 + one) for one in bits) for bits in best}


def headers() -> dict[str, Any]:
    """Return the headers of frames by rules, without facts about a scene, and the states' names."""
    rules, names = {}, {}
    for number in RULES:
        scene, _ = decoded(FIRST_SCREEN)
        header = Recorder(played({**scene, "rules": number, "ants": 1}, [], 0)).header()
        names[header["n_states"]] = header.pop("names")
        types = {name: "cell" if name in CELLS else kind for name, kind in header["types"].items()}
        observation = dict(header["about"])["observation"]
        for name in ("title", "ranges", "about"):
            del header[name]
        rules[number] = {**header, "types": types, "observation": observation}
    return {"rules": rules, "names": names}


DATA = {"page/followers.json": followers, "live/headers.json": headers}

if __name__ == "__main__":
    facts = build(clang=sys.argv[1] if len(sys.argv) > 1 else "clang")
    (ENGINE / "built.json").write_text(json.dumps(facts, indent=2) + "\n")
    for name, content in DATA.items():
        text = json.dumps(content(), separators=(",", ":")) + "\n"
        (ENGINE.parent / name).write_text(text, "utf-8")
    for name in SOURCES:
        print(f"{name}: {(ENGINE / name).stat().st_size} bytes")
