"""Documentation is short and plain: words of pages, length of sentences, words to avoid, one first paragraph."""

import ast
import re
import tomllib
from pathlib import Path

import prose
import pytest

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
MADE = {"_build", "_made"}
PAGES = sorted(path for path in DOCS.rglob("*.md") if not MADE & set(path.parts))
WRITTEN = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md"]
PACKAGES = ("core", "fragility", "models", "motions", "studies")


def relative(path):
    return str(path.relative_to(ROOT))


def test_the_counter_counts():
    page = "# A title\n\nTwo words. Then `code` and $x$ here.\n\n```python\nx = 1\n```\n\n| a | b |\n|--|--|\n| 1 | 2 |"
    assert prose.words(page) == 2 + 2 + 4 + 1 + 4
    assert prose.sentences(page) == ["Two words.", "Then CODE and CODE here."]
    assert [words for words, _, _ in prose.avoided("That of nobody `that of` at least\n")] == ["That of", "nobody"]
    assert prose.sentences("- One [thing](a.md#b).\n- Another e.g. thing\n") == ["One thing.", "Another eg thing"]


def test_entries_of_a_docstring_are_paragraphs():
    entries = 'Parameters\n----------\na : {"least"}\n    First entry.\nb : float\n    Second entry.\n'
    text = prose.prose_of_docstring(f"Title.\n\n{entries}\n>>> least\n1\n")
    assert prose.sentences(text) == ["Title.", "First entry.", "Second entry.", "1"]
    assert prose.avoided(text) == []


def test_words_of_all_pages():
    assert sum(prose.words(path.read_text("utf-8")) for path in PAGES) <= 42_000


@pytest.mark.parametrize("path", PAGES, ids=relative)
def test_no_page_is_long(path):
    assert prose.words(path.read_text("utf-8")) <= 2500


def test_words_of_the_readme():
    assert prose.words((ROOT / "README.md").read_text("utf-8")) <= 900


@pytest.mark.parametrize("path", WRITTEN, ids=relative)
def test_sentences_are_plain(path):
    text = path.read_text("utf-8")
    assert [words for words in prose.sentences(text) if prose.length(words) > prose.MOST_WORDS_OF_A_SENTENCE] == []
    assert [(words, around) for words, _, around in prose.avoided(text)] == []


def test_one_first_paragraph():
    """README, index and the package's page introduce toppling in the same words."""
    pages = [path.read_text("utf-8") for path in (ROOT / "README.md", DOCS / "index.md", DOCS / "package.md")]
    assert len({tuple(page.split("\n\n")[1:3]) for page in pages}) == 1


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_are_plain(package):
    """Docstrings have no long sentences and no words to avoid."""
    wrong = []
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = prose.prose_of_docstring(ast.get_docstring(node) or "")
                long = [s for s in prose.sentences(text) if prose.length(s) > prose.MOST_WORDS_OF_A_SENTENCE]
                wrong += [(path.name, words) for words in prose.avoided(text)]
                wrong += [(path.name, sentence) for sentence in long]
    assert not wrong


def test_templates_are_plain():
    for path in (ROOT / "studies/templates").glob("*.j2"):
        text = re.sub(r"\{#.*?#\}|\{%.*?%\}", "", path.read_text("utf-8"), flags=re.DOTALL)
        assert [words for words, _, _ in prose.avoided(re.sub(r"\{\{.*?\}\}", "x", text))] == [], path.name


def test_input_warnings_are_plain():
    """A few words, which readers know from earlier results, are kept."""
    kept = {"in place of", "that of", "those of", "ones", "were asked for"}
    text = (ROOT / "core/doubts.toml").read_text("utf-8")
    tables = tomllib.loads(text)
    texts = [row[key] for row in tables["doubt"].values() for key in ("sentence", "plural") if key in row]
    texts += [*tables["cure"].values(), *(part for row in tables["quantity"].values() for part in row)]
    words = {words.lower() for text in texts for words, _, _ in prose.avoided(re.sub(r"\{.*?\}", "x", text))}
    assert words == kept
