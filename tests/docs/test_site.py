"""The site: it builds without a warning, its links lead somewhere, and it asks no other server."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest
from command_lines import ROOT

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
