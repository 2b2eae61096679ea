"""Soft beds: the moment against a bed of springs, the polygon against the curve, runs against an independent solver."""

import cmath
import math

import numpy as np
import pytest
from check_facts import numbers_in
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from shared_cases import shake

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.block import block_from, describe_block
from toppling.models.laws import oscillator_of
from toppling.models.oscillator import Oscillator
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace
from toppling.models.scenes.bed import polygon
from toppling.models.sides import sides

CABINET = tp.Block(0.4, 1.8, bed=tp.Bed(0.002))
SOFTEST = tp.Block(0.4, 1.8, bed=tp.Bed(0.0043))
FIRM = tp.Block(0.3, 1.5, bed=tp.Bed(2e-5))
ELASTIC = (
    tp.ViscousDamping(0.1),
    tp.DiscreteDamping(e=0.85, rest="soft"),
    tp.EnergyConsistent(e=0.85, rest="soft"),
)


def bed_moment(rotation: float) -> float:
    """Return the moment of a bed over m g b, at a rotation (>= 0) over that at uplift, theta_u.

    theta/(3 theta_u) up to the uplift, then 1 - (2/3) sqrt(theta_u/theta): 1/3 at 1, 2/3 at 4 (derived).
    """
    return rotation / 3.0 if rotation <= 1.0 else 1.0 - 2.0 / 3.0 / math.sqrt(rotation)


