"""Runs of several motions side by side: the bits of each are those that it has alone, whatever goes beside it."""

import numpy as np
import pytest
from shared_cases import LAWS, lifts_at, shake

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.fragility.runs import plan
from toppling.models import runs
from toppling.models.engine.starts import begin_runs
from toppling.models.engine.tables import LANES, SPAN, TILE
from toppling.models.oscillator import stack
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import TALLY, batch_of, lay_out, run_many, run_mixed, run_specimens, stacked
from toppling.models.sliding.law import Slider
from toppling.motions.arrays import Record

BLOCKS = [tp.Block.from_slenderness(0.2, 0.5), tp.Block.from_slenderness(0.15, 1.5)]
WAYS = {"peaks": (True, False), "whole": (False, False), "flags": (True, True)}


def motion(acceleration, dt=0.01, vertical=None):
    return Record("", np.array(acceleration), dt, "test", vertical=vertical)


@pytest.fixture(scope="module")
def motions():
    """Records of two steps that end in every place of a tile, a few samples among them, and one without shaking."""
    rng = np.random.default_rng(7)
    lengths = [*range(600, 600 + TILE + 1), 900, 1201, 2, 4]
    found = [motion(shake(rng, n=n)) for n in lengths]
    found += [motion(shake(rng, n=n, dt=0.005), 0.005) for n in (1000, 1003)]
    return [*found, motion(np.zeros(300))]


def draw(rng, specimens, motions, oscillator, size=300):
    """Runs in any order: specimens, motions, factors from below uplift to far above."""
    factors = np.exp(rng.uniform(np.log(0.6), np.log(8.0), size)) * lifts_at(oscillator) / oscillator.gain
    return rng.integers(0, specimens, size), rng.integers(0, len(motions), size), factors


def one_by_one(specimens, which, where, factors, motions, skip, flags_only, tally=None):
    """The same runs, each alone."""
    found = []
    for o, i, factor in zip(which, where, factors, strict=True):
        one = motions[i]
        alone = [[factor]], one.acceleration, one.dt, skip, flags_only, tally, one.vertical
        found.append(run_many([specimens[o]], np.array(alone[0]), *alone[1:])[0, 0])
    return np.array(found)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.label)
def test_a_run_has_the_bits_that_it_has_alone(motions, law, way):
    """With all that is counted on the way."""
    specimens = [law.oscillator(block) for block in BLOCKS]
    rng = np.random.default_rng(11)
    which, where, factors = draw(rng, len(specimens), motions, specimens[0])
    apart, together = np.zeros(len(TALLY), np.int64), np.zeros(len(TALLY), np.int64)
    alone = one_by_one(specimens, which, where, factors, motions, *WAYS[way], apart)
    mixed = run_mixed(stacked(specimens), which, where, factors, motions, *WAYS[way], together)
    np.testing.assert_array_equal(mixed, alone)
    np.testing.assert_array_equal(together, apart)
    assert 0.1 < mixed[:, OF_ENGINE["overturned"]].mean() < 0.9


@pytest.mark.parametrize("geometry", ["linear", "exact"])
def test_neither_company_nor_order_matters(motions, geometry):
    """More runs than lanes, halves of them, and turned round; also where a batch holds a record or two only."""
    specimens = [tp.HousnerImpact(e=e, geometry=geometry).oscillator(BLOCKS[0]) for e in (0.8, 0.95)]
    tables = stacked(specimens)
    rng = np.random.default_rng(13)
    which, where, factors = draw(rng, 2, motions, specimens[0], LANES + 300)
    every = run_mixed(tables, which, where, factors, motions)
    for some in (np.arange(0, factors.size, 2), rng.permutation(factors.size), np.arange(5)):
        found = run_mixed(tables, which[some], where[some], factors[some], motions)
        np.testing.assert_array_equal(found, every[some])


def test_small_batches_have_the_same_bits(motions, monkeypatch):
    specimens = [tp.EnergyConsistent(e=0.9).oscillator(block) for block in BLOCKS]
    which, where, factors = draw(np.random.default_rng(17), 2, motions, specimens[0])
    every = run_mixed(stacked(specimens), which, where, factors, motions)
    monkeypatch.setattr(runs, "_MOST_SAMPLES", 1500)
    np.testing.assert_array_equal(run_mixed(stacked(specimens), which, where, factors, motions), every)
    monkeypatch.setattr(runs, "ENOUGH_OF_ONE", 10)
    np.testing.assert_array_equal(run_mixed(stacked(specimens), which, where, factors, motions), every)


def test_walls_straps_and_a_mass_off_the_middle(motions):
    strap = tp.Restraint.strap(1.0, strength=150.0)
    scenes = [
        tp.Block(0.3, 1.2, wall=tp.Wall(0.03)),
        tp.Block(0.3, 1.2, wall=tp.Wall()),
        tp.Block(0.3, 1.2, mass=60.0, restraint=strap),
        tp.Block(0.3, 1.2, cm_offset=0.02),
    ]
    for geometry in ("linear", "bilinear"):
        specimens = [tp.HousnerImpact(e=0.9, geometry=geometry).oscillator(block) for block in scenes]
        rng = np.random.default_rng(19)
        which, where = rng.integers(0, 4, 200), rng.integers(0, len(motions), 200)
        factors = np.exp(rng.uniform(np.log(0.5), np.log(12.0), 200))
        for way in WAYS.values():
            alone = one_by_one(specimens, which, where, factors, motions, *way)
            np.testing.assert_array_equal(run_mixed(stacked(specimens), which, where, factors, motions, *way), alone)


