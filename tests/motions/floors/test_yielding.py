"""Buildings that yield: a table of ten digits, closed forms, another integrator, and what analyses make of them."""

import math
import warnings

import numpy as np
import pytest
from yielding_reference import reference

import toppling as tp
from toppling.motions import Building, CollapsingBuilding, Yielding
from toppling.motions.kernels.yielding import storey_response

G = 9.80665
TIME = np.arange(1001) * 0.01
SHAKING = 3.0 * (np.sin(2 * np.pi * TIME / 0.9) + 0.6 * np.sin(2 * np.pi * TIME / 0.37 + 1.0))
SHAKING *= np.exp(-(((TIME - 5.0) / 3.0) ** 2))
SHAKING[0] = 0.0
THREE = [4.76915959, 3.54006583, 2.91801687]


def response(ground, dt, mass, stiffness, yields, hardening=0.0, theta=0.0, damping=(0.0, 0.0), limit=1e9, start=None):
    n = len(mass)
    accelerations, velocities = np.empty((2, n, len(ground)))
    peaks, residual = np.empty((2, n))
    viscous = damping[1] * np.broadcast_to(stiffness, n)
    rows = (stiffness, yields, hardening, theta, viscous)
    storeys = np.array([np.broadcast_to(one, n).astype(float) for one in rows])
    found = storey_response(
        np.asarray(ground, float), dt, np.asarray(mass, float), storeys, float(damping[0]), np.full(n, limit),
        accelerations, velocities, peaks, residual,
    )  # fmt: skip
    return accelerations, velocities, peaks, residual, found


def uniform(n, period, strength, zeta):
    """Storeys of equal mass 1 and equal stiffness: stiffness, yield drifts and damping."""
    stiffness = (2 * np.pi / period / (2 * math.sin(np.pi / (2 * (2 * n + 1))))) ** 2
    modes = 2 * math.sqrt(stiffness) * np.sin((2 * np.arange(1, n + 1) - 1) * np.pi / (2 * (2 * n + 1)))
    number = np.arange(1, n + 1)
    strengths = strength * n * G * np.array([number[i:].sum() for i in range(n)]) / number.sum()
    if n == 1:
        return stiffness, strengths / stiffness, (2 * zeta * modes[0], 0.0)
    of_stiffness = 2 * zeta / (modes[0] + modes[-1])
    return stiffness, strengths / stiffness, (of_stiffness * modes[0] * modes[-1], of_stiffness)