class Rocking:
    """A block on a bed, per unit moment of inertia, from the formulas alone: moment, dashpots, held damping."""

    def __init__(self, block: tp.Block, law: tp.models.Law, *, curve: bool = False) -> None:
        self.uplift = block.bed.settlement / block.b
        side, _ = sides(block, "bilinear", "h")
        self.q2, self.alpha, self.gain, self.law = side.q2, side.alpha, side.gain, law
        found = polygon(self.uplift / self.alpha)
        self.nodes = np.array([0.0, *found.rotations]) * self.alpha
        self.moments = np.array([0.0, *found.moments])
        self.balance = found.balance * self.alpha
        self.curve = curve
        self.stiffness = self.q2 * (self.alpha / (3.0 * self.uplift) - 1.0)

    def restoring(self, theta: float) -> float:
        size = abs(theta)
        moment = bed_moment(size / self.uplift) if self.curve else float(np.interp(size, self.nodes, self.moments))
        return math.copysign(1.0, theta) * self.q2 * (self.alpha * moment - size)

    def energy(self, theta: float) -> float:
        size = abs(theta)
        inside = self.nodes[self.nodes < size]
        at = np.append(inside, size)
        area = np.trapezoid(np.interp(at, self.nodes, self.moments), at)
        return float(self.q2 * (self.alpha * area - 0.5 * size**2))

    def dashpot(self, theta: float) -> float:
        """The viscous damping, constant over each chord: the mean of (theta_u/theta)^(3/2)."""
        c = 2.0 * self.law.zeta * math.sqrt(self.stiffness)
        k = int(np.searchsorted(self.nodes, abs(theta)))
        if k <= 1:
            return c
        start = self.nodes[k - 1]
        end = self.nodes[k] if k < self.nodes.size else self.balance
        at = np.linspace(start, end, 4001)
        return c * float(np.trapezoid((self.uplift / at) ** 1.5, at) / (end - start))

    def peak(self, record: np.ndarray, dt: float) -> tuple[float, bool]:
        """The peak rotation within the record, and whether the block passes pi/2 in it: DOP853 from node to node."""
        time = np.arange(record.size) * dt
        held = [self.dashpot(0.5 * (a + b)) for a, b in zip(self.nodes, [*self.nodes[1:], 2.0], strict=True)] if (
            isinstance(self.law, tp.ViscousDamping)
        ) else [0.0] * self.nodes.size  # fmt: skip
        edges = [*(-self.nodes[:0:-1]), *self.nodes[1:]]
        state, t, highest = np.zeros(2), 0.0, 0.0
        middle = len(edges) // 2
        at = middle  # (edges[at - 1] <= theta <= edges[at])
        while t < time[-1]:
            lower = edges[at - 1] if at > 0 else -0.5 * math.pi
            upper = edges[at] if at < len(edges) else 0.5 * math.pi
            c = held[abs(at - middle)]

            def rate(t, y, c=c):
                return [y[1], -self.restoring(y[0]) - c * y[1] - self.gain * np.interp(t, time, record)]

            def below(t, y, lower=lower):
                return y[0] - lower

            def above(t, y, upper=upper):
                return y[0] - upper

            def turn(t, y):
                return y[1]

            below.terminal = above.terminal = True
            below.direction, above.direction = -1.0, 1.0
            last = min(time[-1], (math.floor(t / dt + 1e-9) + 1) * dt)
            piece = solve_ivp(
                rate, (t, last), state, method="DOP853", rtol=1e-11, atol=1e-13, events=(below, above, turn)
            )
            turns = [abs(y[0]) for y in piece.y_events[2]]
            highest = max(highest, *np.abs(piece.y[0]), *turns)
            state, t = piece.y[:, -1].copy(), float(piece.t[-1])
            if piece.status != 1:
                continue
            down = piece.t_events[0].size > 0
            state[0] = lower if down else upper
            if abs(state[0]) >= 0.5 * math.pi:
                return 0.5 * math.pi, True
            at += -1 if down else 1
            if at == middle:
                held[0] = self.entered(abs(state[1]))
        return highest, False

    def entered(self, speed: float) -> float:
        """The damping of the zone from an inward crossing to the next."""
        if isinstance(self.law, tp.ViscousDamping):
            return self.dashpot(0.0)
        if isinstance(self.law, tp.DiscreteDamping):
            return (1.0 - self.law.e) * speed / (2.0 * self.uplift)
        edge = 0.5 * self.stiffness * self.uplift**2
        leaves = self.law.e**2 * (0.5 * speed**2 + edge) - edge
        return brentq(lambda c: self.leaving(c, speed) - math.sqrt(2.0 * max(leaves, 0.0)), 0.0, 100.0 * speed / edge)

    def leaving(self, c: float, speed: float) -> float:
        """The velocity at the far edge of an unforced crossing, from its exponentials; negative if it turns before."""
        root = cmath.sqrt(0.25 * c * c - self.stiffness)
        fast, slow = -0.5 * c - root, -0.5 * c + root
        b = (speed + fast * self.uplift) / (slow - fast)

        def motion(t):
            parts = (-self.uplift - b) * cmath.exp(fast * t), b * cmath.exp(slow * t)
            return (parts[0] + parts[1]).real, (fast * parts[0] + slow * parts[1]).real

        step = self.uplift / speed / 20.0
        for t in np.arange(2000) * step:
            theta, omega = motion(t)
            end = t
            if omega <= 0.0:
                end = brentq(lambda t: motion(t)[1], t - step, t, xtol=1e-16)
                theta = motion(end)[0]
                if theta < self.uplift:
                    return theta - self.uplift
            if theta >= self.uplift:
                return motion(brentq(lambda t: motion(t)[0] - self.uplift, t - step, end, xtol=1e-16))[1]
        return -self.uplift


def strips(ratio: float, number: int = 20_000) -> float:
    """The moment over m g b of a rigid base on strips without tension, at a rotation over that at uplift."""
    x = (np.arange(number) + 0.5) / number * 2.0 - 1.0  # over the half width; weight, stiffness and settlement 1

    def pressure(depth):
        return np.maximum(depth + ratio * x, 0.0)

    depth = brentq(lambda w: pressure(w).mean() - 1.0, -ratio - 2.0, 1.0 + ratio)
    return float((pressure(depth) * x).mean())


