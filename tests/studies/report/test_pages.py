"""Pages of reports: their content and contrast, in Chromium, of hostile names; refused results, and the command."""

import re
from collections import Counter
from io import StringIO
from pathlib import Path

import pytest
import xarray as xr
from markdown_it import MarkdownIt
from plot_cases import faults
from report_pages import (
    DETAILS,
    HOSTILE,
    OVERFLOW,
    SECTIONS,
    STUDIES,
    UNFOLDED,
    WIDTHS,
    Page,
    accessible,
    loaded,
    outside,
    written,
)
from rich.console import Console

import toppling as tp
from toppling.studies import show
from toppling.studies.command.cli import main
from toppling.studies.facts.say import TEMPLATES, register_of
from toppling.studies.report.page import MOST_STEPS, MOST_WORDS, content, markdown, write_report
from toppling.studies.store.content import AS_WRITTEN
from toppling.studies.tables.table import Column, Table
from toppling.studies.tables.terminal import rendered
from toppling.studies.text.names import clean, drawable


class TestPages:
    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_says_all_in_order(self, pages, name):
        page = Page(pages[name])
        acts = name not in ("fragility", "uncertainty")  # (with a hazard nothing is to be done)
        assert [one["id"] for one in page.every("section")] == [one for one in SECTIONS if acts or one != "actions"]
        assert [one["id"] for one in page.every("details") if one.get("id") not in (None, "further")] == DETAILS
        assert page.headings[0] == page.headings.count(1) == 1
        assert all(b <= a + 1 for a, b in zip(page.headings, page.headings[1:], strict=False))
        text = " ".join("".join(page.text).split())
        assert "A <small> study" in text
        assert not re.search(r"\bnan\b|\bNone\b|\binf\b|Undefined|\{\{|\[bold\]|\[italic\]", text)
        assert page.every("figure")
        assert page.every("table")

    @pytest.mark.parametrize("name", STUDIES)
    def test_asks_for_nothing_and_is_for_everyone(self, pages, name):
        outside(pages[name])
        accessible(Page(pages[name]))

    @pytest.mark.slow
    def test_same_results_same_bytes(self, folder, pages, tmp_path):
        for name in ("cloud", "performance"):
            write_report(folder / name / "results.nc", tmp_path / "again.html")
            assert (tmp_path / "again.html").read_bytes() == pages[name].read_bytes()

    @pytest.mark.slow
    def test_small(self, pages, hostile):
        assert all(path.stat().st_size < 3e6 for path in [*pages.values(), hostile])

    def test_ids_are_unique(self, pages):
        for path in pages.values():
            found = [attributes["id"] for _, attributes in Page(path).tags if "id" in attributes]
            assert len(found) == len(set(found))
            text = path.read_text(encoding="utf-8")
            used = re.findall(r'href="#([^"]+)"', text) + re.findall(r"url\(#([^)]+)\)", text)
            assert set(used) <= set(found)

    def test_landmarks_have_names_of_their_own(self, pages):
        for name, path in pages.items():
            captions = re.findall(r"<caption[^>]*>(.*?)</caption>", path.read_text(encoding="utf-8"))
            assert len(captions) == len(set(captions)), name

    def test_laws_have_their_names(self, folder, pages):
        """Labels with parameters are in the study file at the end, nowhere before."""
        for name in ("fragility", "sensitivity"):
            labels = loaded(folder, name)["model"].values
            before, _, _ = "".join(Page(pages[name]).text).partition("F Reproduce")
            assert len(labels) > 1
            assert not any(str(label) in before for label in labels)

    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_texts_of_figures_can_be_read(self, folder, name):
        found = {label: faults(figure) for label, figure in show.figures(loaded(folder, name))}
        assert found
        assert not any(found.values()), found


