"""The screen of inventories, of uncertain blocks and of sensitivity studies: what single runs of their blocks have."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of, notes_named
from flips import undecided_outcomes
from study_texts import BLOCKS, HAZARD, IDA, laws, motions, study_of, tower

import toppling as tp
from toppling.core.facts import CARE, GOOD, INVALID, UNKNOWN
from toppling.fragility import screen, wilson_interval
from toppling.fragility.numerics import slabs
from toppling.fragility.uncertainty.joint import pieces_of
from toppling.fragility.validity import undecided as perturbed
from toppling.studies import StudyError
from toppling.studies.buildings import screening
from toppling.studies.store import shards
from toppling.studies.store.shards import Shards

MODELS = laws("housner", "vassiliou")
LAWS = [tp.HousnerImpact(), tp.Vassiliou()]
IMPACTS = MODELS.replace("vassiliou", "discrete")
NUMBER = 6
MOTIONS = motions(NUMBER)
LEVELS = [1.0, 2.0, 4.0, 8.0]
PIECES = [tp.Block(0.35, 1.6, name="narrow"), tp.Block(0.6, 1.6, name="wide")]
INVENTORY = """item,width_m,height_m,floor,count,anchored
narrow,0.35,1.6,0,3,no
held,0.9,0.8,0,1,yes
twin,0.35,1.6,0,1,no
wide,0.6,1.6,2,2,no
"""
NARROW = "item,width_m,height_m,floor,count\nnarrow,0.35,1.6,0,3\n"
BUILDING = tower(0.5, 2)
PERFORMANCE = """
[performance]
inventory = "things.csv"
im = "pga"
levels = { values = [1.0, 2.0, 4.0, 8.0], unit = "m/s2" }
replicates = 200
"""
UNCERTAIN = """
[uncertainty]
samples = 4