@pytest.mark.parametrize(
    ("case", "drifts", "accelerations"),
    [
        ((1, 0.5, 0.2, 0.05, 0.05, 0.0), [0.0780677755], [2.83582895]),
        ((1, 0.5, 0.2, 0.0, 0.05, 0.0), [0.0861799943], [2.62513655]),
        ((1, 0.5, 10.0, 0.05, 0.05, 0.0), None, [6.50435765]),
        ((1, 1.0, 0.15, 0.05, 0.05, 0.08), [0.1219156221], [1.86584554]),
        ((3, 0.6, 0.15, 0.05, 0.05, 0.0), [0.0631387545, 0.0246355910, 0.0149384233], THREE),
        (
            (5, 1.0, 0.1, 0.03, 0.03, 0.0),
            [0.0382827487, 0.0264105735, 0.0317962898, 0.0345949233, 0.0227756018],
            [4.97667020, 4.28613634, 3.58131441, 2.91968237, 1.99029608],
        ),
    ],
    ids=str,
)  # fmt: skip
def test_the_table_of_ten_digits(case, drifts, accelerations):
    n, period, strength, hardening, zeta, theta = case
    stiffness, yields, damping = uniform(n, period, strength, zeta)
    found = response(SHAKING, 0.01, np.ones(n), stiffness, yields, hardening, theta, damping)
    if drifts is not None:  # (of the elastic one the table has the peak at samples)
        np.testing.assert_allclose(found[2], drifts, rtol=0, atol=6e-11)
    np.testing.assert_allclose(np.abs(found[0]).max(axis=1), accelerations, rtol=0, atol=6e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_another_integrator_and_the_balance_of_energy(seed):
    """Accelerations to 1e-9, and input = kinetic + stored + damped + yielding by that integrator's own quadrature."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 5))
    ground = np.concatenate([[0.0], 4.0 * np.convolve(random.standard_normal(300), np.ones(4) / 4, "same")])
    mass = random.uniform(0.5, 2.0, n)
    stiffness, yields = random.uniform(100.0, 400.0, n), random.uniform(0.005, 0.02, n)
    hardening, theta = random.uniform(0.0, 0.1, n), random.uniform(0.0, 0.05, n)
    damping = (0.3, 2e-3)
    ours = response(ground, 0.02, mass, stiffness, yields, hardening, theta, damping)
    accelerations, peaks, energies, plastic = reference(
        ground, 0.02, mass, stiffness, yields, hardening, theta, damping
    )
    assert ours[4][0] > 10
    np.testing.assert_allclose(ours[0], accelerations, rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours[3], plastic, rtol=0, atol=1e-11)
    # (its steps see peaks of flowing storeys, at events, and elastic ones between steps hardly less)
    assert (ours[2] >= peaks * (1.0 - 1e-9)).all()
    np.testing.assert_allclose(ours[2], peaks, rtol=0.01)
    assert energies[0] == pytest.approx(sum(energies[1:]), rel=1e-10)


@pytest.mark.parametrize("r", [0.6, 0.75, 0.9])
def test_ductility_under_a_step(r):
    """A constant a_g with m a_g/V_y = r in (.5, 1): mu = 0.5/(1 - r), from the balance of work at the turning point."""
    stiffness, yields = (2 * np.pi / 0.7) ** 2, 0.02
    pull = r * stiffness * yields
    found = response(np.full(4001, -pull), 0.001, [1.0], stiffness, yields)
    assert found[2][0] / yields == pytest.approx(0.5 / (1.0 - r), rel=1e-12)


def test_an_elastic_building_is_the_limit():
    """Strong storeys: the modal building with the same (Rayleigh) damping, all digits; and it scales."""
    masses, stiffnesses = [2e5, 1.5e5, 1e5], [3e8, 2e8, 1.5e8]
    shakes = tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(2, seed=1)
    strong = Building.from_storeys(masses, stiffnesses, 0.03, yielding=Yielding(1e3))
    omega = 2 * np.pi / Building.from_storeys(masses, stiffnesses).periods
    a, b = strong.damping
    elastic = Building.from_storeys(masses, stiffnesses, (a / omega + b * omega) / 2)
    with warnings.catch_warnings(action="ignore"):
        one, two = strong.floor_motions(shakes), elastic.floor_motions(shakes)
        np.testing.assert_allclose(one.values, two.values, rtol=0, atol=1e-11)
        np.testing.assert_allclose(strong.floor_motions(shakes, factor=3.0).values, 3.0 * one.values, atol=1e-10)
        peaks = strong.response(shakes, [1.0, 3.0])
        np.testing.assert_allclose(peaks["pfa"][0], elastic.peaks(shakes)["pfa"], rtol=1e-10)
        np.testing.assert_allclose(peaks["pfv"][0], elastic.peaks(shakes)["pfv"], rtol=1e-10)
    assert np.allclose((a / omega + b * omega)[[0, -1]] / 2, 0.03)
    assert (one["ductility"] < 1.0).all()


def test_yielding_limits_what_floors_pass_on():
    shakes = tp.motions.scale_to(tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(3, seed=2), 2.0)
    weak = Building.from_storeys([1e5] * 3, [1e8] * 3, yielding=Yielding(0.1))
    found = weak.response(shakes, [0.5, 1.0, 2.0])
    assert (found["ductility"].max("storey").diff("factor") > 0.0).all()
    # (hardening and the forces of damping come on top of the strength)
    top = weak.strengths[-1] / weak.masses[-1]
    assert (found["pfa"].isel(floor=-1, factor=2) < 2.0 * top).all()
    elastic = Building.from_storeys([1e5] * 3, [1e8] * 3).peaks(2.0 * shakes.assign_attrs(units="m s-2"))
    assert (elastic["pfa"].isel(floor=-1) > 3.0 * top).all()
    whole = weak.floor_motions(shakes, factor=2.0)
    np.testing.assert_allclose(np.abs(whole).max("time"), found["pfa"].isel(factor=2), rtol=1e-12)
    np.testing.assert_array_equal(whole["ductility"], found["ductility"].isel(factor=2).max("storey"))


def test_strengths_follow_the_lateral_forces_of_codes():
    masses, stiffnesses = np.array([2e5, 1e5]), [1e8, 1e8]
    short = Building.from_storeys(masses, stiffnesses, yielding=Yielding(0.2), storey_height=[4.0, 3.0])
    forces = masses * np.array([4.0, 7.0])
    weight = G * masses.sum()
    np.testing.assert_allclose(short.strengths, 0.2 * weight * np.array([1.0, forces[1] / forces.sum()]))
    own = Building.from_storeys(masses, stiffnesses, yielding=Yielding([0.2, 0.1]))
    np.testing.assert_allclose(own.strengths, [0.2 * weight, 0.1 * weight])
    counted = Building.from_storeys(masses, stiffnesses, yielding=Yielding(0.2, p_delta=True))
    np.testing.assert_allclose(counted.p_delta, [G * 3e5 / (1e8 * 3.0), G * 1e5 / (1e8 * 3.0)])
    assert "P-delta counted" in repr(counted)


def test_a_collapse_is_said():
    soft = Building.from_storeys([1e5], [1e6], yielding=Yielding(0.05, hardening=0.0, p_delta=0.15))
    shakes = tp.motions.from_array(np.concatenate([[0.0], np.full(2000, 1.5)]), 0.01)
    with pytest.warns(CollapsingBuilding, match=r"collapses under 1 of 1 motions \(times 2: "):
        found = soft.floor_motions(shakes, factor=2.0)
    assert found["collapsed"].values.tolist() == [1]
    assert float(np.abs(found.isel(time=-1)).max()) == 0.0
    with pytest.warns(CollapsingBuilding):
        peaks = soft.response(shakes, 2.0)
    assert peaks["collapsed"].values.tolist() == [[1]]
    # (peaks are those until it counts as collapsed, at a tenth of the storey's height)
    assert 0.3 < peaks["drift"].item() < 0.32


def test_floors_that_yield_are_not_scaled():
    shakes = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(3, seed=1)
    weak = Building.from_storeys([1e5] * 2, [4e7] * 2, yielding=Yielding(0.1))
    block, law = tp.Block(0.3, 1.5), tp.EnergyConsistent()
    roof = weak.floor_motions(shakes, floors=[2], factor=2.0)
    with pytest.raises(ValueError, match="is of a floor that yields"):
        tp.ida(block, law, roof, [1.0, 2.0])
    with pytest.raises(ValueError, match="must be of the ground"):
        weak.floor_motions(roof.isel(floor=0, drop=True))
    sets = []
    for level in (1.0, 3.0):
        below = tp.motions.scale_to(shakes, level)
        with warnings.catch_warnings(action="ignore"):
            sets.append(weak.floor_motions(below, floors=[2]))
    runs = tp.stripes(block, law, sets, [1.0, 3.0], scale=False, screen=False)
    assert runs.sizes["motion"] == 6
    for i, one in enumerate(sets):
        alone = tp.cloud(block, law, one, screen=False)
        here = runs["overturned"].values[0, 0, 3 * i : 3 * i + 3]
        np.testing.assert_array_equal(here, alone["overturned"].values[0, 0])


def test_strengths_of_a_motion_are_its_own_whatever_the_others():
    """One factor on all storeys, from seed and name alone: chunks, order and level leave every bit as it is."""
    ground = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(6, seed=1)
    storeys = ([1e5, 1e5], [4e7, 3e7])

    def make(beta, coefficient=0.1):
        return Building.from_storeys(*storeys, yielding=Yielding(coefficient, strength_dispersion=beta, seed=4))

    found = make(0.3).floor_motions(ground, [2], factor=2.0)
    factors = found["strength_factor"].values
    parts = [make(0.3).floor_motions(ground.isel(motion=at), [2], factor=2.0) for at in ([5, 2], [0, 1, 3, 4])]
    for part in parts:
        np.testing.assert_array_equal(part, found.sel(motion=part["motion"]))
    np.testing.assert_array_equal(make(0.3).floor_motions(ground, [2])["strength_factor"], factors)
    np.testing.assert_array_equal(make(0.3).response(ground, [1.0, 3.0])["strength_factor"], factors)
    alone = make(0.0, 0.1 * factors[3]).floor_motions(ground.isel(motion=[3]), [2], factor=2.0)
    np.testing.assert_allclose(found.isel(motion=[3]), alone, rtol=0, atol=1e-10)
    assert found["ductility"].values[3] == pytest.approx(float(alone["ductility"].item()), rel=1e-10)
    assert "strength_factor" not in alone.coords
    np.testing.assert_allclose(np.log(make(0.6).floor_motions(ground, [2])["strength_factor"]), 2 * np.log(factors))


def test_strengths_are_lognormal_about_the_given_one():
    from scipy.stats import kstest

    one = Building.from_storeys([1e5], [4e7], yielding=Yielding(0.2, strength_dispersion=0.3, seed=11))
    logarithms = np.log([one.strength_of(f"motion {i}") for i in range(4000)]) / 0.3
    assert kstest(logarithms, "norm").pvalue > 0.01
    other = Building.from_storeys([1e5], [4e7], yielding=Yielding(0.2, strength_dispersion=0.3, seed=12))
    assert abs(np.corrcoef(logarithms, np.log([other.strength_of(f"motion {i}") for i in range(4000)]))[0, 1]) < 0.05


def test_refused(refusal):
    refusal()
