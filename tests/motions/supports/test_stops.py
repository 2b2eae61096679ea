"""Stops of isolated platforms: closed forms of a strike, integration of high order between events, what is said."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import toppling as tp
from toppling.motions import Isolator, IsolatorStrikes
from toppling.motions.kernels.pendulum import pendulum_response
from toppling.motions.kernels.stops import stopped_response
from toppling.motions.supports.stops import Stops

G = 9.80665
FREE = (0.0, 0.0, 0.0, math.inf, 0.0)
"""A platform without a spring: damping, initial stiffness, that after yielding, yield displacement, force."""


def stopped(ground, dt, spring, stop, start=(0.0, 0.0), parts=1):
    displacement, acceleration = np.empty((2, (len(ground) - 1) * parts + 1))
    found = stopped_response(np.asarray(ground, float), dt, parts, spring, stop, start, displacement, acceleration)
    return displacement, acceleration, *found


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_undamped_strike(side):
    """Contact speed v at a negligible spring: depth v/omega, duration pi/omega, peak acceleration v omega."""
    stops, v = Stops(0.1, 5.0, 1.0), 0.8
    omega = 2 * math.pi * 5.0
    assert stops.contact == pytest.approx(math.pi / omega, rel=1e-15)
    steps = 2000  # of which 1000 in contact
    start = (side * (0.1 - v * 1e-6), side * v)  # (the contact begins after a microsecond)
    u, a, strikes, peak = stopped(np.zeros(steps + 1), stops.contact / 1000, FREE, stops.over_mass, start)
    assert np.abs(u).max() - 0.1 == pytest.approx(v / omega, rel=1e-5)
    assert peak == np.abs(a).max() == pytest.approx(v * omega, rel=1e-5)
    assert strikes == 1
    assert (a != 0.0).sum() == 1000
    assert u[-1] - u[-2] == pytest.approx(-side * v * stops.contact / 1000, rel=1e-10)


@pytest.mark.parametrize("restitution", [0.15, 0.3, 0.6, 0.9, 0.999])
def test_a_stop_keeps_its_restitution(restitution):
    """What leaves the stop has e times the velocity, after 2 arccos(zeta)/(omega_d), and was never pulled."""
    stops = Stops(0.1, 5.0, restitution)
    h = stops.contact / 500
    u, a, strikes, _ = stopped(np.zeros(1001), h, FREE, stops.over_mass, (0.1 - 1e-12, 1.0))
    assert (u[-1] - u[-2]) / h == pytest.approx(-restitution, rel=1e-9)
    assert (a <= 0.0).all()
    assert strikes == 1
    assert abs(int((a != 0.0).sum()) - 500) <= 1


def reference(ground, dt, spring, stop):
    """Displacements at the samples, and times of contact: Runge-Kutta of order 8 from event to event."""
    damping, initial, after, yields, slip = spring
    clearance, hard, viscous = stop
    u, v, plastic, flow, contact = 0.0, 0.0, 0.0, 0, 0
    found, strikes = [0.0], 0
    for first, last in zip(ground, ground[1:], strict=False):
        t = 0.0

        def acceleration(t, u, first=first, last=last):
            return first + (last - first) * t / dt

        while t < dt:
            pushed = contact * max(0.0, contact * u - clearance) * hard
            if yields == 0.0 and flow == 0:
                fine = t + np.linspace(0.0, dt - t, 20_001)
                pull = acceleration(fine, u) + after * u + pushed
                over = np.flatnonzero(np.abs(pull) > slip)
                if not over.size:
                    break
                t, flow = fine[over[0]], -int(np.sign(pull[over[0]]))

            def slope(t, y, flow=flow, contact=contact, plastic=plastic):
                own = (
                    after * y[0] + slip * flow
                    if flow or yields == 0.0
                    else initial * y[0] - (initial - after) * plastic
                )
                force = own + damping * y[1] + acceleration(t, y[0])
                if contact:
                    force += contact * (hard * (contact * y[0] - clearance) + viscous * contact * y[1])
                return [y[1], -force]

            def sprung(t, y, flow=flow, plastic=plastic):
                return abs(y[0] - plastic) - yields - 1e-14 if flow == 0 else -flow * y[1] - 1e-13

            def pushes(t, y, contact=contact):
                side = contact or math.copysign(1.0, y[0])
                deep = hard * (side * y[0] - clearance)
                force = deep + viscous * side * y[1]
                return -force - 1e-12 if contact else min(deep, force) - 1e-12

            for event in (sprung, pushes):
                event.terminal, event.direction = True, 1.0
            run = solve_ivp(
                slope, (t, dt), [u, v], "DOP853", events=[sprung, pushes], rtol=1e-12, atol=1e-13, max_step=dt / 3
            )
            t, (u, v) = run.t[-1], run.y[:, -1]
            if run.t_events[1].size:
                strikes += contact == 0
                contact = 0 if contact else int(math.copysign(1, u))
            elif run.t_events[0].size:
                if flow == 0:
                    flow = 1 if u > plastic else -1
                else:
                    plastic, flow = (u - flow * yields, 0)
                    if yields == 0.0:
                        v = 0.0
                        contact = int(math.copysign(1, u)) if abs(u) > clearance else 0
        found.append(u)
    return np.array(found), strikes


@pytest.mark.parametrize(
    ("spring", "restitution"),
    [
        ((2 * 0.1 * 2.5, 2.5**2, 2.5**2, math.inf, 0.0), 0.4),
        ((0.0, 2.5**2 + 0.03 * G / 0.005, 2.5**2, 0.005, 0.03 * G), 0.6),
        ((0.0, G / 1.5, G / 1.5, 0.0, 0.04 * G), 1.0),
        ((0.0, G / 1.5, G / 1.5, 0.0, 0.04 * G), 0.3),
    ],
    ids=["linear", "bilinear", "pendulum", "damped pendulum"],
)
def test_another_integrator(spring, restitution):
    """Displacements and strikes under shaking that drives the platform from stop to stop."""
    time = np.arange(151) * 0.02
    ground = 4.0 * np.sin(2 * np.pi * time / 1.1) * np.minimum(time, 1.0)
    stop = Stops(0.06, 4.0, restitution).over_mass
    ours, _, strikes, _ = stopped(ground, 0.02, spring, stop)
    theirs, other = reference(ground, 0.02, spring, stop)
    assert strikes == other >= 3
    # (the pendulum's start from rest is found on a grid there)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 if spring[3] else 1e-7)
    fine = stopped(ground, 0.02, spring, stop, parts=7)
    np.testing.assert_allclose(fine[0][::7], ours, rtol=0, atol=1e-11)


def test_far_stops_change_nothing():
    floor = tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(2, seed=5)
    far = {"clearance": 50.0, "stop_frequency": 2.0}
    for make in (
        lambda **more: Isolator.bilinear(2.5, 0.02, **more),
        lambda **more: Isolator.pendulum(1.5, 0.02, **more),
        lambda **more: Isolator.linear(2.0, 0.1, **more),
    ):
        held = make(**far).motions(floor)
        np.testing.assert_allclose(held, make().motions(floor), rtol=0, atol=1e-10)
        assert (held["strikes"] == 0).all()
        assert (held["strike_acceleration"] == 0.0).all()


def test_a_pendulum_that_rests_behind_a_stop_of_no_stiffness():
    """A stop of next to no stiffness leaves the sines of the pendulum, which it begins and ends contact within."""
    ground = np.concatenate([[0.0], 3.0 * np.random.default_rng(2).standard_normal(200)])
    plain = np.empty((2, 201))
    pendulum_response(ground, 0.02, 1, math.sqrt(G / 1.2), 0.03 * G, 0.0, *plain)
    ours = stopped(ground, 0.02, (0.0, G / 1.2, G / 1.2, 0.0, 0.03 * G), (0.01, 1e-9, 0.0))
    np.testing.assert_allclose(ours[:2], plain, rtol=0, atol=1e-9)


def test_strikes_are_counted_and_contacts_have_samples_enough():
    floor = tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(3, seed=5)
    isolator = Isolator.pendulum(1.5, 0.03, clearance=0.02, stop_frequency=60.0, stop_restitution=0.5)
    with pytest.warns(IsolatorStrikes, match=r"strikes its stops, 0.02 m away, under 3 of 3 motions \(\d+ strikes, up"):
        top = isolator.motions(floor)
    assert float(top["dt"][0]) <= isolator.stops.contact / 20.0
    assert top["strikes"].dims == ("motion",)
    assert (top["strikes"] > 0).all()
    assert bool(top["own_level"].all())
    np.testing.assert_array_equal(top["strike_acceleration"], np.abs(top).max("time"))
    assert (top["support_displacement"] > 0.02).all()
    free = Isolator.pendulum(1.5, 0.03, clearance=0.02)
    with pytest.warns(IsolatorStrikes, match="strikes are not modelled"):
        assert "strikes" not in free.motions(floor).coords


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"stop_frequency": 5.0}, "stop_frequency needs a clearance"),
        ({"clearance": 0.1, "stop_restitution": 0.5}, "stop_restitution needs a stop_frequency"),
        ({"clearance": 0.1, "stop_frequency": 0.0}, "stop_frequency must be"),
        (
            {"clearance": 0.1, "stop_frequency": 1e-9},
            "stop_frequency must be finite and >= 0.01 .* got 1e-09",
        ),
        ({"clearance": 0.1, "stop_frequency": 0.3}, "stop_frequency must be at least that of the isolator, 0\\.[45]"),
        ({"clearance": 0.1, "stop_frequency": 300.0}, "contact of at least 2 ms, 20 samples of 0.1 ms, got 1.5 ms"),
        ({"clearance": 0.1, "stop_frequency": 5.0, "stop_restitution": 0.1}, "stop_restitution must be"),
        ({"clearance": 0.1, "stop_frequency": 5.0, "stop_restitution": 1.1}, "stop_restitution must be"),
        ({"clearance": -0.1}, "clearance must be"),
        ({"clearance": math.nan}, "clearance must be finite"),
    ],
)
def test_what_is_refused(options, said):
    for make in (
        lambda **more: Isolator.pendulum(1.5, 0.05, **more),
        lambda **more: Isolator.bilinear(2.0, 0.05, **more),
        lambda **more: Isolator.linear(2.0, 0.05, **more),
    ):
        with pytest.raises(ValueError, match=said):
            make(**options)
