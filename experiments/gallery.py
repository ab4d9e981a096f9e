"""Draw all pictures of the README and the docs, and publish the tables of the studies.

`taichi-ants render`, `learning.py` and `policy_sheet.py` draw the pictures in `renders/`. The
pictures in `docs/figures/`, and the tables of their pages, are those of `results/compare`,
`results/colony` and `results/bridge`. If results are missing, the script runs the study first. The
comparison takes less than a minute on two cores; see docs/results/foraging.md and
docs/results/bridge.md for the other two.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import io
    import shutil
    import tempfile
    import threading
    from collections.abc import Iterator
    from contextlib import contextmanager
    from importlib import import_module
    from pathlib import Path
    from typing import Any

    from taichi_ants.commands import render, watch
    from taichi_ants.studies.command_line import Parser, run_command

ROOT = Path(__file__).parents[1]
_MAP = str(ROOT / "experiments" / "maps" / "garden.txt")

# The policy of the study's median seed: 64 ants with rules for queues, trained on far piles.
_POLICY = str(ROOT / "experiments" / "policies" / "far_piles.npz")
_COLONY = [
    *("colony", "--policy", _POLICY, "--world", "far_piles", "--world.seed", "3", "--ants", "64"),
    *("--epsilon", "0.01", "--title", "a colony that learned together"),
]
GALLERY: dict[str, list[str]] = {
    "still.png": [*_COLONY, "--ticks", "500", "--frame-interval", "500", "--size", "1280x720"],
    "colony.gif": [
        *(*_COLONY, "--ticks", "400", "--frame-interval", "8", "--fps", "10"),
        *("--size", "800x450"),
    ],
    "episode.gif": [
        *("episode", "--world", _MAP, "--size", "960x540", "--fps", "4"),
        *("--title", "SARSA in a garden"),
    ],
    "learning.gif": ["learning", "--size", "1200x480", "--fps", "12"],
    "policy_sheet.png": [
        *("policy_sheet", "--seed", "7"),
        *("--title", "What SARSA has learned in the world of the paper, after 500 episodes"),
    ],
}


# The page of the same colony with a followed ant, and the live page after some episodes of
# learning; they need Chromium and Playwright.
VIEWER, LIVE = "viewer.png", "live.png"
_FOLLOWED, _TICK, _WINDOW = 12, 330, (1280, 760)
_LEARNED, _LIVE_WINDOW = 25_000, (1440, 860)
_WALL = (3, 12, 0), (0, 11, 4)  # cells between which a wall of rock is drawn

# Figure in docs/figures -> figure in results.
FIGURES = {
    "learning_curves.png": "compare/figures/learning_curves.png",
    "return_against_deliveries.png": "compare/figures/return_against_deliveries.png",
    "colony_rules.png": "colony/figures/rules.png",
    "colony_scaling.png": "colony/figures/scaling.png",
    "colony_training.png": "colony/figures/training.png",
    "colony_elsewhere.png": "colony/figures/elsewhere.png",
    "bridge.png": "bridge/figures/bridge.png",
    "bridge_late.png": "bridge/figures/late.png",
}


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add = parser.add_argument
    folder = "write the folders renders/ and docs/figures/ here"
    add("--folder", type=Path, default=ROOT, help=folder)
    skip = "make only renders/ and the pictures of pages, which takes half a minute"
    add("--no-figures", action="store_true", help=skip)
    return parser.parse_args(arguments)


def make_gallery(settings: argparse.Namespace) -> None:
    """Make all pictures, and replace existing ones."""
    for name, arguments in GALLERY.items():
        path = settings.folder / "renders" / name
        draw, chosen = drawing([*arguments, "--out", str(path)])
        draw(chosen)
    with chromium() as browser:
        if browser is None:
            print(f"Skipped {VIEWER} and {LIVE}, which need Chromium and Playwright.")
        else:
            make_viewer(settings.folder / "docs" / "figures", browser)
            make_live(settings.folder / "docs" / "figures", browser)
    if not settings.no_figures:
        make_figures(settings.folder / "docs" / "figures")


def drawing(arguments: list[str]) -> tuple[Any, argparse.Namespace]:
    """Return the function that draws a picture, and its settings."""
    if arguments[0] in ("episode", "colony"):
        return render.run, render.parse_arguments(arguments)
    script = import_module(arguments[0])
    return script.show, script.parse_arguments(arguments[1:])


@contextmanager
def chromium() -> Iterator[Any]:
    """Yield a browser, or None if there is none."""
    path = shutil.which("chromium") or shutil.which("google-chrome")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        path = None
    if path is None:
        yield None
        return
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


def opened(browser: Any, url: str, window: tuple[int, int]) -> Any:
    """Return a page in a window of this size, after the world is drawn."""
    width, height = window
    page = browser.new_page(viewport={"width": width, "height": height}, bypass_csp=True)
    page.goto(url)
    page.locator("#place b").wait_for()
    return page


def make_viewer(folder: Path, browser: Any) -> None:
    """Take a picture of the page that plays a colony."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "colony.html")
        follow = ["--ticks", "400", "--follow", str(_FOLLOWED), "--out", str(path)]
        render.run(render.parse_arguments([*_COLONY, *follow]))
        page = opened(browser, path.as_uri(), _WINDOW)
        page.evaluate("tick => { viewer.player.go(tick); }", _TICK)
        page.locator("#place b", has_text=str(_TICK)).wait_for()
        _keep(page.screenshot(), folder / VIEWER)


