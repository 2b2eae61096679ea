"""Plausibility of sizes and levels, and how Python is warned."""

import warnings

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.core.doubts import ImplausibleInput, noted
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import curve_probability
from toppling.fragility.validity.plausibility import level_doubts, period_doubts
from toppling.models.block_array import BlockArray
from toppling.models.plausibility import block_doubts, law_doubts, unit_doubts

CABINET = tp.Block(0.4, 1.8, name="cabinet")
SHAKES = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)


@pytest.mark.parametrize(
    ("width", "height", "expected"),
    [
        (0.4, 1.8, None),
        (1.5, 1.9, False),
        (0.7, 1.8, None),
        (0.8, 2.02, False),
        (0.9, 1.2, None),
        (0.9, 2.51, None),
        (1.51, 19.9, False),
        (5.0, 20.1, False),
        (0.8, 0.8, None),
        (0.81, 0.8, False),
        (40.0, 99.0, False),
        (400.0, 1800.0, True),
        (0.011, 0.05, None),
        (0.009, 0.05, False),
        (0.0004, 0.0018, True),
    ],
)
def test_sizes(width, height, expected):
    found = block_doubts([tp.Block(width, height, name="one")])
    assert [one.grave for one in found] == ([] if expected is None else [expected])
    assert all(f"one: {width:g} m × {height:g} m" in one.sentence for one in found)


def test_a_front_taken_for_the_smaller_size_in_plan():
    """A bookcase is less deep than wide; a stated depth shows that a wide block is meant."""
    (doubt,) = block_doubts([tp.Block(0.9, 1.8, name="bookcase"), CABINET])
    assert "wider than 0.7 m (bookcase: 0.9 m × 1.8 m)" in doubt.sentence
    assert block_doubts([tp.Block(0.9, 1.8, depth=0.9)]) == block_doubts([tp.Block(0.9, 1.8, depth=1.2)]) == []
    with pytest.raises(ValueError, match="depth must be at least the width"):
        tp.Block(0.9, 1.8, depth=0.3)


STRAP = tp.Restraint.strap(1.1, 267.0, slack=0.005)


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ({"mass": 120_000.0}, "cabinet: 120,000 kg: tonnes, grams or newtons"),
        ({"mass": 0.12}, "cabinet: 0.12 kg: tonnes, grams or newtons"),
        ({"mass": 5000.0, "depth": 0.4}, "cabinet: 5,000 kg"),
        ({"mass": 1500.0, "depth": 0.4}, "cabinet: 1,500 kg: tonnes, grams or newtons"),
        ({"mass": 700.0, "depth": 0.4}, ""),
        ({"depth": 900.0}, "cabinet: a depth of 900 m: metres in place of mm"),
        ({"depth": 12.0}, ""),
        ({"mass": 5000.0}, ""),  # (a row of shelves 4 m long)
        ({"mass": 12.0, "depth": 1.0}, ""),
        ({"mass": 120.0, "restraint": STRAP}, ""),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 0.267)}, "a strength of 0.267 N: kN in place of N?"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 2e6)}, "a strength of 2e+06 N: kN"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, np.inf)}, ""),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 267.0, slack=5.0)}, "a slack of 5000 mm: metres in"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 267.0, slack=0.5)}, "a slack of 500 mm: metres in"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(0.17, 267.0)}, "a strap that acts 170 mm above the floor"),
        (
            {"mass": 120.0, "restraint": tp.Restraint.strap(0.017)},
            "a strap that acts 17 mm above the floor: a height in",
        ),
        ({"mass": 120.0, "restraint": tp.Restraint.cable(0.018, 267.0)}, "a cable that acts 18 mm above the floor"),
        ({"wall": tp.Wall(0.00002)}, "cabinet: 0.02 mm to a wall or an edge: metres in place of mm"),
        ({"wall": tp.Wall(0.02, front_gap=0.00003)}, "cabinet: 0.03 mm to a wall"),
        ({"edge": tp.Edge(None, 0.00005)}, "cabinet: 0.05 mm to a wall or an edge"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, slack=5e-6)}, "a slack of 0.005 mm: metres in"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 600.0, 20.0)}, "stretch by 3e+04 mm before it breaks"),
        ({"mass": 120.0, "restraint": tp.Restraint.strap(1.1, 267.0, 2e7)}, "stretch by 0.013"),
        ({"mass": 120.0, "restraint": tp.Restraint.adhesive(200.0, 0.3)}, ""),
        ({"wall": tp.Wall(20.0)}, "20000 mm to a wall or an edge: metres in place of mm"),
        ({"cm_offset": 2e-5}, "cabinet: an offset of 0.02 mm: metres in place of mm"),
        ({"cm_offset": -0.02}, ""),
        ({"lean": 3.5e-4}, "cabinet: leans by 0.02 degrees: radians in place of degrees?"),
        ({"lean": 0.0018}, ""),
        ({"tilt_limit": 0.0052}, "cabinet: counts as overturned at 0.3 degrees: radians in place of degrees?"),
        ({"tilt_limit": 0.0524}, ""),
        ({"wall": tp.Wall(0.0)}, ""),
        ({"edge": tp.Edge(0.05)}, ""),
    ],
)
def test_numbers_of_another_unit(scene, expected):
    found = block_doubts([tp.Block(0.4, 1.8, name="cabinet", **scene)])
    assert [(one.kind, expected in one.sentence) for one in found] == [("units", True)] * bool(expected)
    assert unit_doubts([("strap", STRAP)]) == []
    assert [one.kind for one in unit_doubts([("kit", tp.Restraint.bracket(0.02, 500.0))])] == ["units"]


