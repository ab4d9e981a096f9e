"""The pages in a real browser: sort, filter, open, play, print."""

import pytest
from browser import Page, printed, shares
from finished_pages import colony_html, comparison_html, results
from paper.claims import claims_rows

pytestmark = pytest.mark.browser

VERDICTS = ["supported", "equivalent", "undecided", "contradicted", "not tested"]


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reports")
    for name, text in (("comparison", comparison_html()), ("colony", colony_html())):
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return folder


class Report(Page):
    """A page of results."""

    ready = "window.report"


@pytest.fixture
def opened(browser, paths):
    """Opens a page without a network; at the end nothing must have gone wrong."""
    pages = []

    def show(name: str, width: int = 1280, **options):
        pages.append(Report(browser, paths / f"{name}.html", (width, 800), **options))
        return pages[-1].tab

    yield show
    for page in pages:
        page.close()


@pytest.mark.parametrize("name", ["comparison", "colony"])
def test_the_page_works_under_its_policy(browser, paths, name):
    faults, context = [], browser.new_context(offline=True)
    tab = context.new_page()
    tab.on("console", lambda message: faults.append(message.text))
    tab.goto((paths / f"{name}.html").as_uri())
    before = tab.get_attribute("html", "data-theme")
    tab.click("#theme")
    assert tab.get_attribute("html", "data-theme") != before
    assert tab.evaluate("getComputedStyle(document.body).margin") == "0px"
    context.close()
    assert faults == []


def shown(tab) -> list[list[str]]:
    """The cells of the lines that are not hidden, without details."""
    script = """() => [...document.querySelectorAll(".statements tbody tr:not([hidden])")]
      .map((one) => [...one.cells]
        .map((cell) => (cell.querySelector("summary") ?? cell).textContent.trim()))"""
    return tab.evaluate(script)


def test_claims_are_sorted(opened):
    tab = opened("comparison")
    order = shown(tab)
    for column, key in ((0, str.lower), (1, None)):
        head = tab.locator(".statements th").nth(column)
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == "ascending"
        up = [cells[column] for cells in shown(tab)]
        if key:
            assert up == sorted(up, key=key)
        head.locator("button").press("Enter")  # by keyboard, too
        assert head.get_attribute("aria-sort") == "descending"
        assert shown(tab)[0][column] == up[-1]
        head.locator("button").click()
        assert shown(tab) == order
    tab.locator(".statements th button").nth(3).click()
    places = [VERDICTS.index(cells[3]) for cells in shown(tab)]
    assert places == sorted(places)
    assert len(set(places)) > 1


def test_claims_are_filtered(opened):
    tab = opened("comparison")
    tab.fill(".filters input", "sarsa STABLE")
    assert 0 < len(shown(tab)) < 10
    assert all("SARSA" in cells[0] for cells in shown(tab))
    assert tab.inner_text(".filters output") == f"{len(shown(tab))} of 51 claims"
    tab.fill(".filters input", "")
    tab.select_option(".filters [name=verdict]", "contradicted")
    rows = claims_rows(results().audit)
    wanted = {row["statement"] for row in rows if row["verdict"] == "contradicted"}
    assert {cells[0] for cells in shown(tab)} == wanted
    tab.fill(".filters input", "no such words")
    assert shown(tab) == []
    assert tab.inner_text(".filters output") == "0 of 51 claims"


def test_a_phone_sorts_by_a_choice_that_the_heads_share(opened):
    tab = opened("comparison", width=390)
    order = shown(tab)
    choice = tab.locator(".filters [name=order]")
    assert not tab.locator(".statements thead").is_visible()
    choice.select_option("Truncates ↓")
    verdicts = [VERDICTS.index(cells[2]) for cells in shown(tab)]
    assert verdicts == sorted(verdicts, reverse=True) != sorted(verdicts)
    tab.set_viewport_size({"width": 1280, "height": 800})
    head = tab.locator(".statements th").nth(2)
    assert not choice.is_visible()
    assert head.get_attribute("aria-sort") == "descending"
    head.locator("button").click()
    assert shown(tab) == order
    assert choice.input_value() == ""


