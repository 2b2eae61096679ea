"""Trips of an inventory's pieces over obstacles: against runs of blocks, in years, tables, files and refusals."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from assessed import assess
from numpy.testing import assert_allclose, assert_array_equal
from study_texts import motions, study_in

import toppling as tp
from toppling.core.streams import stream
from toppling.fragility import HazardCurve, slide_runs
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.uncertainty.joint import Variability, pieces_of
from toppling.models.friction import Contact, LognormalFriction
from toppling.studies import StudyError
from toppling.studies.buildings import assessment
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.slide_runs import COEFFICIENTS, SlidingRuns
from toppling.studies.facts.notes import notes_of
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.inventory.reading import read_inventory
from toppling.studies.plan.slides import Slides
from toppling.studies.tables.assessment import at_most, at_the_level
from toppling.studies.tables.pieces import exported_pieces
from toppling.studies.tables.slides import item_slides

pytestmark = pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")

LAW = tp.HousnerImpact()
MOTIONS = tp.motions.CloughPenzien(duration=12.0, dt=0.01).sample(8, seed=2)
LEVELS = np.geomspace(2.0, 24.0, 4)
CURVE = HazardCurve(np.geomspace(0.2, 20.0, 12).tolist(), (0.02 * np.geomspace(0.2, 20.0, 12) ** -1.8).tolist(), "pga")
LOW = LognormalFriction(0.15, 0.3)
SHELF = Contents("shelf", tp.Block(0.12, 0.6), 0, 4, friction=LOW, kinetic_ratio=0.9, trip=0.04)
CABINET = Contents("cabinet", tp.Block(0.08, 0.25), 0, 2, friction=LOW, kinetic_ratio=0.9, trip=0.01)
FREE = Contents("free", tp.Block(0.3, 1.8), 0, friction=LOW, kinetic_ratio=0.9)
ROWS = (SHELF, CABINET, FREE)


def found(*rows, motions=MOTIONS, **options):
    return assess(
        Inventory(rows), Assessment(LAW, motions, LEVELS, "pga", **{"hazard": CURVE, "replicates": 100, **options})
    )


def of_blocks(row, motions=MOTIONS, block=None, draws=COEFFICIENTS, **options):
    """Flags (level, motion, draw) of a line's block by `slide_runs`."""
    block = row.block if block is None else block
    runs = tp.ida(block, LAW, motions, LEVELS)
    slid = slide_runs(runs, motions, Contact(row.friction, row.kinetic_ratio), draws=draws, trip=row.trip, **options)
    return slid["trips"].values[0, 0].reshape(LEVELS.size, motions.sizes["motion"], -1)


@pytest.fixture
def kept(monkeypatch):
    """What the runs of sliding of an assessment hold."""
    every = []

    class Kept(SlidingRuns):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            every.append(self)

    monkeypatch.setattr(assessment, "SlidingRuns", Kept)
    return every