@pytest.mark.parametrize(
    ("im", "doubted"),
    [
        *(
            (f"{of}({im})", True)
            for of in ("RotD50", "GeometricMean")
            for im in ("Sa(50)", "AvgSa(20:50:10)", "Sd(11)")
        ),
        *((im, True) for im in ("Sa(200.0)", "Sa(500.0, 0.02)", "FIV3(300.0)", "AvgSa(0.2:20:10)")),
        *((im, False) for im in ("Sa(10.0)", "d5_75", "RotD50(Sa(10))", "AvgSa(0.2:2:50)", "scale", "pga_normalised")),
    ],
)
def test_periods_in_milliseconds(im, doubted):
    assert [one.kind for one in period_doubts(im)] == ["units"] * doubted


@pytest.mark.parametrize(
    ("im", "said"), [("Sa(1.0, 0.5)", "0.05 for 5 %"), ("RotD50(Sa(1.0, 0.5))", "0.05 for 5 %"), ("Sa(1.0, 0.3)", "")]
)
def test_damping_of_measures(im, said):
    assert [said in doubt.sentence for doubt in period_doubts(im)] == [True] * bool(said)


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


@pytest.mark.parametrize(
    ("block", "said"),
    [
        (tp.Block(0.6, 1.2, 0.2, 1.3), "a centre of mass lower than half the width (0.6 m × 1.2 m):"),
        (tp.Block(0.9, 1.15), None),
    ],
)
def test_the_centre_of_mass_counts_and_not_the_height(block, said):
    assert [one.sentence.partition(":")[0] + ":" for one in block_doubts([block])] == (
        [] if said is None else [f"the block has {said}"]
    )


@pytest.mark.parametrize(
    ("top", "units", "expected"),
    [
        (4.9 * G, "m s-2", None),
        (5.1 * G, "m s-2", False),
        (51.0 * G, "m s-2", True),
        (9.9, "m s-1", None),
        (10.1, "m s-1", False),
        (101.0, "m s-1", True),
        (0.06 * G, "m s-2", None),
        (0.04 * G, "m s-2", False),  # (g written where m/s² is meant)
        (0.021, "m s-1", None),
        (0.008, "m s-1", False),  # (m/s written where cm/s are meant)
        (500.0, "1", None),
    ],
)
def test_levels(top, units, expected):
    for levels in ([0.001, top], [np.nan, top]):
        found = level_doubts(np.array(levels), units)
        assert [doubt.grave for doubt in found] == ([] if expected is None else [expected])
    assert level_doubts(np.array([np.nan]), units) == []


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
