"""The documentation: every block of code runs, every number is of today, every link of the built site leads on."""

import doctest
import functools
import importlib
import importlib.util
import inspect
import json
import re
import shlex
import shutil
import sys
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

import browser
import pytest

from toppling.studies.command.cli import main as command
from toppling.studies.film import frames

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
BUILT = DOCS / "_build" / "html"
MADE = {"_build", "_made"}
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in [*ROOT.glob("*.md"), *DOCS.rglob("*.md")]
    if not MADE & set(path.relative_to(ROOT).parts)
)
SLOW = {"docs/motions.md", "docs/tutorials/engineer.md", "docs/tutorials/researcher.md", "docs/tutorials/owner.md"}
"""Pages whose code takes many seconds."""
NOT_RUN = {"docs/howto/large_studies.md": 2}
"""Python blocks marked no-run, by page: two kinds of cluster."""
COMMANDS_NOT_RUN = {
    # what is not there: records, studies and results of the reader's own, a cluster
    "toppling run STUDY.toml --dry-run",
    "toppling run STUDY.toml --out results/big",
    "toppling status results/big",
    "toppling run STUDY.toml --out results/big --fresh",
    "toppling run STUDY.toml --out results/big --scheduler tcp://10.0.0.1:8786",
}
"""Commands that pages show and no test runs; any other is run, studies with --dry-run."""
LANGUAGES = {"python", "pycon", "sh", "toml", "text", "console", "json"}
DIRECTIVES = {"{toctree}", "{include}", "{image}", "{eval-rst}", "{math}"}


class Block(NamedTuple):
    """A fenced block: its info string in words, its text, its first line, and the output shown directly below it."""

    info: list[str]
    text: str
    line: int
    output: str | None = None


def blocks_of(text):
    found, opened, closed = [], None, None
    for number, line in enumerate(text.splitlines(), 1):
        fence = re.match(r"^\s*(`{3,})(.*)$", line)
        if opened is None and fence:
            opened = Block(fence[2].split(), "", number)
            lines, ticks = [], fence[1]
        elif opened is not None and fence and fence[1] == ticks and not fence[2].strip():
            block = opened._replace(text="\n".join(lines) + "\n")
            if block.info == ["text"] and closed is not None:
                found[-1] = found[-1]._replace(output=block.text)
            closed = number if block.info[:1] in (["python"], ["sh"]) else None
            found.append(block)
            opened = None
        elif opened is not None:
            lines.append(line)
        elif line.strip():
            closed = None
    assert opened is None, "a fence is not closed"
    return found


def prints(expected, output):
    """True if lines of the output are the expected words; an ellipsis stands for any others, progress is left out."""
    expected, output = (re.sub(r"(?m)^runs: \d+ %.*$", "", text) for text in (expected, output))
    position, output = 0, " ".join(output.split())
    for part in expected.split("..."):
        words = " ".join(part.split())
        position = output.find(words, position)
        if position < 0:
            return False
        position += len(words)
    return True


def read(page):
    return blocks_of((ROOT / page).read_text(encoding="utf-8"))


def load(name):
    specification = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


MADE_STUDY = ("toppling", "run", "studies/examples/office.toml", "--out", "results/office")


def commands_of(block):
    """Return the words of each command of a block of shell; `make study` is the run of its study."""
    if block.info != ["sh"]:
        return []
    lines = [tuple(shlex.split(line, comments=True)) for line in block.text.splitlines()]
    lines = [MADE_STUDY if words == ("make", "study") else words for words in lines]
    return [words for words in lines if words[:1] == ("toppling",)]


def code_of(page):
    return [one for one in read(page) if one.info[:1] in (["python"], ["pycon"])]


def test_the_extractor_sees_blocks():
    text = "a\n```python\nx = 1\n```\n````text\n```python\n```\n````\n```python no-run\ny\n```\n"
    found = blocks_of(text)
    assert [(one.info, one.line) for one in found] == [(["python"], 2), (["text"], 5), (["python", "no-run"], 9)]
    assert found[0].text == "x = 1\n"
    shown = blocks_of("```sh\nls\n```\n\n```text\na\n```\n```sh\nls\n```\nwords\n```text\na\n```\n")
    assert [block.output for block in shown] == ["a\n", None, None, None]
    with pytest.raises(AssertionError, match="not closed"):
        blocks_of("```python\n")


def test_what_is_printed_is_compared():
    assert prints("a  b 1.0\nc", "head\na b 1.0\n c\ntail")
    assert prints("a ...\nc", "a b\nc")
    assert not prints("a 1.0", "a 1.1")
    assert not prints("c ... a", "a b c")