[uncertainty.inputs]
width_m = { distribution = "lognormal", median = 0.5, dispersion = 0.2, lower = 0.3, upper = 0.7 }
e = { distribution = "uniform", lower = 0.7, upper = 0.95 }
"""
SENSITIVE = """
[sensitivity]
parameter = "e"
values = [0.7, 0.9]
replicates = 100
"""
SCREEN = "[friction]\nstatic = 0.35\n[screen]\nundecided = 1.0\n"
VARIED = "replicates = 200\nvariability = { restitution_sd = 0.02, variants = 3 }"
UNTESTED = "[screen]\nundecided = 0.0\n"
REASONS = ["squat", "slides_at_uplift", "slides_while_rocking", "slides_at_impact", "elastic_mode", "scaled_far"]
KINDS = {
    "performance": (MODELS, BUILDING, PERFORMANCE),
    "uncertainty": (BLOCKS, IMPACTS, IDA, UNCERTAIN),
    "sensitivity": (BLOCKS, MODELS, IDA, SENSITIVE),
}


def shakes():
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(NUMBER, seed=1)


def study(folder, *parts, inventory=INVENTORY):
    return study_of(folder, *parts, things=inventory)


def same(found, expected, by):
    """Shares and demands are those of a screen of single runs, `by` its dimensions that are kept."""
    each = [dim for dim in expected["verdict"].dims if dim not in by]
    chances = expected["outside"].sel(reason=REASONS)
    np.testing.assert_allclose(found["outside"].sel(reason=REASONS).transpose(*chances.dims).values, chances.values)
    for name in ("friction_uplift_demand", "friction_rocking_demand"):
        one = expected[name]
        np.testing.assert_allclose(found[name].values, one.max([dim for dim in each if dim in one.dims]).values)


class TestInventories:
    @pytest.fixture(scope="class")
    def both(self, tmp_path_factory):
        """A study, its results, and on each floor the screen of single runs of its pieces."""
        patch = pytest.MonkeyPatch()
        patch.setattr(perturbed, "PERTURBATION", 1e-2)  # (so much that many outcomes change)
        one = study(tmp_path_factory.mktemp("inventory"), MODELS, MOTIONS, BUILDING, PERFORMANCE, SCREEN)
        counts = []
        found = one.run(progress=lambda *done: counts.append(done))
        building = tp.motions.Building.flexural_shear(period=0.5, storeys=2)
        single = {}
        for item, block, floor in (("narrow", PIECES[0], 0), ("wide", PIECES[1], 2)):
            here = building.floor_motions(shakes(), [floor])
            runs = tp.ida(block, LAWS, here, LEVELS, ground=shakes())
            single[item] = screen(runs, here, 0.35, undecided=True)
        patch.undo()
        return one, found, single, counts

    def test_equals_the_screen_of_single_runs(self, both):
        _, found, single, _ = both
        for item, expected in single.items():
            here = found.sel(block=[item]).rename(block="block").transpose("block", ...)
            same(here, expected, ("block", "model"))
            np.testing.assert_allclose(here["scale_factor_highest"], expected["scale_factor"].max())
            assert expected["outside"].sel(reason="slides_while_rocking").max() > 0.0
        assert {"verdict", "slides"} & {*found.data_vars} == set()

    def test_undecided_outcomes_are_counted(self, both):
        one, found, single, counts = both
        for item, expected in single.items():
            for name in ("undecided", "undecided_lower", "undecided_upper"):
                np.testing.assert_allclose(found[name].sel(block=item), expected[name].isel(block=0))
        assert float(found["undecided"].max()) > 0.0
        assert one.perturbed_runs == 2 * (4 + 2) * len(LEVELS) * NUMBER  # lines that are alike are run once
        assert counts[-1] == (one.work, one.work) == (one.runs + one.perturbed_runs,) * 2

    def test_anchored_lines_neither_slide_nor_rock(self, both):
        _, found, _, _ = both
        held = found.sel(block="held")
        assert held["outside"].isnull().all()
        assert np.isnan(held["friction_rocking_demand"])
        assert bool(held["squat"])
        np.testing.assert_array_equal(found["outside"].sel(block="twin"), found["outside"].sel(block="narrow"))

    def test_the_notes_say_it(self, both):
        _, found, _, _ = both
        share = found["outside"].sel(reason="slides_while_rocking")
        (note,) = (fact for fact in notes_named(found, "sliding.share") if fact.more["when"] == "rocking")
        assert note.value == float(share.mean())
        assert "held" not in {name for _, *names in note.more["worst"] for name in names}
        (note,) = notes_named(found, "stability.undecided")
        flipped, tested = float(found["undecided"].mean()), 3 * 2 * len(LEVELS) * NUMBER
        low, high = (float(end) for end in wilson_interval(np.array(round(flipped * tested)), np.array(tested)))
        assert (note.value, note.lower, note.upper) == (pytest.approx(flipped), low, high)
        counts = {"flipped": round(flipped * tested), "tested": tested, "perturbed": 6, "motions": 6}
        assert counts.items() <= note.more.items()
        (squat,) = notes_named(found, "block.squat")
        assert squat.names == ("held",)
        assert squat.lower == pytest.approx(0.9, abs=0.05)

    def test_variants_are_tested_as_they_are(self, tmp_path, monkeypatch):
        """Pieces that differ: every variant's own runs are repeated, here by analyses of their own."""
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        varied = PERFORMANCE + "variability = { restitution_sd = 0.02, variants = 3 }\n"
        one = study(tmp_path, '[[models]]\nlaw = "housner"\n', MOTIONS, varied, SCREEN, inventory=NARROW)
        found = one.run()
        flips = []
        for block, model in pieces_of(PIECES[0], LAWS[0], None, one.variability):
            flips.append(undecided_outcomes(tp.ida(block, model, shakes(), LEVELS), shakes()).values > 0)
        assert np.mean(flips) > 0.0
        np.testing.assert_allclose(found["undecided"].values, [[np.mean(flips)]])


class TestScaling:
    """Records are scaled by far, and filtered noise, whose amplitude is a parameter, is not."""

    @pytest.fixture
    def record(self, tmp_path):
        t = np.arange(0.0, 8.0, 0.02)
        for k in range(4):
            a = 0.02 * np.sin(2.0 * np.pi * (0.7 + 0.3 * k) * t) * np.exp(-(((t - 3.0) / 1.5) ** 2))
            rows = [f"{x:.6f},{y:.8f}" for x, y in zip(t, a, strict=True)]
            text = "time (s),acceleration (m/s2)\n" + "\n".join(rows) + "\n"
            (tmp_path / f"weak{k}.csv").write_text(text, encoding="utf-8")
        return '[motions]\nrecords = "weak*.csv"\n'

    @pytest.mark.parametrize("kind", KINDS)
    def test_records_that_are_scaled_far(self, tmp_path, record, kind):
        found = study(tmp_path, *KINDS[kind], record, UNTESTED).run()
        (note,) = notes_named(found, "motion.scaled_far")
        assert (note.value, note.lower, note.upper) == (1.0, 0.2, 5.0)
        assert float(found["scale_factor_highest"].max()) > 300.0
        check = check_of(found, "scaling")
        assert check.word == CARE

    @pytest.mark.parametrize("kind", KINDS)
    def test_noise_is_not(self, tmp_path, kind):
        parts = [part.replace("values = [1.0", "values = [0.01, 1.0") for part in KINDS[kind]]
        found = study(tmp_path, *parts, MOTIONS, UNTESTED).run()
        assert not notes_named(found, "motion.scaled_far")
        assert (found["outside"].sel(reason="scaled_far").fillna(0.0) == 0.0).all()


