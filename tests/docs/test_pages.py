"""The README, the pages, whose Python blocks run and print what they say, and the site.

The blocks of a page are one program, from top to bottom. A block after `<!-- not run: reason -->`
is left out. A comment behind a `print` begins with what it prints, if it begins with a value, and
so do the lines of a `text` block that follows.
"""

import re
import subprocess
import sys
from itertools import islice
from pathlib import Path
from urllib.parse import unquote

import pytest
from command_lines import ROOT, environment

AT_ONCE = "\t"  # before a line that is printed right after the one before it
BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<code>.*?)^```$", re.M | re.S)
PAGES = {
    str(path.relative_to(ROOT)): text
    for path in sorted((ROOT / "docs").rglob("*.md"))  # the README's run below
    if "```python\n" in (text := path.read_text("utf-8"))
}


def program_and_lines(text: str) -> tuple[str, list[str]]:
    """The program of a page, and the lines that it prints according to the page."""
    parts, lines, runs = [], [], False
    for block in BLOCK.finditer(text):
        if block["language"] == "python":
            runs = "<!-- not run: " not in text[: block.start()].rpartition("\n\n")[2]
            if runs:
                parts.append(block["code"])
                lines += re.findall(r"^print\(.*\) +# ([-\d([{TF].*)$", block["code"], re.M)
        elif block["language"] == "text" and runs:
            first, *others = filter(None, block["code"].splitlines())
            lines += [first, *(AT_ONCE + line for line in others)]
    return "\n\n".join(parts), lines


def test_at_most_thirty_pages_are_written_by_hand():
    """Apart from cards of models, lessons, the page of a broken link, and files of the root.

    A page is generated if most of it is.
    """
    by_hand = set()
    for page in (ROOT / "docs").rglob("*.md"):
        text = page.read_text("utf-8")
        own = re.sub(r"<!-- generated: .*?<!-- end -->", "", text, flags=re.S)
        is_generated = "api" in page.parts or len(own) < len(text) / 2 or own.startswith("```{incl")
        if not is_generated and not {"models", "lessons", "404.md"} & {*page.parts}:
            by_hand.add(page)
    assert 25 < len(by_hand) <= 30, by_hand


# Scripts of models have tests of their own, see tests/examples/.
MARKED = [
    pytest.param(page, marks=pytest.mark.long if "models/" in page else pytest.mark.slow)
    for page in PAGES
]


@pytest.mark.parametrize("page", MARKED)  # a process each, and some train
def test_the_program_of_a_page_prints_what_the_page_says(page, kernels, tmp_path):
    program, lines = program_and_lines(PAGES[page])
    script = tmp_path / "page.py"  # a file, because rules and learners are read from their source
    script.write_text(program, "utf-8")
    for folder in ("experiments", "examples"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    how = {"cwd": tmp_path, "env": environment(kernels), "capture_output": True, "text": True}
    done = subprocess.run([sys.executable, str(script)], timeout=300, check=False, **how)
    assert done.returncode == 0, done.stderr
    printed = filter(None, done.stdout.splitlines())
    for line in lines:  # in this order; lines between them are not on the page
        text, at_once = line.removeprefix(AT_ONCE), line.startswith(AT_ONCE)
        rest = islice(printed, 1) if at_once else printed
        begins = (re.match(rf"{re.escape(one)}(?![\w.])", text) for one in rest)
        assert any(begins), (text, done.stdout)


# The README: its code, its numbers, its links and its pictures.

README = (ROOT / "README.md").read_text("utf-8")
WORDS = " ".join(README.split())


def test_the_ten_lines_print_their_number(capsys):
    code, other = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    [promised] = re.findall(r"print\(.*\)  # (\d+) food items delivered\n", code)
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == f"{promised}\n"
    exec(compile(code.replace("queueing", "paper"), "README.md", "exec"), {})
    assert f"in the same world, {capsys.readouterr().out.strip()}." in WORDS
    exec(compile(other, "README.md", "exec"), {})


def anchors(text: str) -> set[str]:
    """The anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_links_and_pictures_are_there():
    links = re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)", README)
    assert len(links) > 15
    for path, anchor in links:
        assert (ROOT / path).exists(), path
        assert not anchor or anchor in anchors((ROOT / path).read_text("utf-8")), anchor
    pictures = re.findall(r'src(?:set)?="([^"]+)"', README)
    assert len(pictures) == 8
    for path in pictures:
        assert (ROOT / path).stat().st_size < 3_000_000, path
    alts = re.findall(r"<img [^>]*alt=\"([^\"]+)\"", README)
    assert len(alts) == README.count("<img ") == README.count("<picture>") == 4


# The site builds without a warning, its links lead somewhere, and it asks no other server.

APPS = {path.name for path in (ROOT / "docs").glob("*.html")}  # pages that others test
_LINK = re.compile(r"""<(?:a|img|link|script|iframe|source)\b[^>]*?\s(?:href|src)="([^"]+)""")
_LOADED = re.compile(
    r"""<(?:img|link|script|iframe|source)\b[^>]*?\s(?:href|src)="(https?://[^"]+)"""
)


def test_the_front_page_says_what_the_readme_says():
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    page = (ROOT / "docs" / "index.md").read_text("utf-8")
    findings = re.findall(r"^### (.*)$", page, re.MULTILINE)
    shown = re.findall(r"!\[([^\]]+)\]", page)
    assert (len(findings), len(shown)) == (3, 6)
    first, paper = re.findall(r"^(?:Taichi Ants simulates|\*Ants and)(?:.+\n)+", page, re.MULTILINE)
    for words in (*findings, *shown, first, paper):
        assert " ".join(words.split()) in readme


@pytest.mark.long  # a minute
def test_the_site_builds_and_its_links_lead_somewhere(tmp_path):
    pytest.importorskip("furo")
    options = ["-W", "--keep-going", "-q", "-d", str(tmp_path / "trees")]
    site = tmp_path / "site"
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, "docs", str(site)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    pages = {path: path.read_text("utf-8") for path in site.rglob("*.html")}
    pages = {path: text for path, text in pages.items() if path.name not in APPS}
    assert len(pages) > 60
    broken = []
    for page, text in pages.items():
        assert not _LOADED.findall(re.sub(r'<link rel="canonical"[^>]*>', "", text)), page.name
        for link in _LINK.findall(text):
            place, _, anchor = unquote(link).partition("#")
            if re.match(r"[a-z]+:", link):
                continue
            root = site if place.startswith("/") else page.parent
            target = Path(root, place.lstrip("/").partition("?")[0]) if place else page
            target = target / "index.html" if target.is_dir() else target
            there = target.is_file() and (
                not anchor or target not in pages or f'id="{anchor}"' in pages[target]
            )
            if not there:
                broken.append(f"{page.relative_to(site)}: {link}")
    assert broken == []
    listed = (site / "sitemap.xml").read_text("utf-8")
    assert "start/quickstart.html</loc>" in listed
    assert "lab.html</loc>" in listed
    front = pages[site / "index.html"]
    assert 'property="og:image"' in front
    assert (site / "_static" / "card.png").stat().st_size > 10_000
    assert 'href="/start/install.html"' in pages[site / "404.html"]
