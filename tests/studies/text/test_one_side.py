"""Falls to one side: curves need not rise to 1, and one that is made to is named where its number is read."""

import json
import math

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of, facts_of
from study_texts import IDA, blocks, laws, motions, study_of as study

import toppling as tp
from toppling.fragility import annual_rate, fit_fragility
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.checks import badge, checks_of
from toppling.studies.tables.blocks import short_blocks

K0, K = 1e-3, 2.5
MEDIAN, DISPERSION, FRONT = 2.0, 0.4, 0.5
PARTS = blocks(shelf=0.3), laws("housner")
HAZARD = '[hazard]\nk0 = 1e-3\nk = 2.5\nunit = "m/s2"\n'


def levelling_off(motions=6000):
    """Runs that overturn at a lognormal capacity, half of them to the front."""
    rng = np.random.default_rng(5)
    levels = np.geomspace(0.4, 12.0, 60)
    capacity = MEDIAN * np.exp(DISPERSION * rng.standard_normal(motions))
    side = np.where(rng.random(motions) < FRONT, 1, -1)
    direction = np.where(capacity <= levels[:, None], side, 0)
    flags = {"direction": direction, "overturned": direction != 0}
    return xr.Dataset(
        {name: (("block", "model", "level", "motion"), values[None, None]) for name, values in flags.items()},
        coords={"level": ("level", levels, {"im": "pga", "units": "m s-2"})},
    )


class TestRates:
    def test_a_curve_that_levels_off(self):
        """The default is within the scatter of 6,000 motions of the closed form; a lognormal curve is far off."""
        exact = FRONT * K0 * MEDIAN**-K * math.exp(0.5 * (K * DISPERSION) ** 2)
        hazard, runs = tp.HazardCurve.power_law(K0, K, "pga"), levelling_off()
        fits = (fit_fragility(runs, form=form, state="front", replicates=100) for form in (None, "lognormal"))
        free, lognormal = fits
        least = annual_rate(free, hazard, outside="least")["rate"].item()
        assert least == pytest.approx(exact, rel=0.08)
        assert not 0.75 < annual_rate(lognormal, hazard, outside="least")["rate"].item() / exact < 1.25
        # as studies take it, the rate of the last level is added where the curve stays at 1/2
        most, top = annual_rate(free, hazard, outside="most")["rate"].item(), runs["level"].values[-1]
        assert most - least == pytest.approx((1.0 - free["probability"].values.max()) * K0 * top**-K, rel=1e-6)

    @pytest.mark.parametrize(
        ("state", "form"), [("front", "isotonic"), ("back", "isotonic"), ("overturned", "lognormal")]
    )
    def test_the_default_form(self, state, form):
        assert fit_fragility(levelling_off(60), state=state, replicates=100).attrs["form"] == form


class TestStudies:
    @pytest.mark.slow
    def test_the_default_is_free_and_lognormal_is_not_valid(self, tmp_path):
        parts = (*PARTS, motions(30), IDA, HAZARD)
        free = study(tmp_path, *parts, '[fit]\nstate = "front"\nreplicates = 100\n').run()
        assert free.attrs["form"] == "isotonic"
        assert json.loads(free.attrs["study"])["fit"]["form"] == "isotonic"
        assert "curve.forced" not in {check.what for check in checks_of(free)}
        forced = study(tmp_path, *parts, '[fit]\nstate = "front"\nform = "lognormal"\nreplicates = 100\n').run()
        assert badge(checks_of(forced)).word == "not valid"
        assert badge(checks_of(forced)).names[0] == "form of curves"
        assert "rise to 1" in short_blocks(forced).note
        assert "rise to 1" not in short_blocks(free).note

    def test_without_a_median(self, tmp_path):
        """A probability that never reaches 1/2 has no level of half, and the answer has another."""
        low = IDA.replace("to = 12.0", "to = 3.2")
        fit = '[fit]\nstate = "front"\nreplicates = 100\n'
        found = study(tmp_path, *PARTS, motions(30), low, HAZARD, fit).run()
        assert np.isinf(found["half_level"].values).all()
        facts, end = facts_of(curves.answer, found), float(found["probability"].values.ravel()[-1])
        assert 0.0 < end == float(found["probability"].max()) < 0.5
        assert (facts["curve.at_end"].more["end"], facts["curve.at_end"].value) == ("strongest", end)
        assert facts["rate.chance"].value == float(found["risk_probability"].squeeze())
        assert "curve.half_level" not in facts
        assert short_blocks(found).texts("level")[0].startswith("not reached")

    def test_blocks_are_ranked_by_the_chance(self, tmp_path):
        """Curves that cross: the lowest median is not the highest rate."""
        both = blocks(steep=0.3, spread=0.36)
        found = study(tmp_path, both, laws("housner"), motions(20), IDA, HAZARD, "[fit]\nreplicates = 100\n").run()
        found = found.copy(deep=True)
        low = int(np.argmin(found["half_level"].values[:, 0]))
        first, other = (f"“{found['block'].values[i]}”" for i in (1 - low, low))
        for end in ("", "_lower", "_upper"):
            found[f"rate{end}"][low] = 0.5 * found[f"rate{end}"][1 - low]
        for names in ((other,), ()):
            rank = facts_of(curves.answer, found)["curve.rank"]
            assert (rank.value, rank.more["name"], rank.names) == (2, first, names)
            found["rate_lower"][:] = found["rate_upper"][:] = found["rate"]


class TestAdvice:
    @pytest.mark.parametrize(
        ("levels", "said"),
        [
            ("values = [0.01, 0.02]", "add higher levels to ida.levels.values"),
            ("from = 0.01, to = 0.02, number = 2", "raise ida.levels.to"),
        ],
    )
    def test_nothing_fell(self, tmp_path, levels, said):
        ida = f'[ida]\nlevels = {{ {levels}, unit = "m/s2" }}\n'
        found = study(tmp_path, *PARTS, motions(5), ida).run()
        assert check_of(found, "curves").more["higher"] == said
