"""Plausibility of sizes and levels, and how Python is warned."""

import warnings

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.core.doubts import Doubt, ImplausibleInput, noted
from toppling.fragility import curve_probability
from toppling.models.block_array import BlockArray
from toppling.models.plausibility import block_doubts, law_doubts
from toppling.motions.intensity.measure import NamedMeasure

CABINET = tp.Block(0.4, 1.8, name="cabinet")
SHAKES = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)


def test_a_front_taken_for_the_smaller_size_in_plan():
    """A bookcase is less deep than wide; a stated depth shows that a wide block is meant."""
    (doubt,) = block_doubts([tp.Block(0.9, 1.8, name="bookcase"), CABINET])
    assert doubt == Doubt.of("block_front", deepest=0.7, named="bookcase: 0.9 m × 1.8 m")
    assert block_doubts([tp.Block(0.9, 1.8, depth=0.9)]) == block_doubts([tp.Block(0.9, 1.8, depth=1.2)]) == []
    with pytest.raises(ValueError, match="depth must be at least the width"):
        tp.Block(0.9, 1.8, depth=0.3)


STRAP = tp.Restraint.strap(1.1, 267.0, slack=0.005)


def test_single_runs_are_doubted_as_studies_are():
    """Sizes in cm, and a strap of 20 N/m (brothers: free rocking, a zeta of 5): no study notes them."""
    strapped = tp.Block(0.3, 1.8, mass=100.0, restraint=tp.Restraint.strap(1.75, 267.0, 20.0))
    with pytest.warns(ImplausibleInput, match=r"0.4 m × 1.8 m with both divided by 100"):
        tp.simulate(tp.Block(40.0, 180.0), tp.HousnerImpact(), SHAKES[0])
    with pytest.warns(ImplausibleInput, match=r"N/m or kN/mm in place of N/mm"):
        tp.simulate(strapped, tp.HousnerImpact(geometry="linear"), SHAKES[0])
    with pytest.warns(ImplausibleInput, match=r"0.05 for 5 %"):
        tp.free_rocking(CABINET, tp.ViscousDamping(zeta=5.0), 0.1, 1.0)


def test_damping_in_per_cent():
    laws = [tp.ViscousDamping(zeta=0.64), tp.ViscousDamping(zeta=5.0), tp.HousnerImpact()]
    (doubt,) = law_doubts([CABINET], laws, [])
    assert "ζ=5" in doubt.sentence
    with pytest.warns(ImplausibleInput, match="0.05 for 5 %"):
        tp.ida(CABINET, laws[1], SHAKES, [1.0])


def test_restitution_that_no_block_has():
    laws = [tp.HousnerImpact(e=0.09), tp.HousnerImpact(e=0.5), tp.HousnerImpact()]
    (doubt,) = law_doubts([CABINET], laws, [])
    assert "(housner e=0.09: 0.09)" in doubt.sentence
    region = BlockArray(width=[0.4] * 3, height=[1.8] * 3, e=[0.9, 0.08, 0.9], delta=[0.05] * 3, names=["a", "b", "c"])
    assert ["b: 0.08" in doubt.sentence for doubt in block_doubts(region)] == [True]


# (what was written, what was meant, by hand)
@pytest.mark.parametrize(
    ("width", "height", "meant"),
    [
        (1.95, 0.45, "0.45 m × 1.95 m with width and height exchanged"),
        (450.0, 1950.0, "0.45 m × 1.95 m with both divided by 1000"),
        (1950.0, 450.0, "0.45 m × 1.95 m with both exchanged and divided by 1000"),
        (45.0, 1.95, "0.45 m × 1.95 m with the width divided by 100"),
        (0.45, 1950.0, "0.45 m × 1.95 m with the height divided by 1000"),
        (45.0, 195.0, "0.45 m × 1.95 m with both divided by 100"),
        (4.5, 19.5, "0.45 m × 1.95 m with both divided by 10"),
        (0.9, 0.8, "0.8 m × 0.9 m with width and height exchanged"),
        (2.0, 60.0, ""),
    ],
)
def test_likely_sizes(width, height, meant):
    (doubt,) = block_doubts([CABINET, tp.Block(width, height, name="shelf")])
    assert (f", or {meant}?" in doubt.sentence) if meant else (", or " not in doubt.sentence)
    assert "shelf: " in doubt.sentence
    assert "cabinet" not in doubt.sentence
    many = BlockArray([0.4, width], [1.8, height], names=["cabinet", "shelf"])
    assert block_doubts(many) == [doubt]


