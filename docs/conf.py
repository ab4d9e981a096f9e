"""The site: `python -m sphinx -W docs build/site` builds it, and makes no request."""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from xml.sax.saxutils import escape

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.addnodes import download_reference

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(ROOT))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
URLS = PROJECT.get("urls", {})

project = "Taichi Ants"
author = PROJECT["authors"][0]["name"]
copyright = author
release = PROJECT["version"]
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "notfound.extension",
    "sphinxext.opengraph",
]
exclude_patterns = ["lessons/class"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
default_role = "py:obj"
highlight_language = "none"  # commands and what they print; Python blocks name their language

# Pages. Notebooks hold their results, so that building the site runs nothing.
nb_execution_mode = "off"
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_update_mathjax = False
html_math_renderer = "mathml"

html_theme = "furo"
html_title = project
html_static_path = ["_static"]
html_favicon = "_static/favicon.svg"
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
if "Repository" in URLS:
    html_theme_options = {"source_repository": URLS["Repository"], "source_branch": "main"}
    html_theme_options["source_directory"] = "docs/"
# Where the site is; sitemaps and cards need it. Without an address, that of a local server.
html_baseurl = os.environ.get("DOCS_URL", URLS.get("Documentation", "http://localhost:8000/"))
APPS = tuple(path.name for path in sorted(DOCS.glob("*.html")))  # complete pages, not Sphinx's
html_extra_path = list(APPS)
notfound_urls_prefix = urlparse(html_baseurl).path

ogp_site_url = html_baseurl
ogp_image = "_static/card.png"
ogp_image_alt = "Ants form lanes between food and their nest, and find a way round a wall."
ogp_social_cards = {"enable": False}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # descriptions name types, and shapes too


def split_attributes(app: Any, what: str, name: str, value: Any, options: Any, lines: Any) -> None:
    """Give attributes that share a description an entry each; Napoleon does this for arguments."""
    text = "\n".join(lines)
    shared = re.compile(r"^    (\w+(?:, \w+)+): (.*\n(?:     .*\n)*)", re.MULTILINE)
    start = text.find("Attributes:\n")
    if start >= 0:
        attributes = shared.sub(
            lambda m: "".join(f"    {one}: {m[2]}" for one in m[1].split(", ")), text[start:] + "\n"
        )
        lines[:] = (text[:start] + attributes).split("\n")


def keep_anchors(app: Any, page: str, source: list[str]) -> None:
    """Let links to places in the lab keep their ends, `#home`, which MyST drops without `path:`."""
    source[0] = re.sub(rf"\]\((?=[./]*(?:{'|'.join(APPS)})[#?])", "](path:", source[0])


def link_apps(app: Any, doctree: nodes.document) -> None:
    """Make links to the lab and the article links, not downloads."""
    up = "../" * app.env.docname.count("/")
    for node in list(doctree.findall(download_reference)):
        name = Path(node["reftarget"]).name
        if re.split("[#?]", name)[0] in APPS:
            node.replace_self(nodes.reference("", "", *node.children, refuri=up + name))


def mend_page(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Give captions of the navigation their level, and let the keyboard scroll wide code."""
    tree, level = context.get("furo_navigation_tree", ""), 'role="heading" aria-level="2"'
    context["furo_navigation_tree"] = tree.replace('role="heading"', level)
    if "body" in context:
        context["body"] = re.sub(r"<pre(?= id=|>)", '<pre tabindex="0"', context["body"])


def visit_math(self: Any, node: Any) -> None:
    """Write a formula as MathML, which browsers draw and read aloud without a script."""
    inline = isinstance(node, nodes.math)
    formula = tex2mathml(re.sub(r"\\big\b", "", node.astext()).replace(r"\dots", r"\ldots"), inline)
    self.body.append(formula if inline else f'<div class="math">{formula}</div>')
    raise nodes.SkipNode


def draw_card(app: Any) -> None:
    """Draw the picture that shared links show: the last moment of the film of the README."""
    from PIL import Image

    folder = Path(app.outdir) / "_static"
    folder.mkdir(parents=True, exist_ok=True)
    with Image.open(ROOT / "renders" / "hero_dark.webp") as film:
        film.seek(film.n_frames - 1)  # type: ignore[attr-defined]
        card = Image.new("RGB", (1200, 630), film.convert("RGB").getpixel((2, 2)))  # type: ignore[arg-type]
        picture = film.convert("RGB").resize((1008, 630))
        card.paste(picture, (96, 0))
        card.save(folder / "card.png")


def write_sitemap(app: Any, error: Exception | None) -> None:
    """List the pages for search engines."""
    if error or app.builder.name != "html":
        return
    pages = [app.builder.get_target_uri(name) for name in sorted(app.env.found_docs)]
    lines = [f"<url><loc>{escape(html_baseurl + page)}</loc></url>" for page in (*pages, *APPS)]
    text = "\n".join(lines)
    (Path(app.outdir) / "sitemap.xml").write_text(
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<urlset xmlns="http://www.sitemaps.org/schemas/sitemap/0.9">\n{text}\n</urlset>\n',
        encoding="utf-8",
    )


def copy_notebooks(app: Any, error: Exception | None) -> None:
    """Copy the lessons as notebooks, to which lessons.html links."""
    if error or app.builder.name != "html":
        return
    for path in (DOCS / "lessons").glob("*.ipynb"):
        shutil.copy(path, Path(app.outdir) / "lessons")


def setup(app: Any) -> None:
    app.connect("autodoc-process-docstring", split_attributes, priority=400)  # before Napoleon
    app.connect("source-read", keep_anchors)
    app.connect("doctree-read", link_apps, priority=100)
    app.connect("html-page-context", mend_page, priority=900)  # after the theme
    app.connect("builder-inited", draw_card)
    app.connect("build-finished", write_sitemap)
    app.connect("build-finished", copy_notebooks)
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_math, None))
