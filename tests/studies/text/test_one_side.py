"""Falls to one side: curves need not rise to 1, and one that is made to is named where its number is read."""

import json
import math

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of, facts_of
from study_texts import IDA, motions

import toppling as tp
from toppling.fragility import annual_rate, fit_fragility
from toppling.studies import StudyError
from toppling.studies.facts import curves
from toppling.studies.facts.checks import badge, checks_of
from toppling.studies.tables.blocks import short_blocks

K0, K = 1e-3, 2.5
MEDIAN, DISPERSION, FRONT = 2.0, 0.4, 0.5
SHELF = '[[blocks]]\nname = "{}"\nwidth_m = {}\nheight_m = 1.8\n'
LAW = '[[models]]\nlaw = "housner"\n'
HAZARD = '[hazard]\nk0 = 1e-3\nk = 2.5\nunit = "m/s2"\n'


def study(folder, *parts):
    file = folder / "study.toml"
    file.write_text('title = "One side"\n' + "".join(parts), encoding="utf-8")
    return tp.Study.from_toml(file)


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
        hazard = tp.HazardCurve.power_law(K0, K, "pga")
        runs = levelling_off()
        rates = {}
        for form in (None, "lognormal"):
            curve = fit_fragility(runs, form=form, state="front", replicates=100)
            rates[form] = annual_rate(curve, hazard, outside="least")["rate"].item()
        assert rates[None] == pytest.approx(exact, rel=0.08)
        assert not 0.75 < rates["lognormal"] / exact < 1.25

    def test_the_region_beyond_the_levels_is_taken_as_high_as_it_can_be(self):
        """With outside="most", as studies take it, the rate of the last level is added where the curve stays at 1/2."""
        runs = levelling_off()
        hazard = tp.HazardCurve.power_law(K0, K, "pga")
        curve = fit_fragility(runs, state="front", replicates=100)
        least, most = (annual_rate(curve, hazard, outside=rule)["rate"].item() for rule in ("least", "most"))
        top = runs["level"].values[-1]
        assert most - least == pytest.approx((1.0 - curve["probability"].values.max()) * K0 * top**-K, rel=1e-6)

    @pytest.mark.parametrize(
        ("state", "form"), [("front", "isotonic"), ("back", "isotonic"), ("overturned", "lognormal")]
    )
    def test_the_default_form(self, state, form):
        curve = fit_fragility(levelling_off(60), state=state, replicates=100)
        assert curve.attrs["form"] == form


class TestStudies:
    @pytest.mark.slow
    def test_the_default_is_free_and_lognormal_is_not_valid(self, tmp_path):
        parts = (SHELF.format("shelf", 0.3), LAW, motions(30), IDA, HAZARD)
        free = study(tmp_path, *parts, '[fit]\nstate = "front"\nreplicates = 100\n').run()
        assert free.attrs["form"] == "isotonic"
        assert json.loads(free.attrs["study"])["fit"]["form"] == "isotonic"
        assert "curve.forced" not in {check.what for check in checks_of(free)}
        forced = study(tmp_path, *parts, '[fit]\nstate = "front"\nform = "lognormal"\nreplicates = 100\n').run()
        assert badge(checks_of(forced)).word == "not valid"
        assert badge(checks_of(forced)).names[0] == "form of curves"
        assert "rise to 1" in short_blocks(forced).note
        assert "rise to 1" not in short_blocks(free).note

    def test_a_touching_wall_leaves_one_side(self, tmp_path):
        block = SHELF.format("shelf", 0.3) + "wall_gap_mm = 0\n"
        law = LAW + 'geometry = "linear"\n'
        fit = '[fit]\nstate = "front"\nform = "lognormal"\nreplicates = 100\n'
        found = study(tmp_path, block, law, motions(20), IDA, fit).run()
        assert "curve.forced" not in {check.what for check in checks_of(found)}

    def test_without_a_median(self, tmp_path):
        """A probability that never reaches 1/2 has no level of half, and the answer has another."""
        low = IDA.replace("to = 12.0", "to = 3.2")
        fit = '[fit]\nstate = "front"\nreplicates = 100\n'
        found = study(tmp_path, SHELF.format("shelf", 0.3), LAW, motions(30), low, HAZARD, fit).run()
        assert np.isinf(found["half_level"].values).all()
        assert 0.0 < float(found["probability"].max()) < 0.5
        facts = facts_of(curves.answer, found)
        assert facts["curve.at_end"].more["end"] == "strongest"
        assert facts["curve.at_end"].value == float(found["probability"].values.ravel()[-1])
        assert facts["rate.chance"].value == float(found["risk_probability"].squeeze())
        assert "curve.half_level" not in facts
        assert short_blocks(found).texts("level")[0].startswith("not reached")

    def test_modelling_uncertainty_needs_a_lognormal_curve(self, tmp_path):
        fit = '[fit]\nstate = "front"\nmodelling_dispersion = 0.3\n'
        with pytest.raises(StudyError, match="got form 'isotonic', the default of state 'front'"):
            study(tmp_path, SHELF.format("shelf", 0.3), LAW, motions(5), IDA, fit)

    def test_blocks_are_ranked_by_the_chance(self, tmp_path):
        """Curves that cross: the lowest median is not the highest rate."""
        blocks = SHELF.format("steep", 0.3) + SHELF.format("wide spread", 0.36)
        found = study(tmp_path, blocks, LAW, motions(20), IDA, HAZARD, "[fit]\nreplicates = 100\n").run()
        names = ("rate", "rate_lower", "rate_upper")
        swapped = found.assign({name: found[name].copy() for name in names})
        low = int(np.argmin(found["half_level"].values[:, 0]))
        for name in names:
            swapped[name][low] = 0.5 * swapped[name][1 - low]
        first, other = (f"“{found['block'].values[i]}”" for i in (1 - low, low))
        rank = facts_of(curves.answer, swapped)["curve.rank"]
        assert (rank.value, rank.more["name"], rank.names) == (2, first, (other,))
        for end in ("_lower", "_upper"):
            swapped[f"rate{end}"][:] = swapped["rate"]
        rank = facts_of(curves.answer, swapped)["curve.rank"]
        assert (rank.value, rank.more["name"], rank.names) == (2, first, ())


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
        found = study(tmp_path, SHELF.format("shelf", 0.3), LAW, motions(5), ida).run()
        assert check_of(found, "curves").more["higher"] == said
