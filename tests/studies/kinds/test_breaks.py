"""How often restraints break: shares of the motions at each level and at the design shaking, held to the runs."""

import math

import numpy as np
import pytest
from check_facts import facts_of
from numpy.testing import assert_allclose, assert_array_equal
from study_texts import IDA, motions, study_in, study_of

from toppling.fragility.numerics.proportions import wilson_interval
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.notes import notes_of
from toppling.studies.file.blocks import stiffness_notes
from toppling.studies.plan.design_shaking import at_level
from toppling.studies.tables.registry import REGISTRY

SHELF = '[[blocks]]\nname = "{}"\nwidth_m = 0.3\nheight_m = 1.8\n'
BLOCKS = (
    SHELF.format("free")
    + SHELF.format("kit")
    + 'wall_gap_mm = 20\nmass_kg = 100\nrestraint = "kit"\n'
    + '[restraints.kit]\nkind = "strap"\nheight_m = 1.75\nstrength_n = 267\nslack_mm = 5\n'
)
LAW = '[[models]]\nlaw = "housner"\ngeometry = "linear"\n'
N, K0, K = 20, 4e-3, 2.0
HAZARD = f'[hazard]\nk0 = {K0}\nk = {K}\nunit = "m/s2"\nyears = 50\n'
DESIGN = (K0 / (-math.log(0.9) / 50.0)) ** (1.0 / K)
"""The level of the power law that is exceeded with 10 % in 50 years, m/s²."""
ENDS = "", "_lower", "_upper"


def study(folder, *parts):
    return study_of(folder, BLOCKS, LAW, motions(N), *parts)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return study(tmp_path_factory.mktemp("breaks"), IDA, HAZARD, "[fit]\nreplicates = 100\n").run()


def test_shares_are_those_of_the_runs(results):
    """Of both runs of each motion; the interval takes a motion, not a run, as a trial."""
    broke = results["ruptured"].isel(model=0).sel(block="kit").transpose("level", "motion").values
    assert 0 < broke.sum() < broke.size
    assert broke.shape[1] == 2 * N
    one = results.isel(model=0).sel(block="kit")
    assert_array_equal(one["broken_probability"], broke.mean(axis=1))
    low, high = wilson_interval(broke.sum(axis=1) / 2, np.full(broke.shape[0], N), 0.95)
    assert_allclose(one["broken_probability_lower"], low, rtol=1e-12, atol=1e-15)
    assert_allclose(one["broken_probability_upper"], high, rtol=1e-12)
    assert np.isnan(results["broken_probability"].sel(block="free")).all()
    # (a fall away from the wall breaks the strap first)
    assert (broke >= (results["overturned"].isel(model=0).sel(block="kit").transpose("level", "motion").values)).all()


def test_at_the_design_shaking(results):
    levels = results["level"].values
    assert levels[0] < DESIGN < levels[-1]
    assert float(results["design_level"]) == pytest.approx(DESIGN, rel=1e-6)
    one = results.isel(model=0).sel(block="kit")
    for end in ENDS:
        shares = one[f"broken_probability{end}"].values
        found = np.interp(math.log(DESIGN), np.log(levels), shares)
        assert float(one[f"broken_at_design{end}"]) == pytest.approx(found, rel=1e-5)
    assert np.isnan(results["broken_at_design"].sel(block="free")).all()


def test_values_at_a_level():
    levels, values = np.array([1.0, 2.0, 8.0]), np.array([0.0, 0.2, np.nan])
    assert at_level(2.0, levels, values) == 0.2
    assert at_level(math.sqrt(2.0), levels, values) == pytest.approx(0.1)
    assert np.isnan(at_level(math.nan, levels, values))
    assert at_level(8.0, levels, np.array([0.0, 0.2, 0.9])) == 0.9


def test_without_a_hazard_the_level_is_named(tmp_path):
    found = study(tmp_path, IDA).run()
    assert "broken_at_design" not in found
    one = found.isel(model=0).sel(block="kit")
    at = next(iter(np.flatnonzero(one["broken_probability"].values >= 0.5)), -1)
    fact = facts_of(curves.answer, found)["restraint.breaks"]
    assert (fact.value, fact.lower, fact.upper) == tuple(float(one[f"broken_probability{end}"][at]) for end in ENDS)
    assert (fact.more["design"], fact.level) == (False, float(found["level"][at]) / 9.80665)


def test_without_a_restraint_nothing_is_kept(tmp_path):
    plan = study_in(tmp_path, 'title = "a"\n' + SHELF.format("free") + LAW + motions(4) + IDA)
    assert "ruptured" not in plan.kept_outputs
    found = plan.run()
    assert not REGISTRY["breaks"].applies(found)
    assert "restraint.breaks" not in facts_of(curves.answer, found)


def test_a_stiffness_that_is_not_given_is_noted(results, tmp_path):
    (note,) = (fact for fact in notes_of(results) if fact.what == "restraint.stiffness_assumed")
    assert (note.names, note.more["stiffnesses"]) == (("kit",), [20.0])
    given = BLOCKS + "stiffness_n_per_mm = 20\n"
    plan = study_in(tmp_path, 'title = "a"\n' + given + LAW + motions(4) + IDA)
    assert "restraint.stiffness_assumed" not in {fact.what for fact in plan.facts}
    inline = {"blocks": [{"name": "shelf", "restraint": {"kind": "bracket", "height_m": 1.0, "strength_n": 9.0}}]}
    (note,) = stiffness_notes(inline)
    assert note.more["stiffnesses"] == [500.0]
    assert note.names[0].endswith("of shelf")
    # (a pole needs its own, an adhesive has none)
    assert stiffness_notes({"restraints": {"a": {"kind": "adhesive", "front_m": 0.3, "strength_n": 9.0}}}) == []
