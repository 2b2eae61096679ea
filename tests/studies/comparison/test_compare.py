"""Two results side by side: ratios, intervals and verdicts held to the files that were compared, and to brute force."""

import csv
import json
import math
import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from lognormal import fit_lognormal
from scipy.optimize import isotonic_regression
from scipy.stats import norm

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.comparison import curves, figures, pieces, sides
from toppling.studies.comparison.compare import compare
from toppling.studies.comparison.inputs import inputs_that_differ, notes_on_inputs
from toppling.studies.store.differences import changes
from toppling.studies.store.outputs import RECORD
from toppling.studies.text.error import StudyError

BLOCKS = '[[blocks]]\nname = "narrow"\nwidth_m = 0.35\nheight_m = 1.6\n'
WIDE = '[[blocks]]\nname = "wide"\nwidth_m = 0.5\nheight_m = 1.6\n'
MOTIONS = '[motions]\ngenerator = "clough-penzien"\nnumber = 16\nseed = {seed}\nduration_s = 6\ndt_s = 0.02\n'
K0, K = 2e-3, 2.5
CURVES = """
title = "{title}"
{blocks}
[[models]]
law = "housner"
[[models]]
law = "discrete"
{motions}
[ida]
im = "pga"
levels = {{ from = 1.0, to = 12.0, number = 12, spacing = "log", unit = "m/s2" }}
[fit]
replicates = 120
[hazard]
k0 = {k0}
k = 2.5
unit = "m/s2"
"""
BUILDING = """
title = "{title}"
[[models]]
law = "housner"
{motions}
[performance]
inventory = "{inventory}"
im = "pga"
levels = {{ from = 1.0, to = 12.0, number = 7, spacing = "log", unit = "m/s2" }}
replicates = 200
variability = {{ restitution_sd = 0.03, variants = 4, realisations = 4 }}
[hazard]
k0 = {k0}
k = 2.5
unit = "m/s2"
"""
HEAD = "e,item,width_m,height_m,floor,room,count,value,currency,anchored,anchoring_cost\n"
SHELF, RACK = "{e},shelf,0.35,1.7,0,archive,4,300,EUR,{},40\n", ",rack,0.5,2.0,0,server room,2,9000,EUR,{},200\n"
VASE, CLOCK = ",vase,0.12,0.5,0,hall,1,500,EUR,no,10\n", ",clock,0.4,1.9,0,hall,1,800,EUR,no,30\n"