class TestMoment:
    @pytest.mark.parametrize(
        ("ratio", "moment"), [(1.0, 0.333333), (2.0, 0.528595), (4.0, 0.666667), (10.0, 0.789181), (100.0, 0.933333)]
    )
    def test_published_nodes(self, ratio, moment):
        assert bed_moment(ratio) == pytest.approx(moment, abs=5e-7)

    @pytest.mark.parametrize("ratio", [0.3, 1.0, 1.5, 4.0, 30.0])
    def test_strips_without_tension(self, ratio):
        assert bed_moment(ratio) == pytest.approx(strips(ratio), rel=2e-6)

    @pytest.mark.parametrize("uplift", [0.1, 0.05, 0.02, 5e-3, 1e-3, 1e-5, 1e-9])
    def test_polygon(self, uplift):
        """Its balance is that of the curve; its greatest moment and its energy at the balance are close to it."""
        found = polygon(uplift)
        assert found.balance == pytest.approx(
            brentq(lambda x: bed_moment(x / uplift) - x, 1.5 * uplift, 1.0, xtol=1e-15), rel=1e-12
        )
        block = tp.Block(0.4, 1.8, bed=tp.Bed(uplift * 0.2 * math.atan2(0.2, 0.9)))
        assert block.balances[0] == pytest.approx(found.balance * block.alpha, rel=1e-12)
        assert found.moments[-1] == pytest.approx(found.balance, rel=1e-13)
        assert list(found.moments) == sorted(found.moments)
        x = np.unique(np.concatenate([np.geomspace(uplift, found.balance, 100_001), found.rotations, [0.0]]))
        curve = np.array([bed_moment(one / uplift) for one in x]) - x
        straight = np.interp(x, (0.0, *found.rotations), (0.0, *found.moments)) - x
        assert straight.max() / curve.max() == pytest.approx(1.0, abs=0.012)
        assert np.trapezoid(straight, x) / np.trapezoid(curve, x) == pytest.approx(1.0, abs=1e-3)

    @pytest.mark.parametrize("block", [CABINET, SOFTEST, FIRM], ids=str)
    def test_regions_join(self, block):
        """Moments and potentials of neighbours agree at their edge; the row that falls holds the balance."""
        oscillator = tp.ViscousDamping(0.0).oscillator(block)
        own = Rocking(block, tp.ViscousDamping(0.0))
        assert len(oscillator.regions) == 15
        for region in oscillator.regions:
            for at in (region.lower, region.upper):
                if abs(at) > 1.5:
                    continue
                scale = own.q2 * own.alpha
                assert region.stiffness * at - region.offset == pytest.approx(own.restoring(at), abs=1e-12 * scale)
                potential = (0.5 * region.stiffness * at - region.offset) * at + region.potential
                assert potential == pytest.approx(own.energy(at), abs=1e-12 * scale * own.alpha)
        last = max(oscillator.regions, key=lambda region: region.upper)
        assert last.offset / last.stiffness == pytest.approx(own.balance, rel=1e-12)
        assert last.lower < own.balance < last.upper

    def test_rigid_limit(self):
        """A bed that hardly settles is the rigid floor: Housner's bilinear block loses e² at each impact."""
        law, rigid = tp.EnergyConsistent(e=0.9, rest="elastic"), tp.HousnerImpact(e=0.9, geometry="bilinear")
        bare = tp.Block(0.4, 1.8)
        wanted = tp.free_rocking(bare, rigid, 0.5 * bare.alpha, 8.0).peak_rotations.values[:4]
        errors = []
        for settlement in (1e-4, 1e-6, 1e-8):
            block = tp.Block(0.4, 1.8, bed=tp.Bed(settlement))
            peaks = tp.free_rocking(block, law, 0.5 * bare.alpha, 8.0).peak_rotations.values[:4]
            errors.append(np.abs(peaks / wanted - 1.0).max())
        assert errors[0] < 0.05
        assert errors[1] < 0.12 * errors[0]  # (as the root of the settlement)
        assert errors[2] < 0.12 * errors[1]


