"""The lab in a real browser: its story, brushes and controls, and links that Python replays."""

import importlib.util
import itertools
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from browser import Page

from taichi_ants import lab, runtime

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "lab.html"
START = "AQAPVUAeZIQHAQrYBAEC"  # the code of the first screen
QUESTIONS = ("never", "copies", "home", "bridge", "wall", "halves")
SIZES = {"phone": (390, 844), "tablet": (1024, 768), "desk": (1440, 900)}
TWO_FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
CUT_OFF = """[...document.querySelectorAll("button, output, canvas, h1, label")].filter((one) => {
    const { left, right, width } = one.getBoundingClientRect();
    const spills = one.tagName === "BUTTON" && one.scrollWidth > one.clientWidth + 2;
    return width && (left < -1 || right > innerWidth + 1 || spills);
}).map((one) => one.outerHTML)"""
# Texts with too little contrast, and controls without a name.
WEAK = """() => {
    const linear = (v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    const light = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).reduce(
        (sum, v, k) => sum + linear(v / 255) * [0.2126, 0.7152, 0.0722][k], 0);
    const ground = (one) => {
        const colour = getComputedStyle(one).backgroundColor, clear = /, 0\\)/.test(colour);
        return clear && one.parentElement ? ground(one.parentElement) : colour;
    };
    const has = (node) => node.nodeType === Node.TEXT_NODE && node.data.trim();
    return [...document.querySelectorAll("body *:not(option)")].filter(
        (one) => one.checkVisibility() && !one.disabled && [...one.childNodes].some(has)
    ).map((one) => {
        const shades = [light(getComputedStyle(one).color), light(ground(one))];
        return [one.outerHTML, (Math.max(...shades) + 0.05) / (Math.min(...shades) + 0.05)];
    }).filter(([, ratio]) => ratio < 4.5);
}"""
NAMELESS = """[...document.querySelectorAll("button, input, select, canvas")].filter(
    (one) => one.checkVisibility() && !one.textContent.trim() && !one.labels?.length
        && !one.ariaLabel && !one.getAttribute("aria-labelledby")
).map((one) => one.outerHTML)"""