def curves_study(title, seed=1, k0=K0, blocks=BLOCKS + WIDE):
    return CURVES.format(title=title, blocks=blocks, motions=MOTIONS.format(seed=seed), k0=k0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with small finished studies, by name."""
    here = tmp_path_factory.mktemp("compared")
    studies = {
        "base": curves_study("Base"),
        "site": curves_study("Another site", k0=2 * K0),
        "motions": curves_study("Other motions", seed=2),
        "deeper": curves_study("Deeper", blocks=BLOCKS.replace("0.35", "0.45") + BLOCKS.replace("narrow", "new")),
        "nearly": curves_study("Nearly", blocks=BLOCKS.replace("0.35", "0.35001") + WIDE),
        "free": BUILDING.format(title="Free", motions=MOTIONS.format(seed=1), inventory="free.csv", k0=K0),
        "held": BUILDING.format(title="Anchored", motions=MOTIONS.format(seed=1), inventory="held.csv", k0=2 * K0),
    }
    (here / "free.csv").write_text(HEAD + SHELF.format("no", e=0.9) + RACK.format("no") + VASE, encoding="utf-8")
    (here / "held.csv").write_text(HEAD + SHELF.format("no", e=0.92) + RACK.format("yes") + CLOCK, encoding="utf-8")
    for name, text in studies.items():
        (here / f"{name}.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(here / f"{name}.toml").run(here / name)
    return here


def lines_of(folder, first, second, laws=None):
    with sides.two_sides(folder / first, folder / second, first == second) as (a, b):
        if a.kind == "performance":
            return pieces.compare_pieces(a, b, laws)
        return curves.compare_curves(a, b, laws)[0]


def one(found, quantity, name, law=None):
    (line,) = [
        line
        for line in found.lines
        if (line.quantity, line.name) == (quantity, name) and (law is None or law in line.laws[0])
    ]
    return line


def resampled(flags, levels, weights):
    """Medians and dispersions of a block's flags (level, motion) when motions (replicate, motion) are drawn."""
    found = [fit_lognormal(levels, (flags * w).sum(axis=1), np.full(levels.size, w.sum()), "auto") for w in weights]
    return np.array([one.median for one in found]), np.array([one.dispersion for one in found])


def half_levels(flags, levels, weights):
    """Levels at which half of flags (level, motion) overturn, on straight lines in normal scores over ln x."""
    n = weights[0].sum()
    found = []
    for w in weights:
        rising = isotonic_regression((flags * w).sum(axis=1) / n).x
        scores, x = norm.ppf(np.clip(rising, 0.25 / n, 1.0 - 0.25 / n)), np.log(levels)
        first, last = np.argmax(scores >= 0.0), np.argmax(scores > 0.0)
        ends = [np.interp(0.0, scores[[at - 1, at]], x[[at - 1, at]]) for at in (first, last)]
        found.append(np.exp(np.mean(ends)))
    return np.array(found)


def drawn(seed, replicates, motions):
    """How often each motion is drawn: replicate r from SeedSequence(seed, spawn_key=(r,))."""
    found = []
    for r in range(replicates):
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(r,))))
        found.append(np.bincount(rng.integers(0, motions, motions), minlength=motions))
    return np.array(found)


def percentiles(samples):
    """The 95 % percentile interval, as order statistics."""
    found = np.sort(samples)
    at = math.ceil(0.025 * found.size - 1e-9) - 1
    return found[at], found[-1 - at]


def rate(median, dispersion, k0):
    """The annual rate of a lognormal curve under the power law k0 x^-k, in closed form."""
    return k0 * median**-K * np.exp(0.5 * K**2 * dispersion**2)


def studentised(side, medians, dispersions, k0):
    """Samples of a rate: steps of ln(rate) the other way, over the squares of the dispersions."""
    own = float(side["rate"])
    return own * (own / rate(medians, dispersions, k0)) ** (
        np.minimum(float(side["dispersion"]) / dispersions, 2.0) ** 2
    )


