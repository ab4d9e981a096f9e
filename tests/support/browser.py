"""A headless Chromium for tests of pages."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from taichi_ants import Colony

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")

# The world of the last moment of a page.
WORLD = """() => {
  const { history } = viewer, moment = history.length - 1, frame = history.frames[moment];
  const { ground, trail } = history.worldAt(moment);
  return { ground: [...ground], trail: [...trail], cells: [...frame.cells].sort((a, b) => a - b),
           loaded: frame.poses.reduce((sum, pose) => sum + (pose >> 3 & 1), 0),
           tick: frame.tick, deliveries: frame.deliveries };
}"""


@contextmanager
def started() -> Iterator[Any]:
    """Yield a browser: the variable CHROMIUM, or a command on the PATH; without, skip the test."""
    path = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, _NAMES)), None)
    if path is None:
        pytest.skip("there is no Chromium here; install the package chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        # Chromium has no sandbox as root, and test machines have no graphics processor.
        browser = driver.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-gpu"]
        )
        yield browser
        browser.close()


def printed(tab: Any, folder: Path) -> tuple[str, list[np.ndarray]]:
    """Return the text of a page as the browser prints it, in one line, and its sheets as RGB."""
    missing = [tool for tool in ("pdftotext", "pdftoppm") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"there is no {missing[0]} here; install the package poppler-utils")
    path = folder / "printed.pdf"
    tab.pdf(path=path)
    text = subprocess.run(["pdftotext", path, "-"], check=True, capture_output=True, text=True)
    subprocess.run(["pdftoppm", "-r", "70", "-png", path, folder / "sheet"], check=True)
    sheets = [np.array(Image.open(one).convert("RGB")) for one in sorted(folder.glob("sheet*.png"))]
    return " ".join(text.stdout.split()), sheets


def shares(sheets: list[np.ndarray], *colours: str) -> list[float]:
    """Return the largest share of a sheet with each colour, "#rrggbb"; print changes it a bit."""
    wanted = [np.array([*bytes.fromhex(one[1:])]) for one in colours]
    same = [[(abs(sheet - one) <= 3).all(-1).mean() for sheet in sheets] for one in wanted]
    return [float(max(of_sheets)) for of_sheets in same]


class Page:
    """A page opened from a file or a server, with the errors on it."""

    ready = "window.viewer"  # holds when its scripts have run

    def __init__(
        self, browser: Any, path: Path | str, size: tuple[int, int] = (1280, 720), **options: Any
    ):
        width, height = size
        url = path if isinstance(path, str) else path.as_uri()
        # `bypass_csp`, because the page forbids the evaluation of text, which Playwright needs.
        usual = {"viewport": {"width": width, "height": height}, "offline": url.startswith("file")}
        self.context = browser.new_context(**usual, bypass_csp=True, **options)
        self.tab = self.context.new_page()
        self.faults: list[str] = []
        self.tab.on("console", lambda message: self.faults.append(message.text))
        self.tab.on("pageerror", lambda error: self.faults.append(str(error)))
        self.tab.goto(url)
        self.tab.wait_for_function(self.ready)
        self.settle()

    def settle(self) -> None:
        """Wait until the viewer has drawn everything."""
        self.tab.wait_for_function("!window.viewer || !viewer.dirty && !viewer.player.playing")

    def read(self, script: str, argument: Any = None) -> Any:
        """Return the result of a script."""
        return self.tab.evaluate(script, argument)

    def text(self, selector: str) -> str:
        """Return the visible text in one line."""
        self.settle()
        return " ".join(self.tab.inner_text(selector).split())

    def press(self, *keys: str) -> None:
        for key in keys:
            self.tab.keyboard.press(key)
        self.settle()

    def click(self, selector: str) -> None:
        self.tab.click(selector)
        self.settle()

    def click_cell(self, cell: int) -> None:
        """Click the middle of a cell."""
        x, y = self.read("cell => viewer.stage.toPage(viewer.history.grid.centre(cell))", cell)
        box = self.tab.locator("#world").bounding_box()
        self.tab.mouse.click(box["x"] + x, box["y"] + y)
        self.settle()

    @property
    def moment(self) -> int:
        return self.read("viewer.player.moment")

    def close(self) -> None:
        self.context.close()
        assert not self.faults


def world_of(colony: Colony) -> dict[str, Any]:
    """Return what `WORLD` is in the engine."""
    snapshot = colony.snapshot()
    return {
        "ground": snapshot.ground.tolist(),
        "trail": snapshot.trail.tolist(),
        "cells": sorted(snapshot.ant_cells.tolist()),
        "loaded": int(snapshot.ant_carries.sum()),
        "tick": colony.ticks,
        "deliveries": int(colony.outcome().deliveries[0, 0]),
    }