def test_vertical_shaking_beside_none(motions):
    """Some motions have a vertical component, some one of zeros; some runs leave the floor."""
    rng = np.random.default_rng(23)
    shakes = [one._replace(vertical=0.7 * shake(rng, n=one.acceleration.size)) for one in motions[:4]]
    shakes += [motions[4], motions[5]._replace(vertical=np.zeros(motions[5].acceleration.size))]
    specimens = [tp.HousnerImpact(e=0.9).oscillator(block) for block in BLOCKS]
    which, where = rng.integers(0, 2, 150), rng.integers(0, len(shakes), 150)
    factors = np.exp(rng.uniform(np.log(0.5), np.log(20.0), 150))
    for way in WAYS.values():
        alone = one_by_one(specimens, which, where, factors, shakes, *way)
        mixed = run_mixed(stacked(specimens), which, where, factors, shakes, *way)
        np.testing.assert_array_equal(mixed, alone)
    assert 0.0 < mixed[:, OF_ENGINE["airborne"]].mean() < 1.0


def test_vertical_shaking_is_refused_in_linear_geometry(motions):
    shaken = motions[0]._replace(vertical=motions[0].acceleration)
    tables = stacked([LAWS[0].oscillator(BLOCKS[0])])
    with pytest.raises(ValueError, match="needs exact geometry"):
        run_mixed(tables, np.array([0]), np.array([0]), np.ones(1), [shaken])


def test_sliding_blocks_go_motion_by_motion(motions):
    """By the engine of their own, in any order."""
    rng = np.random.default_rng(29)
    tables = stacked([Slider(0.3, 0.3, 0.25, 0.25), Slider(0.2, 0.3, 0.1, 0.25)])
    which, where, factors = rng.integers(0, 2, 60), rng.integers(0, 5, 60), rng.uniform(1.0, 12.0, 60)
    tally = np.zeros(len(TALLY), np.int64)
    mixed = run_mixed(tables, which, where, factors, motions, tally=tally)
    for j, (o, i) in enumerate(zip(which, where, strict=True)):
        counts = np.zeros(len(TALLY), np.int64)
        apart = run_specimens(tables[o : o + 1], factors[None, j : j + 1], motions[i], True, False, counts)
        np.testing.assert_array_equal(mixed[j], apart[0, 0])
    assert (mixed[:, 0] > 0.0).any()


class TestChunks:
    """`run_part` mixes the motions of a chunk where few runs share one; the results are the same either way."""

    @pytest.mark.parametrize("outputs", [tuple(OF_ENGINE), ("overturned",)])
    def test_mixed_or_not(self, motions, outputs, monkeypatch):
        specimens = [law.oscillator(block) for law in (LAWS[0], LAWS[-1]) for block in BLOCKS]
        factors = np.random.default_rng(31).uniform(1.0, 10.0, (len(specimens), 3, len(motions)))
        calls = []
        monkeypatch.setattr(plan, "run_mixed", lambda *given: (calls.append(given[1].size), run_mixed(*given))[1])
        mixed = plan.run_part(specimens, motions, factors, True, outputs)
        assert calls == [factors.size]
        monkeypatch.setattr(plan, "MOST_MIXED", 50)
        few = plan.run_part(specimens, motions, factors, True, outputs)
        assert max(calls[1:]) <= 50
        monkeypatch.setattr(plan, "ENOUGH_OF_ONE", 1)
        calls.clear()
        apart = plan.run_part(specimens, motions, factors, True, outputs)
        assert calls == []
        for one, two, three in zip(mixed.results, few.results, apart.results, strict=True):
            np.testing.assert_array_equal(one, two)
            np.testing.assert_array_equal(one, three)
        np.testing.assert_array_equal(mixed.tally, apart.tally)
        np.testing.assert_array_equal(few.tally, apart.tally)

    def test_what_leaves_the_floor_counts_as_overturned(self, motions):
        """Beside motions without a vertical component, as alone."""
        lifted = motions[0]._replace(vertical=5.0 * motions[0].acceleration)
        specimens = [tp.HousnerImpact(e=0.9).oscillator(BLOCKS[0])]
        found = plan.run_part(specimens, [motions[1], lifted], np.full((1, 1, 2), 5.0), True, ("overturned", "impacts"))
        assert found.results[0][0, 0, 1]
        assert found.results[1][0, 0].tolist()[1] == -1 != found.results[1][0, 0].tolist()[0]


def test_what_is_left_of_a_record_is_the_integral_of_its_chords():
    """Of every span, and of records that end anywhere in one, in both components."""
    rng = np.random.default_rng(5)
    pairs = [rng.normal(size=(2, n)) for n in (2, 31, 32, 33, 64, 65, 500)]
    stacked = stack([tp.HousnerImpact(geometry="exact").oscillator(tp.Block(0.4, 1.8))])
    records = lay_out([one[0] for one in pairs], 0.01, [one[1] for one in pairs])
    runs = np.arange(len(pairs))
    batch = batch_of(records, stacked, np.zeros_like(runs), runs, np.ones(runs.size), np.zeros(5, np.int64))
    spans = batch.shaking.highs.size
    batch = batch._replace(shaking_left=np.full(spans, np.nan), lifting_left=np.full(spans, np.nan))
    begin_runs(batch, np.empty(0), True, True)
    for pair, start in zip(pairs, records.start, strict=True):
        for i in range(0, pair.shape[1], SPAN):
            chords = np.trapezoid(np.abs(pair[:, i:]), dx=0.01)
            span = (start + i) // SPAN
            assert batch.shaking_left[span] == pytest.approx(chords[0], rel=1e-12, abs=1e-15)
            assert batch.lifting_left[span] == pytest.approx(chords[1] / STANDARD_GRAVITY, rel=1e-12, abs=1e-15)
