"""No action adds energy: unforced motion of random scenes from random states, its energy by hand at every sample."""

import math

import numpy as np
import pytest
from scene_draws import case_of, scene_of

from toppling.models.engine.tables import HISTORY_OMEGA, HISTORY_THETA
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import trace
from toppling.models.sides import sides

DT, SAMPLES = 0.02, 100
QUIET = np.zeros(SAMPLES)
TIME = DT * np.arange(SAMPLES)
ROUNDING = 1e-11
"""Of the largest energy, by which the energy may seem to grow between two samples."""


def parts_of(block, geometry):
    """Of front and back: inertia over mass, q², alpha, and the arm of the restraint (0: none)."""
    hold = block.restraint
    arms = (0.0, 0.0) if hold is None else (hold.front or 0.0, hold.back or 0.0)
    return [(side.inertia, side.q2, side.alpha, arm) for side, arm in zip(sides(block, geometry), arms, strict=True)]


def energy_of(block, geometry, theta, omega, intact):
    """Energy over mass, J/kg, from the block alone: weight and restraint lift it, and it moves about one corner."""
    hold = block.restraint
    energy = np.zeros(np.shape(theta))
    for (inertia, q2, alpha, arm), here, y in zip(
        parts_of(block, geometry), (theta > 0.0, theta <= 0.0), (theta, -theta), strict=True
    ):
        level = q2 * (alpha * y - 0.5 * y * y)
        if geometry == "exact":
            level = q2 * (np.cos(alpha - y) - math.cos(alpha))
        total = inertia * (0.5 * omega * omega + level)
        if arm and not hold.rigid:
            stretch = np.maximum(0.0, arm * y - hold.slack)
            stored = hold.count * (hold.preload * arm * y + 0.5 * hold.stiffness * stretch**2)
            total = total + np.where(intact, stored / block.mass, 0.0)
        energy = np.where(here, total, energy)
    return energy


def start(rng, block, geometry):
    """A rotation between walls and ruptures, mostly before the saddle, and a velocity of that scale."""
    hold, wall = block.restraint, block.wall
    reach = []
    for (_, _, alpha, arm), gap in zip(
        parts_of(block, geometry), (wall and wall.front_gap, wall and wall.gap), strict=True
    ):
        most = min(1.2 * alpha, 1.5)
        if gap is not None:
            most = min(most, 0.999 * wall.contact(gap, block.height, geometry == "exact"))
        if arm and not hold.rigid and hold.strength < math.inf:
            most = min(most, (hold.slack + (hold.strength - hold.preload) / hold.stiffness) / arm)
        reach.append(most)
    theta = rng.uniform(-reach[1], reach[0])
    _, q2, alpha, _ = parts_of(block, geometry)[0 if theta > 0.0 else 1]
    return theta, rng.choice([0.0, rng.normal()]) * math.sqrt(q2) * alpha


def growth(block, law, run):
    """The largest growth of the energy from one sample to the next and its loss in all, over the largest energy."""
    theta, omega = run.history[HISTORY_THETA], run.history[HISTORY_OMEGA]
    broken = run.results[OF_ENGINE["rupture_time"]]
    energy = energy_of(block, law.geometry, theta, omega, np.isnan(broken) | (broken > TIME))
    scale = np.abs(energy).max()
    if scale == 0.0:
        return 0.0, 0.0
    return np.diff(energy).max() / scale, (energy[0] - energy[-1]) / scale


def housner_case(rng):
    while True:
        case = case_of(*scene_of(rng.integers(2**32)))
        if case.law.law == "housner":
            return case


def check(seed, scenes, states):
    """The largest growth over random scenes, and how many runs lost energy."""
    rng = np.random.default_rng(seed)
    losing = 0
    for _ in range(scenes):
        case = housner_case(rng)
        oscillator = case.law.oscillator(case.block)
        for _ in range(states):
            at = start(rng, case.block, case.law.geometry)
            grown, lost = growth(case.block, case.law, trace(oscillator, QUIET, DT, *at))
            assert grown <= ROUNDING, (case, at)
            losing += lost > 1e-6
    return losing


def test_no_action_adds_energy():
    assert check(1, 40, 25) > 500


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 6))
def test_no_action_adds_energy_in_25_000_runs(seed):
    assert check(seed, 500, 50) > 12_500


def test_without_losses_the_energy_stays():
    """e = 1 at the base and the wall, a restraint that does not break: an energy that is wrong would show, too."""
    rng = np.random.default_rng(7)
    for _ in range(200):
        scene, record, dt = scene_of(rng.integers(2**32))
        hold = scene.restraint
        if scene.law != "housner" or (hold is not None and math.isinf(hold.stiffness)):
            continue
        if hold is not None:
            scene = scene._replace(restraint=hold._replace(strength=math.inf))
        case = case_of(scene._replace(restitution=1.0, wall_restitution=1.0), record, dt)
        gap = case.block.wall and (case.block.wall.gap, case.block.wall.front_gap)
        if gap and min(one for one in gap if one is not None) < 1e-3:
            continue  # (it would bounce thousands of times)
        at = start(rng, case.block, case.law.geometry)
        run = trace(case.law.oscillator(case.block), QUIET, DT, *at)
        if run.results[OF_ENGINE["overturned"]] == 0.0:
            grown, lost = growth(case.block, case.law, run)
            assert abs(grown) <= ROUNDING
            assert abs(lost) <= 1e-9