def test_every_block_says_what_it_is():
    """A block without a language would not be looked at."""
    for page in PAGES:
        for one in read(page):
            assert one.info, f"{page}:{one.line} has a block without a language"
            assert one.info[0] in LANGUAGES | DIRECTIVES, f"{page}:{one.line}: {one.info[0]}"
            assert one.info[1:] in ([], ["no-run"]) or one.info[0] in DIRECTIVES, f"{page}:{one.line}: {one.info}"


def test_blocks_that_do_not_run_are_counted():
    found = Counter(page for page in PAGES for one in read(page) if "no-run" in one.info)
    assert found == {page: number for page, number in NOT_RUN.items() if (ROOT / page).is_file()}
    # pages that are made of another carry its marks
    for source in (ROOT / "benchmarks/pages").glob("*.md.in"):
        marked = sum("no-run" in one.info for one in blocks_of(source.read_text(encoding="utf-8")))
        assert marked == NOT_RUN.get(f"docs/{source.stem}", 0), source.name


STARTED = {"office": ["inventory"], "shelf": ["bookcase"], "site": ["hazard"]}
"""Folders that the pages have `toppling new` write, with its words."""


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """A reader's folder: the repository's examples, room for results, nothing else."""
    (tmp_path / "studies").symlink_to(ROOT / "studies", target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def small_results(tmp_path_factory):
    """A function that copies the results which a text reads, where they are of an example study, into a folder.

    They are of five motions, or of those that are selected, and each is made once.
    """
    made = tmp_path_factory.mktemp("examples")

    @functools.cache
    def results_of(name):
        example = ROOT / "studies/examples" / f"{name}.toml"
        whole = example.read_text("utf-8")
        small, changes = re.subn(r"^number = \d+$", "number = 5", whole, flags=re.MULTILINE)
        selects = "[stripes.select]" in whole  # (few candidates do not agree with the hazard)
        assert changes == 1 or selects
        (made / example.name).write_text(whole if selects else small, encoding="utf-8")
        for other in ("inventory.csv", "risk_target.csv"):
            shutil.copy(example.with_name(other), made)
        assert command(["run", str(made / example.name), "--out", str(made / name)]) == 0
        return made / name

    @functools.cache
    def begun(folder):
        """What `toppling new` writes into a folder of the pages, and its results of few records."""
        begun = made / "new" / folder  # (an example has the same name)
        assert command(["new", *STARTED[folder], str(begun)]) == 0
        for record in sorted(begun.glob("records/*"))[5:]:
            record.unlink()
        assert command(["run", str(begun / "study.toml"), "--out", str(begun / "results")]) == 0
        return begun

    def copy(text, folder):
        for name in STARTED:
            if f" {name}/" in text:
                shutil.copytree(begun(name), folder / name)
                if " run " in text:
                    shutil.rmtree(folder / name / "results")
        for name in set(re.findall(r"(?:results/(?=\w+/results\.nc)|status results/)(\w+)", text)):
            shutil.copytree(results_of(name), folder / "results" / name)

    return copy


SESSIONS = [page for page in PAGES if any(block.output and block.info == ["sh"] for block in read(page))]
"""Pages whose commands run one after another, as a reader would type them, and print what is shown below them."""


@pytest.fixture(scope="module")
def whole_results(tmp_path_factory):
    """A function that returns the folder of results of an example study, which is run once."""
    made = tmp_path_factory.mktemp("whole")

    @functools.cache
    def results_of(name):
        assert command(["run", str(ROOT / f"studies/examples/{name}.toml"), "--out", str(made / name)]) == 0
        return made / name

    return results_of


@pytest.mark.slow
@pytest.mark.parametrize("page", SESSIONS)
def test_pages_print_what_they_show(page, reader, whole_results, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "90")
    monkeypatch.setattr(frames, "MOST_FRAMES", 100)
    text = "".join(block.text for block in read(page) if block.info in (["python"], ["sh"]))
    for name in {*re.findall(r"results/(\w+)", text)} - {*re.findall(r" run \S*?(\w+)\.toml(?!.*--dry-run)", text)}:
        if (ROOT / f"studies/examples/{name}.toml").is_file():
            shutil.copytree(whole_results(name), reader / "results" / name)
    for name, words in STARTED.items():
        if re.search(rf"\b{name}/", text) and f"new {words[0]} {name}" not in text:
            assert command(["new", *words, name]) == 0
            if f"{name}/results" in text and f"run {name}/" not in text:
                assert command(["run", f"{name}/study.toml", "--out", f"{name}/results"]) == 0
    capsys.readouterr()
    names = {"__name__": "__main__"}
    for block in read(page):
        if block.info == ["python"]:
            exec(compile("\n" * block.line + block.text, page, "exec"), names)
        elif block.info == ["sh"]:
            chosen = [words for words in commands_of(block) if " ".join(words) not in COMMANDS_NOT_RUN]
            for words in chosen:
                assert command([*words[1:]]) == 0, capsys.readouterr().err
            if not chosen:
                continue
        else:
            continue
        output = capsys.readouterr().out
        assert block.output is None or prints(block.output, output), f"{page}:{block.line} prints\n{output}"


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.slow] if page in SLOW else [])
        for page in PAGES
        if code_of(page) and page not in SESSIONS
    ],
)
def test_code_runs(page, reader, small_results, capsys):
    """The Python of a page, block by block in one namespace, as a reader would type it."""
    names = {"__name__": "__main__"}
    chosen = [one for one in code_of(page) if "no-run" not in one.info]
    small_results("".join(one.text for one in chosen), reader)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for one in chosen:
        if one.info[0] == "python":
            # numbered as in the page, so that an error names its line there
            exec(compile("\n" * one.line + one.text, page, "exec"), names)
            output = capsys.readouterr().out
            assert one.output is None or prints(one.output, output), f"{page}:{one.line} prints\n{output}"
        else:
            test = doctest.DocTestParser().get_doctest(one.text, names, page, page, one.line)
            runner.run(test, clear_globs=False)
            names.update(test.globs)
    assert runner.summarize(verbose=False).failed == 0


