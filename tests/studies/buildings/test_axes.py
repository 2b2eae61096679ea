"""Inventories under both horizontal components, held to plain loops of `tp.ida` about each axis and to refusals."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from assessed import assess
from scipy.stats import norm
from study_texts import changed, motions, study_in

import toppling as tp
from toppling.core.facts import Fact
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import HazardCurve
from toppling.fragility.runs.axes import WEAK_RATIO
from toppling.fragility.uncertainty.joint import Variability
from toppling.models.friction import LognormalFriction
from toppling.models.outputs import SLIDES
from toppling.models.sliding.law import PlaneSlider
from toppling.models.sliding.runs import plane_table, run_in_plane
from toppling.motions.arrays import BOTH_AXES, WEAK_AXIS, digest
from toppling.motions.floors.histories import FloorHistories, History
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.axes import axes_notes, placed_on_axes
from toppling.studies.buildings.shaking import Shaking
from toppling.studies.buildings.slide_runs import Slipping
from toppling.studies.buildings.sliding import item_slide_notes
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.inventory.kits import Kit
from toppling.studies.kits.savings import kit_savings
from toppling.studies.store.worker_motions import motions_again

pytestmark = pytest.mark.filterwarnings("ignore:.*sways")  # (short motions on a swaying frame)
PAIRS = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample_pairs(8, 3, correlation=0.3)
TURNED = tp.motions.both_axes(PAIRS, "random", 5)
FRAME = tp.motions.Building.flexural_shear(0.6, storeys=2)
LAW = tp.HousnerImpact()
LEVELS = np.array([0.12, 0.18, 0.3]) * G
CABINET = tp.Block(0.30, 1.40, name="cabinet", depth=0.40)
SHELF = tp.Block(0.28, 1.30, name="shelf", depth=0.28)
WALLED = tp.Block(0.30, 1.50, name="walled", depth=0.40, wall=tp.Wall(0.01))
LINES = (
    Contents("cabinet", CABINET, floor=1, count=2, direction="x"),
    Contents("shelf", SHELF, floor=2, count=3, direction="y"),
)
HAZARD = HazardCurve.from_points([0.5, 1.5, 3.0, 6.0], [3e-2, 4e-3, 8e-4, 6e-5], im="RotD50(pga)", units="m s-2")


def named(facts):
    """The names in each fact, by what it is."""
    return {fact.what: fact.names for fact in facts}


def of_component(name):
    """One component of the turned pairs, as motions of their own."""
    (array,) = TURNED
    return array.sel(component=name, drop=True).drop_vars(["azimuth", "shakes"])


def rotated_median(x, y):
    """The median over directions of the peak acceleration of a pair."""
    angles = np.radians(np.arange(180.0))
    return np.median(np.abs(np.outer(np.cos(angles), x) + np.outer(np.sin(angles), y)).max(axis=1))


def by_hand(block, floor, direction, law=LAW):
    """Flags (level, motion) of either axis, of the depth alone, and the first axis: run by run with `tp.ida`."""
    ground = {name: of_component(name) for name in ("h1", "h2")}
    moved = {name: FRAME.floor_motions(one, [floor]).isel(floor=0, drop=True) for name, one in ground.items()}
    width, depth = ("h1", "h2") if direction == "x" else ("h2", "h1")
    other = tp.Block(block.depth, block.height, name="across")
    fell, first = np.zeros((2, LEVELS.size, 8), int)
    for i in range(8):
        factors = LEVELS / rotated_median(ground["h1"].values[i], ground["h2"].values[i])
        outputs = ["overturned", "overturning_time"]
        one = tp.ida(block, law, moved[width].isel(motion=[i]), factors, "scale", outputs, screen=False)
        two = tp.ida(other, law, moved[depth].isel(motion=[i]), factors, "scale", outputs, screen=False)
        for k in range(LEVELS.size):
            x, y = (bool(runs["overturned"].values[0, 0, k, 0]) for runs in (one, two))
            t, u = (float(runs["overturning_time"].values[0, 0, k, 0]) for runs in (one, two))
            fell[k, i] = x or y
            first[k, i] = 0 if not (x or y) else 1 if x and (not y or t <= u) else 2
    return fell.astype(bool), first


def sideways_by_hand(block, floor, direction, law=LAW):
    """Flags (level, motion) of the depth alone, as of a free block."""
    ground = {name: of_component(name) for name in ("h1", "h2")}
    moved = FRAME.floor_motions(ground["h2" if direction == "x" else "h1"], [floor]).isel(floor=0, drop=True)
    fell = np.zeros((LEVELS.size, 8), bool)
    for i in range(8):
        factors = LEVELS / rotated_median(ground["h1"].values[i], ground["h2"].values[i])
        free = tp.Block(block.depth, block.height)
        fell[:, i] = tp.ida(free, law, moved[[i]], factors, "scale", screen=False)["overturned"].values[0, 0, :, 0]
    return fell


@pytest.fixture(scope="module")
def found():
    options = {"building": FRAME, "hazard": HAZARD, "replicates": 100}
    return assess(Inventory(LINES), Assessment(LAW, TURNED, LEVELS, "RotD50(pga)", **options))


@pytest.mark.slow
def test_flags_are_those_of_each_axis_or_ed(found):
    for i, line in enumerate(LINES):
        fell, first = by_hand(line.block, line.floor, line.direction)
        np.testing.assert_array_equal(found["overturned"].values[0, i], fell)
        np.testing.assert_array_equal(found["sideways"].values[0, i], first == 2)
        assert 0 < fell.sum() < fell.size
        assert (first == 1).any()
        assert (first == 2).any()


def test_rates_and_shares_are_sums_over_the_levels(found):
    weights = found["level_weight"].values
    for i, line in enumerate(LINES):
        fell, first = by_hand(line.block, line.floor, line.direction)
        rate, deep = ((weights[:, None] * flags).sum(0).mean() for flags in (fell, first == 2))
        assert float(found["rate"].values[0, i]) == pytest.approx(rate, rel=1e-12)
        assert float(found["sideways_rate"].values[0, i]) == pytest.approx(deep, rel=1e-12)
        assert float(found["sideways_share"].values[0, i]) == pytest.approx(deep / rate, rel=1e-12)


def test_joint_numbers_are_of_the_same_runs(found):
    flags = [by_hand(line.block, line.floor, line.direction)[0] for line in LINES]
    number = 2 * flags[0] + 3 * flags[1]
    whole = found.sel(place="building")
    np.testing.assert_array_equal(whole["number"].values[0], number)
    np.testing.assert_allclose(whole["any_probability"].values[0], (number > 0).mean(axis=1), rtol=1e-14)
    product = 1.0 - (1.0 - flags[0].mean(1)) * (1.0 - flags[1].mean(1))
    assert np.abs(product - (number > 0).mean(1)).max() > 0.01  # (so that a product of marginals would be seen)


def test_both_polarities(found):
    """A wall makes all motions run both ways; what stands free falls under both, forward under one of them."""
    rows = (*LINES, Contents("walled", WALLED, floor=1, direction="x"))
    both = assess(Inventory(rows), Assessment(LAW, TURNED, LEVELS, "RotD50(pga)", FRAME))
    free = both.isel(block=[0, 1])
    for name in ("overturned", "sideways"):
        own = free[name].values.reshape(1, 2, 3, 8, 2)
        np.testing.assert_array_equal(own[..., 0], own[..., 1])
        np.testing.assert_array_equal(own[..., 0], found[name].values)
    front = free["front"].values.reshape(1, 2, 3, 8, 2)
    along_width = found["overturned"].values & ~found["sideways"].values
    np.testing.assert_array_equal(front.sum(-1), along_width)
    runs = [tp.motions.as_recorded(one) for one in TURNED]
    alone = assess(Inventory(rows[2:]), Assessment(LAW, runs, LEVELS, "RotD50(pga)", FRAME))
    deep = np.repeat(sideways_by_hand(WALLED, 1, "x"), 2, axis=1)
    assert (deep & ~alone["overturned"].values[0, 0]).any()
    np.testing.assert_array_equal(both["overturned"].values[0, 2], alone["overturned"].values[0, 0] | deep)
    placed = placed_on_axes(Inventory(rows), Shaking.of(FRAME, TURNED, None), [LAW])
    assert [row.both_axes for row in placed.rows] == [True, True, True]
    assert named(axes_notes(placed, placed, BOTH_AXES))["axis.held_free"] == ("walled",)


def test_a_soft_bed_is_run_about_its_width():
    soft = Contents("soft", replace(CABINET, bed=tp.Bed(1e-4)), floor=1, direction="x")
    placed = placed_on_axes(
        Inventory((*LINES, soft)), Shaking.of(FRAME, TURNED, None), [tp.HousnerImpact(geometry="linear")]
    )
    assert [row.both_axes for row in placed.rows] == [True, True, False]
    assert named(axes_notes(placed, placed, BOTH_AXES))["axis.bed_along_width"] == ("soft",)


class TestKits:
    """A strap acts along the width; along its depth a piece stands free, with the kit and without it."""

    LAW = tp.HousnerImpact(geometry="linear")
    KITS = (
        Kit("strap", tp.Restraint.strap(1.2, 60.0, 20e3), 15.0, 1.2),
        Kit("bracket", tp.Restraint.bracket(1.2, 5000.0, 100e3), 60.0, 1.2),
    )
    HEAVY = replace(CABINET, mass=60.0)
    ROWS = (
        Contents("cabinet", HEAVY, floor=1, count=2, direction="x", value=100.0),
        Contents("walled", replace(WALLED, mass=60.0), floor=1, direction="y", value=50.0),
        Contents("strapped", KITS[0].held(HEAVY), floor=1, direction="x", kit="strap"),
    )
    ASKED = Assessment([LAW], TURNED, LEVELS, "RotD50(pga)", FRAME, HAZARD, replicates=100)

    @pytest.fixture(scope="class", params=["as recorded", "both"])
    def plain(self, request):
        return assess(Inventory(self.ROWS, "EUR"), replace(self.ASKED, polarity=request.param), sides=True)

    @pytest.mark.slow
    def test_savings_are_differences_of_assessments(self, plain):
        inventory = Inventory(self.ROWS, "EUR")
        found = kit_savings(inventory, self.KITS, plain, self.ASKED)
        for k, kit in enumerate(self.KITS):
            rows = [i for i, row in enumerate(self.ROWS) if kit.fits(row)]
            held = Inventory(tuple(kit.on(self.ROWS[i]) for i in rows), "EUR")
            polarity = "both" if "polarity" in plain.coords else "as recorded"
            own = assess(held, replace(self.ASKED, polarity=polarity), sides=True)
            assert own["both_axes"].values.all()
            for i, at in enumerate(rows):
                rate, before = float(own["rate"][0, i]), float(plain["rate"][0, at])
                assert float(found["kit_falls"][0, k, at]) == pytest.approx(rate, rel=1e-12)
                assert float(found["kit_falls_saved"][0, k, at]) == pytest.approx(before - rate, rel=1e-9, abs=1e-15)
                assert float(found["kit_breaks"][0, k, at]) == pytest.approx(float(own["broken_rate"][0, i]), rel=1e-12)
            assert float(found["kit_falls_saved"][0, k, 0]) > 0.0
        assert np.isnan(found["kit_falls"].values[0, 0, 2])

    def test_what_a_kit_cannot_save_is_along_the_depth(self):
        """Run by run: the strong bracket never breaks, and what is left are falls about the depth."""
        plain = assess(Inventory(self.ROWS[:1], "EUR"), replace(self.ASKED, polarity="as recorded"), sides=True)
        held = [replace(kit.on(self.ROWS[0]), label=kit.name) for kit in reversed(self.KITS)]
        found = assess(Inventory(tuple(held), "EUR"), replace(self.ASKED, polarity="as recorded"), sides=True)
        deep = sideways_by_hand(self.HEAVY, 1, "x", self.LAW)
        np.testing.assert_array_equal(found["overturned"].values[0, 0], deep)
        np.testing.assert_array_equal(found["sideways"].values[0, 0], deep)
        assert not found["front"].values[0, 0].any()
        fell, first = by_hand(self.KITS[0].held(self.HEAVY), 1, "x", self.LAW)
        np.testing.assert_array_equal(found["overturned"].values[0, 1], fell)
        np.testing.assert_array_equal(found["sideways"].values[0, 1], first == 2)
        broken = found["broken_probability"].values[0]
        assert (broken[0] == 0.0).all()
        assert broken[1].max() > 0.0
        assert (plain["probability"].values[0, 0] >= found["probability"].values[0, 0]).all()
        assert (plain["probability"].values[0, 0] > found["probability"].values[0, 0]).any()


@pytest.mark.slow
def test_pieces_that_differ_keep_their_plan_ratio():
    spread = Variability(slenderness_dispersion=0.1, variants=3, realisations=4)
    lines = Inventory(LINES[:1])
    different = assess(lines, Assessment(LAW, TURNED, LEVELS, "RotD50(pga)", FRAME, variability=spread))
    for k, (_, share) in enumerate(spread.sample()):
        angle = CABINET.alpha * math.exp(0.1 * norm.ppf(share))
        size = tp.Block.from_slenderness(angle, CABINET.R)
        block = tp.Block(size.width, size.height, name="variant", depth=size.width * 4.0 / 3.0)
        fell, first = by_hand(block, 1, "x")
        np.testing.assert_array_equal(different["overturned"].values[0, 0, k], fell)
        np.testing.assert_array_equal(different["sideways"].values[0, 0, k], first == 2)


@pytest.mark.slow
def test_floor_histories_in_two_directions_are_pairs(found):
    """Histories as they are, one set for each level: the floors of the same pairs, scaled beforehand."""
    (array,) = FRAME.floor_motions(TURNED, [1, 2])
    ground = TURNED[0].values
    own = [
        History(level, f"m{i}", str(floor), direction, array.values[i, j, k] * (level / measure), 0.02, "made")
        for i in range(8)
        for measure in [rotated_median(*ground[i])]
        for level in LEVELS.tolist()
        for j, direction in enumerate("xy")
        for k, floor in enumerate((1, 2))
    ]
    histories = replace(FloorHistories.of(own), axes=BOTH_AXES)
    given = assess(Inventory(LINES), Assessment(LAW, histories, LEVELS, "RotD50(pga)"))
    for name in ("overturned", "sideways"):
        np.testing.assert_array_equal(given[name].values, found[name].values)
    plain = assess(Inventory(LINES), Assessment(LAW, replace(histories, axes=""), LEVELS, "RotD50(pga)"))
    assert "sideways" not in plain
    one_way = FloorHistories.of([one for one in own if (one.floor, one.direction) != ("2", "x")])
    with pytest.raises(ValueError, match="floor 2, on which 'shelf' stands, needs histories in x and y"):
        assess(Inventory(LINES), Assessment(LAW, replace(one_way, axes=BOTH_AXES), LEVELS, "RotD50(pga)"))


def test_the_weak_axis_alone():
    long = Contents("long", tp.Block(0.3, 1.4, depth=0.5), floor=1, direction="y")
    weak = tp.motions.weak_axis(PAIRS, "random", 5)
    alone = assess(Inventory((long,)), Assessment(LAW, weak, LEVELS, "RotD50(pga)", FRAME))
    runs = [tp.motions.as_recorded(one, "h2") for one in TURNED]
    other = assess(Inventory((long,)), Assessment(LAW, runs, LEVELS, "RotD50(pga)", FRAME))
    np.testing.assert_array_equal(alone["overturned"], other["overturned"])
    assert "sideways" not in alone
    with pytest.raises(ValueError, match=r"'cabinet' must have a depth of at least 1\.6 times its width"):
        assess(Inventory(LINES), Assessment(LAW, weak, LEVELS, "RotD50(pga)", FRAME))
    with pytest.raises(ValueError, match="im must be a measure of both components"):
        assess(Inventory((long,)), Assessment(LAW, weak, LEVELS, "pga", FRAME))
    placed = placed_on_axes(Inventory((long,)), Shaking.of(FRAME, weak, None), [LAW])
    assert axes_notes(placed, placed, WEAK_AXIS) == [Fact("axis.weak_axis", WEAK_RATIO)]


def test_a_long_squat_piece_is_run_about_its_width():
    desk = Contents("desk", tp.Block(0.8, 0.75, depth=1.6), floor=0)
    deep = Contents("deep", tp.Block(0.9, 0.75, depth=1.2), floor=0)
    shaking = Shaking.of(None, TURNED, None)
    placed = placed_on_axes(Inventory((desk,)), shaking, [LAW])
    assert not placed.rows[0].both_axes
    notes = named(axes_notes(placed, Inventory((desk,)), BOTH_AXES))
    assert notes["axis.too_deep"] == notes["axis.direction_not_given"] == ("desk",)
    with pytest.raises(ValueError, match="'deep' in the direction of its depth"):
        placed_on_axes(Inventory((deep,)), shaking, [LAW])
    own = Contents("deep", deep.block, floor=0, e=0.5)
    assert placed_on_axes(Inventory((own,)), shaking, [LAW]).rows[0].both_axes


def lifted(strength):
    """Pairs with a vertical component, of which the greatest downward acceleration is so many times g."""
    h1, h2, up = (tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(4, seed) for seed in (1, 2, 3))
    down = -up.values.min(axis=1, keepdims=True)
    upward = up.copy(data=up.values / down * strength * G)
    return tp.motions.both_axes(tp.motions.join(h1, h2, upward), 0.3, vertical=True)


def test_vertical_shaking_on_the_ground():
    """Flags are those of planar runs in exact geometry with the vertical component, about each axis."""
    shaken = lifted(0.7)
    line = Contents("cabinet", CABINET, floor=0, direction="y")
    here = assess(Inventory((line,)), Assessment(LAW, shaken, [0.8, 1.2], "scale"))
    flags = []
    for name, block in (("h2", CABINET), ("h1", CABINET.across)):
        one = [tp.motions.as_recorded(array, name, vertical=True) for array in shaken]
        flags.append(tp.ida(block, LAW, one, [0.8, 1.2], "scale", screen=False)["overturned"].values[0, 0])
    np.testing.assert_array_equal(here["overturned"].values[0, 0], flags[0] | flags[1])
    level = tp.motions.both_axes(shaken[0].sel(component=["h1", "h2"]))
    flat = assess(Inventory((line,)), Assessment(LAW, level, [0.8, 1.2], "scale"))
    assert (flat["overturned"].values != here["overturned"].values).any()


def test_runs_that_leave_the_floor_count_along_the_width():
    rows = (
        Contents("cabinet", CABINET, floor=0, direction="x"),
        Contents("loaded", tp.Block(0.3, 1.4, cm_offset=0.02, depth=0.4, name="loaded"), floor=0, direction="x"),
    )
    flying = assess(Inventory(rows), Assessment(LAW, lifted(1.5), [1.0], "scale"))
    assert flying["overturned"].values.all()
    assert flying["front"].values.all()  # (of which side is not known: both ways it counts as the worse one)
    assert not flying["sideways"].values.any()
    with pytest.raises(ValueError, match="vertical shaking needs exact geometry"):
        assess(Inventory(rows), Assessment(tp.DiscreteDamping(), lifted(0.5), [1.0], "scale"))
    with pytest.raises(ValueError, match="a building answers horizontal shaking alone"):
        assess(Inventory(rows), Assessment(LAW, lifted(0.5), [1.0], "scale", FRAME))


STUDY = f"""
title = "Pairs in an inventory"
[[models]]
law = "housner"
{motions(8, 8, 0.02, 3)}component = "pair"
correlation = 0.3
azimuth = "random"
[building]
kind = "flexural-shear"
period_s = 0.6
storeys = 2
[performance]
inventory = "inventory.csv"
im = "RotD50(pga)"
levels = {{ values = [0.12, 0.18, 0.3], unit = "g" }}
replicates = 100
[hazard]
levels = [0.05, 0.15, 0.3, 0.6]
rates = [3e-2, 4e-3, 8e-4, 6e-5]
unit = "g"
"""
INVENTORY = """item,width_m,height_m,depth_m,round,floor,direction,count
cabinet,0.30,1.40,0.40,,1,x,2
shelf,0.28,1.30,0.28,,2,y,3
vase,0.12,0.50,,yes,2,,1
"""


def study(tmp_path, *changes, inventory=INVENTORY):
    return study_in(tmp_path, changed(STUDY, *changes), inventory=inventory)


def test_workers_make_the_same_pairs(tmp_path):
    plan = study(tmp_path)
    made = {digest(one) for one in motions_again(json.dumps(plan.configuration))}
    shaking = Shaking.of(FRAME, plan.motions, None)
    on_floors = shaking.on(shaking.supports(plan.inventory)[0])
    assert {digest(one) for one in on_floors} <= made


class TestSliding:
    """Lines whose coefficients lie below b/h along the width, between both, and above."""

    FRICTION = LognormalFriction(0.24, 0.3)
    EDGE = tp.Edge(0.02, 0.03, "foot")
    SLIDES = Contents(
        "analyser", replace(CABINET, edge=EDGE), 1, 2, direction="y", friction=FRICTION, kinetic_ratio=0.9
    )

    def by_hand(self, mu, reverse=False):
        """Greatest slips (level, motion) in the plane and along the width, and whether it slides: run by run."""
        width, depth = 0.3 / 1.4, 0.4 / 1.4
        ground = {name: of_component(name) for name in ("h1", "h2")}
        moved = {name: FRAME.floor_motions(one, [1]).isel(floor=0, drop=True) for name, one in ground.items()}
        friction = plane_table([PlaneSlider(mu, 0.9 * mu)]).friction
        peak, front, back = np.zeros((3, LEVELS.size, 8))
        slides = np.zeros((LEVELS.size, 8), bool)
        for i in range(8):
            factors = LEVELS / rotated_median(ground["h1"].values[i], ground["h2"].values[i])
            for k, factor in enumerate(factors.tolist()):
                along, across = ((-factor if reverse else factor) * moved[name][[i]] for name in ("h2", "h1"))
                pushed = np.hypot(np.minimum(np.abs(along.values) / G, width), across.values / G).max()
                slides[k, i] = mu < depth and pushed > mu
                if slides[k, i]:
                    dt = float(along["dt"][0])
                    shaking = along.values[0], across.values[0]
                    found = run_in_plane(friction, np.ones((1, 1)), shaking, None, dt)[0, 0]
                    peak[k, i], front[k, i], back[k, i] = (
                        found[SLIDES[f"slide_{name}"]] for name in ("peak", "forward", "backward")
                    )
        return peak, front, back, slides

    @pytest.mark.slow
    def test_lines_slide_in_the_plane(self):
        rows = Inventory((self.SLIDES, LINES[1]))
        options = {"building": FRAME, "polarity": "as recorded", "slipping": Slipping((0.01, 0.04))}
        found = assess(rows, Assessment(LAW, TURNED, LEVELS, "RotD50(pga)", **options))
        share, slips, off = np.zeros(3), np.zeros((2, 3)), []
        for mu in self.FRICTION.quantile((np.arange(20) + 0.5) / 20).tolist():
            peak, front, back, slides = self.by_hand(mu)
            share += slides.mean(axis=1) / 20
            slips += [(peak > one).mean(axis=1) / 20 for one in (0.01, 0.04)]
            off.append((front > 0.02) | (back > 0.03))
        np.testing.assert_allclose(found["slide_probability"].values[0], share, rtol=1e-12)
        np.testing.assert_allclose(found["slip_probability"].values[0], slips, rtol=1e-12)
        np.testing.assert_allclose(found["off_probability"].values[0], np.mean(off, axis=(0, 2)), rtol=1e-12)
        assert np.isnan(found["slide_probability"].values[1]).all()
        assert (share > 0.0).all()
        fell, _ = by_hand(CABINET, 1, "y")
        np.testing.assert_array_equal(found["fallen"].values[0, 0], np.array(off) | fell)
        below = self.FRICTION.below(np.array([0.3, 0.39, 0.4, 0.52]) / 1.4)
        assert float(found["slides_instead"][0]) == pytest.approx(below[0], rel=1e-12)
        assert float(found["friction_near_uplift"][0]) == pytest.approx(below[3] - below[2] + below[1] - below[0])
        np.testing.assert_allclose(found["gated_probability"].values[0, 0], (1.0 - below[0]) * fell.mean(axis=1))
        said = {fact.what: fact for fact in item_slide_notes(found, rows)}
        assert "sliding.in_plane" in said
        assert said["sliding.friction_near_uplift"].more["plane"]

    @pytest.mark.slow
    def test_both_ways_front_and_back_change_places(self):
        found = assess(Inventory((self.SLIDES,)), Assessment(LAW, TURNED, LEVELS, "RotD50(pga)", building=FRAME))
        off = []
        for mu in self.FRICTION.quantile((np.arange(20) + 0.5) / 20).tolist():
            ways = [self.by_hand(mu, reverse) for reverse in (False, True)]
            off.append([(front > 0.02) | (back > 0.03) for _, front, back, _ in ways])
        np.testing.assert_allclose(found["off_probability"].values[0], np.mean(off, axis=(0, 1, 3)), rtol=1e-12)

    def test_what_a_pedestal_does_is_of_both_components(self):
        """A slab that does not rock slides where both components exceed its friction."""
        slab = Contents("slab", tp.Block(0.8, 0.5, name="slab", depth=0.9), 1, direction="y", friction=self.FRICTION)
        vase = replace(self.SLIDES, label="vase", stands_on="slab", count=1, block=CABINET)
        found = assess(
            Inventory((slab, vase)), Assessment(tp.HousnerImpact(e=0.9), TURNED, LEVELS, "RotD50(pga)", FRAME)
        )
        ground = {name: of_component(name) for name in ("h1", "h2")}
        x, y = (FRAME.floor_motions(one, [1]).isel(floor=0, drop=True).values for one in ground.values())
        chance = np.zeros(LEVELS.size)
        for i in range(8):
            factors = LEVELS / rotated_median(ground["h1"].values[i], ground["h2"].values[i])
            chance += self.FRICTION.below(factors * np.hypot(x[i], y[i]).max() / G) / 8
        np.testing.assert_allclose(found["support_moves_probability"].values[1], chance, rtol=1e-12)