@pytest.mark.parametrize("name", ["lab.html", "article.html", "lessons.html", "live.html"])
def test_the_committed_page_is_built_from_the_modules(name):
    spec = importlib.util.spec_from_file_location("build_lab", ROOT / "lab" / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    text = FILE.with_name(name).read_text(encoding="utf-8")
    assert text == build.BUILDS[name](), "run python lab/build.py"
    assert len(text) < 400_000
    text = re.sub(r"base64,[\w+/=]+", "", text)
    assert set(re.findall(r"https?://[\w.]+", text)) <= {"http://www.w3.org"}  # a namespace


def test_the_modules_have_no_errors_of_types():
    if not (compiler := shutil.which("tsc")):
        pytest.skip("there is no TypeScript here; npm install typescript")
    config = ROOT / "lab" / "page" / "jsconfig.json"
    done = subprocess.run([compiler, "-p", config], capture_output=True, text=True)
    assert done.stdout == ""


class Lab(Page):
    """The page of the lab; time that tests pass by ticks, so it does not play."""

    ready = "window.lab && lab.firstFrame"

    def __init__(self, browser, address="", size="desk", **options):
        super().__init__(browser, FILE.as_uri() + address, SIZES[size], **options)
        self.read("lab.play(false)")

    def visit(self, name):
        """Write a name or a link into the address."""
        self.read("(name) => { location.hash = name; }", name)

    def until(self, condition, most=2000):
        """Advance until a condition holds, then show the words that belong to it."""
        self.read(f"for (let k = 0; k < {most} && !({condition}); k++) lab.advance()")
        assert self.read(condition), condition
        return self.words()

    def words(self):
        self.read("lab.words()")
        return self.tab.inner_text("#headline")

    def point(self, x, y, side=0):
        """Return where a point of geometry.js is in the window."""
        return self.read(
            """([x, y, side]) => {
                const { painter } = lab.sides[side], box = painter.canvas.getBoundingClientRect();
                const [a, b] = painter.at([x, y]);
                return [box.left + a / painter.dpr, box.top + b / painter.dpr];
            }""",
            [x, y, side],
        )

    def drag(self, begin, end):
        (ax, ay), (bx, by) = self.point(*begin), self.point(*end)
        self.tab.mouse.move(ax, ay)
        self.tab.mouse.down()
        self.tab.mouse.move(bx, by, steps=8)
        self.tab.mouse.up()

    def link(self):
        """Return what "Copy link" writes into the address."""
        self.read("lab.play(false)")
        self.read("clearTimeout(lab.address.saving)")  # else it replaces the link soon
        self.tab.click("#copy")
        return self.read("location.hash.slice(1)")


@pytest.fixture
def opened(browser):
    pages = []

    def open_lab(*arguments, **options):
        pages.append(Lab(browser, *arguments, **options))
        return pages[-1]

    yield open_lab
    for page in pages:
        page.close()


@pytest.mark.browser
def test_the_story_follows_what_ants_do(opened):
    page = opened()
    page.read("lab.begin([{ scene: { ...lab.runs[0].scene, seed: 1 } }])")
    assert page.until("lab.runs[0].facts.firstFood >= 0") == "One has found food."
    page.read("lab.begin()")  # on a busy machine, ants have already found food
    assert page.words() == "These 64 ants know nothing."
    assert page.until("lab.runs[0].facts.firstFood >= 0") == "They have found food."  # two at once
    assert page.until("lab.runs[0].facts.firstHome >= 0") == "One brought food home."
    assert page.until("lab.runs[0].engine.deliveries > 1") == "They bring food home."
    assert page.until("lab.runs[0].facts.lanes >= 0") == "Nobody told them the way."
    assert page.tab.inner_text("#call") == "Draw a wall across it."
    axis = page.read("[...document.querySelectorAll('#plot text')].map((one) => one.textContent)")
    assert max(int(word) for word in axis if word.isdigit()) >= page.read("lab.runs[0].perMinute")
    page.until("lab.runs[0].tick >= lab.runs[0].facts.lanes + 150")
    assert "switch Learning off" in page.tab.inner_text("#sub")
    page.drag(*page.read("lab.ui.ghost"))  # where the ghost draws
    page.tab.wait_for_function("lab.runs[0].engine.events.length > 0")
    assert page.until("lab.runs[0].tick > lab.runs[0].wall.last") == "Their way is blocked."
    detour = page.until("lab.runs[0].wall.detour >= 0")
    ticks = page.read("lab.runs[0].wall.detour - lab.runs[0].wall.last")
    assert detour == f"They found a detour in {ticks / 18:.1f} s."
    assert page.tab.inner_text("#call") == "Can you stop them?"


@pytest.mark.browser
def test_a_visit_by_touch_on_a_phone_replays_in_python_to_the_same_hash(opened, capsys):
    page = opened(size="phone", has_touch=True, is_mobile=True, device_scale_factor=2)
    page.until("lab.runs[0].facts.lanes >= 0")
    (ax, ay), (bx, by) = (page.point(*end) for end in page.read("lab.runs[0].suggestion()"))
    touch = page.context.new_cdp_session(page.tab)
    for kind, t in [("touchStart", 0), *(("touchMove", k / 6) for k in range(1, 7))]:
        points = [{"x": ax + (bx - ax) * t, "y": ay + (by - ay) * t}]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.tab.wait_for_function("lab.runs[0].wall && lab.runs[0].wall.crossed")
    assert page.read("scrollY") == 0  # the world takes the touch, the page stays
    changes = {"ants": 80, "epsilon": 0.05, "shaping": 2, "discount": 0.95, "level": 300}
    for name, value in changes.items():
        page.read("([name, value]) => lab.set(name, value)", [name, value])
        page.read("lab.advance()")
    page.until("lab.runs[0].tick >= 400")
    link = page.link()
    assert len(link) < 400
    runtime.start(1)
    visit = lab.replay(link)
    assert visit.tick >= 400
    assert visit.hash == visit.expected_hash == page.read("lab.runs[0].engine.hash()")
    lines = page.read("lab.address.verify()")
    assert lines.count("\n") == 2
    exec(lines, {})  # what a visitor would paste
    assert capsys.readouterr().out.split() == [visit.hash]
    second = opened(f"#{link}", size="phone")
    assert second.read("lab.address.replayed.equal")


@pytest.mark.browser
def test_messages_name_the_moment_that_was_copied_while_the_run_goes_on(opened):
    page = opened("#copies")
    page.read("lab.say(0); lab.play(false)")
    page.read("""navigator.clipboard.writeText = async (text) => {
        window.pasted = text;
        for (let k = 0; k < 5; k++) lab.advance();
    }""")
    ticks = page.read("lab.runs.map((run) => run.tick.toLocaleString('en').replace(',', '\u202f'))")
    page.read("lab.address.copy()")
    assert f"these {ticks[0]} and {ticks[1]} ticks" in page.tab.inner_text("#toast")
    page.read("lab.address.verify()")
    state = page.read("pasted").split()[-1]
    assert f"{state}, the state of the right world" in page.tab.inner_text("#toast")


@pytest.mark.browser
def test_everything_works_by_keyboard(opened):
    page = opened()
    page.tab.focus(".world")
    page.tab.keyboard.press("r")
    for key in (*["ArrowUp"] * 3, "Enter", *["ArrowRight"] * 5, *["ArrowUp"] * 2, "Enter"):
        page.tab.keyboard.press(key)
    page.tab.wait_for_function("!lab.ui.down && lab.runs[0].engine.events.length > 0")
    cells = page.read("lab.runs[0].engine.events.flatMap((event) => event.path).length")
    assert cells == 8  # the cell where the brush was lowered, and seven steps
    page.tab.keyboard.press("z")
    assert page.read("lab.runs[0].engine.events.length") == 0
    playing = page.read("lab.ui.playing")
    page.tab.keyboard.press(" ")
    assert page.read("lab.ui.playing") != playing
    page.tab.focus("#brushes :checked")
    page.tab.keyboard.press("ArrowRight")
    assert page.read("lab.ui.brush") == "food"
    seen = set()
    page.tab.focus("#play")
    for _ in range(60):
        page.tab.keyboard.press("Tab")
        name, outline = page.read(
            """((one) => [one.id || one.dataset.question || one.tagName,
                         getComputedStyle(one).outlineWidth])(document.activeElement)"""
        )
        seen.add(name)
        assert name == "BODY" or outline == "2px"
    wanted = {"c-ants", "c-epsilon", "learns", "c-level", "c-shaping", "c-discount", "rules"}
    wanted |= {"learned", "daily", "train", "restart", "copy", "film", "verify", *QUESTIONS}
    assert seen >= wanted


@pytest.mark.browser
def test_each_control_changes_its_setting_now_or_at_a_restart(opened):
    page = opened()
    move = """([id, step]) => {
        const input = document.getElementById(id);
        input.value = step;
        input.dispatchEvent(new Event("input"));
        input.dispatchEvent(new Event("change", { bubbles: true }));
    }"""
    scene = "lab.runs[0].engine.scene"
    page.read("lab.advance()")
    moves = [("ants", 13, 128), ("epsilon", 20, 0.2), ("level", 3, 200), ("shaping", 4, 4)]
    for name, step, value in moves:
        page.read(move, [f"c-{name}", step])
        assert page.read(f"{scene}.{name}") == value
    page.read(move, ["c-discount", 50])
    page.tab.click("#learns")
    assert page.read(f"[{scene}.discount, {scene}.learns]") == [0.5, 0]
    assert page.read("lab.runs[0].tick") > 0
    page.tab.select_option("#rules", "foraging")
    assert page.read(f"[{scene}.rules, {scene}.ants]") == [7, 128]
    for part, rules in [("directed", 6), ("rightOfWay", 4), ("seesAnts", 0)]:
        page.tab.click(f'[data-part="{part}"]') if page.tab.is_visible("#parts") else None
        assert page.read(f"{scene}.rules") == rules
    page.tab.focus("#rules")  # as a finger does
    assert page.tab.inner_text("#toast").startswith("Rules: what ants see")
    page.tab.click("#more summary")
    page.read(move, ["c-first", 2])
    page.tab.fill("#seed", "7")
    page.tab.press("#seed", "Enter")
    page.tab.select_option("#place", "3")
    page.tab.select_option("#learner", "1")
    names = ("first", "seed", "world", "learner")
    assert [page.read(f"{scene}.{name}") for name in names] == [2, 7, 3, 1]


@pytest.mark.browser
def test_undo_plays_the_run_as_if_the_stroke_had_never_been_drawn(opened):
    page = opened()
    page.until("lab.runs[0].tick >= 100")
    page.drag((-10, 5), (-4, 14))
    page.tab.wait_for_function("lab.runs[0].engine.events.length > 0")
    page.until("lab.runs[0].tick >= 150")
    page.read("lab.undo()")
    visit = lab.replay(page.link())
    assert (visit.tick, visit.equal) == (page.read("lab.runs[0].tick"), True)
    assert page.read("lab.runs[0].engine.events") == []


@pytest.mark.browser
def test_questions_wait_for_a_prediction_and_answer_by_what_they_measure(opened):
    """The link of the last one, of two halves, gives the same states."""
    page = opened()
    expected = {
        "never": lambda f: f[0] > 2 * f[1],
        "copies": lambda f: f[1] < 0.5 * f[0],
        "home": lambda f: f[1] > 2 * f[0],
        "wall": lambda f: f[0] > 1.5 * f[1],
    }
    for name in QUESTIONS:
        page.visit(name)
        page.tab.wait_for_function(f"lab.question && lab.question.id === '{name}'")
        begun = page.read("lab.runs.map((run) => run.tick)")
        page.tab.click("#play")  # refused: first a prediction
        assert not page.read("lab.ui.playing")
        assert page.read("lab.runs.map((run) => run.tick)") == begun
        assert page.tab.is_visible("#options")
        assert page.tab.inner_text("#rate") == "?"  # the rates would give the answer away
        page.read("lab.say(0); lab.play(false)")
        page.until("lab.question.found", most=3000)
        found = page.read("lab.question.found")
        ticks = page.read("lab.question.ticks")
        assert page.read("lab.runs.map((run) => run.tick)") == [tick + ticks for tick in begun]
        said = "You were right." if found["right"] == 0 else "Not what you said."
        assert page.words() == found["head"]
        assert page.tab.inner_text("#sub").startswith(said)
        foods = page.read("lab.runs.map((run) => run.engine.deliveries - run.total[run.start])")
        assert expected.get(name, lambda f: min(f) > 0)(foods), name
    assert opened(f"#{page.link()}", size="phone").read("lab.address.replayed.equal")


@pytest.mark.browser
def test_two_halves_share_world_seed_and_strokes_and_differ_in_one_setting(opened):
    page = opened("#halves")
    page.read("lab.say(0); lab.play(false)")
    worlds = page.read("lab.runs.map(({ engine }) => [engine.scene.seed, engine.scene.world])")
    assert worlds[0] == worlds[1]
    page.read("lab.set('shaping', 5)")
    assert page.read("lab.runs.map((run) => run.engine.scene.shaping)") == [1, 5]
    page.drag((-10, 5), (-4, 14))
    strokes = "lab.runs.map((run) => run.engine.events.filter((event) => event.path))"
    page.tab.wait_for_function(f"{strokes}.every((drawn) => drawn.length)")
    left, right = page.read(strokes)
    assert left == right
    page.tab.wait_for_function("location.hash.includes('~')")  # both halves are in the address


@pytest.mark.browser
def test_a_browser_without_simd_says_what_it_needs(browser):
    context = browser.new_context(offline=True)
    context.add_init_script("WebAssembly.Module = class { constructor() { throw Error('old'); } }")
    tab = context.new_page()
    tab.goto(FILE.as_uri())
    assert "they need WebAssembly with SIMD" in tab.inner_text(".story")
    context.close()


@pytest.mark.browser
def test_a_damaged_link_gives_a_sentence_and_the_first_screen(opened):
    page = opened("#xx")
    for address in ("", "%%%", "AQAPVUAeZIQH;3;00", f"{START};-5", f"{START};abc", "never;5", "~~"):
        if address:
            page.read("document.querySelector('#toast').textContent = ''")
            page.read("lab.begin([{ scene: { ...lab.runs[0].engine.scene, seed: 1 } }])")
            page.visit(address)
            page.tab.wait_for_function("document.querySelector('#toast').textContent")
        assert re.fullmatch(r"This link .+\.", page.tab.inner_text("#toast"))
        assert page.read("lab.runs[0].engine.scene.seed") == 85


@pytest.mark.browser
@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("", r"This link has settings alone: a new run starts with them\."),
        (";999999", ".+: it plays from the start."),
        (";50", r"Replayed 50 ticks in \d+ ms\."),  # no hash, so nothing was compared
    ],
)
def test_a_link_says_what_it_does(opened, more, said):
    page = opened(f"#{START}{more}")
    assert re.fullmatch(said, page.tab.inner_text("#toast"))


