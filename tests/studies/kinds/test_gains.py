"""What a wall or a kit changes: ratios of chances under the same motions, held to brute force."""

import math

import numpy as np
import pytest
from check_facts import facts_of
from lognormal import fit_lognormal
from study_texts import IDA, motions, study_in

import toppling as tp
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import say
from toppling.studies.plan.gains import comparable
from toppling.studies.tables.blocks import lead_blocks
from toppling.studies.text.one_side import falling_both_ways

SHELF = '[[blocks]]\nname = "{}"\nwidth_m = 0.3\nheight_m = 1.8\n'
BLOCKS = (
    SHELF.format("free")
    + SHELF.format("at the wall")
    + "wall_gap_mm = 20\n"
    + SHELF.format("kit")
    + 'wall_gap_mm = 20\nmass_kg = 100\nrestraint = "kit"\n'
    + SHELF.format("deeper").replace("0.3", "0.4")
    + '[restraints.kit]\nkind = "strap"\nheight_m = 1.75\nstrength_n = 267\nslack_mm = 5\n'
)
LAW = '[[models]]\nlaw = "housner"\ngeometry = "linear"\n'
K0, K, YEARS, REPLICATES = 2e-3, 2.5, 50.0, 120
HAZARD = f'[hazard]\nk0 = {K0}\nk = {K}\nunit = "m/s2"\nyears = {YEARS:g}\n'
FIT = f"[fit]\nreplicates = {REPLICATES}\n"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return study_in(
        tmp_path_factory.mktemp("gains"), 'title = "Gains"\n' + BLOCKS + LAW + motions(20) + IDA + HAZARD + FIT
    ).run()


def gains(results):
    return [fact for fact in curves.answer(results) if fact.what == "gain.chance"]


def rates(flags, levels, weights):
    """Rates and dispersions of lognormal curves under the power law, in closed form, for drawn motions."""
    found = []
    for w in weights:
        curve = fit_lognormal(levels, (flags * w).sum(axis=1), np.full(levels.size, w.sum()), "auto")
        rate = K0 * curve.median**-K * math.exp(0.5 * (K * curve.dispersion) ** 2)
        found.append((rate, curve.dispersion))
    return np.array(found).T


def samples(flags, levels, weights):
    """Chances of the studentised bootstrap: steps of ln(rate) the other way, over the squares of dispersions."""
    (rate,), (dispersion,) = rates(flags, levels, [np.ones(flags.shape[1])])
    drawn, spread = rates(flags, levels, weights)
    return -np.expm1(-YEARS * rate * (rate / drawn) ** (np.minimum(dispersion / spread, 2.0) ** 2))


def test_the_ratio_and_its_interval(results):
    n = 20  # (each is run both ways, and drawn with its reverse)
    weights = []
    for r in range(REPLICATES):
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(0, spawn_key=(r,))))
        weights.append(np.repeat(np.bincount(rng.integers(0, n, n), minlength=n), 2))
    flags = results["overturned"].isel(model=0).transpose("block", "level", "motion").values
    levels = results["level"].values
    drawn = [samples(one, levels, weights) for one in flags[:3]]
    for i, other in ((1, 0), (2, 1)):
        one = results.isel(block=i, model=0)
        ratio = float(one["risk_probability"]) / float(results["risk_probability"][other, 0])
        assert float(one["chance_ratio"]) == pytest.approx(ratio, rel=1e-9)
        found = np.sort(drawn[i] / drawn[other])
        at = math.ceil(0.025 * REPLICATES - 1e-9) - 1
        ends = [float(one[f"chance_ratio_{end}"]) for end in ("lower", "upper")]
        # (the interval also contains itself moved to the ratio of the runs)
        runs = -np.expm1(-YEARS * results["rate_of_runs"].isel(model=0).values)
        apart = runs[i] / runs[other] / ratio
        ends_of = [found[at] * min(1.0, apart), found[-1 - at] * max(1.0, apart)]
        assert ends == pytest.approx(ends_of, rel=5e-4)