class TestRuns:
    @pytest.mark.slow
    @pytest.mark.parametrize("law", ELASTIC, ids=lambda law: law.law)
    @pytest.mark.parametrize("block", [CABINET, SOFTEST], ids=["2 mm", "4.3 mm"])
    def test_independent_solver(self, block, law):
        """Peaks within the record to 1e-8 of alpha; the same blocks fall."""
        rng = np.random.default_rng(11)
        oscillator, own = law.oscillator(block), Rocking(block, law)
        fell = 0
        for amplitude in (0.4, 1.2, 2.0, 3.5):
            record = amplitude * shake(rng, n=400)
            run = trace(oscillator, record, 0.01)
            peak, falls = own.peak(record, 0.01)
            assert falls == (run.results[0] == 1.0 and run.results[OF_ENGINE["overturning_time"]] <= 3.99)
            fell += falls
            if not falls:
                assert run.history[4, -1] == pytest.approx(peak, abs=1e-8 * block.alpha)
        assert fell < 4

    @pytest.mark.parametrize("law", ELASTIC, ids=lambda law: law.law)
    def test_mirror(self, law):
        record = 2.0 * shake(np.random.default_rng(3))
        one, other = (trace(law.oscillator(CABINET), sign * record, 0.01) for sign in (1.0, -1.0))
        np.testing.assert_array_equal(one.history[:2], -other.history[:2])
        assert one.results[1] == other.results[1]

    @pytest.mark.parametrize("law", ELASTIC, ids=lambda law: law.law)
    @pytest.mark.parametrize("block", [CABINET, SOFTEST, FIRM], ids=["2 mm", "4.3 mm", "0.02 mm"])
    def test_skips_and_lanes(self, block, law):
        """Skips, flags alone, and many runs at once give what single runs give."""
        rng = np.random.default_rng(8)
        factors = np.linspace(0.3, 9.0, 60)[None]
        share = 0.0
        for _ in range(5):
            record = 1.5 * shake(rng)
            plain = run_many([law.oscillator(block)], factors, record, 0.01, skip=False)
            quick = run_many([law.oscillator(block)], factors, record, 0.01)
            flags = run_many([law.oscillator(block)], factors, record, 0.01, flags_only=True)
            singles = [trace(law.oscillator(block), factor * record, 0.01).results for factor in factors[0]]
            np.testing.assert_array_equal(plain[0, :, 0], quick[0, :, 0])
            np.testing.assert_array_equal(plain[0, :, 0], flags[0, :, 0])
            np.testing.assert_array_equal(plain[0, :, 0], [one[0] for one in singles])
            np.testing.assert_allclose(np.median(np.abs(plain[0, :, 1] / quick[0, :, 1] - 1.0)), 0.0, atol=1e-12)
            share += plain[0, :, 0].mean() / 5.0
        assert 0.1 < share < 0.9

    @pytest.mark.parametrize(
        "law", [tp.ViscousDamping(0.0), tp.DiscreteDamping(e=1.0), tp.EnergyConsistent(e=1.0, rest="soft")]
    )
    def test_energy_is_kept_without_loss(self, law):
        run = tp.free_rocking(CABINET, law, 0.5 * CABINET.alpha, 400.0, dt=0.1)
        assert run.sizes["peak"] > 300
        np.testing.assert_allclose(run.peak_rotations.values, 0.5 * CABINET.alpha, rtol=1e-11)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("block", "w", "turning", "least", "most"),
        [
            (SOFTEST, 0.3, False, 0.996, 1.004),
            (CABINET, 2.0, False, 0.996, 1.004),
            (CABINET, 4.0, False, 0.996, 1.004),
            (FIRM, 2.0, False, 0.996, 1.004),
            (CABINET, 2.0, True, 1.0, 1.015),
            (CABINET, 4.0, True, 1.0, 1.02),
            (tp.Block(0.6, 1.4, bed=tp.Bed(0.002)), 4.0, True, 1.0, 1.045),
        ],
    )
    def test_critical_pulse(self, block, w, turning, least, most):
        """Half a sine overturns from an amplitude within 0.4 % of that with the curve instead of the polygon.

        `turning`: with the kinetic energy of a base that turns about its middle and moves up without inertia of its
        own, J = I_G + m h² + m b² (1 - sqrt(theta_u/theta))², the amplitude is lower by what the documentation says.
        """
        law = tp.ViscousDamping(0.0)
        own = Rocking(block, law, curve=True)
        q = math.sqrt(own.q2)
        length, unit = math.pi / (w * q), own.q2 * own.alpha / own.gain
        x = np.linspace(0.0, own.balance, 200_001)
        barrier = np.trapezoid([own.restoring(one) for one in x], x)

        def share(theta):  # of the moment of inertia about an edge, and its derivative
            if not turning:
                return 1.0, 0.0
            ratio = math.sqrt(own.uplift / max(abs(theta), own.uplift))
            edge, about = block.b**2, block.inertia * block.R**2
            by_theta = edge * (1.0 - ratio) * ratio**3 / own.uplift * math.copysign(1.0, theta)
            return (about - edge + edge * (1.0 - ratio) ** 2) / about, by_theta / about

        def falls_on_curve(amplitude):
            def rate(t, y):
                inertia, by_theta = share(y[0])
                push = own.gain * amplitude * unit * math.sin(w * q * t)
                return [y[1], (push - own.restoring(y[0]) - 0.5 * by_theta * y[1] ** 2) / inertia]

            end = solve_ivp(rate, (0.0, length), [0.0, 0.0], method="DOP853", rtol=1e-9, max_step=length / 200).y[:, -1]
            x = np.linspace(0.0, abs(end[0]), 2001)
            energy = 0.5 * share(end[0])[0] * end[1] ** 2 + np.trapezoid([own.restoring(one) for one in x], x)
            return abs(end[0]) > own.balance or energy > barrier

        time = np.linspace(0.0, length, 2001)

        def falls(amplitude):
            record = -amplitude * unit * np.sin(w * q * time)
            return trace(law.oscillator(block), record, time[1]).results[0] == 1.0

        def critical(overturns):
            low = next(one for one in np.arange(0.3, 8.0, 0.05) if overturns(one)) - 0.05
            high = low + 0.05
            for _ in range(9):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if overturns(middle) else (middle, high)
            return high

        assert least < critical(falls) / critical(falls_on_curve) < most


