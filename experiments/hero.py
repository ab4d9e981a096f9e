"""Make the film at the top of the README: the lab, whose ants learn from nothing and find a detour.

The command opens `docs/lab.html` in Chromium. In the page, it runs 100 colonies of the first
screen, each with its own seed, and measures when lanes form and how long the ants search for a way
round a wall. It films the colony whose two times are closest to the median, and writes
`hero_dark.webp` and `hero_light.webp`. It needs Playwright, and takes some minutes.
"""

from __future__ import annotations

from taichi_ants.studies.interruption import stoppable

with stoppable():  # Ctrl-C also works during these slow imports
    import argparse
    import io
    from collections.abc import Iterator
    from pathlib import Path
    from typing import Any

    import numpy as np
    from gallery import chromium
    from PIL import Image

    from taichi_ants import files
    from taichi_ants.errors import AntsError
    from taichi_ants.studies.command_line import Parser, run_command

ROOT = Path(__file__).parents[1]
PAGE, SHOWN = (1280, 800), (960, 600)  # pixels: the window, and its picture
FPS, QUALITY = 20, 54
PAUSE, STROKE, AFTER = 60, 24, 180  # ticks from lanes to the wall, of its stroke, after the detour
LONGEST = 1500  # ticks after which a colony counts as one that found no detour
COURSE = (
    f"globalThis.PAUSE = {PAUSE}, globalThis.STROKE = {STROKE}, globalThis.LONGEST = {LONGEST};"
)
COURSE += """
// Pass a tick of a run, and draw the next piece of its wall.
globalThis.pass = (run, act) => {
  const { lanes } = run.facts, { engine } = run;
  const drawn = lanes < 0 ? -1 : run.tick - lanes - PAUSE;
  if (drawn === 0) {
    const [from, to] = run.suggestion().map(([x, y]) => cellAt(x, y));
    run.stroke = [from, ...lineTo(from, to)].map(([q, r]) => engine.at(q, r));
  }
  if (drawn >= 0 && drawn < STROKE) {
    const at = (n) => Math.floor(n * run.stroke.length / STROKE);
    const path = run.stroke.slice(at(drawn), at(drawn + 1));
    if (path.length) act({ do: "rock", reach: 1, path });
  }
  run.advance();
};
globalThis.timesOf = (seed) => {
  const run = new Run(lab.module, { ...SCENE, seed }), end = () => run.wall?.detour ?? -1;
  while (end() < 0 && run.tick < LONGEST) pass(run, (event) => run.apply(event));
  return [run.facts.firstHome, run.facts.lanes, end() < 0 ? LONGEST : end() - run.wall.last];
};
"""
START = """(seed) => {
  window.requestAnimationFrame = () => 0; // time passes by `show`
  lab.begin([{ scene: { ...SCENE, seed } }]);
  lab.play(true);
}"""
SHOW = """([tick, now]) => {
  const [run] = lab.runs, { ui } = lab;
  while (run.tick < tick) pass(run, (event) => {
    lab.act(event);
    const cell = event.path[event.path.length - 1];
    ui.pointer = [run.engine.q(cell), run.engine.r(cell)];
  });
  const drawn = run.tick - run.facts.lanes - PAUSE;
  ui.down = run.facts.lanes >= 0 && drawn >= 0 && drawn < STROKE + 1;
  if (!ui.down) ui.pointer = null;
  [ui.playing, lab.owed] = [false, tick - Math.floor(tick) || 1];
  lab.frame(now);
  lab.words();
}"""
STILL = "* { animation: none !important; transition: none !important; }"


def opened(browser: Any, theme: str) -> Any:
    """Return a tab with the lab in a theme."""
    width, height = PAGE
    tab = browser.new_page(viewport={"width": width, "height": height})
    tab.goto(f"{(ROOT / 'docs' / 'lab.html').as_uri()}?theme={theme}")
    tab.wait_for_function("window.lab && lab.firstFrame")
    tab.add_style_tag(content=STILL)
    tab.evaluate(COURSE)
    return tab


def most_typical(times: np.ndarray) -> int:
    """Return the colony whose times of lanes and of the search are closest to the median."""
    ranks = np.argsort(np.argsort(times[:, 1:], axis=0, kind="stable"), axis=0, kind="stable")
    return int(np.abs(ranks - (len(times) - 1) / 2).max(axis=1).argmin())


def film(tab: Any, seed: int, times: np.ndarray) -> Iterator[Image.Image]:
    """Yield the pictures of a colony, which are shown at `FPS`."""
    first, lanes, search = (int(one) for one in times)
    wall = lanes + PAUSE
    detour = wall + STROKE + search
    seconds = 0.0, 1.6, 2.5, 3.1, 4.0, 5.0, 6.4, 8.0
    ticks = 0, 30, first, lanes, wall, wall + STROKE, detour, detour + AFTER
    tab.evaluate(START, seed)
    for number in range(round(FPS * seconds[-1])):
        tick = float(np.interp(number / FPS, seconds, ticks))
        tab.evaluate(SHOW, [tick, 1000 * number / FPS])
        picture = Image.open(io.BytesIO(tab.screenshot()))
        yield picture.convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS)


def parse_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Return the settings of the command line."""
    parser = Parser(__doc__)
    add, renders = parser.add_argument, ROOT / "renders"
    add("--folder", type=Path, default=renders, help="write both films here")
    add("--seeds", type=int, default=100, help="choose among so many colonies")
    return parser.parse_args(arguments)


def make_hero(settings: argparse.Namespace) -> None:
    """Choose the typical colony, and film it in both themes."""
    with chromium() as browser:
        if browser is None:
            raise AntsError("there is no browser to film; install Chromium and Playwright.")
        tab = opened(browser, "dark")
        times = np.array([tab.evaluate("timesOf", seed) for seed in range(settings.seeds)])
        seed = most_typical(times)
        for name, of in zip(("first delivery", "lanes", "search"), times.T, strict=True):
            low, middle, high = np.percentile(of, [0, 50, 100])
            print(f"{name}: median {middle:g} ticks ({low:g} to {high:g}); seed {seed}: {of[seed]}")
        for theme in ("dark", "light"):
            first, *others = film(opened(browser, theme), seed, times[seed])
            content, path = io.BytesIO(), settings.folder / f"hero_{theme}.webp"
            options = {"save_all": True, "append_images": others, "duration": 1000 // FPS}
            first.save(content, "WEBP", **options, loop=0, quality=QUALITY, method=4)
            files.write_bytes(path, content.getvalue())
            print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    run_command(lambda: make_hero(parse_arguments()))