class TestFriction:
    @pytest.mark.slow
    @pytest.mark.parametrize("kind", KINDS)
    def test_only_where_there_is_too_little(self, tmp_path, kind):
        one = study(tmp_path, *KINDS[kind], MOTIONS, "[friction]\nstatic = 0.1\n[screen]\nundecided = 0.0\n")
        slippery = one.run()
        assert "uplift" in {fact.more["when"] for fact in notes_named(slippery, "sliding.share")}
        assert not notes_named(slippery, "friction.not_given")
        assert not notes_named(slippery, "stability.undecided")
        assert "undecided" not in slippery
        assert "perturbed" not in one.words
        check = check_of(slippery, "sliding")
        assert check.word in (CARE, INVALID)
        rough = study(tmp_path, *KINDS[kind], MOTIONS, "[friction]\nstatic = 2.0\n[screen]\nundecided = 0.0\n").run()
        assert not notes_named(rough, "sliding.share")
        check = check_of(rough, "sliding")
        assert check.word == GOOD
        unknown = study(tmp_path, *KINDS[kind], MOTIONS, UNTESTED).run()
        assert notes_named(unknown, "friction.not_given")
        check = check_of(unknown, "sliding")
        assert check.word == UNKNOWN
        assert {*check.more} == {"uplift", "rocking"}  # (two needs, no range of one)
        assert math.isnan(check.lower)
        assert math.isnan(check.upper)

    def test_a_distribution(self, tmp_path):
        """Sliding counts where it is more likely than not: the median decides."""
        table = "[friction]\nstatic = 0.35\ndispersion = 0.3\n[screen]\nundecided = 0.0\n"
        found = study(tmp_path, *KINDS["performance"], MOTIONS, table).run()
        fixed = study(
            tmp_path, *KINDS["performance"], MOTIONS, "[friction]\nstatic = 0.35\n[screen]\nundecided = 0.0\n"
        ).run()
        np.testing.assert_array_equal(found["outside"], fixed["outside"])
        assert json.loads(found.attrs["screen"])["friction"]["wide"]["dispersion"] == 0.3


