"""Pages of the documentation that are made from the code as it is: the API's lists, study files, results.

They go into docs/_made, which git does not keep.
"""

import ast
import importlib
import inspect
import json
import re
from pathlib import Path

import matplotlib as mpl

PACKAGES = {
    "toppling": "What most scripts need: `import toppling as tp`.",
    "toppling.models": "Blocks, the catalogue, damping laws, single histories.",
    "toppling.motions": "Generators, pulses, records, spectra, floors, intensity measures.",
    "toppling.fragility": "Analyses, estimators, measures compared, uncertain inputs, hazard, risk, exchange.",
    "toppling.studies": "Study files, inventories, assessments.",
}
"""The public packages and what each is for."""
ELSEWHERE = {"toppling": {"motions", "plot"}}
"""Names that are packages or modules with pages of their own."""
MODULES = {
    "toppling.models.friction": "The friction that a block needs so that it does not slide, and what a floor may have.",
    "toppling.fragility.curves.published": "Published overturning criteria as curves.",
    "toppling.studies.plot": "Figures of results: `tp.plot`.",
    "toppling.studies.film.animate": "The film of one block: `tp.animate`.",
}
"""Modules beside the packages that pages of this site refer to."""


def names_of(package: str) -> list[str]:
    """The public names of a package or module that get a page."""
    module = importlib.import_module(package)
    if hasattr(module, "__all__"):
        public = set(module.__all__)
    else:
        public = {n for n, value in vars(module).items() if n[0] != "_" and getattr(value, "__module__", "") == package}
    return sorted(public - ELSEWHERE.get(package, set()), key=str.lower)


def home_of(name: str) -> str | None:
    """The package or module whose page describes a name of `toppling`; None of one that is none of theirs."""
    described = getattr(importlib.import_module("toppling"), name)
    places = [place for place in (*PACKAGES, *MODULES) if place != "toppling"]
    return next((place for place in places if getattr(importlib.import_module(place), name, None) is described), None)


def api_page(package: str, about: str) -> str:
    """The page of one package: tables of its classes, functions and tables of names."""
    module = importlib.import_module(package)
    kinds: dict[str, list[str]] = {"Classes": [], "Functions": [], "Values": []}
    for name in names_of(package):
        value = getattr(module, name)
        kinds["Classes" if inspect.isclass(value) else "Functions" if callable(value) else "Values"].append(name)
    # a page that lists names described elsewhere has no module of its own to look in
    current = "" if package == "toppling" else f".. currentmodule:: {package}\n"
    parts = [f"{package}\n{'=' * len(package)}\n\n{about.replace('`', '``')}\n\n{current}"]
    for title, names in kinds.items():
        if not names:
            continue
        if package == "toppling":  # described where they are made
            rows = "".join(f"   ~{home_of(name)}.{name}\n" for name in names if home_of(name))
            parts.append(f"{title}\n{'-' * len(title)}\n\n.. autosummary::\n\n{rows}" if rows else "")
            continue
        rows = "".join(f"   {name}\n" for name in names)
        if title == "Values":
            parts.append(
                f"{title}\n{'-' * len(title)}\n\n" + "".join(f".. autodata:: {n}\n   :no-value:\n\n" for n in names)
            )
        else:
            parts.append(f"{title}\n{'-' * len(title)}\n\n.. autosummary::\n   :toctree: objects\n\n{rows}")
    return "\n".join(parts)


def study_file_page() -> str:
    """Every key of a study file: from the schema."""
    head = (
        "# Study files: every key\n\nMade from the schema that reads study files, so that page and program cannot "
        "differ. [How a study works](../study.md) explains them with examples.\n\n"
    )
    made = importlib.import_module("made_keys")
    keys = made.key_reference().replace("\n### ", "\n## ").replace("### Top", "## Top", 1)
    return head + keys + made.doubts_section()


def modules_page() -> str:
    """Every module of the package with the first line of its docstring."""
    root = Path(importlib.import_module("toppling").__file__ or "").parent
    parts = ["# All modules\n\nMade from their docstrings. [Architecture](../architecture.md) shows how data flow.\n"]
    for package in ("core", "models", "motions", "fragility", "studies"):
        rows = []
        for path in sorted((root / package).rglob("*.py")):
            place = path.relative_to(root / package).as_posix()
            if place != "__init__.py":
                first = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
                cell = " ".join(first.split()).replace("|", "\\|")
                rows.append(f"| `{place.removesuffix('__init__.py')}` | {cell} |\n")
        parts.append(f"## `{package}`\n\n| module | what it is |\n|---|---|\n{''.join(rows)}")
    return "\n".join(parts)