def make_live(folder: Path, browser: Any) -> None:
    """Take a picture of the live page, after ants have learned and a wall has been drawn."""
    from taichi_ants.live.choices import Choices
    from taichi_ants.live.server import SessionServer
    from taichi_ants.live.session import Session

    choices = Choices(watch.policies([]))
    session = Session(choices.setup(watch.START))
    room = SessionServer(session, choices)
    thread = threading.Thread(target=room.run, daemon=True)
    thread.start()
    page = opened(browser, room.url, _LIVE_WINDOW)
    page.fill("#speed", "100")  # as fast as possible
    page.click("#play")
    page.wait_for_function(f"live.state.ticks >= {_LEARNED}")
    page.fill("#speed", "90")
    page.wait_for_function("viewer.history.frames.at(-1).tick % 1000 > 500")
    page.click("#play")
    page.wait_for_function("!live.running")
    page.keyboard.press("2")  # rock, with a brush of seven cells
    page.keyboard.press("]")
    box = page.locator("#world").bounding_box()
    places = "cells => cells.map((c) => viewer.stage.toPage(viewer.history.grid.centre(c)))"
    wall = [int(session.colony.grid.index(cell)) for cell in _WALL]
    (x0, y0), (x1, y1) = page.evaluate(places, wall)
    page.mouse.move(box["x"] + x0, box["y"] + y0)
    page.mouse.down()
    page.mouse.move(box["x"] + x1, box["y"] + y1)
    page.mouse.up()
    page.keyboard.press("n")
    page.keyboard.press("ArrowRight")
    page.locator("#ant .reward").wait_for()
    page.evaluate("document.activeElement.blur()")
    page.wait_for_timeout(500)
    _keep(page.screenshot(), folder / LIVE)
    room.end()
    thread.join()


def _keep(picture: bytes, path: Path) -> None:
    """Write a picture in 256 colours, one of them that of the queen, who has few pixels.

    So the history of pictures in Git stays small.
    """
    from PIL import Image

    from taichi_ants.rendering.colours import CELL_QUEEN, channels

    path.parent.mkdir(parents=True, exist_ok=True)
    palette = Image.new("P", (1, 1))
    with Image.open(io.BytesIO(picture)) as image:
        others = image.convert("RGB").quantize(255).getpalette()
        palette.putpalette([*others, *channels(CELL_QUEEN).tolist()])
        few = image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        few.save(path, optimize=True)
    print(f"{path}: {path.stat().st_size // 1000} kB")


def make_figures(folder: Path) -> None:
    """Copy figures and tables of the studies, after running missing studies."""
    import bridge
    import colony
    import compare
    import published

    from taichi_ants.studies.command import planned, run_study

    results = ROOT / "results"
    for script, words in ((compare, ()), (colony, ("study",)), (bridge, ())):
        settings = script.parse_arguments([*words, "--out", str(results / script.__name__)])
        run_study(settings, planned(script.__file__, settings))
        for table in (settings.out / "tables").glob("*.json"):
            shutil.copy(table, published.data_file(table.stem))
    published.fill()
    for name, source in FIGURES.items():
        _keep((results / source).read_bytes(), folder / name)


if __name__ == "__main__":
    run_command(lambda: make_gallery(parse_arguments()))