class TestCurves:
    @pytest.mark.slow
    @pytest.mark.parametrize("law", ["housner", "discrete"])
    @pytest.mark.parametrize("block", ["narrow", "wide"])
    def test_ratios_of_both_files(self, folder, block, law):
        found = lines_of(folder, "base", "motions")
        a, b = (xr.open_dataset(folder / name / "results.nc") for name in ("base", "motions"))
        where = {"block": block, "model": str(a["model"].values[a["law"].values.tolist().index(law)])}
        for quantity, name in (("half_level",) * 2, ("dispersion",) * 2, ("rate",) * 2, ("chance", "risk_probability")):
            line = one(found, quantity, block, law)
            values = [float(each[name].sel(where)) for each in (a, b)]
            assert (line.a.value, line.b.value) == pytest.approx(values, rel=1e-12)
            assert line.ratio.value == pytest.approx(values[1] / values[0], rel=1e-12)
            assert line.a.lower == pytest.approx(float(a[f"{name}_lower"].sel(where)), rel=1e-12)
            upper = float(b[f"{name}_upper"].sel(where))
            # (an end beyond all levels that were run is open)
            upper = math.inf if quantity == "half_level" and upper > float(b["level"][-1]) else upper
            assert line.b.upper == pytest.approx(upper, rel=1e-12)

    @pytest.mark.slow
    @pytest.mark.parametrize(("other", "seed", "k0"), [("site", 0, 2 * K0), ("motions", 1, K0)])
    def test_intervals_by_brute_force(self, folder, other, seed, k0):
        """Draws are the same for both sides where the motions are, and independent where they are not."""
        found = lines_of(folder, "base", other)
        both, sides, halves = [], [], []
        for name, own in (("base", 0), (other, seed)):
            results = xr.open_dataset(folder / name / "results.nc")
            flags = results["overturned"].isel(model=0).sel(block="wide").transpose("level", "motion").values
            sides.append(results.isel(model=0).sel(block="wide"))
            levels, weights = results["level"].values, drawn(own, 120, flags.shape[-1])
            both.append(resampled(flags, levels, weights))
            halves.append(half_levels(flags, levels, weights))
        (m_a, d_a), (m_b, d_b) = both
        rates = studentised(sides[1], m_b, d_b, k0) / studentised(sides[0], m_a, d_a, K0)
        runs, fitted = (float(sides[1][name] / sides[0][name]) for name in ("rate_of_runs", "rate"))
        # (the interval of a ratio of rates also contains itself moved to that of the runs)
        for quantity, ratio, apart in (
            ("half_level", halves[1] / halves[0], 1.0),
            ("dispersion", d_b / d_a, 1.0),
            ("rate", rates, runs / fitted),
        ):
            line = one(found, quantity, "wide", "housner")
            low, high = percentiles(ratio)
            expected = low * min(1.0, apart), high * max(1.0, apart)
            assert (line.ratio.lower, line.ratio.upper) == pytest.approx(expected, rel=2e-4), quantity

    def test_another_site(self, folder):
        """Only the hazard differs: curves are the same to the last digit, and rates r twice as high.

        Then the ratio of chances is (1 - exp(-100 r))/(1 - exp(-50 r)) = 1 + exp(-50 r), replicate by replicate, and by
        the runs.
        """
        found = lines_of(folder, "base", "site")
        results = xr.open_dataset(folder / "base/results.nc")
        for line in found.lines:
            if line.quantity in ("half_level", "dispersion"):
                assert (line.ratio, line.verdict) == ((1.0, 1.0, 1.0), "the same")
            elif line.quantity == "rate":
                assert line.ratio == pytest.approx((2.0, 2.0, 2.0), rel=1e-9)
                assert line.verdict == "higher"
            else:
                value, lower, upper = one(found, "rate", line.name, line.laws[0]).a
                runs = float(results["rate_of_runs"].sel(block=line.name, model=line.laws[0]))
                # (ends of rates before they are moved to the rate of the runs)
                plain = value, upper / max(1.0, runs / value), lower / min(1.0, runs / value), runs
                expected, low, high, by_runs = (1.0 + math.exp(-50.0 * each) for each in plain)
                ends = low * min(1.0, by_runs / expected), high * max(1.0, by_runs / expected)
                assert line.ratio == pytest.approx((expected, *ends), rel=1e-9)

    def test_two_laws_of_one_study(self, folder):
        found = lines_of(folder, "base", "base", ("discrete", "housner"))
        results = xr.open_dataset(folder / "base/results.nc")
        line = one(found, "half_level", "wide")
        assert [name.split()[0] for name in line.laws] == ["discrete", "housner"]
        values = results["half_level"].sel(block="wide").values
        assert line.ratio.value == pytest.approx(values[0] / values[1], rel=1e-12)
        assert line.ratio.lower < line.ratio.value < line.ratio.upper

    @pytest.mark.slow
    def test_what_only_one_has(self, folder, tmp_path):
        found = compare(folder / "base", folder / "deeper", tmp_path)
        sizes = [("width", "0.35 m", "0.45 m"), ("e", "0.932", "0.89")]
        assert [fact.names for fact in found.inputs] == [("block", "wide", "new"), *sizes]
        (motions,) = (fact.more for fact in found.notes if fact.what == "comparison.same_motions")
        assert motions == {"motions": (16, 16), "both_ways": [], "resampled": True}

    @pytest.mark.slow
    def test_what_differs(self, folder, tmp_path):
        found = compare(folder / "base", folder / "motions", tmp_path)
        assert [fact.names for fact in found.inputs] == [("motions.seed", "1", "2")]
        (motions,) = (fact.more for fact in found.notes if fact.what == "comparison.other_motions")
        assert (motions["known"], motions["changed"]) == (True, False)
        found = compare(folder / "base", folder / "site", tmp_path)
        assert [fact.names for fact in found.inputs] == [("hazard.k0", "0.002", "0.004")]


