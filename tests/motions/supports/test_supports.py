"""Benches and isolators: closed forms, reference values, another integrator, and what analyses make of them."""

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import toppling as tp
from toppling.motions import Isolator, IsolatorStrikes, Support
from toppling.motions.kernels.pendulum import pendulum_response

G = 9.80665
TIME = np.arange(1001) * 0.01
SHAKING = 3.0 * (np.sin(2 * np.pi * TIME / 0.9) + 0.6 * np.sin(2 * np.pi * TIME / 0.37 + 1.0))
SHAKING *= np.exp(-(((TIME - 5.0) / 3.0) ** 2))
SHAKING[0] = 0.0


def pendulum(ground, dt, radius, friction, start=0.0, parts=1):
    displacement, acceleration = np.empty((2, (len(ground) - 1) * parts + 1))
    events = pendulum_response(
        np.asarray(ground, float), dt, parts, math.sqrt(G / radius), friction * G, start, displacement, acceleration
    )
    return displacement, acceleration, events


def shaking(values, dt):
    return tp.motions.from_array(values, dt, labels=["shaking"])


@pytest.mark.parametrize(
    ("frequency", "ratio"), [(1.0, 1.00699283), (5.0, 1.20990860), (10.0, 3.23380606), (12.0, 16.69663972)]
)
def test_transmissibility_of_a_bench(frequency, ratio):
    """The formula's ratios in the steady state of a run, to what linear interpolation of a sine loses."""
    bench = Support(12.0, 0.03)
    dt = 1.0 / frequency / 200.0
    time = np.arange(int(12.0 / dt)) * dt
    top = bench.motions(shaking(np.sin(2 * np.pi * frequency * time), dt))
    assert float(np.abs(top).isel(time=slice(-400, None)).max()) == pytest.approx(ratio, rel=1e-3)


def test_a_linear_isolator_is_such_a_support():
    floor = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(2, seed=3)
    building = tp.motions.Building.from_storeys([1.0], [(2 * np.pi / 2.5) ** 2], 0.1)
    with warnings.catch_warnings(action="ignore"):
        other = building.floor_motions(floor, floors=[1]).isel(floor=0)
    np.testing.assert_allclose(Isolator.linear(2.5, 0.1).motions(floor), other, rtol=0, atol=1e-12)


def test_a_pendulum_let_go():
    """Turning points fall by 2 mu R every pi sqrt(R/g); it rests where the friction holds it."""
    radius, friction = 1.5, 0.05
    half = math.pi * math.sqrt(radius / G)
    displacement, acceleration, events = pendulum(np.zeros(20_001), half / 10_000, radius, friction, 0.2)
    assert half == pytest.approx(1.2286697455, abs=1e-10)
    assert displacement[10_000] == pytest.approx(-(0.2 - 2 * friction * radius), abs=1e-12)
    assert displacement[-1] == pytest.approx(-0.05, abs=1e-12)
    assert acceleration[-1] == 0.0
    assert events == 2
    far = pendulum(np.zeros(100_001), half / 10_000, radius, friction, 1.0)[0]
    turns = far[::10_000]
    np.testing.assert_allclose(np.abs(turns[:7]), 1.0 - 0.15 * np.arange(7), atol=1e-11)


def test_a_pendulum_under_a_motion():
    displacement, acceleration, _ = pendulum(SHAKING, 0.01, 1.5, 0.05)
    assert np.abs(displacement).max() == pytest.approx(0.0800126148, abs=6e-11)
    assert displacement[-1] == pytest.approx(0.0078676264, abs=6e-11)
    assert np.abs(acceleration).max() == pytest.approx(1.01277095, abs=6e-9)
    # (samples between those of the motion change nothing)
    fine = pendulum(SHAKING, 0.01, 1.5, 0.05, parts=7)
    np.testing.assert_allclose(fine[0][::7], displacement, rtol=0, atol=1e-13)


def test_the_balance_of_energy_of_a_pendulum():
    """Work of the ground = kinetic + potential + friction, by fine sums of the exact states."""
    parts, dt = 200, 0.01
    u, acceleration, _ = pendulum(SHAKING, dt, 1.5, 0.05, parts=parts)
    step = dt / parts
    ground = np.interp(np.arange(u.size) * step, TIME, SHAKING)
    v = np.gradient(u, step)
    work = -np.sum(0.5 * (ground[1:] + ground[:-1]) * np.diff(u))
    lost = 0.05 * G * np.abs(np.diff(u)).sum()
    assert work == pytest.approx(0.5 * v[-1] ** 2 + 0.5 * G / 1.5 * u[-1] ** 2 + lost, rel=1e-5)
    assert np.abs(acceleration).max() <= G / 1.5 * np.abs(u).max() + 0.05 * G + 1e-9