def glossary_page() -> str:
    """Every term that reports define, with its definition."""
    terms = importlib.import_module("toppling.studies.text.glossary").terms()
    head = "# Glossary\n\nThe terms that reports use; a report defines those that it uses, in these words.\n\n"
    return head + "\n".join(f"**{term.name}**\n: {term.definition}\n" for term in terms)


def commands_page() -> str:
    """Every command with its options, from their help."""
    app = importlib.import_module("toppling.studies.command.cli").app
    text = app.generate_docs()
    listed = re.sub(r"## Table of Contents\n.*?(?=\n\*\*)", "", text, flags=re.DOTALL)
    # (usage has the module of the process, here of the build)
    listed = re.sub(r"(?m)^(toppling \w+) -m \w+", r"\1", listed).replace("# toppling\n", "# Commands\n", 1)
    return re.sub(r"\(#toppling-(\w+)\)", r"(#\1)", listed).replace("\n## toppling ", "\n## ")


def catalogue_page() -> str:
    """Every item of the catalogue: sizes, usual place, FEMA P-58 id and quality of the source."""
    catalogue = importlib.import_module("toppling.models").catalogue
    qualities = importlib.import_module("toppling.models.items").QUALITIES
    rows = []
    for name in catalogue:
        item = catalogue.item(name)
        size = f"{item.block.width:.3f} | {item.block.height:.3f} | {item.block.alpha:.3f}"
        wall = "free" if item.wall_gap is None else f"{1000.0 * item.wall_gap:.0f} mm"
        rows.append(f"| `{name}` | {item.title} | {size} | {wall} | {item.fema_p58 or ''} | {item.quality} |\n")
    return (
        f"# Catalogue\n\nThe catalogue contains {len(rows)} items. Widths (the smaller plan size) and heights are "
        "in m, α in rad. *Wall* is the assumed distance to a wall behind the item as it is usually placed.\n\n"
        "| name | item | width | height | α | wall | FEMA P-58 | quality |\n|---|---|---|---|---|---|---|---|\n"
        + "".join(rows)
        + "".join(f"\n- {letter}: {meaning}" for letter, meaning in qualities.items())
        + "\n"
    )


def gallery_text(_configuration: object, _script: str) -> None:
    """Text of the gallery's figures, 5.2 in wide, so large that a phone shows it at 8 pt."""
    mpl.rcParams["font.size"] = 11.0


def notebook(page: str) -> str:
    """Return a page as a notebook: its Python is run, what it prints is shown, and links within the site are text."""
    cells: list[dict[str, object]] = []
    for language, code, text in re.findall(r"```(\w+)\n(.*?)^```$|((?:(?!^```).)+)", page, re.DOTALL | re.MULTILINE):
        words = re.sub(r"\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text).strip()
        if language == "python":
            code_cell = {"execution_count": None, "outputs": [], "source": code.rstrip()}
            cells.append({"cell_type": "code", "metadata": {}, **code_cell})
        elif language:
            cells[-1]["outputs"] = [{"output_type": "stream", "name": "stdout", "text": code}]
        elif words:
            cells.append({"cell_type": "markdown", "metadata": {}, "source": words})
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    made = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}
    return json.dumps(made, ensure_ascii=False, indent=1) + "\n"


def write(docs: Path) -> None:
    """Write every made page under `docs`/_made, where it is new or another."""
    pages = {
        "study-file.md": study_file_page(),
        "results.md": importlib.import_module("made_results").results_page(),
        "glossary.md": glossary_page(),
        "commands.md": commands_page(),
        "catalogue.md": catalogue_page(),
        "modules.md": modules_page(),
        "compare_laws.ipynb": notebook((docs / "tutorials/researcher.md").read_text(encoding="utf-8")),
    }
    for package, about in {**PACKAGES, **MODULES}.items():
        pages[f"api/{package}.rst"] = api_page(package, about)
    for name, text in pages.items():
        path = docs / "_made" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
