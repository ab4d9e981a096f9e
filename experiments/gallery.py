"""Makes all pictures of the README and the docs anew: those of `renders/` and of `docs/figures/`.

Those of `renders/` are made by `render.py`; the arguments below can be given to it by hand as well.
Those of `docs/figures/` are those of the finished studies in `results/compare`, `results/colony`
and `results/bridge`; a study that is not there is run first, which takes about one minute for the
comparison, six for the colony and five for the bridge on two cores. A million ants take another.
"""

from __future__ import annotations

import argparse
import io
import shutil
import tempfile
from pathlib import Path

from taichi_ants.commands import render
from taichi_ants.studies.command_line import Parser, run_command

ROOT = Path(__file__).parents[1]
_MAP = str(ROOT / "experiments" / "maps" / "garden.txt")

# That of the study's median seed: 64 ants that queue, trained together in worlds of far piles.
_POLICY = str(ROOT / "experiments" / "policies" / "far_piles.npz")
_COLONY = [
    *("colony", "--policy", _POLICY, "--world", "far_piles", "--world-seed", "3", "--ants", "64"),
    *("--epsilon", "0.01", "--title", "a colony that learned together"),
]
GALLERY: dict[str, list[str]] = {
    "still.png": [*_COLONY, "--ticks", "500", "--every", "500", "--size", "1280x720"],
    "colony.gif": [
        *(*_COLONY, "--ticks", "400", "--every", "8", "--fps", "10"),
        *("--size", "800x450"),
    ],
    "episode.gif": [
        *("episode", "--world", _MAP, "--size", "960x540", "--fps", "4"),
        *("--title", "SARSA in a garden"),
    ],
    # Seed 7 is worth a look: after 10 episodes the ant has learned that steps towards the queen
    # pay, but not yet to give the food away, and circles beside her.
    "learning.gif": [
        *("learning", "--seed", "7", "--max-steps", "100"),
        *("--size", "1200x480", "--fps", "12"),
        *("--title", "SARSA: the same ant before and after learning"),
    ],
    "policy_sheet.png": [
        *("sheet", "--seed", "7"),
        *("--title", "What SARSA has learned in the world of the paper, after 500 episodes"),
    ],
}


# The page of the same colony, while an ant of it is followed; it needs Chromium and Playwright.
VIEWER = "viewer.png"
_FOLLOWED, _TICK, _WINDOW = 12, 330, (1280, 760)

# Tracked figure -> the figure of a study that it is.
FIGURES = {
    "learning_curves.png": "compare/figures/learning_curves.png",
    "return_against_deliveries.png": "compare/figures/return_against_deliveries.png",
    "colony_rules.png": "colony/figures/rules.png",
    "colony_scaling.png": "colony/figures/scaling.png",
    "colony_training.png": "colony/figures/training.png",
    "colony_elsewhere.png": "colony/figures/elsewhere.png",
    "million.png": "million.png",
    "bridge.png": "bridge/figures/bridge.png",
}
_QUEUEING = str(ROOT / "experiments" / "policies" / "queueing.npz")
MILLION = [
    *("live", "--policy", _QUEUEING, "--sharing", "fixed", "--epsilon", "0.01"),
    *("--ants", "64", "--colonies", "15625", "--ranges", "30", "30", "30", "--ticks", "300"),
]


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """The settings of the command line."""
    parser = Parser(__doc__.split("\n", 1)[0], epilog=__doc__.split("\n", 1)[1])
    add = parser.add_argument
    add("--folder", type=Path, default=ROOT, help="put renders/ and docs/figures/ there")
    add("--no-figures", action="store_true", help="only renders/, which takes half a minute")
    return parser.parse_args(arguments)


def make_gallery(settings: argparse.Namespace) -> None:
    """Make all pictures; the ones that exist are replaced."""
    for name, arguments in GALLERY.items():
        path = settings.folder / "renders" / name
        render.show(render.parse_arguments([*arguments, "--out", str(path)]))
    make_viewer(settings.folder / "docs" / "figures")
    if not settings.no_figures:
        make_figures(settings.folder / "docs" / "figures")


def make_viewer(folder: Path) -> None:
    """Take a picture of the page that plays a colony, where there is a browser."""
    from PIL import Image

    browser = shutil.which("chromium") or shutil.which("google-chrome")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        browser = None
    if browser is None:
        print(f"{VIEWER} is left out: it needs Chromium and Playwright")
        return
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        path = Path(place, "colony.html")
        follow = ["--ticks", "400", "--follow", str(_FOLLOWED), "--out", str(path)]
        render.show(render.parse_arguments([*_COLONY, *follow]))
        chromium = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        width, height = _WINDOW
        page = chromium.new_page(viewport={"width": width, "height": height})
        page.goto(path.as_uri())
        page.locator("#place b").wait_for()
        page.evaluate("tick => { viewer.player.go(tick); }", _TICK)
        page.locator("#place b", has_text=str(_TICK)).wait_for()
        picture = page.screenshot()
        chromium.close()
    folder.mkdir(parents=True, exist_ok=True)
    with Image.open(io.BytesIO(picture)) as image:
        image.convert("RGB").quantize(256).save(folder / VIEWER, optimize=True)
    print(f"{folder / VIEWER}: {(folder / VIEWER).stat().st_size // 1000} kB")


def make_figures(folder: Path) -> None:
    """Keep some figures of the studies, and of a million ants; a missing study is run first.

    They are kept in 256 colours, so that their history stays small.
    """
    from PIL import Image

    from taichi_ants.commands import bridge, colony, compare

    results = ROOT / "results"
    compare.compare(compare.parse_arguments(["--out", str(results / "compare")]))
    colony.study(colony.parse_arguments(["study", "--out", str(results / "colony")]))
    colony.live(colony.parse_arguments([*MILLION, "--figure", str(results / "million.png")]))
    bridge.bridge(bridge.parse_arguments(["--out", str(results / "bridge")]))
    folder.mkdir(parents=True, exist_ok=True)
    for name, source in FIGURES.items():
        with Image.open(results / source) as image:
            image.convert("RGB").quantize(256).save(folder / name, optimize=True)
        print(f"{folder / name}: {(folder / name).stat().st_size // 1000} kB")


if __name__ == "__main__":
    run_command(lambda: make_gallery(parse_arguments()))
