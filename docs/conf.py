"""How Sphinx builds the documentation; pages that are made from the code come from `made_pages`."""

import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import made_pages  # noqa: E402
from docutils import nodes  # noqa: E402
from PIL import Image  # noqa: E402
from sphinx.search.en import SearchEnglish  # noqa: E402

project = "toppling"
author = copyright = "The toppling developers"
release = version = metadata.version("toppling")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_parser",
    "sphinx_design",
    "sphinx-mathjax-offline",
    "sphinx_gallery.gen_gallery",
    "sphinx_reredirects",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = [
    "_build",
    "package.md",
    "gallery_examples",
    "_made/gallery/*.ipynb",
    "_made/gallery/*.py",
]
templates_path = ["_templates"]
default_role = "py:obj"
language = "en"

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 4
myst_dmath_double_inline = True

autosummary_generate = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

sphinx_gallery_conf = {
    "examples_dirs": "gallery_examples",
    "gallery_dirs": "_made/gallery",
    "filename_pattern": r"plot_",
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 600,
    "show_signature": False,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "image_scrapers": ("matplotlib",),
    "reset_modules": ("matplotlib", "made_pages.gallery_text"),
    "within_subsection_order": "FileNameSortKey",
}

redirects = {
    "use": "howto/index.html",
    "decisions": "howto/index.html",
    "scaling": "howto/large_studies.html",
    "scaling_measured": "howto/large_studies.html",
    "questions": "howto/read_a_report.html",
    "coverage": "runs.html",
    "kits": "walls.html",
    "sensitivity": "paper.html",
}
"""New homes of pages that people may have kept an address of."""

html_theme = "pydata_sphinx_theme"
html_title = "toppling"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options: dict[str, Any] = {
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {"index": [], "start": []}

# a bar in |theta| is no substitution, a star of *args no emphasis
BAR = re.compile(r"(?<!\\)\|")


def _plain_bars(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are written to be read as text: their |theta| stays one."""
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else BAR.sub(r"\\|", line) for line in lines]


# in; of figures that a narrow screen would shrink until nobody can read them
WIDE = 6.0


def _wide_figures(app: Any, document: nodes.document) -> None:
    """Figures wider than `WIDE` carry a class, for which a narrow screen scrolls (site.css)."""
    for image in document.findall(nodes.image):
        path = Path(app.srcdir) / image["uri"]
        if path.suffix == ".png":
            with Image.open(path) as picture:
                if picture.width > WIDE * float(picture.info.get("dpi", (100.0,))[0]):
                    image["classes"].append("wide")


# of words of code that fit into every line of a telephone
SHORT = 28


def _short_code(app: Any, document: nodes.document) -> None:
    """Code in sentences whose words are short carries a class, for which a word does not break (site.css)."""
    for literal in document.findall(nodes.literal):
        if max(map(len, literal.astext().split()), default=0) <= SHORT:
            literal["classes"].append("short")


class EveryWord(SearchEnglish):
    """The search without stop words, of which some are keys (`from`, `until`)."""

    stopwords: frozenset[str] = frozenset()


def setup(app: Any) -> None:
    """Write the made pages before anything is read, and keep docstrings as they are."""
    app.add_search_language(EveryWord)
    made_pages.write(HERE)
    app.connect("autodoc-process-docstring", _plain_bars, priority=900)
    app.connect("doctree-read", _wide_figures)
    app.connect("doctree-read", _short_code)