class TestRuns:
    def test_are_those_of_blocks_run_by_run(self, kept):
        results = found(*ROWS)
        (runs,) = kept
        assert runs.near == [0, 1]
        weights = level_weights(LEVELS, CURVE).weights
        for k, row in enumerate((SHELF, CABINET)):
            flags = of_blocks(row)
            assert 0.0 < flags.mean() < 1.0
            assert_array_equal(runs.tripped[k], flags.sum(axis=-1))
            assert_allclose(results["trip_probability"].values[k], flags.mean(axis=(1, 2)), rtol=1e-12)
            assert_allclose(results["trip_rate"].values[k], weights @ flags.mean(axis=(1, 2)), rtol=1e-12)
        assert np.isnan(results["trip_probability"].values[2]).all()
        assert_array_equal(results["trip_distance"], [0.04, 0.01, np.nan])
        for name in ("trip_probability", "trip_rate"):
            low, high = (results[f"{name}{end}"].values[:2] for end in ("_lower", "_upper"))
            assert (low <= results[name].values[:2]).all()
            assert (results[name].values[:2] <= high).all()

    def test_each_coefficient_by_itself(self, kept):
        """One number at a time: the flags of each run, not their sum alone."""
        for mu in LOW.quantile((np.arange(4) + 0.5) / 4).tolist():
            row = replace(SHELF, friction=tp.models.friction.FixedFriction(mu))
            found(row)
            assert_array_equal(kept[-1].tripped[0] == COEFFICIENTS, of_blocks(row)[..., 0])
            assert {*np.unique(kept[-1].tripped[0]).tolist()} <= {0, COEFFICIENTS}

    def test_variants_have_their_own_sizes_and_coefficients(self, kept):
        varied = Variability(0.0, 0.15, variants=5, realisations=4, seed=3)
        found(SHELF, variability=varied)
        flags = np.zeros((LEVELS.size, 8), int)
        order = stream(3, 2).permutation(5)
        for k, (block, _) in enumerate(pieces_of(SHELF.block, LAW, None, varied)):
            flags += of_blocks(SHELF, block=replace(block, name="shelf"), draws=5)[..., order[k]]
        assert_array_equal(kept[0].tripped[0], flags)
        assert flags.any()

    def test_both_ways(self, kept):
        """An obstacle on either side: the reverse of a motion trips what the motion does."""
        found(*ROWS, polarity="both")
        flags = of_blocks(SHELF).sum(axis=-1)
        assert_array_equal(kept[0].tripped[0], np.repeat(flags, 2, axis=-1))

    def test_the_weight_is_taken(self, kept):
        up = MOTIONS.copy(data=0.5 * MOTIONS.values[::-1])
        lifted = tp.motions.as_recorded(tp.motions.join(MOTIONS, MOTIONS, up), "h1", vertical=True)
        results = found(*ROWS, motions=lifted)
        for k, row in enumerate((SHELF, CABINET)):
            flags = of_blocks(row, lifted)
            assert flags.all(axis=-1).any()
            assert_array_equal(kept[0].tripped[k], flags.sum(axis=-1))
        assert (results["trip_probability"].values[:2, -1] > 0.0).all()

    @pytest.mark.parametrize("options", [{}, {"modelling_dispersion": 0.3, "hazard": None}])
    def test_nothing_else_changes(self, options):
        near, plain = (found(*rows, **options) for rows in (ROWS, [replace(row, trip=None) for row in ROWS]))
        for name in plain.data_vars:
            assert plain[name].variable.identical(near[name].variable), name
        more = {str(name) for name in {*near.data_vars} - {*plain.data_vars}}
        assert all("trip" in name for name in more)
        assert "trip_probability" in more

    def test_anchored_and_held_lines_do_not_trip(self):
        held = Contents("case", tp.Block(0.3, 1.6, wall=tp.Wall(0.02)), 0, friction=LOW, trip=0.01)
        results = found(replace(SHELF, anchored=True), held, CABINET)
        assert np.isnan(results["trip_probability"].values[:2]).all()
        assert np.isfinite(results["trip_probability"].values[2]).all()
        assert_array_equal(results["trip_distance"], [np.nan, 0.01, 0.01])

    def test_both_components_are_refused(self):
        pairs = tp.motions.both_axes(tp.motions.join(MOTIONS, MOTIONS))
        row = replace(SHELF, block=tp.Block(0.3, 1.8, depth=0.5))
        words = "trip_mm cannot be given where both components shake, got one for shelf: trips are of one component"
        with pytest.raises(ValueError, match=words):
            assess(Inventory((row,)), Assessment(LAW, pairs, LEVELS, "RotD50(pga)"))
        assess(Inventory((replace(row, trip=None),)), Assessment(LAW, pairs, LEVELS, "RotD50(pga)"))


class TestWords:
    @pytest.fixture
    def results(self):
        return found(*ROWS)

    def test_chances_are_of_50_years_or_of_the_level(self, results):
        for end, rate in {"": 0.01, "_lower": 0.005, "_upper": 0.02}.items():
            results[f"trip_rate{end}"][:] = rate
        assert item_slides(results).texts("trips")[1] == "39\u00a0% (22–63)"  # (once in 100 years, 50 to 200)
        level = found(*ROWS, hazard=None).assign_attrs(at_level=float(LEVELS[-1]))
        assert item_slides(level).title.endswith(at_the_level(level, float(LEVELS[-1])))
        assert item_slides(level).texts("trips")[1] == at_most(level)  # (no run of the cabinet trips there)
        for end, chance in {"": 0.39, "_lower": 0.22, "_upper": 0.63}.items():
            level[f"trip_probability{end}"][:] = chance
        assert item_slides(level).texts("trips")[1] == "39\u00a0% (22–63)"

    def test_titles_name_the_measure(self):
        level = xr.DataArray([0.5 * 9.80665], dims="level", attrs={"im": "pga", "units": "m s-2"})
        level.attrs["long_name"] = "peak ground acceleration of the ground"
        assert at_the_level(xr.Dataset(coords={"level": level}), 0.5 * 9.80665) == "at PGA of the ground = 0.5 g"