@pytest.mark.browser
def test_the_daily_map_is_the_same_for_all_and_its_result_is_a_link(opened):
    page, other = opened("#daily"), opened("#daily", size="phone")
    read = "(({ scene, world }) => [scene.seed, world.rocks, world.foods])(lab.runs[0].engine)"
    assert page.read(read) == other.read(read)
    page.tab.click('#brushes [data-value="rock"]')
    for k in range(12):  # two more than allowed
        page.tab.mouse.click(*page.point(-30 + 4 * k, 20))
        page.read("lab.advance()")
    assert page.read("lab.runs[0].engine.events.length") == 10
    assert page.tab.inner_text("#toast") == "All ten rocks are placed."
    page.until("lab.runs[0].tick >= 2000")
    page.tab.click("#play")  # refused: the link holds the result
    page.read("lab.advance()")
    assert (page.read("lab.runs[0].tick"), page.read("lab.ui.playing")) == (2000, False)
    food = page.read("lab.runs[0].engine.deliveries")
    assert page.words() == f"{food:,} loads of food.".replace(",", "\u202f")
    link = page.link()
    again = opened("#" + link)
    assert again.words() == page.words()
    assert lab.replay(link).deliveries == food
    again.visit("copies")
    again.tab.click("#more summary")
    again.tab.select_option("#place", "5")  # today's map
    assert again.words() == "Today\u2019s map. Most food wins."
    again.tab.fill("#seed", "85")
    again.tab.press("#seed", "Enter")
    assert again.words() == "The map of seed 85. Most food wins."


