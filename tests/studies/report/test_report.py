"""Reports: every kind of study, hostile names, refused files; and in Chromium at three widths, light and dark."""

import json
import re
from html import unescape
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path

import browser
import numpy as np
import pytest
import xarray as xr
from markdown_it import MarkdownIt
from rich.console import Console

import toppling as tp
from toppling.doubts import KINDS
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.command.verdict import verdict
from toppling.studies.reference.json_schema import study_schema
from toppling.studies.report import page as module
from toppling.studies.report.actions import next_steps
from toppling.studies.report.answers import answer
from toppling.studies.report.basis import basis
from toppling.studies.report.cells import markdown, page_table
from toppling.studies.report.figures import LONGEST_ALT
from toppling.studies.report.law_choice import law_choice
from toppling.studies.report.page import write_report
from toppling.studies.report.summary import plain_answer
from toppling.studies.report.validity import (
    CARE,
    GOOD,
    INVALID,
    ODD,
    SLIDING,
    UNKNOWN,
    Check,
    badge,
    checks_of,
    worst_word,
)
from toppling.studies.store.content import sealed
from toppling.studies.tables.client import client_rows
from toppling.studies.text.glossary import TERMS
from toppling.studies.text.names import clean, drawable
from toppling.studies.text.rows import plain_table
from toppling.studies.text.words import reference_law
from toppling.wording import about_percent, three_digits, two_digits