ALL_COMMANDS = sorted(
    {words for page in PAGES if page not in SESSIONS for block in read(page) for words in commands_of(block)}
)
QUICK_WORDS = {"new", "catalogue", "studies/examples/office.toml"}
"""Commands with one of these take a second or two; the others make many motions even to say what they would take."""
RUN_COMMANDS = [one for one in ALL_COMMANDS if " ".join(one) not in COMMANDS_NOT_RUN]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [pytest.param(one, marks=[] if set(one) & QUICK_WORDS else [pytest.mark.slow]) for one in RUN_COMMANDS],
    ids=" ".join,
)
def test_commands_run(words, reader, small_results, monkeypatch, capsys):
    """Commands of the pages; studies say what they would take, results are of five motions, films are short."""
    monkeypatch.setattr(frames, "MOST_FRAMES", 100)  # (so that they have 5 frames a second)
    small_results(" ".join(words), reader)
    arguments = list(words[1:])
    if arguments[0] == "run" and "--dry-run" not in arguments:
        arguments.append("--dry-run")
    assert command(arguments) == 0, capsys.readouterr().err


def test_commands_not_run_are_shown_somewhere():
    shown = {" ".join(words) for page in PAGES for block in read(page) for words in commands_of(block)}
    assert shown >= COMMANDS_NOT_RUN
    assert len(shown) >= 30


@pytest.mark.parametrize("page", ["law", "generator", "estimator"])
def test_extensions_are_short(page):
    first = next(one for one in code_of(f"docs/extend/{page}.md") if one.info[0] == "python")
    assert len(first.text.splitlines()) < 50


@pytest.mark.slow
def test_the_notebook_prints_what_it_shows(reader, capsys):
    """The notebook of the researcher's tutorial has the page's code in the page's order, and runs."""
    text = (DOCS / "tutorials/researcher.md").read_text(encoding="utf-8")
    cells = json.loads(load("made_pages").notebook(text))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert [cell["source"] + "\n" for cell in code] == [
        block.text for block in blocks_of(text) if block.info == ["python"]
    ]
    assert not re.search(r"\]\((?!https?:)|```", "".join(cell["source"] for cell in cells))
    names = {"__name__": "__main__"}
    for cell in code:
        exec(compile(cell["source"], "notebook", "exec"), names)
        output = capsys.readouterr().out
        assert all(prints(shown["text"], output) for shown in cell["outputs"]), cell["source"]


class TestApi:
    pages = load("made_pages")

    @pytest.mark.parametrize("package", pages.PACKAGES)
    def test_every_public_name_is_on_its_page_once(self, package):
        """It resolves, and has a docstring of its own or is a value."""
        module = importlib.import_module(package)
        text = self.pages.api_page(package, "about")
        for name in set(module.__all__) - self.pages.ELSEWHERE.get(package, set()):
            assert len(re.findall(rf"[ .~]{name}$", text, re.MULTILINE)) == 1, name
            one = getattr(module, name)
            if inspect.isclass(one) or inspect.isroutine(one):
                # (a dataclass without a docstring gets its signature for one)
                assert one.__doc__, name
                assert not one.__doc__.startswith(f"{name}("), name

    def test_no_name_is_described_twice(self):
        """Each of the other pages describes what no other describes; that of `toppling` only refers to them."""
        places = [place for place in (*self.pages.PACKAGES, *self.pages.MODULES) if place != "toppling"]
        found = Counter(
            id(getattr(importlib.import_module(place), name)) for place in places for name in self.pages.names_of(place)
        )
        assert set(found.values()) == {1}

    def test_every_name_of_toppling_has_a_home(self):
        for name in self.pages.names_of("toppling"):
            assert self.pages.home_of(name), name
        assert self.pages.home_of("Block") == "toppling.models"

    def test_modules_beside_the_packages(self):
        for module in self.pages.MODULES:
            names = self.pages.names_of(module)
            assert names
            for name in names:
                one = getattr(importlib.import_module(module), name)
                assert inspect.getdoc(one), name

    def test_usage_of_commands_has_no_module(self):
        """The command line is that of a reader, whatever process makes the page."""
        usages = re.findall(r"(?m)^toppling \w+.*", self.pages.commands_page())
        assert "toppling run [OPTIONS] STUDY.TOML" in usages
        assert not any(" -m " in usage for usage in usages)

    def test_the_page_of_study_files(self, monkeypatch):
        monkeypatch.syspath_prepend(DOCS)
        page = self.pages.study_file_page()
        assert "`width_m`" in page
        assert "| m | must be given | number > 0 | `pendulum` |" in page
        assert "| `drift` | " in page


