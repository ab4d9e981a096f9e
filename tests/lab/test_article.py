"""The article in a real browser: ten worlds that run in view, and what their controls change."""

from pathlib import Path

import pytest
from browser import Page

from taichi_ants import runtime

FILE = Path(__file__).parents[2] / "docs" / "article.html"
# The worlds in their order, each with options by their results, the lowest first.
ORDER = {"alone": (0, 3), "scent": (0, 1, 2, 3), "direction": (0, 1, 2), "copies": (2, 1, 3)}
ORDER |= {"bridge": (3, 0), "chance": (0, 2), "forget": (3, 1), "wall": (3, 2, 1, 0)}
ORDER |= {"learning": (1, 0), "pay": (3, 0)}


class Article(Page):
    ready = "window.article"

    def __init__(self, browser, width=1024, height=768, **options):
        super().__init__(browser, FILE, (width, height), **options)

    def read(self, name, script):
        find = f"const world = article.worlds.find(({{ id }}) => id === '{name}')"
        return self.tab.evaluate(f"{find}; {script}")

    def until(self, name, condition):
        find = f"article.worlds.find(({{ id }}) => id === '{name}')"
        self.tab.wait_for_function(f"((world) => {condition})({find})")

    def look_at(self, name):
        self.tab.locator(f"[data-piece={name}] canvas").scroll_into_view_if_needed()
        self.until(name, "world.inView && world.run")
        return self.read(name, "world.run.tick")


@pytest.fixture
def opened(browser):
    pages = []
    yield lambda *size, **options: pages.append(Article(browser, *size, **options)) or pages[-1]
    pages[0].close()


@pytest.mark.browser
def test_worlds_run_in_view_and_their_controls_change_what_is_measured(opened):
    page, before = opened(), None
    assert page.tab.evaluate("article.worlds.map(({ id }) => id)") == [*ORDER]
    assert page.tab.evaluate("article.worlds.every(({ run }) => !run)")  # none is in view yet
    for name, options in ORDER.items():
        began = page.look_at(name)
        page.until(name, f"world.run.tick > {began}")
        if before:
            stopped = page.read(before, "[world.inView, world.run.tick]")
            page.tab.wait_for_timeout(150)
            assert page.read(before, "[world.inView, world.run.tick]") == stopped
            assert not stopped[0]
        results = []
        for option in options:
            page.tab.check(f"[name={name}][value='{option}']")
            ends = "world.results[world.option] !== null"
            page.read(name, f"while (!({ends})) world.advance(); world.tell()")
            results.append(page.read(name, "world.results[world.option]"))
            shown = page.tab.inner_text(f"[data-piece={name}] .option:has(:checked) output")
            assert float(shown) == results[-1]
        assert results == sorted(set(results)), name
        before = name


@pytest.mark.browser
def test_with_reduced_motion_worlds_wait_and_everything_works_by_keyboard(opened, capsys):
    page = opened(390, 844, reduced_motion="reduce")
    tab = page.tab
    assert tab.evaluate("document.documentElement.scrollWidth") == 390
    assert page.look_at("wall") == 1000  # lanes are there; then the wall
    tab.wait_for_timeout(150)
    assert page.read("wall", "world.run.tick") == 1000
    tab.focus("[data-piece=wall] .play")
    tab.keyboard.press("Enter")
    page.until("wall", "world.run.tick > 1000")
    tab.keyboard.press("Enter")
    tab.focus("[name=wall]:checked")
    tab.keyboard.press("ArrowUp")
    assert page.read("wall", "world.option") == 1
    tab.evaluate("article.python()")
    lines = tab.inner_text("#python")
    runtime.start(1)
    exec(lines, {})  # what a reader would paste
    assert capsys.readouterr().out.strip() == lines[-16:]
    address = tab.evaluate("document.querySelector('[data-piece=wall] .open').href")
    tab.goto(address)
    tab.wait_for_function("window.lab && lab.address.replayed.equal && lab.runs[0].tick >= 1000")


@pytest.mark.browser
def test_twenty_seeds_give_the_medians_of_the_text(opened):
    page = opened()
    page.look_at("chance")
    page.tab.click("[data-piece=chance] .seeds")
    page.tab.wait_for_selector("[data-piece=chance] small")
    medians = page.tab.locator("[data-piece=chance] small").all_inner_texts()
    assert medians == ["median 2", "median 51", "median 56", "median 22"]