BASE = """
title = "A <small> study"
[[blocks]]
width_m = 0.4
height_m = 1.8
name = "shelf"
[[blocks]]
width_m = 0.6
height_m = 1.8
name = "rack"
[[models]]
law = "energy-consistent"
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 12
seed = 1
duration_s = 10
dt_s = 0.01
"""
IDA = """
[ida]
im = "pga"
levels = { from = 0.1, to = 2.0, number = 8, spacing = "log", unit = "g" }
"""
HAZARD = """
[hazard]
levels = [0.1, 0.3, 1.0]
rates = [1e-2, 1e-3, 1e-5]
unit = "g"
"""
CLOUD = """
[cloud]
im = "pga"
"""
STRIPES = """
[stripes]
im = "pga"
unit = "g"
scale = true
[[stripes.at]]
level = 0.3
[[stripes.at]]
level = 0.9
motions = { seed = 5 }
"""
UNCERTAIN = """
[uncertainty]
samples = 8
seed = 1
[uncertainty.inputs]
restitution_factor = { distribution = "uniform", lower = 0.8, upper = 1.0 }
alpha_factor = { distribution = "uniform", lower = 0.9, upper = 1.1 }
"""
SENSITIVE = """
[sensitivity]
parameter = "delta"
values = [0.02, 0.05, 0.1]
replicates = 100
"""
INVENTORY = "item,width_m,height_m,floor,count,value,currency,consequence\nrack,0.5,1.8,0,2,100,EUR,injury\n"
RACK = '[[blocks]]\nwidth_m = 0.6\nheight_m = 1.8\nname = "rack"\n'
LAWS_OF_SENSITIVITY = """
[[models]]
law = "discrete"
[[models]]
law = "giannini-masiani"
"""
NOT_SWEPT = BASE.replace('[[models]]\nlaw = "energy-consistent"\n[[models]]\nlaw = "housner"\n', LAWS_OF_SENSITIVITY)
STUDIES = {
    "fragility": BASE + IDA + HAZARD,
    "cloud": BASE + CLOUD,
    "stripes": BASE + STRIPES,
    "uncertainty": BASE + IDA + HAZARD + UNCERTAIN,
    "sensitivity": NOT_SWEPT.replace(RACK, "") + IDA + SENSITIVE,
    "performance": re.sub(r"\[\[blocks\]\][^\[]*", "", BASE)
    + HAZARD
    + '[performance]\ninventory = "inventory.csv"\nim = "pga"\n'
    + 'levels = { from = 0.1, to = 2.0, number = 6, spacing = "log", unit = "g" }\n',
}
SECTIONS = (
    "answer pieces steps basis terms detail figures tables technical-terms method assumptions validity provenance"
)
HOSTILE = [
    "<script>alert(1)</script>",
    "\"'><img src=x onerror=alert(1)>",
    "x" * 300,
    "🪦 \u202egnp\x00\x1b[31m",
    r"$\frac{1}$ {{ 7*7 }} {% raw %}",
    "</style></svg></title>",
]
WIDTHS = (360, 768, 1440)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("report")
    (made / "inventory.csv").write_text(INVENTORY, encoding="utf-8")
    for name, text in STUDIES.items():
        (made / f"{name}.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(made / f"{name}.toml").run(made / name)
    return made


@pytest.fixture(scope="module")
def pages(folder):
    for name in STUDIES:
        write_report(folder / name / "results.nc")
    return {name: folder / name / "report.html" for name in STUDIES}


def loaded(folder, name="fragility"):
    with xr.open_dataset(folder / name / "results.nc") as stored:
        return stored.load()


def written(results, folder, name="changed"):
    path = folder / f"{name}.nc"
    path.unlink(missing_ok=True)
    results.to_netcdf(path, engine="netcdf4")
    return path


@pytest.fixture(scope="module")
def hostile(folder):
    """The page of results with hostile names of blocks and laws, and with missing medians and rates."""
    return write_hostile(folder, 3)


def write_hostile(folder, blocks):
    few = loaded(folder).isel(motion=slice(4))
    many = few.isel(block=np.arange(blocks) % 2, model=np.arange(6) % 2)
    names = [f"{HOSTILE[i % len(HOSTILE)]}{i}".replace("\x00", "\x01") for i in range(blocks)]
    laws = [one.replace("\x00", "\x01") for one in HOSTILE]
    many = many.assign_coords(block=("block", names), model=("model", laws))
    for name in ("median", "rate", "risk_probability"):
        for end in ("", "_lower", "_upper"):
            many[f"{name}{end}"][:, 1] = np.nan
    many["converged"][:, 1] = False
    many["status"] = many["status"].astype(object)
    many["status"][:, 1] = "<i>none</i>"
    study = json.loads(many.attrs["study"]) | {"title": HOSTILE[0], "motions": {"records": HOSTILE}}
    many = many.assign_attrs(title=" ".join(laws[:2]), notes="\n".join(laws), study=json.dumps(study))
    path = written(sealed(many), folder, f"hostile{blocks}")
    write_report(path, path.with_suffix(".html"))
    return path.with_suffix(".html")


class Page(HTMLParser):
    """The contents of a page: tags with attributes, headings, ids, and text outside of tags."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.headings, self.text, self.within = [], [], [], []
        self.feed(Path(path).read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_data(self, data):
        self.text.append(data)

    def every(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]


class TestPages:
    @pytest.mark.parametrize("name", STUDIES)
    def test_says_all_in_order(self, pages, name):
        page = Page(pages[name])
        found = [one["id"] for one in page.every("section")]
        assert found == SECTIONS.split()
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
        assert len(page.every("figure")) == 4

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


def outside(path):
    """A page refers to nothing but itself, and runs nothing."""
    text = path.read_text(encoding="utf-8")
    page = Page(path)
    assert not [tag for tag, _ in page.tags if tag in ("script", "img", "link", "iframe", "object", "embed", "base")]
    for tag, attributes in page.tags:
        assert not [key for key in attributes if key.startswith("on")], (tag, attributes)
        for key in ("src", "href", "xlink:href", "action", "srcset", "poster"):
            if key in attributes:
                assert attributes[key].startswith(("#", "data:image/png;base64,")), (tag, attributes)
    assert "@import" not in text
    assert all(one.startswith("#") for one in re.findall(r"url\(([^)]*)\)", text))
    policy = next(one["content"] for one in page.every("meta") if one.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy


def accessible(page):
    assert page.every("html")[0]["lang"] == "en"
    assert page.every("a")[0]["href"] == "#answer"
    images = [one for one in page.every("div") if one.get("role") == "img"]
    assert len(images) == len(page.every("figure"))
    # a short alternative text says what is drawn; a text of its own describes the figure and gives numbers
    assert all(20 < len(one["aria-label"]) <= LONGEST_ALT for one in images)
    described = {one.get("id") for one in page.every("p")}
    assert all(one["aria-describedby"] in described for one in images)
    assert len(page.every("caption")) == len(page.every("table"))
    assert all(one.get("scope") in ("col", "row", "rowgroup") for one in page.every("th"))
    boxes = [one for one in page.every("div") if "scroll" in one.get("class", "")]
    assert all(one.get("tabindex") == "0" and one.get("role") for one in boxes)


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


class TestAnswer:
    def test_reference_law_first(self, folder):
        results = loaded(folder)
        assert reference_law(results) == (1, True)
        said = answer(results).sentences
        one = results.isel(block=0, model=1)
        g = 9.80665
        interval = f"{three_digits(one['median_lower'].item() / g)}–{three_digits(one['median_upper'].item() / g)}"
        assert said[0].startswith("“shelf” overturns with a probability of 50 % at a peak")
        median = three_digits(one["median"].item() / g)
        assert f"{median} g (95 % interval {interval}) under housner e=e_R, the ref" in said[0]
        assert f"The other law gives {three_digits(results['median'].values[0, 0] / g)} g" in said[0]
        assert "the mean return period is" in said[0]
        assert reference_law(results.isel(model=[0])) == (0, False)
        assert "reference" not in answer(results.isel(model=[0])).sentences[0]

    def test_no_median_is_said(self, folder):
        results = loaded(folder).copy(deep=True)
        results["median"][:] = np.nan
        results["rate"][:] = np.nan
        results["status"] = results["status"].astype(object)
        results["status"][:] = "no overturning"
        said = answer(results).sentences[0]
        assert (
            "has no median under housner e=e_R, the reference law: no overturning. No other law has a median." in said
        )
        assert "Without a curve there is no annual rate." in said

    def test_beyond_the_levels_is_said(self, folder):
        results = loaded(folder).copy(deep=True)
        results["median"][:, 1] = 100.0
        said = answer(results).sentences[0]
        assert "up to the highest shaking that was run (2.00 g): its median is not reached." in said
        assert "10.2" not in said
        results["median"][:, 1] = 0.1
        assert "below the lowest shaking that was run: an extrapolation" in answer(results).sentences[0]

    def test_of_an_inventory(self, folder):
        results = loaded(folder, "performance")
        said = answer(results).sentences
        assert "of the 2 pieces that are not anchored overturn a year" in said[0]
        assert "EUR" in said[0]
        assert said[1].startswith("Anchoring “rack” (ground) saves the most of the ")

    def test_of_many_blocks_the_weakest(self, folder):
        results = loaded(folder)
        many = results.isel(block=np.arange(40) % 2).assign_coords(block=[f"b{i:02}" for i in range(40)])
        said = answer(many).sentences
        assert len([one for one in said if one.startswith("“b")]) == 12
        assert all(int(one[2:4]) % 2 == 0 for one in said if one.startswith("“b"))  # shelves fall before racks


CLIENT = ("answer", "pieces", "steps", "basis", "terms")
"""Sections of the first part of a report."""


def of_client(page):
    """The text of the part of a page that is written for the client."""
    return page.read_text(encoding="utf-8").split('<section id="detail"')[0].split("</header>")[1].split("<main>")[1]


class TestClientPart:
    """The first part of a report: no key names, no parameters of laws, two digits, every term defined once."""

    @pytest.mark.parametrize("name", STUDIES)
    def test_without_keys_parameters_and_toml(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name]))
        rules = text.partition("What this answer rests on")[0]
        assert not re.search(r"e=|δ=|\[\[?[a-z]|\]\]|_[a-z]+_|= \[|`|--[a-z]", text)
        keys = {key for name in study_schema()["$defs"].values() for key in name.get("properties", {}) if "_" in key}
        assert keys
        assert not [key for key in keys if re.search(rf"\b{key}\b", text)]
        if name != "sensitivity":
            assert not re.search(r"[αδζ]", rules)

    @pytest.mark.parametrize("name", [name for name in STUDIES if name != "sensitivity"])
    def test_numbers_have_two_digits(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name])).partition("What this answer rests on")[0]
        numbers = re.findall(r"(?<![\d.,])\d+\.\d+", text)
        assert numbers
        assert [one for one in numbers if len(one.replace(".", "").lstrip("0")) > 2] == []
        # whole numbers, too, but those that are exact: years, and what the study or its inventory gives
        whole = re.findall(r"(?<![\w.,])\d{3,}(?![\w.])|(?<![\w.,])\d{1,3}(?:,\d{3})+(?!\d)", text)
        given = {float(one) for one in re.findall(r"\d+(?:\.\d+)?", STUDIES[name] + INVENTORY)} | {100.0, 1000.0}
        given.add(1963.0)  # (Housner's paper)
        computed = [one for one in whole if float(one.replace(",", "")) not in given]
        assert [one for one in computed if len(one.replace(",", "").rstrip("0")) > 2] == []

    @pytest.mark.parametrize("name", STUDIES)
    def test_each_term_is_defined_once_where_it_is_used(self, pages, name):
        text = pages[name].read_text(encoding="utf-8")
        defined = [unescape(one) for one in re.findall(r"<dt>([^<]+)</dt><dd>", text)]
        assert len(set(defined)) == len(defined) >= 8
        assert set(defined) <= {one.name for one in TERMS}
        plain = unescape(re.sub(r"<dl.*?</dl>|<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", text, flags=re.DOTALL))
        for one in ("hazard curve", "median", "fragility curve", "damping law", "uplift", "bootstrap", "payback"):
            if re.search(rf"\b{one}s?\b", plain.partition("Provenance")[0]):
                assert one in defined, one

    def test_cover_changes_no_results(self, folder, tmp_path):
        source = Path(folder / "fragility")
        study = tmp_path / "study.toml"
        study.write_text(STUDIES["fragility"], encoding="utf-8")
        before = tp.Study.from_toml(study).identity
        cover = '[report]\nclient = "A <client>"\nsite = "Here"\nauthor = "Me"\ndate = "1 May"\n'
        study.write_text(f"{STUDIES['fragility']}{cover}", encoding="utf-8")
        renamed = tp.Study.from_toml(study)
        assert renamed.identity == before
        with xr.open_dataset(source / "results.nc") as results:
            covered = results.load().assign_attrs(study=json.dumps(renamed.configuration))
        found = module.content(covered, source / "results.nc", "as written")
        assert found["cover"] == [("Client", "A <client>"), ("Site", "Here"), ("Author", "Me"), ("Date", "1 May")]
        page = module.html_page(covered, source / "results.nc", "as written")
        assert "<dt>Client</dt><dd>A &lt;client&gt;</dd>" in page
        assert module.content(loaded(folder), source / "results.nc", "as written")["cover"] == []

    @pytest.mark.parametrize("cover", ["", 'client = " "', 'client = "a"\ntitle = "b"', "date = 2026-01-01"])
    def test_covers_that_are_refused(self, tmp_path, cover):
        (tmp_path / "study.toml").write_text(f"{STUDIES['fragility']}[report]\n{cover}\n", encoding="utf-8")
        with pytest.raises(StudyError, match="report"):
            tp.Study.from_toml(tmp_path / "study.toml")

    def test_basis_names_the_motions_that_were_run(self, folder):
        said = basis(loaded(folder))[0]
        assert said == "The pieces are shaken by 12 simulated ground motions, scaled to 8 levels of shaking."
        stripes = basis(loaded(folder, "stripes"))[0]
        assert "24 ground motions, from different earthquakes for each level of shaking" in stripes
        results = loaded(folder)
        study = json.loads(results.attrs["study"]) | {"motion_sets": [{}, {}], "hazards": [{}]}
        branched = results.assign_attrs(study=json.dumps(study))
        assert "; 2 further sets of motions are weighted with it." in basis(branched)[0]
        assert "How often the ground shakes, and how strongly, is taken from 2 weighted hazard curves." in basis(
            branched
        )
        floors = xr.concat([results, results], "floor", data_vars="minimal").assign_coords(floor=["1", "2"])
        assert "are shaken by 6 simulated" in basis(floors)[0]

    def test_of_many_blocks_and_floors(self, folder):
        results = loaded(folder)
        rows = client_rows(results)
        at, _ = reference_law(results)
        one = results.isel(block=0, model=at)
        assert rows.headings == (
            "piece",
            "PGA at which half of the motions overturn it, g",
            "mean return period, years",
            "chance in 50 years",
        )
        assert rows.rows[0][0] == "shelf"
        assert rows.rows[0][1].startswith(f"{two_digits(float(one['median']) / 9.80665)} (")
        assert rows.rows[0][2] == two_digits(1.0 / float(one["rate"]))
        assert rows.rows[0][3].startswith(about_percent(float(one["risk_probability"])))
        bare = results.copy(deep=True)
        bare["median"][:] = np.nan
        bare["status"] = bare["status"].astype(object)
        bare["status"][0], bare["status"][1] = "no overturning", "all overturned"
        bare["rate"][:] = np.nan
        bare["risk_probability"][:] = np.nan
        assert [row[1:] for row in client_rows(bare).rows] == [
            ("never seen", "not known", "not known"),
            ("at every level", "not known", "not known"),
        ]


class TestPlainWords:
    """The summary in plain words at the top of a report."""

    def test_of_a_hundred_earthquakes(self, folder):
        results = loaded(folder)
        one = results.isel(block=0, model=1)
        seen = one["probability"].values
        below = np.flatnonzero((seen > 0) & (seen < 0.5) & (one["level"].values < float(one["median"])))
        at = below[np.abs(np.log(10.0 * seen[below])).argmin()]
        g = 9.80665
        first, second, third, laws = plain_answer(results)
        assert laws.endswith(law_choice(results))  # (the laws agree: none of their results is given)
        assert first == "“shelf” is the more vulnerable of the 2 pieces."
        strong = f"Of 100 earthquakes with a peak ground acceleration of {two_digits(float(one['level'][at]) / g)} g, "
        few = [round(100 * float(one[end][at])) for end in ("probability", "lower", "upper")]
        assert second.startswith(f"{strong}about {few[0]} ({few[1]} to {few[2]}) would overturn “shelf”; at ")
        level, low, high = (two_digits(float(one[f"median{end}"]) / g) for end in ("", "_lower", "_upper"))
        assert second.endswith(
            f"; at {level} g ({low}–{high}) about half of them would. Ranges in brackets are 95 % intervals."
        )
        chance = float(one["risk_probability"])
        assert f"overturns within 50 years is about {100 * chance:.2g}\u00a0%" in third

    def test_without_what_it_needs(self, folder):
        results = loaded(folder).copy(deep=True)
        results["probability"][:] = 0.0
        said = plain_answer(results)
        assert "about 50 would overturn “shelf”" in said[1]
        results["median_upper"][:] = np.inf
        assert re.search(r" g \(above [\d.]+\), about 50 would", plain_answer(results)[1])
        results["median_lower"][:] = 0.0
        assert "(these motions do not show how precisely that level is known)" in plain_answer(results)[1]
        results["median"][:] = np.nan
        results["status"] = results["status"].astype(object)
        results["status"][:] = "no overturning"
        assert plain_answer(results) == ["The runs do not show how strong the shaking must be: no overturning."]
        assert plain_answer(loaded(folder, "cloud"))[1].startswith("Of 100 earthquakes with a ")

    def test_of_a_building(self, folder):
        results = loaded(folder, "performance")
        one = results.sel(model="housner e=e_R", place="building")
        rate = float(one["any_rate"])
        said = plain_answer(results)
        assert said[0].startswith(
            f"At least one piece in this building overturns about once in {two_digits(1 / rate)} years ("
        )
        assert f", which is a probability of about {about_percent(1 - np.exp(-50 * rate))} (" in said[0]
        assert said[0].endswith(" in 50 years.")
        other = float(results["any_rate"].sel(model="energy-consistent e=e_R δ=0.05", place="building"))
        assert said[1] == (
            "The answer depends on the damping law that is assumed: under the other law of this study, this happens "
            f"about once in {two_digits(1 / other)} years. {law_choice(results)}"
        )
        alike = results.copy(deep=True)
        alike["any_rate"][:] = alike["any_rate"].values[1]
        assert plain_answer(alike) == [said[0], *said[2:]]
        assert said[2].startswith(
            f"The expected loss (the value of what falls) is about {two_digits(float(one['annual_loss']))} EUR a year ("
        )
        rate = float(one["consequence_rate"].sel(consequence="injury"))
        assert said[3].startswith(
            f"At least one piece that can injure people overturns about once in {two_digits(1 / rate)} years ("
        )
        assert said[4].startswith("All ranges here are 95 % intervals that reflect only the limited number of motions")
        assert len(said) == 5
        held = results.assign_coords(anchored=("item", [True]))
        assert plain_answer(held)[4] == "2 of 2 pieces are anchored and assumed not to overturn: 2 × rack."

    def test_other_laws_where_they_disagree(self, folder):
        """Chances with a hazard, levels without; nothing where no law differs by a tenth."""
        results = loaded(folder).copy(deep=True)
        results["risk_probability"][0] = [0.03, 0.02]
        assert "overturns within 50 years is 3.0\u00a0%." in plain_answer(results)[-1]
        results["risk_probability"][0] = [0.021, 0.02]
        assert not [one for one in plain_answer(results) if "damping law that is assumed" in one]
        bare = loaded(folder, "stripes").copy(deep=True)
        bare["median"][0] = [6.0, 4.0]
        said = plain_answer(bare)[-1]
        assert "about half of the earthquakes would overturn “shelf” at a peak ground acceleration of 0.61 g." in said

    def test_of_an_uncertain_piece(self, folder):
        """The headline's range holds what is not known of the piece: nine tenths of its samples, by hand."""
        results = loaded(folder, "uncertainty").copy(deep=True)
        g = 9.80665
        results["sample_median"][0] = np.array([[0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0]] * 2) * g
        first = next(one for one in plain_answer(results) if one.startswith("Of 100 earthquakes"))
        assert "this level may lie between 0.25 and 2.0 g (90 % range)" in first
        ends = [two_digits(float(results[f"median_{end}"][0, 1]) / g) for end in ("lower", "upper")]
        assert first.endswith(f"The 95 % interval for the limited number of motions is {'–'.join(ends)} g.")
        rows = client_rows(results)
        assert dict(zip(rows.headings, rows.rows[0], strict=True))["90 % range over its uncertain properties, g"] == (
            "0.25–2.0"
        )
        results["sample_median"][0, :, -1] = 2.1 * g  # (above the levels that were run: not reached)
        assert any("may lie above 0.25 g (90 % range)" in one for one in plain_answer(results))
        # the reference law is found among laws of which each sample names its own
        assert reference_law(results) == (1, True)

    def test_names_of_the_catalogue_are_titles(self, folder):
        results = loaded(folder).assign_coords(block=["bookcase-5-shelf", "rack"])
        assert plain_answer(results)[0] == "“Bookcase, 5 shelves” is the more vulnerable of the 2 pieces."
        assert client_rows(results).rows[0][0] == "Bookcase, 5 shelves"

    def test_the_size_that_is_needed(self, folder):
        """Of what, for which target, and the pieces that miss it, which can be anchored instead."""
        results = loaded(folder).copy(deep=True)
        results["risk_probability"][:, 1] = [0.02, 0.001]
        for end, values in {"": [0.5, 0.38], "_lower": [0.4, 0.37], "_upper": [0.6, 0.4]}.items():
            results[f"size_width{end}"] = ("model", values, {"units": "m"})
        results = results.assign_attrs(size_along="width", size_probability=0.01)
        assert next_steps(results, []) == [
            "For the chance that a piece like these overturns to meet the target of this study (no more than "
            "1\u00a0% in 50 years), its width must be at least about 0.38 m (0.37–0.40; 0.50 m under the other law), "
            "with its other dimensions unchanged.",
            "“shelf” does not meet this target: where its width cannot be changed, anchor it.",
        ]

    def test_the_share_beyond_the_hazard_curve(self, folder):
        """The footnote gives the shares of the marked rows themselves."""
        results = loaded(folder).copy(deep=True)
        results["rate_share_above"][:] = [[0.0, 0.01], [0.0, 0.78]]
        rows = client_rows(results)
        assert [row[2].endswith(" *") for row in rows.rows] == [False, True]
        assert "*: 78\u00a0% of the rate comes from shaking beyond the end of the hazard curve" in rows.title
        results["rate_share_above"][:, 1] = [0.12, 0.78]
        assert "*: 12\u00a0% to 78\u00a0% of the rate" in client_rows(results).title

    def test_what_matters_most(self, folder):
        results = loaded(folder, "uncertainty")
        one = results.isel(block=0)
        share = one["capacity_share"] if "capacity_share" in one else one["flag_share"].isel(level=0)
        assert share.dims == ("component",)
        said = next(line for line in plain_answer(results) if "contribution to that scatter" in line)
        assert f" {about_percent(float(share.max()))}, comes from " in said
        assert not re.search(r"[αδ$×]", said)

    def test_next_steps_count_the_checks_that_are_not_good(self, folder):
        results = loaded(folder, "cloud")
        every = [Check("q", word, f"because {word}.", "Do.") for word in (GOOD, CARE, UNKNOWN, CARE, INVALID)]
        first, last = next_steps(results, every)
        assert "If a hazard curve for the site is added to the study" in first
        assert "the validity checks that are not rated “good” (4 of 5)" in last
        assert "the validity check that is not rated “good” (1 of 2)" in next_steps(results, every[:2])[1]
        assert next_steps(results, every[:1]) == [first]
        sliding = Check(SLIDING, CARE, "because.", "Do.")
        assert "with a second person steadying it and nobody where it could fall" in next_steps(results, [sliding])[1]
        assert next_steps(results, [sliding._replace(word=GOOD)]) == [first]
        steps = next_steps(loaded(folder, "performance"), [])
        assert steps == [
            "Anchor first, for safety (injury): “rack” (ground).",
            "Code requirements are not checked. Any piece that the law requires to be anchored must be anchored, "
            "whatever these results say.",
        ]


class TestChecks:
    @staticmethod
    def word(results, about):
        return next(one.word for one in checks_of(results) if about in one.question)

    def test_words_follow_the_screen(self, folder):
        results = loaded(folder).copy(deep=True)
        assert self.word(results, "bounce") == GOOD
        assert self.word(results, "enough motions") == CARE  # 12 of them
        assert self.word(results, "slide") == UNKNOWN  # no friction is given
        results["friction_uplift"][:] = 0.6
        assert self.word(results, "bounce") == INVALID
        results["friction_uplift"][:1] = 0.2
        assert self.word(results, "bounce") == CARE
        results["outside"].loc[{"reason": "slides_at_uplift"}] = 0.3
        assert self.word(results, "slide") == CARE
        results["outside"].loc[{"reason": "slides_at_uplift"}] = 0.6
        assert self.word(results, "slide") == INVALID
        results["interval_half_width"][()] = 0.4
        assert self.word(results, "enough motions") == INVALID
        results["interval_half_width"][()] = 0.1
        assert self.word(results, "enough motions") == GOOD

    def test_of_the_zone(self, folder):
        results = loaded(folder).copy(deep=True)
        assert self.word(results.isel(model=[1]), "δ") == GOOD
        rigid = results.assign_coords(rest=("model", ["rigid"] * results.sizes["model"]))
        assert self.word(rigid.assign_coords(delta=results["delta"] * 4.0), "δ") == GOOD  # (nothing that resonates)
        results = results.isel(model=[0]).assign_coords(rest=("model", ["elastic"]))
        results["outside"].loc[{"reason": "elastic_mode"}] = 0.0
        assert self.word(results, "δ") == GOOD
        assert self.word(results.assign_coords(delta=results["delta"] * 4.0), "δ") == CARE
        results["outside"].loc[{"reason": "elastic_mode"}] = 0.9
        assert self.word(results, "δ") == INVALID

    def test_of_the_laws_that_the_answer_is_given_for(self, folder):
        """The elastic mode of a law beside the reference law is named in the appendix, and not in the badge."""
        results = loaded(folder).copy(deep=True)
        results["outside"][:] = 0.0
        both = results.assign_coords(rest=("model", ["elastic", "rigid"]))
        both["outside"].loc[{"reason": "elastic_mode", "model": both["model"][0]}] = 0.85
        found = next(one for one in checks_of(both) if "δ" in one.question)
        assert found.word == GOOD
        assert "Other laws of this study (energy-consistent e=e_R δ=0.05), for which the answer is not" in found.reason
        assert "85 % of the runs" in found.reason
        assert "elastic" not in badge(checks_of(both))
        only = both.isel(model=[0])
        assert "the law’s elastic mode resonates in up to 85 % of the runs" in badge(checks_of(only))
        # a sensitivity study is about all of its laws, and branches weigh all of theirs
        assert self.word(both.assign_attrs(kind="sensitivity"), "δ") == CARE
        weighted = both.assign_coords(branch_model=("branch", both["model"].values))
        assert self.word(weighted, "δ") == CARE
        both["risk_probability"][0] = [0.03, 0.02]
        said = plain_answer(both)[-1]
        assert said.startswith("The answer depends on the damping law that is assumed: under the other law of this")
        assert "That law lets a standing piece vibrate elastically, so that it begins to rock in weaker shaking" in said
        assert said.endswith(law_choice(both))

    def test_of_intervals_and_curves(self, folder):
        results = loaded(folder).copy(deep=True)
        results["median_lower"][:], results["median_upper"][:], results["median"][:] = 1.0, 1.2, 1.1
        assert self.word(results, "narrow") == GOOD
        results["median_upper"][0, 0] = 9.0
        assert self.word(results, "narrow") == CARE
        results["median_upper"][:] = 9.0
        assert self.word(results, "narrow") == INVALID
        results["converged"][0, 0] = False
        assert self.word(results, "every curve") == CARE
        results["converged"][:] = False
        assert self.word(results, "every curve") == INVALID

    def test_of_rates(self, folder):
        results = loaded(folder).copy(deep=True)
        results["rate_share_above"][:] = 0.0
        results["rate_lower"][:], results["rate"][:], results["rate_upper"][:] = 1e-4, 2e-4, 3e-4
        assert self.word(results, "annual rates") == GOOD
        results["rate_share_above"][0, 0] = 0.9
        assert self.word(results, "annual rates") == CARE
        results["rate_share_above"][:] = 0.9
        assert self.word(results, "annual rates") == INVALID

    def test_of_rates_from_shaking_that_was_not_run(self, folder):
        """The word follows how far the rate can be off, whatever a curve that rises on does above the highest level."""
        results = loaded(folder).copy(deep=True)
        results["rate"][:], results["rate_share_below_levels"][:] = 1e-3, 0.0
        about = "shaking that was run"

        def set_to(share, reached, most):
            # of such shaking every run reaches the state at `most` times the rate of the results
            results["rate_share_above_levels"][:] = share
            results["probability_at_highest_level"][:] = reached
            results["rate_above_highest_level"][:] = most * 1e-3
            return next(one for one in checks_of(results) if about in one.question)

        assert set_to(0.04, 0.5, 0.06).word == GOOD
        risen = set_to(0.3, 0.94, 0.31)
        assert risen.word == GOOD
        assert "Up to 30 % of any annual rate comes from shaking stronger than any that was run" in risen.reason
        assert "no rate is off by more than 1 %" in risen.reason
        wide = set_to(0.3, 0.5, 0.5)
        assert wide.word == CARE
        assert "30 % of an annual rate" in wide.clause
        assert "the rate is 0.95 to 1.20 times the one given" in wide.reason
        assert wide.cure.startswith("Raise ida.levels.to")
        assert badge([wide]).startswith("use with care: up to 30 % of an annual rate comes from shaking stronger")
        assert set_to(0.8, 0.1, 3.0).word == INVALID
        results["rate_above_highest_level"][0], results["probability_at_highest_level"][0] = 0.82e-3, 0.97
        assert self.word(results, about) == CARE  # (not of every block and law)

        weak = set_to(0.0, 0.99, 0.0)
        assert weak.word == GOOD
        results["rate_share_below_levels"][0, 0] = 0.2
        weak = next(one for one in checks_of(results) if about in one.question)
        assert weak.word == CARE
        assert "20 % of an annual rate comes from shaking weaker than any that was run" in weak.clause
        assert weak.cure.startswith("Lower ida.levels.from")
        older = results.drop_vars(["rate_share_below_levels", "rate_share_above_levels"])
        assert self.word(older, about) == UNKNOWN

    def test_rates_say_where_they_stand_that_curves_are_extrapolated(self, folder):
        results = loaded(folder).copy(deep=True)
        said = "comes from shaking stronger than any that was run, where the fitted curve is extrapolated."
        for name, values in (("above_levels", 0.3), ("below_levels", 0.0)):
            results[f"rate_share_{name}"][:] = values
        results["probability_at_highest_level"][:] = 0.5
        results["rate_above_highest_level"][:] = 0.5 * results["rate"].values
        assert f"About 30\u00a0% of this chance {said}" in " ".join(plain_answer(results))
        assert f"About 30\u00a0% of the rate under {results['model'].values[1]} {said}" in answer(results).sentences[0]
        table = client_rows(results)
        assert "‡: 30\u00a0% of the rate comes from shaking at which nothing was run" in table.title
        assert all(row[2].endswith(" ‡") for row in table.rows)
        plain = verdict(loaded(folder), True)
        lines = verdict(results, True)
        assert lines[0] == f"30\u00a0% of the annual rates of “shelf”, “rack” {said} {plain[0]}"
        assert lines[0].endswith("which the other laws approximate.")
        results["probability_at_highest_level"][:], results["rate_above_highest_level"][:] = (
            0.97,
            0.31 * results["rate"],
        )
        text = " ".join([*plain_answer(results), *answer(results).sentences, *verdict(results, True)])
        assert said not in text
        assert "‡" not in client_rows(results).title

    def test_the_worst_word_wins(self, folder):
        found = checks_of(loaded(folder))
        assert worst_word([one._replace(word=GOOD) for one in found]) == GOOD
        assert worst_word([found[0]._replace(word=UNKNOWN), found[0]._replace(word=GOOD)]) == CARE
        assert worst_word([found[0]._replace(word=INVALID), found[0]._replace(word=GOOD)]) == INVALID

    def test_the_badge_names_the_worst_in_one_clause(self, folder):
        """What is not valid before what needs care, before what was not checked; of the same word the first."""
        named = {word: Check("q", word, "r", "", f"{word}, this") for word in (GOOD, CARE, UNKNOWN, INVALID)}
        assert badge([named[GOOD]._replace(clause="")]) == "good"
        several = [named[UNKNOWN], named[CARE], named[GOOD]]
        assert badge(several) == "use with care: use with care, this; 1 other check needs attention"
        worst = badge([named[CARE], named[INVALID], named[INVALID]._replace(clause="that")])
        assert worst == "not valid: not valid, this; 2 other checks need attention"
        assert badge([named[UNKNOWN], named[GOOD]]) == "use with care: not checked, this"
        results = loaded(folder).copy(deep=True)
        results["outside"].loc[{"reason": "slides_while_rocking"}] = 0.73
        assert badge(checks_of(results)).startswith(
            "not valid: in up to 73 % of the runs a piece would slide instead of rocking unless its coefficient of "
            "friction were above 1; "
        )

    def test_what_is_odd_is_said_in_words(self, folder):
        """A clause for every kind of doubt but the spectra, which have a check of their own."""
        assert {*ODD} == {*KINDS} - {"spectra"}
        results = loaded(folder)
        for kind, clause in ODD.items():
            (check,) = (
                one
                for one in checks_of(results.assign_attrs(doubts=json.dumps([[kind, "it is so", False]])))
                if "records plausible" in one.question
            )
            assert (check.word, check.clause, check.reason) == (CARE, clause, "It is so.")

    @pytest.mark.parametrize("kind", STUDIES)
    def test_every_check_that_is_not_good_has_a_clause(self, folder, pages, kind):
        found = checks_of(loaded(folder, kind))
        for one in found:
            assert bool(one.clause) == (one.word != GOOD), one
            assert not one.clause.endswith(".")
        text = " ".join("".join(Page(pages[kind]).text).split())
        assert f"Validity of this study: {badge(found)}" in text


class TestHostile:
    def test_nothing_is_markup(self, hostile):
        outside(hostile)
        accessible(Page(hostile))
        text = hostile.read_text(encoding="utf-8")
        assert "<script" not in text
        assert "<img" not in text
        assert "{{ 7*7 }} {% raw %}" in text  # printed as it is, not evaluated
        assert "49 {%" not in text
        assert not re.search("[\x00-\x08\x0b-\x1f\u202a-\u202e]", text)

    @pytest.mark.slow
    def test_forty_blocks_under_six_laws(self, chromium, folder):
        path = write_hostile(folder, 40)
        outside(path)
        assert path.stat().st_size < 3.5e6  # (every figure is there twice, for a page and for a phone)
        for width in WIDTHS:
            assert chromium.see(path, width, OVERFLOW).value == [width, width, "complete"]

    def test_names_are_whole_in_tables(self, hostile):
        text = "".join(Page(hostile).text)
        assert HOSTILE[0] in text
        assert HOSTILE[2] in text
        assert "<i>none</i>" in text

    def test_figures_get_short_names_all_different(self):
        long = [f"{'x' * 300}{i}" for i in range(3)]
        found = drawable(xr.Dataset(coords={"block": long, "model": ["a$b", "a", "b\x01"]}))
        assert len(set(found["block"].values)) == 3
        assert max(map(len, found["block"].values)) < 70
        assert found["model"].values.tolist() == [r"a\$b", "a", "b\ufffd"]

    def test_markdown_is_text(self, folder, hostile, tmp_path):
        write_report(folder / "hostile3.nc", tmp_path / "hostile.md", "md")
        text = (tmp_path / "hostile.md").read_text(encoding="utf-8")
        above = text.partition("The study file:")[0]
        assert "<" not in above
        rows = [line for line in above.splitlines() if line.startswith("|")]
        assert rows
        assert all(line.endswith("|") for line in rows)

    def test_titles_and_headings_are_text(self):
        name = "a|b *c* <d> [red]e[/] \\[f]"
        table = plain_table(f"Of {name}", ("", name), [(name, "1")])
        page = page_table(table)
        assert (page.title, page.headings[1], page.groups[0][0].cells[0]) == (f"Of {name}", name, name)
        console = Console(width=200, file=StringIO())
        console.print(table)
        assert console.file.getvalue().count(name) == 3

    def test_markdown_is_read_as_it_was_meant(self, folder, tmp_path):
        name = "a|b *c* <d> [red]e[/] _f_ `g`"
        results = loaded(folder, "sensitivity").assign_coords(block=[name])
        write_report(written(results, tmp_path), tmp_path / "named.md", "md")
        text = (tmp_path / "named.md").read_text(encoding="utf-8")
        tokens = MarkdownIt().enable("table").parse(text.partition("The study file:")[0])
        assert not [one for one in tokens if one.type in ("html_block", "html_inline")]
        inline = [one for one in tokens if one.type == "inline"]
        plain = ["".join(part.content for part in one.children) for one in inline]
        assert sum(name in one for one in plain) > 5
        said = module.content(results, tmp_path / "changed.nc", "as written")
        every = [*said["lead"], *said["tables"], *said["made_of"], *said["provenance"]]
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

    def test_one_block_one_law(self, folder, tmp_path):
        one = loaded(folder).isel(block=[0], model=[0])
        assert write_report(written(one, tmp_path), tmp_path / "one.html")
        assert "before this piece overturns" in (tmp_path / "one.html").read_text(encoding="utf-8")


class TestRefused:
    def said(self, capsys, *arguments):
        assert main(["report", *map(str, arguments)]) == 2
        caught = capsys.readouterr()
        assert caught.out == ""
        assert caught.err.count("\n") == 1
        assert "Traceback" not in caught.err
        return caught.err

    def test_files_that_are_not_ours(self, capsys, folder, tmp_path):
        assert "no such file" in self.said(capsys, tmp_path / "none.nc")
        assert "results.nc: no such file" in self.said(capsys, tmp_path)
        (tmp_path / "text.nc").write_text("not netCDF", encoding="utf-8")
        assert "is no result file" in self.said(capsys, tmp_path / "text.nc")
        whole = (folder / "cloud" / "results.nc").read_bytes()
        for i, size in enumerate((0, 100, len(whole) // 2, len(whole) - 100)):
            (tmp_path / f"cut{i}.nc").write_bytes(whole[:size])
            self.said(capsys, tmp_path / f"cut{i}.nc")
        foreign = xr.Dataset({"t": ("x", [1.0, 2.0])})
        assert "not one of toppling's" in self.said(capsys, written(foreign, tmp_path))

    @pytest.mark.filterwarnings("ignore:.* was edited after it was written")
    def test_layouts(self, capsys, folder, tmp_path):
        results = loaded(folder, "cloud")
        for layout, word in ((99, "newer"), (0, "older"), ("x", "must be a number")):
            assert word in self.said(capsys, written(results.assign_attrs(schema=layout), tmp_path))
        assert "kind 'ghost'" in self.said(capsys, written(results.assign_attrs(kind="ghost"), tmp_path))
        runs = results.drop_attrs().assign_attrs({k: v for k, v in results.attrs.items() if k != "kind"})
        assert "holds runs" in self.said(capsys, written(runs, tmp_path))
        assert "does not hold what" in self.said(capsys, written(results.drop_vars("median"), tmp_path))
        wrong = results.assign_attrs(kind="sensitivity")
        assert "does not hold what" in self.said(capsys, written(wrong, tmp_path))

    def test_where_it_cannot_be_written(self, capsys, folder, tmp_path):
        path = folder / "cloud" / "results.nc"
        (tmp_path / "file").write_text("", encoding="utf-8")
        assert "cannot be written" in self.said(capsys, path, "--out", tmp_path / "file" / "report.html")
        assert "results themselves" in self.said(capsys, path, "--out", path)
        assert "--format" in self.said(capsys, path, "--format", "docx")

    def test_pdf_without_a_browser(self, folder, tmp_path):
        with pytest.raises(StudyError, match="needs Chromium or Chrome"):
            module._browser(lambda name: None)


def test_command(folder, tmp_path, capsys):
    assert main(["report", str(folder / "stripes" / "results.nc"), "--out", str(tmp_path / "a" / "b.html")]) == 0
    assert (tmp_path / "a" / "b.html").stat().st_size > 10_000
    assert "written:" in capsys.readouterr().out
    assert main(["report", str(folder / "stripes" / "results.nc"), "--format", "md", "--out", str(tmp_path / "m")]) == 0
    assert main(["report", str(folder / "stripes" / "results.nc"), "--out", str(tmp_path / "a" / "c.md")]) == 0
    assert (tmp_path / "a" / "c.md").read_text(encoding="utf-8").startswith("# ")  # (the file's ending says the format)
    text = (tmp_path / "m" / "report.md").read_text(encoding="utf-8")
    for name in re.findall(r"\]\(([^)]+)\)", text):
        assert (tmp_path / "m" / name).read_bytes().startswith(b"\x89PNG")
    assert "![" in text


OVERFLOW = "[document.documentElement.scrollWidth, innerWidth, document.readyState]"
SCROLLING = (
    "[...document.querySelectorAll('.scroll:not(.picture)')].filter(one => !one.querySelector('.matrix')"
    " && one.scrollWidth > one.clientWidth + 1).map(one => one.innerText.slice(0, 60))"
)
FOCUS = "document.querySelector('.skip').focus(), document.activeElement.getAttribute('href')"


@pytest.fixture(scope="module")
def chromium():
    if browser.CHROMIUM is None:
        pytest.skip("Chromium is not there (Debian: apt install chromium)")
    opened = browser.Browser()
    yield opened
    opened.close()


class TestBrowser:
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

    def test_no_table_scrolls(self, chromium, pages):
        """On a phone, a tablet and a desktop; the matrices of sensitivity studies do, with their first column fixed."""
        for name, path in pages.items():
            for width in (360, 768, 1440):
                assert chromium.see(path, width, SCROLLING).value == [], (name, width)

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

    def test_dark_is_dark_and_print_is_not(self, chromium, pages):
        script = "getComputedStyle(document.body).backgroundColor"
        path = pages["cloud"]
        assert chromium.see(path, 768, script).value == "rgb(255, 255, 255)"
        assert chromium.see(path, 768, script, dark=True).value == "rgb(20, 24, 28)"
        assert chromium.see(path, 768, script, dark=True, media="print").value == "rgb(255, 255, 255)"

    def test_keyboard(self, chromium, pages):
        script = f"({FOCUS})"
        assert chromium.see(pages["cloud"], 360, script).value == "#answer"

    def test_text_in_figures_can_be_read_on_a_phone(self, chromium, pages):
        """Text drawn with 9 points has at least 9 pixels, and no figure is wider than the page."""
        ratio = "s.getBoundingClientRect().width / s.viewBox.baseVal.width"
        script = f"[...document.querySelectorAll('.picture svg')].map(s => {ratio})"
        wider = "[...document.querySelectorAll('.picture')].map(one => one.scrollWidth - one.clientWidth)"
        for width, least in ((360, 8.6), (1300, 11.0)):
            found = [one for one in chromium.see(pages["fragility"], width, script).value if one > 0.0]
            assert len(found) == pages["fragility"].read_text(encoding="utf-8").count("<figure>")
            assert min(found) * 9.0 >= least
            assert max(chromium.see(pages["fragility"], width, wider).value) <= 0

    def test_pdf(self, chromium, folder, tmp_path):
        assert main(["report", str(folder / "cloud" / "results.nc"), "--format", "pdf", "--out", str(tmp_path)]) == 0
        assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")