@pytest.mark.browser
def test_a_course_page_steers_the_lab_in_a_frame(browser, tmp_path):
    course = tmp_path / "course.html"
    course.write_text(f'<iframe src="{FILE.as_uri()}?bare" width=700 height=600></iframe>')
    tab = browser.new_context(offline=True).new_page()
    tab.goto(course.as_uri())
    tab.frames[1].wait_for_function("window.lab && lab.firstFrame")
    ask = """(message) => new Promise((answer) => {
        addEventListener("message", ({ data }) => { if (data.id === message.id) answer(data); });
        frames[0].postMessage(message, "*");
    })"""
    numbers = itertools.count()
    send = lambda **message: tab.evaluate(ask, {**message, "id": next(numbers)})  # noqa: E731
    assert send(lab="pause")["playing"] is False
    tick = send(lab="skip", ticks=200)["sides"][0]["tick"]
    assert tick >= 200
    send(lab="set", name="epsilon", value=0.25)
    facts = send(lab="strokes", strokes=[{"do": "rock", "reach": 1, "path": [[-3, 1], [5, -3]]}])
    assert facts["sides"][0]["wall"]["tick"] == tick
    assert send(lab="set", name="nest", value=1)["message"].startswith("set: nest is not one of")
    assert send(lab="speed", value=100)["message"] == "speed: 100 is not between 0.1 and 64."
    assert send(lab="fly")["message"].startswith("fly is not one of")
    assert send(lab="start", scene="xx")["message"] == "This link is damaged."
    assert send(lab="strokes", strokes="x")["message"].startswith("strokes: `do` is one of")
    assert send(lab="facts")["sides"][0]["tick"] == tick  # nothing has changed
    assert send(lab="start", scene="copies")["story"] == "ask-copies"
    assert send(lab="say", option=9)["message"] == "say: 9 is not between 0 and 2."
    assert send(lab="say", option=2)["story"] == "run-copies"
    assert send(lab="say", option=2)["lab"] == "error"