class TestSamples:
    @pytest.mark.slow
    def test_equals_the_screen_of_every_sample(self, tmp_path, monkeypatch):
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        one = study(tmp_path, *KINDS["uncertainty"], MOTIONS, SCREEN)
        counts = []
        found = one.run(progress=lambda *done: counts.append(done))
        assert counts[-1] == (one.work, one.work)
        drawn = one.inputs.sample(4, one.seed)
        for block in PIECES:
            each = []
            pairs = [one.inputs.realise(block, law, drawn) for law in (tp.HousnerImpact(), tp.DiscreteDamping())]
            for own in zip(*pairs, strict=True):
                runs = tp.ida(own[0][0], [law for _, law in own], shakes(), one.design.levels)
                each.append(screen(runs, shakes(), 0.35, undecided=True))
            here = found.sel(block=block.label)
            for name in ("outside", "undecided"):
                mean = np.mean([single[name].isel(block=0).values for single in each], axis=0)
                np.testing.assert_allclose(here[name].values, mean)
            for name in ("friction_rocking_demand", "friction_uplift_demand", "friction_impact"):
                worst = np.fmax.reduce([single[name].isel(block=0).values.ravel() for single in each])
                expected = np.nanmax(worst) if name != "friction_impact" else worst
                np.testing.assert_allclose(here[name].values, expected)
            assert float(here["friction_uplift"]) == pytest.approx(block.b / block.h)
        assert float(found["undecided"].max()) > 0.0
        (note,) = notes_named(found, "stability.undecided")
        assert note.more["tested"] == 2 * 2 * 4 * 7 * NUMBER

    @pytest.mark.slow
    def test_laws_that_are_not_known(self, tmp_path, monkeypatch):
        """Samples under laws with a restitution, without one, and of exact geometry: each is tested as if alone."""
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        laws = 'law = { distribution = "choice", values = ["housner", "vassiliou", "makris-konstantinidis"] }\n'
        uncertain = UNCERTAIN.replace("samples = 4", "samples = 12").partition("e = ")[0] + laws
        one = study(tmp_path, BLOCKS, '[[models]]\nlaw = "housner"\n', IDA, uncertain, MOTIONS, SCREEN)
        counts = []
        found = one.run(progress=lambda *done: counts.append(done))
        assert counts[-1] == (one.work, one.work)
        assert all(a[0] < b[0] for a, b in pairwise(counts))
        drawn = one.inputs.sample(12, one.seed)
        for block in PIECES:
            each = []
            pairs = one.inputs.realise(block, tp.HousnerImpact(), drawn)
            assert len({type(law) for _, law in pairs}) == 3
            for own, law in pairs:
                runs = tp.ida(own, law, shakes(), one.design.levels)
                each.append((undecided_outcomes(runs, shakes()).values > 0).mean())
            assert 0.0 < np.mean(each) == pytest.approx(found["undecided"].sel(block=block.label).item(), rel=1e-12)

    @pytest.mark.slow
    def test_levels_that_depend_on_the_block(self, tmp_path):
        """Every sample has its own factors, those of an analysis of it alone."""
        ida = '[ida]\nim = "pga_normalised"\nlevels = { values = [1.0, 3.0], unit = "1" }\n'
        one = study(tmp_path, BLOCKS, IMPACTS, ida, UNCERTAIN, MOTIONS, SCREEN)
        found = one.run()
        drawn = one.inputs.sample(4, one.seed)
        pairs = one.inputs.realise(PIECES[0], LAWS[0], drawn)
        each = [screen(tp.ida(*pair, shakes(), [1.0, 3.0], "pga_normalised"), shakes(), 0.35) for pair in pairs]
        here = found.isel(block=0, model=0)
        np.testing.assert_allclose(here["scale_factor_highest"], max(float(one.scale_factor.max()) for one in each))
        mean = np.mean([one["outside"].values[0, 0] for one in each], axis=0)
        np.testing.assert_allclose(here["outside"].sel(reason=REASONS), mean[: len(REASONS)])


class TestValues:
    def test_equals_the_screen_of_every_value(self, tmp_path, monkeypatch):
        monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
        one = study(tmp_path, *KINDS["sensitivity"], MOTIONS, SCREEN)
        counts = []
        found = one.run(progress=lambda *done: counts.append(done))
        assert counts[-1] == (one.work, one.work)
        laws = [tp.HousnerImpact(e=0.7), tp.HousnerImpact(e=0.9), tp.Vassiliou()]
        single = screen(tp.ida(PIECES, laws, shakes(), one.design.levels), shakes(), 0.35, undecided=True)
        np.testing.assert_allclose(found["outside"].isel(model=0), single["outside"].isel(model=[0, 1]))
        for k in range(2):
            np.testing.assert_allclose(found["outside"].isel(model=1, value=k), single["outside"].isel(model=2))
        np.testing.assert_allclose(found["undecided"].isel(model=0), single["undecided"].isel(model=[0, 1]))
        assert float(found["undecided"].max()) > 0.0
        # laws that stand beside the others, and those that a value does not change, count once
        (note,) = notes_named(found, "stability.undecided")
        assert note.more["tested"] == 2 * 3 * 7 * NUMBER

    def test_the_friction_there_is_decides_which_values_are_usual(self, tmp_path):
        with pytest.raises(StudyError, match=r"unknown key 'sensitivity.friction'"):
            study(tmp_path, *KINDS["sensitivity"], "friction = 0.3\n", MOTIONS)
        found = study(
            tmp_path, *KINDS["sensitivity"], MOTIONS, "[friction]\nstatic = 0.3\n[screen]\nundecided = 0.0\n"
        ).run()
        assert found.attrs["friction"] == 0.3
        assert found["in_use"].sel(block="narrow").values.tolist() == [False, True]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_flips_are_counted_in_files_and_slabs_of_any_size(tmp_path, monkeypatch, kind):
    """Arrays of all tested runs in files, and in slabs of one row: the same, and the forecast holds every array."""
    monkeypatch.setattr(perturbed, "PERTURBATION", 1e-2)
    parts = [part.replace("replicates = 200", VARIED) for part in KINDS[kind]]
    one = study(tmp_path, *parts, MOTIONS, SCREEN)
    whole = one.run()
    assert float(whole["undecided"].max()) > 0.0
    sizes = []
    made = Shards.array

    def array(self, shape, dtype):
        sizes.append((dtype, math.prod(shape)))
        return made(self, shape, dtype)

    monkeypatch.setattr(Shards, "array", array)
    monkeypatch.setattr(shards, "IN_MEMORY", 0)
    monkeypatch.setattr(slabs, "RUNS", 1)
    folder = tmp_path / "results"
    one.run(folder)
    with xr.open_dataset(folder / "results.nc") as found:
        for name in ("undecided", "undecided_lower", "outside", "friction_rocking_demand"):
            np.testing.assert_array_equal(found[name], whole[name])
    flips = [size for dtype, size in sizes if dtype == np.int8]
    of_blocks = {"uncertainty": len(PIECES)}.get(kind, 1)  # (one after the other)
    assert 0 < sum(flips) / of_blocks <= sum(one.arrays_aside)


