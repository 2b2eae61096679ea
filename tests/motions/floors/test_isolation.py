"""Buildings on isolators: isolators alone, dense matrices, an integration from event to event, and what is refused."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from yielding_reference import reference

import toppling as tp
from toppling.motions import Building, Isolator, Yielding
from toppling.motions.floors.isolation import FASTEST

G = 9.80665
LEAD = Isolator.bilinear(2.5, 0.05, 0.008)
SOFT = Isolator.linear(2.0, 0.15)


def shaking(number=2, factor=1.0):
    return factor * tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(number, seed=8)


@pytest.mark.slow
@pytest.mark.parametrize("isolator", [LEAD, SOFT])
def test_a_building_without_mass_leaves_the_isolator_alone(isolator):
    """The slab moves as the platform of the same isolator, to rounding; so do its isolators."""
    ground = shaking()
    building = Building.isolated(isolator, 1e6, [1e-6, 1e-6], [1e-3, 1e-3])
    floors = building.floor_motions(ground, [0])
    top = isolator.motions(ground)
    np.testing.assert_allclose(floors.isel(floor=0), top, rtol=0, atol=1e-9)
    # (that of the platform is the greatest at the samples)
    np.testing.assert_allclose(floors["isolator_displacement"], top["support_displacement"], rtol=1e-3)


@pytest.mark.parametrize("isolator", [LEAD, SOFT])
def test_a_rigid_building_tends_to_its_isolator(isolator):
    """Every floor is the platform of the same isolator and whole weight, but for ringing where the isolator yields."""
    ground = shaking(1)
    top = isolator.motions(ground).values
    errors = []
    for period in (0.048, 0.012, 0.003):
        mass = np.full(2, 2e5)
        plain = Building.from_storeys(mass, [1e9, 1e9])
        stiffness = np.full(2, 1e9) * (float(plain.periods[0]) / period) ** 2
        floors = Building.isolated(isolator, 3e5, mass, stiffness).floor_motions(ground)
        errors.append(float(np.abs(floors.values - top[:, None]).max() / np.abs(top).max()))
    assert errors[2] < 5e-3
    assert errors[2] < errors[1] / 2.0 < errors[0] / 4.0


def chain(isolation, masses, stiffnesses, ratio):
    """Matrices of mass, damping and stiffness of a slab and storeys, dense."""
    m = np.append(isolation[0], masses)
    k = np.append(isolation[1], stiffnesses)
    b = np.eye(m.size) - np.eye(m.size, k=-1)
    fixed = np.eye(len(masses)) - np.eye(len(masses), k=-1)
    stiff = fixed.T @ np.diag(stiffnesses) @ fixed / np.sqrt(np.outer(masses, masses))
    omega = math.sqrt(np.linalg.eigvalsh(stiff)[0])
    c = np.append(isolation[2], 2.0 * ratio / omega * np.asarray(stiffnesses))
    return np.diag(m), b.T @ np.diag(c) @ b, b.T @ np.diag(k) @ b, b, c


def test_elastic_floors_are_those_of_dense_matrices():
    """The exact solution of M u'' + C u' + K u = -M 1 a by exponentials of the state matrix with ramps of a."""
    ground = shaking(1)
    masses, stiffnesses = np.array([3e5, 2e5, 1e5]), np.array([3e8, 2e8, 1.5e8])
    whole = 4e5 + masses.sum()
    omega = 2.0 * math.pi / 2.0
    isolation = (4e5, whole * omega**2, 2.0 * 0.15 * omega * whole)
    m, c, k, *_ = chain(isolation, masses, stiffnesses, 0.04)
    n = 4
    state = np.zeros((2 * n + 2, 2 * n + 2))  # (u, v, a, slope of a)
    state[:n, n : 2 * n] = np.eye(n)
    state[n : 2 * n, :n] = -np.linalg.solve(m, k)
    state[n : 2 * n, n : 2 * n] = -np.linalg.solve(m, c)
    state[n : 2 * n, 2 * n] = -1.0
    state[2 * n, 2 * n + 1] = 1.0
    step = expm(0.01 * state)
    a = ground.values[0]
    y, expected = np.zeros(2 * n), []
    for i in range(a.size):
        expected.append(-np.linalg.solve(m, k @ y[:n] + c @ y[n:]))
        if i + 1 < a.size:
            y = (step @ np.concatenate([y, [a[i], (a[i + 1] - a[i]) / 0.01]]))[: 2 * n]
    building = Building.isolated(SOFT, 4e5, masses, stiffnesses, 0.04)
    np.testing.assert_allclose(building.floor_motions(ground).values[0], np.array(expected).T, rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("strength", [None, 0.08])
def test_yielding_storeys_on_lead_rubber_against_another_integrator(strength):
    ground = shaking(1, 2.0).isel(time=slice(0, 400))
    masses, stiffnesses = np.array([2e5, 1e5]), np.array([1.2e8, 0.8e8])
    whole = 2e5 + masses.sum()
    after = whole * (2 * math.pi / 2.5) ** 2
    initial = after + 0.05 * G * whole / 0.008
    *_, c = chain((2e5, initial, 0.0), masses, stiffnesses, 0.05)
    yielding = None if strength is None else Yielding(strength, 0.02)
    building = Building.isolated(LEAD, 2e5, masses, stiffnesses, yielding=yielding)
    k = np.append(initial, stiffnesses)
    yields = np.append(0.008, np.full(2, 1e3) if strength is None else building.yield_drifts)
    hardening = np.append(after / initial, [0.02, 0.02])
    accelerations, peaks, *_ = reference(
        ground.values[0], 0.01, np.append(2e5, masses), k, yields, hardening, np.zeros(3), (0.0, c / k)
    )
    found = building.response(ground)
    np.testing.assert_allclose(building.floor_motions(ground).values[0], accelerations, rtol=0, atol=1e-8)
    assert float(found["isolator_displacement"].item()) == pytest.approx(peaks[0], rel=0.01)
    assert peaks[0] > 0.016
    np.testing.assert_allclose(found["drift"].values[0, 0], peaks[1:], rtol=0.01)
    ductility = float(found["ductility"].max())
    assert ductility == 0.0 if strength is None else ductility > 1.0
    np.testing.assert_allclose(found["pfa"].values[0, 0], np.abs(accelerations).max(axis=1), rtol=1e-8)


def test_the_least_mass_bounds_the_rates_of_the_slab():
    """At the least mass the fastest rate of the whole chain, of dense matrices, is that of the bound to 3 %."""
    mass, stiffness = np.array([2e5] * 3), np.array([2e8] * 3)
    with pytest.raises(ValueError, match="base_mass") as refused:
        Building.isolated(Isolator.linear(2.5, 0.15), 1.0, mass, stiffness)
    least = float(str(refused.value).split("at least ")[1].split(" kg")[0])
    building = Building.isolated(Isolator.linear(2.5, 0.15), 1.01 * least, mass, stiffness)
    own = building.isolation.storey(mass.sum())
    m, c, k, *_ = chain((own.mass, own.stiffness, own.viscosity), mass, stiffness, 0.05)
    zeros, ones = np.zeros(m.shape), np.eye(len(m))
    rates = np.linalg.eigvals(np.block([[zeros, ones], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]]))
    assert np.abs(rates).max() == pytest.approx(FASTEST, rel=0.03)


def test_refused(refusal):
    refusal()