@pytest.mark.slow
def test_a_bilinear_isolator_against_another_integrator():
    isolator = Isolator.bilinear(period=2.5, strength=0.06, yield_displacement=0.01)
    top = isolator.motions(shaking(SHAKING, 0.01))
    after = (2 * np.pi / 2.5) ** 2
    force = 0.06 * G
    # Q with a smooth (Bouc-Wen) loop of a high power tends to the bilinear one

    def slope(t, y):
        z = y[2]
        rate = y[1] * (1.0 - (abs(z) ** 60 if y[1] * z > 0.0 else 0.0)) / 0.01
        return [y[1], -np.interp(t, TIME, SHAKING) - after * y[0] - force * z, rate]

    found = solve_ivp(slope, (0.0, 10.0), [0.0] * 3, t_eval=TIME, rtol=1e-9, atol=1e-11, max_step=0.01)
    other = -after * found.y[0] - force * found.y[2]
    np.testing.assert_allclose(top.values[0], other, rtol=0, atol=0.02)
    assert top["support_displacement"].item() == pytest.approx(np.abs(found.y[0]).max(), rel=0.02)


def test_a_stiff_support_moves_with_its_floor():
    floor = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
    stiff = Support(frequency=900.0, damping=0.9).motions(floor)
    np.testing.assert_allclose(stiff, floor, rtol=0, atol=2e-3 * float(np.abs(floor).max()))
    held = Isolator.pendulum(2.0, 0.9).motions(floor)
    assert (held["support_displacement"] == 0.0).all()
    np.testing.assert_allclose(held.values[:, ::10], floor.values, rtol=0, atol=1e-12)


def test_floors_keep_their_labels():
    floor = tp.motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
    with warnings.catch_warnings(action="ignore"):
        floors = tp.motions.Building.flexural_shear(0.8, storeys=3).floor_motions(floor, floors=[1, 3])
    top = Support(8.0).motions(floors)
    assert top.dims == ("motion", "floor", "time")
    assert top["support_displacement"].dims == ("motion", "floor")
    assert [one.label for one in tp.motions.records(top)] == [one.label for one in tp.motions.records(floors)]
    alone = Support(8.0).motions(floors.isel(floor=1))
    np.testing.assert_array_equal(top.isel(floor=1), alone)


def test_analyses_scale_benches_and_no_isolators():
    floor = tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(3)
    block, law = tp.Block(0.1, 0.5), tp.EnergyConsistent()
    bench = Support(6.0, 0.03).motions(floor)
    found = tp.ida(block, law, bench, [1.0, 4.0], ground=floor, screen=False)
    np.testing.assert_array_equal(
        found["overturned"].values[0, 0, 1],
        tp.ida(block, law, Support(6.0, 0.03).motions(tp.motions.scale_to(floor, 4.0)), [1.0], "scale", screen=False)[
            "overturned"
        ].values[0, 0, 0],
    )
    isolated = Isolator.bilinear(2.0, 0.05).motions(floor, factor=2.0)
    assert "times 2" in str(isolated["source"].values[0])
    two = Isolator.bilinear(2.0, 0.05).motions(2.0 * floor.assign_attrs(floor.attrs))
    np.testing.assert_array_equal(isolated, two)


def test_strikes_are_said():
    floor = tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(3)
    with pytest.warns(IsolatorStrikes, match="would strike its stops, 0.001 m away, under 3 of 3 motions"):
        Isolator.pendulum(1.5, 0.03, clearance=1e-3).motions(floor)


def test_a_heavy_block_where_that_is_accepted():
    floor = tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(1)
    np.testing.assert_array_equal(
        Support(5.0, mass_ratio=0.5, one_way=True).motions(floor), Support(5.0, mass_ratio=0.0).motions(floor)
    )
    pair = tp.motions.both_axes(tp.motions.SiteBasedScenario(magnitude=6.5, distance=20e3, vs30=620.0).sample_pairs(1))
    pair = pair[0] if isinstance(pair, list) else pair
    with pytest.raises(ValueError, match="one horizontal component"):
        Support(5.0).motions(pair)


@pytest.mark.parametrize("seed", range(3))
def test_a_pendulum_in_tiny_steps(seed):
    """Random shaking, stops at samples among them: a loop in steps of 20 µs with the rule of sticking written out."""
    random = np.random.default_rng(seed)
    ground = np.concatenate([[0.0], 2.0 * np.convolve(random.standard_normal(100), np.ones(3) / 3, "same")])
    ours = pendulum(ground, 0.02, 1.2, 0.04)[0]
    inner, h = 1000, 0.02 / 1000
    u = v = 0.0
    theirs = [0.0]
    for first, last in zip(ground, ground[1:], strict=False):
        for k in range(inner):
            a = first + (last - first) * (k + 0.5) / inner
            pull = a + G / 1.2 * u
            if v == 0.0 and abs(pull) <= 0.04 * G:
                continue
            side = math.copysign(1.0, v) if v != 0.0 else -math.copysign(1.0, pull)
            new = v - h * (pull + 0.04 * G * side)
            u += 0.5 * h * (v + new)
            v = 0.0 if new * side < 0.0 else new
        theirs.append(u)
    assert np.abs(ours).max() > 0.005
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=2e-5)


def test_refused(refusal):
    refusal()