def apparent_restitution(block, law, rotation):
    """The square root of the share of energy that half a cycle of free rocking from a rotation keeps."""
    oscillator = oscillator_of(block, law)
    run = trace(oscillator, np.zeros(100_001), 0.01 / block.p, rotation, max_turning_points=1)

    def potential(at):
        region = oscillator.regions[oscillator.region_at(at, 0.0)]
        return region.inertia * ((0.5 * region.stiffness * at - region.offset) * at + region.potential)

    rest = potential(oscillator.balance)
    return math.sqrt((potential(run.turning_points[1, 0]) - rest) / (potential(rotation) - rest))


class TestDissipation:
    @pytest.mark.parametrize("release", [0.1, 0.3, 0.6, 0.8])
    def test_energy_consistent_keeps_its_share(self, release):
        law = tp.EnergyConsistent(e=0.9, rest="soft")
        assert apparent_restitution(CABINET, law, release * CABINET.alpha) == pytest.approx(0.9, abs=1e-9)
        assert apparent_restitution(CABINET, law, -release * CABINET.alpha) == pytest.approx(0.9, abs=1e-9)

    def test_others_depend_on_the_amplitude(self):
        """As measured in the documentation: a nominal e of 0.9, and 5 % of critical damping."""
        for law, wanted in (
            (tp.DiscreteDamping(e=0.9, rest="soft"), (0.9167, 0.9028, 0.9018)),
            (tp.ViscousDamping(0.05), (0.8717, 0.9176, 0.9278)),
        ):
            found = [apparent_restitution(CABINET, law, share * CABINET.alpha) for share in (0.1, 0.4, 0.8)]
            np.testing.assert_allclose(found, wanted, atol=5e-5)

    def test_small_rocking_is_that_of_a_damped_oscillator(self):
        zeta = 0.05
        found = apparent_restitution(CABINET, tp.ViscousDamping(zeta), 0.5 * 0.002 / CABINET.b)
        assert found == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), rel=1e-10)