def test_whether_to_fit_the_restraint(results):
    """By the interval of the ratio of chances; without a hazard by the intervals of the medians."""
    found = results.copy(deep=True)
    names = [f"chance_ratio{end}" for end in ("", "_lower", "_upper")]

    def said(values):
        for name, value in zip(names, values, strict=True):
            found[name][2] = value
        return list(curves.actions(found))

    helps, check = said((0.5, 0.4, 0.6))
    assert (helps.what, check.what) == ("restraint.helps", "restraint.check")
    _, other, kit, _ = results["risk_probability"].values[:, 0]
    assert (helps.names[0], helps.value, helps.more["other"]) == ("“kit”", kit, other)
    (doubt,) = said((0.9, 0.7, 1.1))
    assert (doubt.what, doubt.names[0], doubt.more["motions"]) == ("restraint.no_effect", "“kit”", 20)
    (little,) = said((0.8, 0.7, 0.9))
    assert little.what == "restraint.too_weak"
    assert (little.names[0], little.more["ratio"].value) == ("“kit”", 0.8)
    (worse,) = said((1.5, 1.2, 1.8))
    assert (worse.what, worse.value, worse.more["other"]) == ("restraint.hurts", kit, other)
    bare = results.drop_vars(names)

    def by_level(low, middle, high):
        changed = bare.copy(deep=True)
        for end, value in zip(("_lower", "", "_upper"), (low, middle, high), strict=True):
            changed[f"median{end}"][2] = value
        facts = list(curves.actions(changed))
        assert (facts[0].names, facts[0].unit) == (("“kit”", "“at the wall”"), "g")
        return [fact.what for fact in facts], facts[0].more["above"]

    for end, value in zip(("_lower", "", "_upper"), (2.0, 2.2, 2.4), strict=True):
        bare[f"median{end}"][1] = value
    bare["upper"][:] = 1.0
    assert by_level(2.5, 2.7, 3.0) == (["restraint.helps_level", "restraint.check"], False)
    assert by_level(2.3, 2.7, 3.0) == (["restraint.no_effect_level"], False)
    assert by_level(1.2, 1.4, 1.6) == (["restraint.hurts_level"], False)
    bare["upper"][2] = 0.4
    assert by_level(np.nan, np.inf, np.nan) == (["restraint.helps_level", "restraint.check"], True)


def test_only_walls_and_restraints(results):
    """A deeper shelf is another piece of furniture: it has no ratio, nor has the first block."""
    assert results["compared_with"].values.tolist() == ["", "free", "at the wall", ""]
    known = np.isfinite(results["chance_ratio"].isel(model=0).values)
    assert known.tolist() == [False, True, True, False]
    free = tp.Block(0.3, 1.8, name="free")
    assert comparable([free, tp.Block(0.3, 1.8, name="twin"), tp.Block(0.3, 1.8, wall=tp.Wall(), cm_offset=0.01)]) == {}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((0.5, 0.4, 0.8), "lower by a factor of 2.0 (1.2–2.5)"),
        ((0.9, 0.7, 1.2), "20 motions do not show which is lower"),
        ((2.0, 1.5, 3.0), "higher by a factor of 2.0 (1.5–3.0)"),
        # (as many digits as show that 1 lies outside)
        ((0.95, 0.88, 0.996), "lower by a factor of 1.053 (1.004–1.136)"),
        ((1.06, 1.02, 1.11), "higher by a factor of 1.06 (1.02–1.11)"),
        ((1.0, 1.0, 1.0), "no difference"),
        ((0.0, np.nan, np.nan), "no fall in 20 motions"),
        ((0.4, np.nan, np.nan), "too few falls for a comparison"),
    ],
)
def test_the_verdict(results, values, said):
    changed = results.copy(deep=True)
    for end, value in zip(("", "_lower", "_upper"), values, strict=True):
        changed[f"chance_ratio{end}"][2, 0] = value
    assert said in say(gains(changed)[1], "page")


@pytest.mark.slow
def test_a_free_piece_may_fall_to_either_side(tmp_path):
    """Forward falls: half of the motions need not bring them, and backward falls are named as not counted."""
    file = tmp_path / "study.toml"
    fit = FIT + 'state = "front"\n'
    file.write_text('title = "Front"\n' + BLOCKS + LAW + motions(8) + IDA + HAZARD + fit, encoding="utf-8")
    found = tp.Study.from_toml(file).run()
    assert falling_both_ways(found) == {"free", "deeper"}
    assert falling_both_ways(found.assign_attrs(state="overturning")) == set()
    table = lead_blocks(found)
    rows = dict(zip(table.column("block"), table.texts("level"), strict=True))
    assert [rows[name].endswith("\u00a0†") for name in ("free", "deeper", "at the wall")] == [True, True, False]
    facts = facts_of(curves.answer, found)
    assert facts["curve.other_side"].names == ("“free”", "“deeper”")
    (forced,) = (fact for fact in notes_of(found) if fact.what in {"curve.forced", "curve.one_side"})
    assert forced.names == ("free", "deeper")
    half = facts["curve.half_level"]
    either = half.names[0] in facts["curve.other_side"].names
    assert half.more["either"] == either