@pytest.mark.parametrize(("period", "changed"), [(1.0, True), (2.0, False)])
def test_floors_of_another_building_are_no_changed_records(folder, period, changed):
    """The motions of both sides differ: only under one building have their records or corrections changed."""
    with sides.two_sides(folder / "base", folder / "motions", False) as (a, b):
        one = a._replace(study={**a.study, "building": {"period_s": 1.0}})
        other = b._replace(study={**a.study, "building": {"period_s": period}})
        (fact,) = (fact for fact in notes_on_inputs(one, other, True, True) if fact.what == "comparison.other_motions")
    assert fact.more["changed"] is changed


def test_surroundings_that_differ(folder):
    """A limit of tilt, a wall or an edge are inputs, and no changed records."""
    with sides.two_sides(folder / "base", folder / "motions", False) as (a, b):
        scenes = [json.dumps({"tilt_limit": math.radians(5.0)}), *["{}"] * (b.results.sizes["block"] - 1)]
        other = b._replace(results=b.results.assign_coords(scene=("block", scenes)), study={**a.study, "blocks": []})
        matched = {"model": sides.matched_laws(a, b, None), "block": sides.matched_names(a, b, "block", "block")}
        (tilt,) = inputs_that_differ(a, other, matched)
        notes = [fact.what for fact in notes_on_inputs(a, other, False, True)]
    assert (tilt.more["of"], tilt.names) == ("narrow", ("surroundings", "", "fails at a tilt of 5°"))
    assert "comparison.files_changed" not in notes


def test_values_are_told_apart(folder):
    """Numbers of equal leading digits, and long values that differ at their end."""
    with sides.two_sides(folder / "base", folder / "nearly", False) as (a, b):
        matched = {"model": sides.matched_laws(a, b, None), "block": sides.matched_names(a, b, "block", "block")}
        width, e = inputs_that_differ(a, b, matched)
    assert (width.more["of"], width.names, e.names[0]) == ("narrow", ("width", "0.35 m", "0.35001 m"), "e")
    (one, other) = ({"outputs": ["overturned", "peak_rotation", "uplifted", last]} for last in ("top", "last"))
    assert list(changes(one, other)) == [("outputs[4]", '"top"', '"last"')]
    files = ({"file": f"records/of/a/long/name/of/a/folder/{name}.csv"} for name in ("first", "second"))
    assert list(changes(*files)) == [("file", '.../a/folder/first.csv"', '.../a/folder/second.csv"')]


