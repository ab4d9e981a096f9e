"""The project's words, as far as a machine judges them: spelling, and what must not be named."""

import re
import subprocess

import pytest
from command_lines import ROOT

README_LINES = 120
SUFFIXES = (".md", ".py", ".ipynb", ".toml", ".html", ".js", ".c", ".cff", ".yml", ".css")
BUILT = ("docs/lab.html", "docs/article.html", "docs/lessons.html", "docs/live.html")

# Each with what to write instead.
TERMS = {
    r"\b[Cc]olour(?=ed|s|ing)?-?map\b": "colormap, as in Matplotlib",
    r"\b([Ee]psilon) [Gg]reedy\b": "epsilon-greedy",
    r"\bDyna Q\b": "Dyna-Q",
    r"\bQ[- ][Ll]earning rate\b": "learning rate",
    r"\b(Pettingzoo|Petting Zoo)\b": "PettingZoo",
    r"\b(Openai Gym|OpenAI Gym)\b": "Gymnasium",
    r"\bpolic(y|ies) written by hand\b": "hand-written policy",
    r"\b(Numpy|Scipy)\b": "NumPy, SciPy",
    r"\b(behavior|neighbor|color scheme)\b(?![-_:=(.])": "British spelling: behaviour, neighbour",
    r"\b(pre-train|post-process)\w*": "train before, process after",
    r"\bfoods per\b": "food items per",
    r"\b(ticks|steps|frames) a second\b": "ticks/s",
    r"\bhome-?ward\b": "towards the queen",
}
# Nothing in the repository names a machine, or what only its makers see.
SECRETS = (
    r"(?<![\w.])/(root|work)/\w",
    r"\bissue #?\d{2}\b",
    r"\b(localhost|127\.0\.0\.1):\d{5}\b",
)


def texts() -> dict[str, str]:
    """The tracked texts by path, except what is built from others."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True).stdout
    paths = [path for path in listed.split("\n") if path.endswith(SUFFIXES) and path not in BUILT]
    return {path: (ROOT / path).read_text("utf-8") for path in paths if (ROOT / path).is_file()}


def found(patterns: object) -> list[str]:
    """Each place that matches a pattern."""
    return [
        f"{path}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]!r}"
        for path, text in texts().items()
        if path != "tests/test_words.py"
        for pattern in patterns
        for match in re.finditer(pattern, text)
    ]


@pytest.mark.parametrize("pattern", TERMS)
def test_terms_are_spelled_in_one_way(pattern):
    assert found([pattern]) == [], f"write: {TERMS[pattern]}"


def test_nothing_names_a_machine():
    assert found(SECRETS) == []


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= README_LINES
