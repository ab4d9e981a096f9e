"""The lessons as a page, in a real browser without a network: a student's way through them."""

import json
import re
from pathlib import Path

import pytest
from browser import Page

DOCS = Path(__file__).parents[2] / "docs"
FILE = DOCS / "lessons.html"
# Experiments whose numbers are those of the notebook, cell by cell.
SAME = ("markov", "sweep", "values", "update", "wrong", "planning", "opens", "two", "practice")
FUNCTION = "function qLearning(q, s, a, r, sNext, terminated, alpha, gamma) { %s }"
PLAIN = "q[s][a] += alpha * (r + %s * Math.max(...q[sNext]) - q[s][a]);"


class Lessons(Page):
    ready = "window.lessons"


@pytest.fixture
def opened(browser):
    pages = []

    def open_page(address, width=1024):
        pages.append(Lessons(browser, FILE.as_uri() + address, (width, 768)))
        return pages[-1].tab

    yield open_page
    for page in pages:
        page.close()


def numbers(text):
    return {float(number) for number in re.findall(r"\d+(?:\.\d+)?", text)}


def saved_numbers():
    """For each experiment, the numbers in the saved results of the cell that it stands for."""
    found = {}
    for path in sorted((DOCS / "lessons").glob("*.ipynb")):
        for cell in json.loads(path.read_text("utf-8"))["cells"]:
            if name := cell["metadata"].get("page"):
                outputs = cell.get("outputs", ())
                texts = ["".join(output.get("text", ())) for output in outputs]
                found[name] = numbers("".join([*texts, *cell["source"]]))
    return found


@pytest.mark.browser
def test_a_question_waits_for_a_prediction_and_a_function_is_checked_step_by_step(opened):
    tab = opened("#3")
    assert tab.locator("article:visible").count() == 1
    field, run = (
        tab.locator("article:visible .predict textarea >> nth=2"),
        tab.locator("[data-run=q_learning]"),
    )
    check, result = run.locator("button"), run.locator(".result")
    answer = "article:visible > details:has(> summary > b:text-is('Why'))"
    tab.set_default_timeout(10_000)
    assert check.is_disabled()
    assert tab.locator(answer).locator("visible=true").count() == 0
    field.focus()
    tab.keyboard.type("Equal to the last bit")
    assert check.is_enabled()
    for written, said in (
        ("} function next( {", "This JavaScript does not run yet: Unexpected token '}'."),
        ("q[s][b] = r;", "Your function stopped with an error: b is not defined."),
        ("while (true) { }", "Your function stopped with an error: a loop does not end."),
        ("q[s][a] += alpha * r;", "In episode 0, step"),
        (PLAIN % "gamma", "In episode 1, step 148, "),  # the second delivery, as in the notebook
        (PLAIN % "(terminated ? 0 : gamma)", "nearly: in episode 0, step"),
    ):
        run.locator(".code").fill(FUNCTION % written)
        check.click()
        tab.wait_for_function("!document.querySelector('[data-run=q_learning] button').disabled")
        assert said in result.inner_text()
        assert ("wrong" in result.get_attribute("class")) == ("nearly" not in said)
    why = tab.locator(answer).locator("visible=true").first
    assert why.get_attribute("open") is None
    why.locator("summary").press("Enter")
    assert "equal to the last bit" in why.inner_text()
    tab.locator("[data-run=episodes] [aria-label='A step forward']").click()
    assert "step 118: it observes foraging" in tab.inner_text("[data-run=episodes] .tells")


@pytest.mark.browser
def test_every_answer_is_right_and_the_numbers_are_those_of_the_notebooks(opened):
    tab = opened("?teachers#6")
    results = tab.evaluate(
        """async (same) => {
            const found = {}, lone = lessons.lone, show = () => 0;
            for (const { element, experiment } of lessons.places) {
                const { code, answer, name, go } = experiment, id = element.dataset.run;
                let refused = "";
                if (code) try { await go({ lone, own: written(code, name), show }); }
                catch (error) { refused = error.message; }
                if (!code && !same.includes(id)) continue;
                const own = code && written(answer, name);
                const { say = "", rows = [] } = await go({ lone, own, show });
                found[id] = { say, refused, rows: rows.flat().join(" "), code: Boolean(code) };
            }
            return found;
        }""",
        [*SAME],
    )
    saved = saved_numbers()
    for name, found in results.items():
        assert bool(found["refused"]) == found["code"], name
        assert found["refused"].endswith((".", "?")) or not found["code"]
        if name in ("q_learning", "sarsa"):
            assert found["say"].endswith("to the last bit.")
        if name in SAME:
            for number in numbers(found["rows"]):  # halves of the last digit are rounded up or down
                assert min(abs(number - one) for one in saved[name]) < 0.051, (name, number)
    assert {*SAME} <= {*results}


@pytest.mark.browser
def test_the_teachers_edition_has_notes_and_open_answers(opened):
    for address, teaches in (("#5", False), ("?teachers#5", True)):
        tab = opened(address)
        lesson = tab.locator("article:visible")
        for shown, all_of in ((".teachers:visible", ".question"), ("details[open]", "details")):
            assert lesson.locator(shown).count() == (
                lesson.locator(all_of).count() if teaches else 0
            )
    link = tab.get_attribute("#edition", "href")
    tab.click("#edition")
    assert tab.url.endswith(link)
    assert tab.locator("article:visible h1").count() == 1
    tab.click("nav a >> nth=0")
    assert tab.locator("article:visible").count() == 0


@pytest.mark.browser
def test_nothing_is_wider_than_a_phone_and_worlds_run(opened):
    tab = opened("?teachers#1", width=390)
    assert tab.locator(".result.wrong").count() == 0
    for number in range(1, 7):
        tab.click(f"nav a >> nth={number}")
        tab.wait_for_selector(f"article:visible h1:has-text('Lesson {number}')")
        assert tab.evaluate("document.documentElement.scrollWidth") == 390
        for figure in tab.locator(f"[id='{number}'] figure").all():
            figure.locator("canvas").scroll_into_view_if_needed()
            tab.wait_for_function(
                "(id) => lessons.worlds.find((world) => world.id === id).run?.tick > 1",
                arg=figure.get_attribute("data-piece"),
            )
            assert "undefined" not in figure.inner_text()