class TestLevelsThatAreNotReached:
    """A level of half above the highest level of the runs is not compared: no run says how far above it lies."""

    @pytest.fixture(scope="class")
    @staticmethod
    def low(folder):
        """The base study without the levels at which half of the motions overturn the wide block."""
        text = curves_study("Weak shaking").replace("to = 12.0", "to = 6.0")
        (folder / "low.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(folder / "low.toml").run(folder / "low")
        with xr.open_dataset(folder / "low" / "results.nc") as stored:
            half = stored["half_level"].load()
        assert float(half.sel(block="wide", model="housner e=e_R")) == math.inf
        return folder / "low"

    def test_a_line(self, folder, low):
        line = one(lines_of(folder, "low", "base"), "half_level", "wide", "housner")
        assert math.isnan(line.a.value)
        assert math.isfinite(line.b.value)
        assert math.isnan(line.ratio.value)
        assert line.said_a == "not reached"

    @pytest.mark.slow
    def test_in_the_file(self, folder, low, tmp_path):
        compare(low, folder / "base", tmp_path)
        rows = list(csv.DictReader((tmp_path / "comparison.csv").open(encoding="utf-8")))
        row = next(row for row in rows if row["name"] == "wide" and row["quantity"].startswith("Half overturn"))
        assert (row["a"], row["ratio"], row["a_is"]) == ("", "", "not reached")
        assert float(row["b"]) > 6.0

    @pytest.mark.slow
    def test_curves_end_at_the_highest_level(self, folder, low):
        """The levels of A end at 6 m/s², those of B at 12."""
        with sides.two_sides(low, folder / "base", False) as (a, b):
            both = curves.compare_curves(a, b, None)
            _, figure = next(figures.of_curves(*both, ("A", "B"), "95 %"))
        for ax in figure.axes:
            ends = [line.get_xdata().max() for line in ax.lines if len(line.get_xdata()) > 2]
            assert sorted(ends) == pytest.approx([6.0 / 9.80665, 12.0 / 9.80665], rel=1e-9)


class TestPieces:
    def test_ratios_of_both_files(self, folder):
        found = lines_of(folder, "free", "held")
        a, b = (xr.open_dataset(folder / name / "results.nc") for name in ("free", "held"))
        line = one(found, "chance", "shelf")
        chances = [1.0 - math.exp(-50.0 * float(each["rate"].sel(block="shelf")[0])) for each in (a, b)]
        assert (line.a.value, line.b.value) == pytest.approx(chances, rel=1e-12)
        assert line.ratio.value == pytest.approx(chances[1] / chances[0], rel=1e-12)
        assert line.place == "archive, ground"
        for quantity, name in (("number", "annual_number"), ("loss", "annual_loss")):
            line = one(found, quantity, pieces.WHOLE)
            values = [float(each[name].sel(place="building")[0]) for each in (a, b)]
            assert (line.a.value, line.b.value, line.ratio.value) == pytest.approx((*values, values[1] / values[0]))
            assert line.a.lower == pytest.approx(float(a[f"{name}_lower"].sel(place="building")[0]))

    def test_intervals_by_brute_force(self, folder):
        found = lines_of(folder, "free", "held")
        weights = drawn(0, 200, 16) / 16
        samples = []
        for name in ("free", "held"):
            results = xr.open_dataset(folder / name / "results.nc")
            each = results["overturned"].astype(float).mean("variant").isel(model=0).sel(block="shelf")
            rates = (each * results["level_weight"]).sum("level").values
            samples.append(1.0 - np.exp(-50.0 * weights @ rates))
        line = one(found, "chance", "shelf")
        assert (line.ratio.lower, line.ratio.upper) == pytest.approx(percentiles(samples[1] / samples[0]), rel=1e-9)
        assert line.verdict == "higher"  # (twice the hazard, paired motions)

    @pytest.mark.parametrize("name", ["free", "held"])
    def test_totals_motion_by_motion(self, folder, name):
        """The mean over motions of what is resampled is what the results hold."""
        with sides.two_sides(folder / name, folder / name, same=True) as (a, _):
            shaken = pieces.fallen(a, 0)
            for quantity, variable in pieces.YEARLY.items():
                if variable not in a.results:  # (neither downtime nor injuries)
                    assert quantity not in shaken
                    continue
                held = float(a.results[variable].sel(place="building")[0])
                assert shaken[quantity].mean() == pytest.approx(held, rel=1e-12)
            assert shaken["chance"].mean(axis=1) == pytest.approx(a.results["rate"].isel(model=0), rel=1e-12)

    @pytest.mark.slow
    def test_anchored(self, folder, tmp_path):
        line = one(lines_of(folder, "free", "held"), "chance", "rack")
        assert (line.verdict, line.said_b) == ("anchored in B", "anchored")
        assert math.isnan(line.ratio.value)
        found = compare(folder / "free", folder / "held", tmp_path)
        keys = {("performance.inventory", '"free.csv"', '"held.csv"'), ("hazard.k0", "0.002", "0.004")}
        lines = {("anchored", "", "rack"), ("item", "vase", "clock"), ("e", "0.9", "0.92")}
        assert {fact.names for fact in found.inputs} == keys | lines
        answers = [(*fact.names, fact.word, fact.value, fact.more["of"]) for fact in found.answer]
        assert answers[:2] == [("chance", "anchored in B", 1, 2), ("chance", "higher", 1, 2)]


@pytest.mark.slow
class TestCommand:
    def test_what_it_prints_and_writes(self, folder, tmp_path, capsys):
        assert main(["compare", str(folder / "free"), str(folder / "held"), "--output", str(tmp_path / "out")]) == 0
        text = " ".join(capsys.readouterr().out.split())
        assert "A: Free (" in text
        assert "Chance that a piece falls in 50 years" in text
        assert "Pieces expected to fall (in 1,000 years)" in text
        page = " ".join(unescape((tmp_path / "out/comparison.html").read_text(encoding="utf-8")).split())
        assert [note for note in re.findall(r"note: (.*?[.])(?= note:| written:)", text) if note not in page] == []
        rows = list(csv.DictReader((tmp_path / "out/comparison.csv").open(encoding="utf-8")))
        row = next(one for one in rows if one["name"] == "shelf")
        assert float(row["ratio"]) == pytest.approx(float(row["b"]) / float(row["a"]))
        assert (row["units"], row["place"]) == ("1", "archive, ground")
        assert (tmp_path / "out/chances.png").read_bytes().startswith(b"\x89PNG")

    def test_the_same_bytes_again(self, folder, tmp_path):
        for name in ("one", "two"):
            compare(folder / "base", folder / "motions", tmp_path / name)
        for file in ("comparison.csv", "comparison.html"):
            one, two = ((tmp_path / name / file).read_bytes() for name in ("one", "two"))
            assert one == two

    def test_equal_titles_are_told_apart(self, folder, tmp_path):
        """Titles that are equal have the names of their folders; two laws of one study, the laws."""
        text = (folder / "motions.toml").read_text(encoding="utf-8").replace("Other motions", "Base")
        (folder / "twin.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(folder / "twin.toml").run(folder / "twin")
        compare(folder / "base", folder / "twin", tmp_path)
        page = (tmp_path / "comparison.html").read_text(encoding="utf-8")
        for name, said in (("A", "Base (base)"), ("B", "Base (twin)")):
            assert f"<dt>{name}</dt><dd>{said}</dd>" in page
            assert f"{name}: {said}" in page
        compare(folder / "base", folder / "base", tmp_path, ("housner", "discrete"))
        page = (tmp_path / "comparison.html").read_text(encoding="utf-8")
        assert "<dt>A</dt><dd>Base (housner)</dd>" in page

    def test_files_of_an_earlier_comparison_are_removed(self, folder, tmp_path):
        """Chances of pieces have no curves; what is not ours stays."""
        (tmp_path / "mine.png").write_bytes(b"mine")
        compare(folder / "base", folder / "motions", tmp_path)
        compare(folder / "free", folder / "held", tmp_path)
        left = {"mine.png", "comparison.csv", "comparison.html", "chances.png", RECORD}
        assert {path.name for path in tmp_path.iterdir()} == left
        (tmp_path / "curves.png").write_bytes(b"mine")
        with pytest.raises(StudyError, match=r"curves[.]png: was not written by toppling"):
            compare(folder / "free", folder / "held", tmp_path)
        assert (tmp_path / "curves.png").read_bytes() == b"mine"

    def test_it_is_no_part_of_the_studies(self, folder, tmp_path):
        """Nothing is written beside the results."""
        before = sorted(path.name for path in Path(folder / "base").iterdir())
        compare(folder / "base", folder / "site", tmp_path)
        assert sorted(path.name for path in Path(folder / "base").iterdir()) == before