def test_details_open_one_by_one_or_at_once_and_stay_on_paper(opened):
    tab = opened("comparison")
    told, opener = tab.locator(".statements .told"), tab.locator(".filters [name=details]")
    tab.locator(".statements summary").first.focus()
    tab.keyboard.press("Enter")
    assert "Tested on" in told.first.inner_text()
    tab.locator(".statements summary").first.click()
    assert not told.first.is_visible()
    opener.click()
    tab.wait_for_function(
        """document.querySelector("[name=details]").innerText.startsWith("Close")"""
    )
    tab.emulate_media(media="print")
    assert all(one.is_visible() for one in told.all())
    assert not opener.is_visible()
    tab.emulate_media(media="screen")
    opener.click()
    assert not any(one.is_visible() for one in told.all())


PIXELS = """number => [...document.querySelectorAll(".player")[number].querySelectorAll("canvas")]
  .map((one) => one.toDataURL())"""


def test_players_play(opened):
    tab, last = opened("comparison"), 34
    player = tab.locator(".player").first
    assert player.locator("output").inner_text() == f"{last // 2} / {last}"  # something goes on
    player.locator("button").click()
    assert tab.evaluate("report.players[0].player.moment") < last // 2  # it begins at the start
    player.locator("button").click()
    slider = player.locator("input")
    slider.focus()
    tab.keyboard.press("End")
    end = tab.evaluate(PIXELS, 0)
    tab.keyboard.press("Home")
    assert player.locator("output").inner_text() == f"0 / {last}"
    assert tab.evaluate(PIXELS, 0) != end
    player.locator("button").click()
    assert player.locator("button").get_attribute("aria-label").startswith("Pause: ")
    tab.wait_for_function("report.players[0].player.moment > 2")
    player.locator("button").click()
    assert player.locator("button").get_attribute("aria-label").startswith("Play: ")
    moment = tab.evaluate("report.players[0].player.moment")
    assert player.locator("output").inner_text() == f"{moment} / {last}"
    tab.evaluate("report.players[0].player.speed = 500")
    player.locator("button").click()
    tab.wait_for_function("!report.players[0].player.playing")
    assert tab.evaluate("report.players[0].player.moment") == last
    assert tab.evaluate(PIXELS, 0) == end
    for number in (0, 1):  # one at a time
        tab.locator(".player button").nth(number).click()
    assert tab.evaluate("report.players.map((one) => one.player.playing)") == [False, True]


@pytest.mark.parametrize("name", ["comparison", "colony"])
def test_the_first_print_is_complete(opened, name, tmp_path):
    """All claims with their numbers, the method, the files, and the players with their worlds."""
    tab = opened(name, color_scheme="dark")
    wanted = tab.evaluate("[...document.querySelectorAll('.statements td:first-child')]"
                          ".map((one) => one.dataset.key)")  # fmt: skip
    told = tab.evaluate("document.querySelector('main').textContent").count("Tested on")
    text, sheets = printed(tab, tmp_path)
    letters = text.replace(" ", "").replace("-", "")  # lines can be broken anywhere
    assert len(wanted) == 51
    for one in (*wanted, "Method", "Files in this folder", "computed from the files"):
        assert one.replace(" ", "").replace("-", "") in letters, one
    assert text.count("Tested on") == told
    tab.click("#theme")
    light = tab.evaluate("['empty', 'queen'].map((name) => report.players[0].stage.colours[name])")
    empty, queen = shares(sheets, *light)
    assert empty > 0.005
    assert queen > 1e-5


@pytest.mark.parametrize("name", ["comparison", "colony"])
def test_nothing_is_wider_than_a_phone(opened, name):
    tab = opened(name, width=390)
    tab.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    assert tab.evaluate("document.documentElement.scrollWidth") == 390
    assert tab.locator(".plot svg").first.bounding_box()["width"] >= 600  # it can be scrolled
    size = "[...document.querySelectorAll('main p')].map((p) => getComputedStyle(p).fontSize)"
    assert min(float(one.removesuffix("px")) for one in tab.evaluate(size)) > 13