HEADER = "item,width_m,height_m,floor,contact,friction,trip_mm"


class TestFiles:
    def read(self, tmp_path, line, sliding=None):
        path = tmp_path / "pieces.csv"
        path.write_text(f"{HEADER}\n{line}\n", encoding="utf-8")
        return read_inventory(path, sliding=sliding).rows[0]

    def test_own_distance_and_that_of_the_study(self, tmp_path):
        study = Slides(LOW, trip=0.03)
        assert self.read(tmp_path, "shelf,0.3,1.8,0,vinyl,,12.5").trip == 0.0125
        assert self.read(tmp_path, "shelf,0.3,1.8,0,vinyl,,").trip is None
        assert self.read(tmp_path, "shelf,0.3,1.8,0,vinyl,,", study).trip == 0.03
        assert self.read(tmp_path, "shelf,0.3,1.8,0,,,12", study).trip == 0.012
        assert self.read(tmp_path, "cart,0.3,0.8,0,castors,,", study).trip is None

    def test_contents_need_friction(self):
        block = tp.Block(0.3, 1.8)
        with pytest.raises(ValueError, match="the obstacle near 'a' needs to know how fast it slides, and its"):
            Contents("a", block, 0, trip=0.1)
        with pytest.raises(ValueError, match="it rolls, which is not modelled"):
            Contents("a", block, 0, contact="castors", trip=0.1)
        for trip in (0.0, -1.0, float("nan"), 11.0):
            with pytest.raises(ValueError, match="trip must be"):
                Contents("a", block, 0, friction=LOW, trip=trip)
        assert Contents("a", block, 0, anchored=True, trip=0.1).obstacle is None

    def test_a_study(self, tmp_path):
        (tmp_path / "pieces.csv").write_text(
            f"{HEADER}\nshelf,0.3,1.8,0,,,\ncabinet,0.4,1.2,0,,,10\ncart,0.3,0.8,0,castors,,\n", encoding="utf-8"
        )
        text = f"""
title = "Cables"
[[models]]
law = "housner"
{motions(6, 8, 0.01, 0)}[performance]
inventory = "pieces.csv"
im = "pga"
levels = {{ values = [0.2, 0.6, 1.6], unit = "g" }}
[friction]
static = 0.15
dispersion = 0.3
trip_mm = 40
"""
        study = study_in(tmp_path, text)
        results = study.run()
        assert_array_equal(results["trip_distance"], [0.04, 0.01, np.nan])
        table = exported_pieces(results)
        keys = {column.key for column in table.columns}
        assert {"tripping_at_level", "trip_distance"} < keys
        assert "tripping_in_50_years" not in keys
        trips = {row["item"]: row["tripping_at_level"].value for row in table.lines}
        level = results.attrs["at_level"]
        assert trips["cabinet"] == pytest.approx(float(results["trip_probability"].sel(level=level)[1]))
        assert np.isnan(trips["cart"])
        assert "sliding.trip_criterion" in {fact.what for fact in notes_of(results)}
        pair = text.replace("number = 6", 'number = 6\ncomponent = "pair"').replace('"pga"', '"RotD50(pga)"')
        (tmp_path / "pair.toml").write_text(pair, encoding="utf-8")
        lines = (tmp_path / "pieces.csv").read_text(encoding="utf-8").splitlines()
        (tmp_path / "pieces.csv").write_text(
            "\n".join([f"{lines[0]},depth_m", *(f"{one},0.6" for one in lines[1:])]), encoding="utf-8"
        )
        with pytest.raises(StudyError, match="trip_mm cannot be given where both components shake"):
            tp.Study.from_toml(tmp_path / "pair.toml")