def test_the_message_on_a_restitution_asks_for_exchanged_sizes():
    with pytest.raises(ValueError, match=r"not positive: 0.45 m × 1.95 m with width and height exchanged\? If not, so"):
        _ = tp.Block(1.95, 0.45).restitution


def test_a_level_beyond_any_shaking_is_questioned_when_a_curve_is_read():
    curve = xr.Dataset({"median": ((), 0.4, {"units": "m s-1"}), "dispersion": 0.3}, attrs={"im": "pgv"})
    with pytest.warns(ImplausibleInput, match="the highest level, 40 m/s, is beyond any shaking: cm/s meant"):
        curve_probability(curve, 40.0)
    with warnings.catch_warnings(action="error"):
        curve_probability(curve, [0.1, 4.0])


class TestWarnings:
    def said(self, block, levels, motions=SHAKES, **options):
        with warnings.catch_warnings(record=True, action="always") as caught:
            tp.ida(block, tp.HousnerImpact(e=0.9), motions, levels, screen=False, **options)
        return [one for one in caught if one.category is ImplausibleInput]

    def test_what_is_plain_is_silent(self):
        assert self.said(CABINET, [1.0, 9.8]) == []
        assert self.said(CABINET, [1.0, 500.0], im="scale") == []

    def test_sizes_levels_and_records(self):
        (size,) = self.said(tp.Block(400.0, 1800.0), [1.0])
        assert "written as metres" in str(size.message)
        (level,) = self.said(CABINET, [1.0, 98.0])
        assert "9.99322 g" in str(level.message)
        offset = tp.motions.from_array(np.sin(np.arange(500) * 0.1) + 0.2, 0.01, recorded=True)
        said = self.said(CABINET, [1.0], offset)
        assert "keeps an offset" in str(said[0].message)

    def test_periods_beyond_spectra(self):
        (period,) = self.said(CABINET, [1.0], im="Sa(20)")
        assert "no spectrum has periods above 10 s" in str(period.message)

    def test_measures_of_ones_own_have_no_known_period(self):
        own = NamedMeasure("rms", lambda acceleration, _dt: float(np.sqrt(np.mean(acceleration**2))), "m s-2", "RMS")
        with warnings.catch_warnings(action="error"):
            tp.cloud(CABINET, tp.HousnerImpact(e=0.9), SHAKES, im=own, screen=False)

    def test_the_place_is_the_callers(self):
        assert self.said(tp.Block(400.0, 1800.0), [1.0])[0].filename == __file__

    def test_buildings_warn_of_the_ground(self):
        offset = tp.motions.from_array(np.sin(np.arange(500) * 0.1) + 0.2, 0.01, recorded=True)
        with pytest.warns(ImplausibleInput, match="keeps an offset|ends in motion|wanders off|PGV/PGA"):
            tp.motions.Building.flexural_shear(0.5).floor_motions(offset)

    def test_stripes_are_of_levels_and_clouds_are_not(self):
        with pytest.warns(ImplausibleInput, match="the highest level"):
            tp.stripes(CABINET, tp.HousnerImpact(e=0.9), [SHAKES], [98.0], screen=False)
        with warnings.catch_warnings(action="error"):
            tp.cloud(CABINET, tp.HousnerImpact(e=0.9), SHAKES, screen=False)

    def test_silence_for_those_who_note(self):
        with noted():
            assert self.said(tp.Block(400.0, 1800.0), [1.0]) == []
        assert self.said(tp.Block(400.0, 1800.0), [1.0]) != []


def test_doubted(doubts):
    doubts()