class TestWall:
    GAP, FACTOR = 0.05, 0.4

    def oscillator(self, law: tp.models.Law) -> Oscillator:
        wall = tp.Wall(self.GAP, restitution=self.FACTOR)
        return law.oscillator(tp.Block(0.4, 1.8, bed=tp.Bed(0.002), wall=wall))

    def test_free_decay_in_closed_form(self):
        """Each crossing leaves e² of the energy, each strike r² of that of the motion."""
        e, law = 0.9, tp.EnergyConsistent(e=0.9, rest="soft")
        own = Rocking(CABINET, law)
        release, at_wall = 0.5 * CABINET.alpha, self.GAP / 1.8
        record = np.zeros(3000)
        turns = trace(self.oscillator(law), record, 0.005, release, max_turning_points=6).turning_points[1]
        energy, wanted = own.energy(release), []
        while len(wanted) < 4:
            energy *= e**2
            if energy > own.energy(at_wall):
                energy = self.FACTOR**2 * (energy - own.energy(at_wall)) + own.energy(at_wall)
            else:
                wanted.append(-brentq(lambda x: own.energy(x) - energy, 0.0, at_wall, xtol=1e-15))  # noqa: B023
            energy *= e**2
            wanted.append(brentq(lambda x: own.energy(x) - energy, 0.0, release, xtol=1e-15))  # noqa: B023
        np.testing.assert_allclose(turns[:4], wanted[:4], rtol=1e-9)

    def test_held_at_the_wall_and_no_fall_through_it(self):
        """Strong shaking throws the block against its wall; it falls to the front or not at all."""
        oscillator = self.oscillator(tp.ViscousDamping(0.05))
        rng = np.random.default_rng(4)
        results = [trace(oscillator, 3.0 * shake(rng), 0.01).results for _ in range(20)]
        assert min(one[OF_ENGINE["direction"]] for one in results) >= 0.0
        assert max(one[OF_ENGINE["peak_back"]] for one in results) == pytest.approx(self.GAP / 1.8, rel=1e-14)
        assert sum(one[0] for one in results) > 0

    def test_wide_gap_is_the_free_block(self):
        law, record = tp.ViscousDamping(0.05), 2.0 * shake(np.random.default_rng(6))
        far = law.oscillator(tp.Block(0.4, 1.8, bed=tp.Bed(0.002), wall=tp.Wall(4.0)))
        one, other = trace(law.oscillator(CABINET), record, 0.01), trace(far, record, 0.01)
        np.testing.assert_array_equal(one.history[:2], other.history[:2])


def test_described_and_labelled():
    assert numbers_in(CABINET.label) == [0.4, 1.8, 2]
    assert not CABINET.sided
    assert block_from(describe_block(CABINET)) == tp.Block(0.4, 1.8, name=CABINET.label, bed=tp.Bed(0.002),
                                                           cm_height=0.9, inertia_factor=4.0 / 3.0)  # fmt: skip
    frequency = math.sqrt(tp.ViscousDamping(0.0).oscillator(CABINET).regions[7].stiffness) / (2.0 * math.pi)
    inertia = 4.0 / 3.0 * CABINET.R**2  # of the base on springs: k (2 b³/3) - m g h over it
    springs = G / (2.0 * CABINET.b * 0.002) * 2.0 * CABINET.b**3 / 3.0 - G * CABINET.h
    assert frequency == pytest.approx(math.sqrt(springs / inertia) / (2.0 * math.pi), rel=2e-3)


def test_refused(refusal):
    refusal()