class Page(HTMLParser):
    """Targets and links of a page."""

    def __init__(self):
        super().__init__()
        self.ids, self.links = set(), []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.ids |= {values[name] for name in ("id", "name") if values.get(name)}
        for name in ("href", "src"):
            if values.get(name) is not None and (tag, values.get("rel")) != ("link", "canonical"):
                self.links.append(values[name])


FITS = """(async () => {
  await window.MathJax?.startup?.promise;
  const pictures = [...document.querySelectorAll("article img")];
  // (the theme lets the whole article scroll: that is too wide, too)
  const frames = [document.documentElement, ...document.querySelectorAll(".bd-main, .bd-article-container")];
  return [
    Math.max(...frames.map(one => one.scrollWidth - one.clientWidth)),
    pictures.filter(one => one.complete && !one.naturalWidth || !one.hasAttribute("alt")).map(one => one.src),
    [...document.querySelectorAll("article .math")].filter(one => !one.querySelector("mjx-container")
      || one.querySelector("[data-mml-node=merror], mjx-merror")).map(one => one.textContent.slice(0, 60)),
  ];
})()"""
"""How much wider than the screen, pictures that are not there or have no words, formulas that did not come out."""


@pytest.mark.skipif(not (BUILT / "index.html").is_file(), reason="the site is not built: `make docs`")
class TestBuiltSite:
    @pytest.fixture(scope="class")
    @staticmethod
    def pages():
        found = {}
        for path in BUILT.rglob("*.html"):
            if "_static" in path.parts:  # templates of the theme
                continue
            found[path] = Page()
            found[path].feed(path.read_text(encoding="utf-8"))
        return found

    def test_no_link_is_broken(self, pages):
        broken, seen = [], 0
        for path, page in pages.items():
            for link in page.links:
                parts = urlsplit(link)
                if parts.scheme or parts.netloc or (link.startswith(("#", "data:")) and link == "#"):
                    continue
                seen += 1
                target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
                target = target / "index.html" if target.is_dir() else target
                anchor = unquote(parts.fragment)
                if not target.is_file() or (anchor and target in pages and anchor not in pages[target].ids):
                    broken.append(f"{path.relative_to(BUILT)}: {link}")
        assert seen > 1000
        assert not broken, "\n".join(sorted(set(broken))[:40])

    def test_nothing_is_fetched_from_elsewhere(self, pages):
        """Scripts, styles and pictures are of the site itself."""
        for path, page in pages.items():
            for link in page.links:
                if urlsplit(link).netloc and re.search(r"\.(js|css|png|svg|woff2?)($|\?)", link):
                    raise AssertionError(f"{path.relative_to(BUILT)} fetches {link}")

    @pytest.mark.slow
    @pytest.mark.skipif(browser.CHROMIUM is None, reason="no Chromium")
    def test_pages_fit_a_telephone(self, pages):
        """No page is wider than the screen, pictures and formulas come out; of the API one page in ten."""
        api = sorted(path for path in pages if "objects" in path.parts)
        chosen = [path for path in pages if path not in api] + api[::10]
        opened, wrong = browser.Browser(), []
        try:
            for path in chosen:
                wide, unnamed, formulas = opened.see(path, 380, FITS).value
                if wide or unnamed or formulas:
                    wrong.append(f"{path.relative_to(BUILT)}: {wide} px too wide, {unnamed}, {formulas}")
        finally:
            opened.close()
        assert len(chosen) > 50
        assert not wrong, "\n".join(wrong)

    def test_every_page_of_the_sources_is_there(self):
        for page in PAGES:
            if (
                page.startswith("docs/") and page != "docs/package.md"
            ):  # (the package's description, no page of the site)
                assert (BUILT / page.removeprefix("docs/")).with_suffix(".html").is_file(), page