@pytest.mark.browser
def test_lone_ants_train_in_the_page(opened):
    page = opened()
    page.read("lab.play(true)")
    page.tab.click("#train")
    for key in ("f", " "):  # neither draws, nor pauses or closes
        page.tab.keyboard.press(key)
    assert page.read("[lab.ui.brush, lab.ui.playing, training.open]") == ["rock", True, True]
    page.read("lab.training.one()")
    text = page.tab.inner_text("#t-results")
    assert text.startswith("100 ants, ")
    _, means, halves = page.read("lab.training.curves[0]")
    assert len(means) == len(halves) == 50
    assert means[-1] > means[0]  # they learn
    assert all(0 <= half < 20 for half in halves)
    page.tab.keyboard.press("Escape")
    tick = page.read("lab.runs[0].tick")
    page.tab.wait_for_function("(tick) => lab.runs[0].tick > tick", arg=tick)


@pytest.mark.browser
def test_a_film_has_at_most_three_megabytes(opened):
    page = opened(accept_downloads=True)
    page.read("window.setTimeout = ((later) => (act, ms) => later(act, ms / 3))(setTimeout)")
    with page.tab.expect_download() as download:
        page.tab.click("#film")  # a third of a film
    assert re.fullmatch(r"ants-85-\d+\.(mp4|webm)", download.value.suggested_filename)
    assert 1000 < 3 * page.read("lab.film.bytes") <= 3_000_000