def colours(text):
    """Custom properties of each block of a style sheet: light first, dark second."""
    found = re.findall(r":root \{(.*?)\}", text, re.DOTALL)
    return [dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", one)) for one in found]


def luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_contrast(pages):
    """WCAG's contrast of every text against its background is at least 4.5, also of figures' lines on their card."""
    light, dark = colours(pages["cloud"].read_text(encoding="utf-8"))
    assert set(light) == set(dark)
    for theme in (light, dark):
        pairs = [(text, page) for text in ("text", "soft", "link") for page in ("page", "band")]
        pairs += [(word, f"{word}-page") for word in ("good", "care", "bad", "unknown")]
        for text, page in pairs:
            a, b = sorted((luminance(theme[text]), luminance(theme[page])), reverse=True)
            assert (a + 0.05) / (b + 0.05) >= 4.5, (text, page)
        assert luminance(theme["card"]) > 0.85  # figures are drawn in black and for white


SCROLLING = (
    f"{UNFOLDED} [...document.querySelectorAll('.scroll:not(.picture)')].filter(one => !one.querySelector('.matrix')"
    " && one.scrollWidth > one.clientWidth + 1).map(one => one.innerText.slice(0, 60))"
)
FOCUS = "document.querySelector('.skip').focus(), document.activeElement.getAttribute('href')"


class TestBrowser:
    @pytest.mark.slow
    @pytest.mark.parametrize("width", WIDTHS)
    @pytest.mark.parametrize("dark", [False, True])
    def test_fits_and_is_silent(self, chromium, pages, hostile, width, dark):
        """No table scrolls, either, but matrices of sensitivity studies, with their first column fixed."""
        for name, path in {**pages, "hostile": hostile}.items():
            seen = chromium.see(path, width, OVERFLOW, dark=dark)
            assert (seen.value, seen.complaints, seen.requests) == ([width, width, "complete"], [], []), name
            assert dark or name == "hostile" or chromium.see(path, width, SCROLLING).value == [], name

    @pytest.mark.slow
    @pytest.mark.parametrize("kind", ["fragility", "performance"])
    def test_comparisons_fit_and_are_silent(self, chromium, folder, tmp_path, kind):
        """The page of `toppling compare`, of curves and of a building, is no wider than a phone or a tablet."""
        laws = [str(law) for law in loaded(folder, kind)["model"].values[:2]]
        assert main(["compare", str(folder / kind / "results.nc"), "--laws", *laws, "--out", str(tmp_path)]) == 0
        page = tmp_path / "comparison.html"
        assert all(f"({law})</dd>" in page.read_text(encoding="utf-8") for law in laws)
        for width in WIDTHS:
            seen = chromium.see(page, width, OVERFLOW)
            assert (seen.value, seen.complaints, seen.requests) == ([width, width, "complete"], [], [])
            assert chromium.see(page, width, SCROLLING).value == []

    def test_the_check_can_fail(self, chromium, tmp_path):
        bad = tmp_path / "bad.html"
        bad.write_text(
            "<!doctype html><body><div style='width:3000px'>x</div><script>console.error('no')</script>"
            "<img src='http://127.0.0.1:9/x.png'>",
            encoding="utf-8",
        )
        seen = chromium.see(bad, 360, OVERFLOW)
        assert seen.value[0] > 360
        assert seen.complaints
        assert seen.requests

    @pytest.mark.slow
    def test_dark_is_dark_and_print_is_not(self, chromium, pages):
        script = "getComputedStyle(document.body).backgroundColor"
        path = pages["cloud"]
        assert chromium.see(path, 768, script).value == "rgb(255, 255, 255)"
        assert chromium.see(path, 768, script, dark=True).value == "rgb(20, 24, 28)"
        assert chromium.see(path, 768, script, dark=True, media="print").value == "rgb(255, 255, 255)"

    def test_nothing_is_folded_in_print(self, chromium, pages):
        shown = "[...document.querySelectorAll('details')].filter(one => one.lastElementChild.checkVisibility())"
        ids = f"{shown}.map(one => one.id)"
        assert chromium.see(pages["cloud"], 768, ids).value == ["results", "checks"]
        folded = f"document.querySelectorAll('details').length - {shown}.length"
        assert chromium.see(pages["cloud"], 768, folded, media="print").value == 0
        # (a figure beside the answer would move to the second sheet, and all of the answer with it)
        display = "getComputedStyle(document.querySelector('.top')).display"
        assert chromium.see(pages["performance"], 1440, display, media="print").value == "block"

    def test_keyboard(self, chromium, pages):
        script = f"({FOCUS})"
        assert chromium.see(pages["cloud"], 360, script).value == "#answer"

    @pytest.mark.slow
    def test_text_in_figures_can_be_read_on_a_phone(self, chromium, pages):
        """Text drawn with 9 points has at least 9 pixels, and no figure is wider than the page."""
        ratio = "s.getBoundingClientRect().width / s.viewBox.baseVal.width"
        script = f"{UNFOLDED} [...document.querySelectorAll('.picture svg')].map(s => {ratio})"
        wider = f"{UNFOLDED} [...document.querySelectorAll('.picture')].map(one => one.scrollWidth - one.clientWidth)"
        for width, least in ((360, 8.6), (1300, 11.0)):
            found = [one for one in chromium.see(pages["fragility"], width, script).value if one > 0.0]
            assert len(found) == pages["fragility"].read_text(encoding="utf-8").count("<figure>")
            assert min(found) * 9.0 >= least
            assert max(chromium.see(pages["fragility"], width, wider).value) <= 0


@pytest.fixture(params=STUDIES)
def page(request, folder):
    path = next(folder.rglob("results.nc"))
    return content(loaded(folder, request.param), path, AS_WRITTEN)


def test_the_first_screen_is_short(page):
    words = sum(len(sentence.split()) for sentence in page["answer"])
    assert words <= MOST_WORDS or len(page["answer"]) == 1
    assert len(page["steps"]) <= MOST_STEPS == 3
    assert len(page["terms"]) <= 8


def test_no_sentence_stands_on_a_page_twice(page):
    parts = ("answer", "steps", "further", "footnotes", "details", "method", "remarks", "notes")
    said = [sentence for part in parts for sentence in page[part]]
    said += [text for _, text in page["inputs"]] + [finding for _, _, finding, _ in page["checks"]]
    counts = Counter(sentence for text in said for sentence in re.split(r"(?<=[.?]) (?=[A-Z“])", text))
    assert [sentence for sentence, number in counts.items() if number > 1] == []


def test_every_check_has_the_template_of_its_remedy():
    code = (Path(tp.__file__).parent / "studies/facts/checks.py").read_text(encoding="utf-8")
    remedies = set(re.findall(r'"(remedy_\w+)"', code))
    assert len(remedies) > 15
    assert [name for name in sorted(remedies) if not hasattr(register_of("checks"), name)] == []


def test_no_advice_is_to_tilt_or_to_push():
    texts = [path.read_text(encoding="utf-8") for path in TEMPLATES.glob("*.j2")]
    assert sum("unloaded sample" in text for text in texts) == 1
    unsafe = re.compile(r"measure it on the piece|\b[Tt]ilt (?!of|counts)|\b[Pp]ush (it|the)\b")
    assert not [text for text in texts if unsafe.search(text)]


class TestHostile:
    def test_nothing_is_markup(self, hostile):
        outside(hostile)
        accessible(Page(hostile))
        text = hostile.read_text(encoding="utf-8")
        assert not re.search(r"<script|<img|49 {%", text)
        assert "{{ 7*7 }} {% raw %}" in text  # printed as it is, not evaluated
        assert not re.search("[\x00-\x08\x0b-\x1f\u202a-\u202e]", text)
        shown = "".join(Page(hostile).text)
        assert all(name in shown for name in (HOSTILE[0], HOSTILE[2], "<i>none</i>"))

    def test_figures_get_short_names_all_different(self):
        long = [f"{'x' * 300}{i}" for i in range(3)]
        found = drawable(xr.Dataset(coords={"block": long, "model": ["a$b", "a", "b\x01"]}))
        assert len(set(found["block"].values)) == 3
        assert max(map(len, found["block"].values)) < 70
        assert found["model"].values.tolist() == [r"a\$b", "a", "b\ufffd"]

    @pytest.mark.slow
    def test_markdown_is_text(self, folder, hostile, tmp_path):
        write_report(folder / "hostile3.nc", tmp_path / "hostile.md", "md")
        above = (tmp_path / "hostile.md").read_text(encoding="utf-8").partition("The study file:")[0]
        assert "<" not in above
        rows = [line for line in above.splitlines() if line.startswith("|")]
        assert rows
        assert all(line.endswith("|") for line in rows)

    def test_titles_and_headings_are_text(self):
        name = "a|b *c* <d> [red]e[/] \\[f]"
        table = Table(f"Of {name}", (Column("a"), Column("b", name)), [{"a": name, "b": "1"}])
        console = Console(width=200, file=StringIO())
        console.print(*rendered(table, 200))
        assert console.file.getvalue().count(name) == 3

    @pytest.mark.slow
    def test_markdown_is_read_as_it_was_meant(self, folder, tmp_path):
        name = "a|b *c* <d> [red]e[/] _f_ `g`"
        results = loaded(folder, "sensitivity").assign_coords(block=[name])
        write_report(written(results, tmp_path), tmp_path / "named.md", "md")
        text = (tmp_path / "named.md").read_text(encoding="utf-8")
        tokens = MarkdownIt().enable("table").parse(text.partition("The study file:")[0])
        assert not [one for one in tokens if one.type in ("html_block", "html_inline")]
        inline = [one for one in tokens if one.type == "inline"]
        plain = ["".join(part.content for part in one.children) for one in inline]
        assert sum(name in one for one in plain) > 3
        said = content(results, tmp_path / "changed.nc", "as written")
        every = [*said["lead"], *said["tables"], *said["input_tables"], *said["provenance"]]
        assert sum(one.type == "table_open" for one in tokens) == len(every)

    def test_clean(self):
        assert clean("a\nb\ud800") == "a\nb\ufffd"
        assert markdown("# [a](b)\n*c*") == r"\# \[a\](b) \*c\*"
        assert markdown("about 18 (10 to 29) + 1, of #2!") == "about 18 (10 to 29) + 1, of #2!"
        (heading,) = [one for one in MarkdownIt().parse(f"# {markdown('Office #')}") if one.type == "inline"]
        assert "".join(one.content for one in heading.children) == "Office #"
        for text in ("# a", "+ a", "- a", "1. a", "12) a", "===", "---", "-", "+", "##", "![a](b)", "[a]: b"):
            tokens = MarkdownIt().parse(markdown(text))
            assert [one.type for one in tokens] == ["paragraph_open", "inline", "paragraph_close"], text
            assert "".join(one.content for one in tokens[1].children) == text

    @pytest.mark.slow
    def test_one_block_one_law(self, results, tmp_path):
        assert write_report(written(results.isel(block=[0], model=[0]), tmp_path), tmp_path / "one.html")
        assert "“shelf” overturns with" in (tmp_path / "one.html").read_text(encoding="utf-8")


class TestRefused:
    """Files that are none of ours, cut or of other layouts are in tests/golden/refused/results.toml, too."""

    def said(self, capsys, *arguments):
        assert main(["report", *map(str, arguments)]) == 2
        caught = capsys.readouterr()
        assert (caught.out, caught.err.count("\n")) == ("", 1)
        return caught.err

    def test_files_that_are_cut(self, capsys, folder, tmp_path):
        whole = (folder / "cloud" / "results.nc").read_bytes()
        for size in (0, 100, len(whole) // 2, len(whole) - 100):
            (tmp_path / "cut.nc").write_bytes(whole[:size])
            assert "cut.nc: " in self.said(capsys, tmp_path / "cut.nc")

    @pytest.mark.slow
    @pytest.mark.filterwarnings("ignore:.* was edited after it was written")
    def test_what_is_missing_in_them(self, capsys, folder, tmp_path):
        results = loaded(folder, "cloud")
        runs = results.drop_attrs().assign_attrs({k: v for k, v in results.attrs.items() if k != "kind"})
        for changed, word in (
            (results.assign_attrs(kind="ghost"), "kind 'ghost'"),
            (runs, "holds runs"),
            (results.drop_vars("median"), "does not hold what"),
            (results.assign_attrs(kind="sensitivity"), "does not hold what"),
        ):
            assert word in self.said(capsys, written(changed, tmp_path))

    @pytest.mark.slow
    def test_where_it_cannot_be_written(self, capsys, folder, tmp_path):
        path = folder / "cloud" / "results.nc"
        (tmp_path / "file").write_text("", encoding="utf-8")
        assert "cannot be written" in self.said(capsys, path, "--out", tmp_path / "file" / "report.html")
        assert "must be a folder or end in .html or .md" in self.said(capsys, path, "--out", tmp_path / "report.pdf")
        assert "--format" in self.said(capsys, path, "--format", "pdf")


@pytest.mark.slow
def test_command(folder, tmp_path, capsys):
    def report(*arguments):
        assert main(["report", str(folder / "stripes" / "results.nc"), *map(str, arguments)]) == 0

    report("--out", tmp_path / "a" / "b.html")
    assert (tmp_path / "a" / "b.html").stat().st_size > 10_000
    assert "written:" in capsys.readouterr().out
    report("--out", tmp_path / "a" / "c.md")
    assert (tmp_path / "a" / "c.md").read_text(encoding="utf-8").startswith("# ")  # (the file's ending says the format)
    report("--format", "md", "--out", tmp_path / "m")
    text = (tmp_path / "m" / "report.md").read_text(encoding="utf-8")
    assert "![" in text
    for name in re.findall(r"\]\(([^)]+)\)", text):
        assert (tmp_path / "m" / name).read_bytes().startswith(b"\x89PNG")
