"""Sliding in inventories: slips and falls off edges against plain loops, joint outcomes, and what friction leaves."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from assessed import anchoring, assessed
from numpy.testing import assert_allclose, assert_array_equal

import toppling as tp
from toppling.core.streams import stream
from toppling.fragility import HazardCurve
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.uncertainty.joint import Variability, pieces_of
from toppling.models.friction import CONTACTS, FixedFriction, LognormalFriction
from toppling.studies.buildings.slide_runs import COEFFICIENTS, Slipping
from toppling.studies.buildings.sliding import item_slide_notes
from toppling.studies.facts.method import _sliding as of_sliding
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.inventory.kits import Kit
from toppling.studies.inventory.reading import read_inventory
from toppling.studies.kits.savings import with_kit

LAW = tp.HousnerImpact(geometry="linear")
MOTIONS = tp.motions.CloughPenzien(duration=8.0, dt=0.01, s0=0.05).sample(12, seed=2)
LEVELS = np.geomspace(1.5, 14.0, 5)
CURVE = HazardCurve(np.geomspace(0.2, 20.0, 12).tolist(), (0.02 * np.geomspace(0.2, 20.0, 12) ** -1.8).tolist(), "pga")
LOW = LognormalFriction(0.3, 0.3)
BENCH = tp.Block(0.3, 0.7, edge=tp.Edge(0.02, 0.05, "foot"))
ANALYSER = Contents("analyser", BENCH, 0, 3, value=100.0, friction=LOW, kinetic_ratio=0.85, consequences=("injury",))
VASE = Contents("vase", tp.Block(0.12, 0.4, edge=tp.Edge(0.0)), 0, 2, value=40.0, friction=CONTACTS["vinyl"].friction)
SHELF = Contents("shelf", tp.Block(0.3, 1.6), 0, 4, value=10.0)
PLAIN = (
    replace(ANALYSER, block=replace(BENCH, edge=None)),
    replace(VASE, block=replace(VASE.block, edge=None)),
    SHELF,
)


def found(*rows, motions=MOTIONS, **options):
    options = {"hazard": CURVE, "replicates": 100, **options}
    return assessed(Inventory(rows, "EUR"), LAW, motions, LEVELS, "pga", **options)


def quantiles(friction, number=COEFFICIENTS):
    return friction.quantile((np.arange(number) + 0.5) / number)


def slips_by_hand(row, mu, motions=MOTIONS, block=None):
    """Slips to the front and to the back (level, motion) of a coefficient, by a plain run; 0 where it rocks."""
    block = replace(row.block if block is None else block, edge=None)
    if mu >= block.b / block.h:
        return np.zeros((2, LEVELS.size, motions.sizes["motion"]))
    law = tp.Sliding(mu, row.kinetic_ratio * mu)
    run = tp.ida(block, law, motions, LEVELS, im="pga", outputs=["slide_forward", "slide_backward"])
    return np.stack([run[name].values[0, 0] for name in ("slide_forward", "slide_backward")])


def off_by_hand(row, motions=MOTIONS, reverse=False):
    """Whether each coefficient takes a piece over an edge (coefficient, level, motion)."""
    every = []
    for mu in quantiles(row.friction):
        slips = slips_by_hand(row, float(mu), motions)
        forward, backward = slips[::-1] if reverse else slips
        front, back = row.block.edge.slips(row.block.b)
        every.append((forward > front) | (backward > back))
    return np.array(every)


ENDS = ("", "_lower", "_upper")


class TestOneLine:
    @pytest.fixture(scope="class")
    def by_hand(self):
        topples = tp.ida(replace(BENCH, edge=None), LAW, MOTIONS, LEVELS, im="pga")["overturned"].values[0, 0]
        return off_by_hand(ANALYSER), topples

    @pytest.fixture(scope="class")
    def results(self):
        return found(ANALYSER, SHELF, polarity="as recorded")

    def test_flags_are_those_of_a_plain_loop_over_coefficients(self, results, by_hand):
        off, topples = by_hand
        assert off.any()
        assert topples.any()
        assert (off & ~topples).any()
        assert (topples & ~off).any()
        assert_array_equal(results["overturned"].values[0, 0], topples)
        assert_array_equal(results["fallen"].values[0, 0], off | topples)
        shelf = results["overturned"].values[0, 1]
        assert_array_equal(results["fallen"].values[0, 1], np.broadcast_to(shelf, off.shape))

    def test_rates_are_those_of_the_loop(self, results, by_hand):
        off, topples = by_hand
        weights = level_weights(LEVELS, CURVE).weights
        for name, chance in (
            ("rate", (off | topples).mean(axis=(0, 2))),
            ("off_rate", off.mean(axis=(0, 2))),
            ("overturning_rate", topples.mean(axis=1)),
        ):
            value = results[name].isel(block=0).values.ravel()[0]
            assert_allclose(value, weights @ chance, rtol=1e-12)
        assert_allclose(results["probability"].values[0, 0], (off | topples).mean(axis=(0, 2)), rtol=1e-12)
        assert_allclose(results["off_probability"].values[0], off.mean(axis=(0, 2)), rtol=1e-12)
        assert np.isnan(results["off_rate"].values[1])

    def test_the_gate_is_beside_the_headline_and_never_in_it(self, results, by_hand):
        _, topples = by_hand
        instead = float(LOW.below(BENCH.b / BENCH.h))
        assert_allclose(results["slides_instead"].values[0], instead, rtol=1e-12)
        gated = results["gated_probability"].values[0, 0]
        assert_allclose(gated, (1.0 - instead) * topples.mean(axis=1), rtol=1e-12)
        assert (results["probability"].values[0, 0] >= topples.mean(axis=1)).all()
        assert_allclose(results["gated_rate"].values[0, 0], (1.0 - instead) * results["overturning_rate"].values[0, 0])

    def test_slips_over_distances(self, results):
        peaks = np.array([slips_by_hand(ANALYSER, float(mu)).max(axis=0) for mu in quantiles(LOW)])
        assert results["slip"].values.tolist() == [0.05, 0.1, 0.3]
        for k, distance in enumerate((0.05, 0.1, 0.3)):
            chance = (peaks > distance).mean(axis=(0, 2))
            assert_allclose(results["slip_probability"].values[0, k], chance, rtol=1e-12)
        moves = (peaks > 0.0).mean(axis=(0, 2))
        assert moves[-1] > 0.0
        assert_allclose(results["slide_probability"].values[0], moves, rtol=1e-12)

    def test_intervals_enclose_and_come_from_the_motions(self, results):
        for name in ("off_rate", "slip_rate", "gated_rate", "overturning_rate"):
            value, low, high = (results[f"{name}{end}"].isel(block=0).values.ravel()[0] for end in ENDS)
            assert 0.0 <= low < value < high
        again = found(ANALYSER, SHELF, polarity="as recorded")
        assert again.drop_attrs(deep=False).identical(results.drop_attrs(deep=False))

    def test_a_number_is_one_coefficient(self):
        row = replace(ANALYSER, friction=FixedFriction(0.3))
        results = found(row, polarity="as recorded")
        assert_array_equal(results["fallen"].values[0, 0], results["fallen"].values[0, 0, :1].repeat(20, axis=0))
        forward, backward = slips_by_hand(row, 0.3)
        assert_allclose(
            results["off_probability"].values[0], ((forward > 0.02) | (backward > 0.05)).mean(axis=1), rtol=1e-12
        )


class TestBothWays:
    @pytest.mark.slow
    def test_edges_that_differ_are_run_both_ways(self):
        results = found(ANALYSER)
        assert {*results["polarity"].values.tolist()} == {1, -1}
        off = results["fallen"].values[0, 0] & ~results["overturned"].values[0, 0]
        plus, minus = off_by_hand(ANALYSER), off_by_hand(ANALYSER, reverse=True)
        topples = results["overturned"].values[0, 0]
        assert_array_equal(off[..., ::2], plus & ~topples[..., ::2])
        assert_array_equal(off[..., 1::2], minus & ~topples[..., 1::2])
        assert (plus != minus).any()
        assert_allclose(results["off_probability"].values[0], 0.5 * (plus + minus.astype(float)).mean(axis=(0, 2)))

    @pytest.mark.slow
    def test_a_reversed_motion_is_a_run_of_its_own(self):
        against = MOTIONS.copy(data=-MOTIONS.values)
        assert_array_equal(off_by_hand(ANALYSER, against), off_by_hand(ANALYSER, reverse=True))

    def test_even_edges_are_run_as_recorded(self):
        even = replace(ANALYSER, block=replace(BENCH, edge=tp.Edge(0.02, 0.02)))
        assert "polarity" not in found(even).coords

    def test_forward_falls_hold_what_slid_off_in_front(self):
        results = found(ANALYSER, sides=True, polarity="as recorded")
        over = np.array([slips_by_hand(ANALYSER, float(mu))[0] > 0.02 for mu in quantiles(LOW)])
        stands = ~results["overturned"].values[0, 0]
        assert_array_equal(results["front"].values[0, 0][:, stands], over[:, stands])
        assert over[:, stands].any()


class TestTogether:
    """Numbers of two lines by the enumeration of all coefficients."""

    @pytest.mark.slow
    @pytest.mark.parametrize("shared", [True, False])
    def test_joint_outcomes_are_enumerated(self, shared):
        results = found(ANALYSER, VASE, polarity="as recorded", slipping=Slipping(shared=shared))
        assert results.attrs["pieces"] == ("together" if shared else "independent")
        a, v = results["fallen"].values[0]
        flags = {"analyser": a, "vase": v}
        for name, own in (("analyser", ANALYSER), ("vase", VASE)):
            topples = results["overturned"].values[0, ["analyser", "vase"].index(name)]
            assert_array_equal(flags[name], off_by_hand(own) | topples)
        n = COEFFICIENTS
        none = np.zeros(a.shape[1:])
        if shared:  # (each line has one of its coefficients)
            for i, j in product(range(n), range(n)):
                none += ~(a[i] | v[j])
            none /= n * n
        else:  # (each piece has one of its own: 3 and 2 pieces)
            for i in product(range(n), repeat=2):
                none += ~(v[i[0]] | v[i[1]])
            none *= (~a).mean(axis=0) ** 3 / n**2
        assert_allclose(results["any_probability"].sel(place="building").values[0], 1.0 - none.mean(axis=1), atol=1e-12)
        expected = 3.0 * a.mean(axis=(0, 2)) + 2.0 * v.mean(axis=(0, 2))
        assert_allclose(results["number_mean"].sel(place="building").values[0], expected, rtol=1e-12)
        loss = 300.0 * a.mean(axis=(0, 2)) + 80.0 * v.mean(axis=(0, 2))
        assert_allclose(results["loss_mean"].sel(place="building").values[0], loss, rtol=1e-12)
        numbers = results["number"].sel(place="building").values[0]
        whole = numbers[a.all(axis=0) | ~a.any(axis=0)]
        assert (whole >= 0.0).all()
        some = a.any(axis=0) & ~a.all(axis=0) & ~v.any(axis=0)  # the analysers' friction alone decides
        assert some.any()
        drawn = {*np.unique(numbers[some]).tolist()}
        assert drawn <= ({0.0, 3.0} if shared else {0.0, 1.0, 2.0, 3.0})
        assert shared or drawn & {1.0, 2.0}
        assert_allclose(numbers[some].mean(), 3.0 * a[:, some].mean(), atol=0.5)

    def test_anchoring_saves_what_falls_off(self):
        results = found(ANALYSER, SHELF)
        ranked = anchoring(results, "number")
        at = ranked["block"].values.tolist().index("analyser")
        assert_allclose(ranked["saving"].values[0, at], 3.0 * results["rate"].values[0, 0], rtol=1e-9)
        (foot,) = (fact for fact in of_sliding(results) if fact.what == "sliding.clearance")
        assert foot.names == ("analyser",)
        anchored = found(replace(ANALYSER, anchored=True), SHELF)
        assert "sliding.clearance" not in {fact.what for fact in of_sliding(anchored)}
        assert "fallen" not in anchored
        assert anchored["rate"].values[0, 0] == 0.0


class TestVariants:
    def test_each_variant_has_a_coefficient_of_its_own(self):
        varied = Variability(0.02, 0.05, variants=5, realisations=4, seed=3)
        results = found(ANALYSER, polarity="as recorded", variability=varied)
        assert results.attrs["pieces"] == "independent"
        order = stream(3, 2).permutation(5)
        own = quantiles(LOW, 5)[order]
        blocks = [block for block, _ in pieces_of(ANALYSER.block, LAW, None, varied)]
        fallen, topples = results["fallen"].values[0, 0], results["overturned"].values[0, 0]
        for k, (mu, block) in enumerate(zip(own, blocks, strict=True)):
            forward, backward = slips_by_hand(ANALYSER, float(mu), block=block)
            front, back = block.edge.slips(block.b)
            assert_array_equal(fallen[k], topples[k] | (forward > front) | (backward > back))
        rocks = [1.0 - float(LOW.below(block.b / block.h)) for block in blocks]
        gated = np.mean([share * one for share, one in zip(rocks, topples.mean(axis=2), strict=True)], axis=0)
        assert_allclose(results["gated_probability"].values[0, 0], gated, rtol=1e-12)


class TestFrictionAlone:
    @pytest.mark.parametrize("variability", [None, Variability(0.02, variants=3, realisations=4)])
    def test_leaves_every_other_variable_as_it_is(self, variability):
        bare = [replace(row, friction=None, kinetic_ratio=1.0) for row in PLAIN]
        without, with_it = (found(*rows, variability=variability) for rows in (bare, PLAIN))
        for name in without.data_vars:
            assert without[name].variable.identical(with_it[name].variable), name
        more = {*with_it.data_vars} - {*without.data_vars}
        assert {"slides_instead", "slip_probability", "slip_rate", "gated_probability"} <= more
        assert not {one for one in more if "off" in str(one) or one == "fallen"}

    def test_with_modelling_uncertainty(self):
        for options in ({"modelling_dispersion": 0.3}, {"modelling_dispersion": 0.3, "hazard": None}):
            results = found(ANALYSER, SHELF, **options)
            assert (results["probability"] >= results["overturning_probability"] - 1e-12).all()
            assert (results["probability"].isel(block=0) >= results["off_probability"].isel(block=0) - 1e-12).all()

    def test_held_pieces_have_none(self):
        walled = Contents("case", tp.Block(0.3, 1.6, wall=tp.Wall(0.02)), 0, friction=LOW)
        results = found(walled, *PLAIN)
        assert np.isnan(results["slides_instead"].values[0])
        assert np.isfinite(results["slides_instead"].values[1])


HEADER = (
    "item,width_m,height_m,floor,count,contact,friction,friction_dispersion,edge_distance_mm,falls_when,wall_gap_mm"
)


class TestFiles:
    def read(self, tmp_path, line, header=HEADER, **options):
        path = tmp_path / "pieces.csv"
        path.write_text(f"{header}\n{line}\n", encoding="utf-8")
        return read_inventory(path, **options).rows[0]

    def test_a_contact_gives_friction_and_ratio(self, tmp_path):
        row = self.read(tmp_path, "vase,0.2,0.5,0,1,vinyl,,,80,foot,")
        assert row.friction == CONTACTS["vinyl"].friction
        assert row.kinetic_ratio == 0.85
        assert row.block.edge == tp.Edge(0.08, falls_when="foot")

    def test_a_number_with_its_dispersion(self, tmp_path):
        assert self.read(tmp_path, "vase,0.2,0.5,0,1,,0.4,0.2,,,").friction == LognormalFriction(0.4, 0.2)
        assert self.read(tmp_path, "vase,0.2,0.5,0,1,castors locked,0.4,,,,").contact == "castors locked"

    @pytest.mark.parametrize("word", ["castors", "castors unlocked", "Castors"])
    def test_castors_roll(self, tmp_path, word):
        row = self.read(tmp_path, f"cart,0.4,0.9,0,1,{word},,,,,")
        assert row.rolls
        assert row.friction is None


BASE = Contents("pedestal", tp.Block(0.45, 1.1), 0, 2, friction=LognormalFriction(0.5, 0.2))
BUST = Contents(
    "bust",
    tp.Block(0.2, 0.4, edge=tp.Edge(0.08)),
    0,
    friction=LOW,
    stands_on="pedestal",
)


class TestPedestals:
    def test_whether_it_rests_is_checked_run_by_run(self):
        results = found(BASE, BUST, polarity="as recorded")
        peaks = np.abs(MOTIONS.values).max(axis=1)
        needed = LEVELS[:, None] * np.ones_like(peaks) / 9.80665  # (scaled to their peak)
        moves = np.where(needed > BASE.block.b / BASE.block.h, 1.0, BASE.friction.below(needed)).mean(axis=1)
        assert (moves > 0.0).any()
        assert (moves < 1.0).any()
        assert_allclose(results["support_moves_probability"].values[1], moves, rtol=1e-9)
        assert np.isnan(results["support_moves_probability"].values[0]).all()
        weights = level_weights(LEVELS, CURVE).weights
        assert_allclose(results["support_moves_rate"].values[1], weights @ moves, rtol=1e-9)

    def test_an_anchored_one_rests(self):
        inventory = Inventory((replace(BASE, anchored=True), BUST), "EUR")
        results = found(*inventory.rows)
        assert (results["support_moves_probability"].values[1] == 0.0).all()
        (said,) = [one for one in item_slide_notes(results, inventory) if one.what == "support.pedestals_as_floor"]
        assert (said.value, said.names, said.more) == (0.0, ("bust",), {"several": False})

    def test_nothing_slides_on_an_anchored_one_without_friction(self):
        base = replace(BASE, anchored=True, friction=None)
        bust = replace(BUST, block=replace(BUST.block, edge=None), friction=None)
        results, free = found(base, bust), found(replace(bust, stands_on=""))
        assert_array_equal(*(one["overturned"].sel(block="bust") for one in (results, free)))
        assert (results["support_moves_probability"].values[1] == 0.0).all()

    def test_a_file_names_the_item_of_its_floor(self, tmp_path):
        path = tmp_path / "pieces.csv"
        lines = ["base,0.45,1.1,0,,0.5", "base,0.45,1.1,1,,0.5", "vase,0.2,0.4,1,base,0.4"]
        path.write_text("\n".join(["item,width_m,height_m,floor,stands_on,friction", *lines]), encoding="utf-8")
        assert read_inventory(path).rows[2].stands_on == "base, floor 1"

    def test_classes_and_kits_leave_it_out(self):
        results = found(BASE, replace(BUST, piece_class="b"), SHELF, modelling_dispersion=0.3)
        assert (results["any_rate"].values > 0.0).all()
        held = Inventory((replace(BASE, block=replace(BASE.block, mass=50.0)), BUST))
        strap = Kit("strap", tp.Restraint.strap(1.0, 2000.0, 20e3, 0.005), height=1.0)
        assert [row.label for row in with_kit(held, strap).rows] == ["pedestal"]


def test_refused(refusal):
    refusal()
