"""Pages of reports: what is on them, nothing from outside, contrast; in Chromium at three widths, light and dark."""

import os
import re
from pathlib import Path

import pytest
import xarray as xr
from report_pages import DETAILS, OVERFLOW, SECTIONS, STUDIES, UNFOLDED, WIDTHS, Page, accessible, loaded, outside

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.report.page import write_report


class TestPages:
    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_says_all_in_order(self, pages, name):
        page = Page(pages[name])
        acts = name not in ("fragility", "uncertainty")  # (with a hazard nothing is to be done)
        assert [one["id"] for one in page.every("section")] == [one for one in SECTIONS if acts or one != "actions"]
        assert [one["id"] for one in page.every("details") if one.get("id") not in (None, "further")] == DETAILS
        assert page.headings[0] == 1
        assert page.headings.count(1) == 1
        assert all(b <= a + 1 for a, b in zip(page.headings, page.headings[1:], strict=False))
        text = " ".join("".join(page.text).split())
        assert "A <small> study" in text
        assert not re.search(r"\bnan\b|\bNone\b|\binf\b|Undefined|\{\{|\[bold\]|\[italic\]", text)
        assert page.every("figure")
        assert page.every("table")

    @pytest.mark.parametrize("name", STUDIES)
    def test_asks_for_nothing(self, pages, name):
        outside(pages[name])

    @pytest.mark.parametrize("name", STUDIES)
    def test_is_for_everyone(self, pages, name):
        accessible(Page(pages[name]))

    @pytest.mark.slow
    def test_same_results_same_bytes(self, folder, pages, tmp_path):
        for name in ("cloud", "performance"):
            write_report(folder / name / "results.nc", tmp_path / "again.html")
            assert (tmp_path / "again.html").read_bytes() == pages[name].read_bytes()

    @pytest.mark.slow
    def test_of_measures(self, folder, tmp_path):
        (tmp_path / "study.toml").write_text(STUDIES["fragility"] + "[measures]\n", encoding="utf-8")
        tp.Study.from_toml(tmp_path / "study.toml").run(tmp_path)
        page = Page(*write_report(tmp_path / "results.nc"))
        outside(tmp_path / "report.html")
        accessible(page)
        assert len(page.every("figure")) == 6

    @pytest.mark.slow
    def test_small(self, pages, hostile):
        assert all(path.stat().st_size < 3e6 for path in [*pages.values(), hostile])

    def test_ids_are_unique(self, pages):
        for path in pages.values():
            found = [attributes["id"] for _, attributes in Page(path).tags if "id" in attributes]
            assert len(found) == len(set(found))
            inside = set(found)
            text = path.read_text(encoding="utf-8")
            used = re.findall(r'href="#([^"]+)"', text) + re.findall(r"url\(#([^)]+)\)", text)
            assert set(used) <= inside

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
VIOLATIONS = f";{UNFOLDED} axe.run().then(found => found.violations.map(one => [one.id, one.nodes[0].html]))"
FOCUS = "document.querySelector('.skip').focus(), document.activeElement.getAttribute('href')"


class TestBrowser:
    @pytest.mark.slow
    @pytest.mark.parametrize("width", WIDTHS)
    @pytest.mark.parametrize("dark", [False, True])
    def test_fits_and_is_silent(self, chromium, pages, hostile, tmp_path, width, dark):
        for name, path in {**pages, "hostile": hostile}.items():
            seen = chromium.see(path, width, OVERFLOW, dark=dark, picture=name == "cloud")
            assert seen.value == [width, width, "complete"], name
            assert seen.complaints == [], name
            assert seen.requests == [], name
            if seen.png:
                assert seen.png.startswith(b"\x89PNG")

    @pytest.mark.slow
    def test_comparisons_fit_and_are_silent(self, chromium, folder, tmp_path):
        """The page of `toppling compare`, of curves and of a building, is no wider than a phone or a tablet."""
        for kind in ("fragility", "performance"):
            result, out = folder / kind / "results.nc", tmp_path / kind
            with xr.open_dataset(result) as results:
                laws = [str(one) for one in results["model"].values[:2]]
            assert main(["compare", str(result), "--laws", *laws, "--out", str(out)]) == 0
            page = (out / "comparison.html").read_text(encoding="utf-8")
            assert all(f"({law})</dd>" in page for law in laws)
            for width in WIDTHS:
                seen = chromium.see(out / "comparison.html", width, OVERFLOW)
                assert seen.value == [width, width, "complete"], kind
                assert (seen.complaints, seen.requests) == ([], []), kind
                assert chromium.see(out / "comparison.html", width, SCROLLING).value == [], kind

    @pytest.mark.slow
    def test_no_table_scrolls(self, chromium, pages):
        """On a phone, a tablet and a desktop; the matrices of sensitivity studies do, with their first column fixed."""
        for name, path in pages.items():
            for width in (360, 768, 1440):
                assert chromium.see(path, width, SCROLLING).value == [], (name, width)

    @pytest.mark.slow
    @pytest.mark.skipif("AXE_CORE" not in os.environ, reason="AXE_CORE is not the path of axe.min.js (npm: axe-core)")
    @pytest.mark.parametrize("dark", [False, True])
    def test_axe_finds_nothing(self, chromium, pages, dark):
        axe = Path(os.environ["AXE_CORE"]).read_text(encoding="utf-8")
        for name, path in pages.items():
            for width in (380, 768, 1280, 1440):
                assert chromium.see(path, width, axe + VIOLATIONS, dark=dark).value == [], (name, width)

    def test_the_check_can_fail(self, chromium, tmp_path):
        """The checks find a page that does everything that reports must not do."""
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