class TestTails:
    """Annual values that come from beyond either end of a hazard curve."""

    POINTS = '[hazard]\nunit = "m/s2"\nlevels = [{}]\nrates = [{}]\n'

    @pytest.mark.parametrize(("side", "levels"), [("below", (3.0, 20.0)), ("above", (0.1, 2.5))])
    def test_the_share_is_that_of_the_integral(self, tmp_path, side, levels):
        """Straight lines in ln x between the levels times a power law, here in a hundred thousand steps."""
        rates = [1e-2 * (one / 2.0) ** -2.5 for one in levels]
        text = self.POINTS.format(", ".join(map(str, levels)), ", ".join(map(str, rates)))
        found = study(tmp_path, MODELS, MOTIONS, PERFORMANCE, text, UNTESTED, inventory=NARROW).run()
        p = found["probability"].isel(block=0, model=0).values
        at = np.log(LEVELS)
        first = 2.0 * at[0] - at[1]
        fine = np.linspace(first, np.log(1e4), 400_001)
        middle = 0.5 * (fine[1:] + fine[:-1])
        value = np.interp(middle, [first, *at], [0.0, *p])
        events = value * -np.diff(1e-2 * (np.exp(fine) / 2.0) ** -2.5)
        outside = np.exp(middle) < levels[0] if side == "below" else np.exp(middle) > levels[1]
        share = events[outside].sum() / events.sum()
        assert 0.05 < share < 1.0
        np.testing.assert_allclose(found[f"annual_number_share_{side}"].isel(model=0), share, rtol=1e-3)
        worst = float(found[f"annual_number_share_{side}"].max())
        (note,) = notes_named(found, "rate.share_beyond_hazard")
        assert note.more["side"] == side
        assert note.more["shares"][0][0] == worst
        check = check_of(found, "hazard curve")
        assert check.word in (CARE, INVALID)
        assert check.more["side"] == side

    def test_not_where_the_curve_covers_the_levels(self, tmp_path):
        found = study(tmp_path, MODELS, MOTIONS, BUILDING, PERFORMANCE, HAZARD, UNTESTED).run()
        assert not notes_named(found, "rate.share_beyond_hazard")
        check = check_of(found, "hazard curve")
        assert check.word == GOOD

    @pytest.mark.slow
    def test_of_curves_from_below(self, tmp_path):
        """A hazard curve that begins above the median: most of the rate is its first slope's."""
        text = self.POINTS.format("6.0, 20.0", "1e-2, 5e-4")
        found = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, text, UNTESTED).run()
        share = found["rate_share_below"]
        assert float(share.max()) > 0.05
        (note,) = (fact for fact in notes_named(found, "rate.beyond_hazard") if fact.more["side"] == "below")
        assert note.value == float(share.max())
        assert note.names[0].startswith("narrow")
        covered = study(tmp_path, BLOCKS, MODELS, MOTIONS, IDA, HAZARD, UNTESTED).run()
        assert "below" not in {fact.more["side"] for fact in notes_named(covered, "rate.beyond_hazard")}


@pytest.mark.parametrize("most", [0, 1, 2, 1000])
def test_friction_of_floors_that_are_described_differently(most, monkeypatch):
    """A floor with many lines lists what friction there is, one with few says it of each line: both are joined."""
    each = [{"kind": "coefficient", "static": value} for value in (0.3, 0.5)]
    monkeypatch.setattr(screening, "DESCRIBED", most)
    listed = [json.loads(text) for text in sorted(json.dumps(one) for one in each)]
    parts = [{"a": each[0]}, {"b": each[1]} if most != 1 else [each[1]]]
    found = screening._joined_friction(parts)
    assert found == ({"a": each[0], "b": each[1]} if most >= 2 else listed)
    assert screening._joined_friction([None, None]) is None