@pytest.mark.browser
@pytest.mark.parametrize("address", ["", "#copies", "#bridge", "#daily"])
def test_nothing_is_cut_off(opened, address):
    page, widths = opened(address), (760, 839, 840, 1200, 1260, 1280, 1366)
    sideways = ((844, 390), (667, 375), (568, 320), (320, 568))
    for width, height in (*SIZES.values(), *sideways, *((width, 768) for width in widths)):
        page.tab.set_viewport_size({"width": width, "height": height})
        page.read(TWO_FRAMES)
        assert page.read("document.documentElement.scrollWidth") <= width
        bar = "document.querySelector('.bar')"
        assert page.read(f"{bar}.scrollWidth - {bar}.clientWidth") == 0, width
        assert page.read(CUT_OFF) == []
        assert page.read("lab.sides[0].canvas.clientHeight") >= 150, (width, height)
        if width > height:
            assert page.read(f"{bar}.getBoundingClientRect().bottom <= innerHeight"), width
        if width >= 840 and height >= 600:  # the first screen has the panel's last buttons
            assert page.read("verify.getBoundingClientRect().bottom <= innerHeight"), width


@pytest.mark.browser
def test_text_has_contrast_and_controls_have_names(opened):
    page = opened("?theme=light#never")
    page.tab.click("#more summary")
    for theme in ("light", "dark"):
        assert page.read("document.documentElement.dataset.theme") == theme
        assert page.read(WEAK) == []
        assert page.read(NAMELESS) == []
        page.tab.select_option("#theme", "dark")


@pytest.mark.browser
def test_reduced_motion_is_respected(opened):
    page = opened(reduced_motion="reduce")
    page.until("lab.runs[0].facts.lanes >= 0")
    assert page.read("lab.ui.still")
    assert page.read("document.getAnimations().length") == 0


@pytest.mark.browser
def test_the_mind_of_an_ant_and_the_arrows_of_the_policy_can_be_seen(opened):
    page = opened()
    page.until("lab.runs[0].tick >= 300")
    page.tab.keyboard.press("l")
    q, r = page.read("((e) => [e.q(e.cells[5]), e.r(e.cells[5])])(lab.runs[0].engine)")
    page.tab.mouse.click(*page.point(1.5 * r, 3**0.5 * (r / 2 - q)))
    assert page.tab.is_visible("#mind")
    ant = page.read("lab.ui.followed")
    assert ant >= 0
    page.read("lab.words()")
    assert page.tab.inner_text("#table .one h3").startswith(f"Ant {ant}, with")
    page.tab.click('#arrows [data-value="loaded"]')
    assert page.read("lab.ui.arrows") == "loaded"
    page.tab.click(".back")
    assert not page.tab.is_visible("#mind")
    assert page.read("lab.ui.arrows") == ""
