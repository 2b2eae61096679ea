"""Buildings that yield beside OpenSees, at a hundredth of the records' step: run where OpenSeesPy is installed.

`.ci/environments` makes such an environment.  The model is put together from OpenSees' own parts, with strengths and
damping by their definitions: it takes no number of the building that is compared with it.
"""

import functools
import math

import numpy as np
import pytest

import toppling as tp
from toppling.motions import Building, Yielding

pytestmark = pytest.mark.opensees

ops = pytest.importorskip("openseespy.opensees")

G = 9.80665
HARDENING = 0.03
HEIGHT = 3.0
DT = 0.005
SAMPLES = 901
"""Of a record that are followed; the buildings have yielded by then."""


@functools.cache
def ground():
    """Three records of different make, m/s², from rest; the one that ships is sampled at 0.01 s, and linear between."""
    time = DT * np.arange(SAMPLES)
    ships = tp.motions.read_at2(tp.motions.example_path()).values[0, 100:]
    example = np.interp(time, 0.01 * np.arange(ships.size), ships)
    filtered = tp.motions.CloughPenzien(duration=10.0, dt=DT).sample(1, seed=3).values[0, 300 : 300 + SAMPLES]
    pulse = np.sin(2 * np.pi * time / 1.1) * np.sin(np.pi * np.minimum(time / 3.0, 1.0)) ** 2
    found = np.array([example, filtered, pulse])
    found[:, 0] = 0.0
    return np.array([5.0, 5.0, 3.0])[:, None] * found / np.abs(found).max(axis=1, keepdims=True)


def case(number):
    """Storeys, record, masses, stiffnesses, damping, strength and P-delta (theta of each storey) of a building."""
    random = np.random.default_rng(number)
    n = 1 + number // 2
    masses = random.uniform(0.8, 1.2, n) * 1e5
    period = random.uniform(0.08, 0.12) * n + 0.25
    stiffnesses = random.uniform(0.9, 1.1, n) * np.linspace(1.2, 0.8, n)
    theta = random.uniform(0.01, 0.06, n) if number % 2 else np.zeros(n)
    scale = np.linalg.eigvalsh(dynamic(masses, stiffnesses))[0]
    stiffnesses *= (2 * math.pi / period) ** 2 / scale
    return n, number % 3, masses, stiffnesses, random.uniform(0.02, 0.06), random.uniform(0.15, 0.3), theta


def dynamic(masses, stiffnesses):
    """The stiffness matrix of a chain between the roots of the masses."""
    above = np.append(stiffnesses[1:], 0.0)
    matrix = np.diag(stiffnesses + above) - np.diag(above[:-1], 1) - np.diag(above[:-1], -1)
    return matrix / np.sqrt(np.outer(masses, masses))


def strengths(masses, period, coefficient):
    """ASCE 7's lateral forces, from the roof down; N."""
    exponent = min(max(0.75 + 0.5 * period, 1.0), 2.0)
    forces = masses * (HEIGHT * np.arange(1, masses.size + 1)) ** exponent
    shears = np.array([forces[i:].sum() for i in range(masses.size)])
    return coefficient * G * masses.sum() * shears / shears[0]


def opensees(shaking, substeps, masses, stiffnesses, damping, coefficient, theta, folder):
    """Accelerations of floors at the samples (storey, time), greatest drifts, plastic and yield drifts (storey,)."""
    n = masses.size
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for i in range(1, n + 1):
        ops.node(i, 0.0, "-mass", float(masses[i - 1]))
    omega = np.sqrt(np.linalg.eigvalsh(dynamic(masses, stiffnesses)))
    yields = strengths(masses, 2 * math.pi / omega[0], coefficient)
    of_mass, of_stiffness = 2 * damping * omega[0], 0.0
    if n > 1:  # the ratio at the first and the last mode: a/(2 omega) + b omega/2
        pair = np.array([[0.5 / omega[0], 0.5 * omega[0]], [0.5 / omega[-1], 0.5 * omega[-1]]])
        of_mass, of_stiffness = np.linalg.solve(pair, [damping, damping])
    for i in range(1, n + 1):
        k = float(stiffnesses[i - 1])
        ops.uniaxialMaterial("Steel01", i, float(yields[i - 1]), k, HARDENING)
        ops.element("zeroLength", i, i - 1, i, "-mat", i, "-dir", 1)
        # P-delta as a negative spring, and the damping by the initial stiffness beside it
        ops.uniaxialMaterial("Elastic", 100 + i, float(-theta[i - 1] * k), float(of_stiffness * k))
        ops.element("zeroLength", 100 + i, i - 1, i, "-mat", 100 + i, "-dir", 1)
    ops.rayleigh(float(of_mass), 0.0, 0.0, 0.0)
    # (a time that rounding puts behind the last value would have none)
    ops.timeSeries("Path", 1, "-dt", DT, "-values", *shaking.tolist(), "-useLast")
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    drifts = folder / f"drifts-{substeps}.txt"
    of = ["-ele", *range(1, n + 1), "deformation"]
    ops.recorder("EnvelopeElement", "-file", str(drifts), "-precision", 14, *of)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-13, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    accelerations = np.zeros((n, shaking.size))
    for j in range(1, shaking.size):
        assert ops.analyze(substeps, DT / substeps) == 0
        accelerations[:, j] = [ops.nodeAccel(i, 1) + shaking[j] for i in range(1, n + 1)]
    at_end = np.diff([0.0, *(ops.nodeDisp(i, 1) for i in range(1, n + 1))])
    forces = np.array([ops.eleResponse(i, "material", 1, "stress")[0] for i in range(1, n + 1)])
    plastic = (at_end - forces / stiffnesses) / (1.0 - HARDENING)
    ops.wipe()  # (closes the recorder's file: least, greatest, and greatest without sign)
    return accelerations, np.loadtxt(drifts).reshape(3, n)[2], plastic, yields / stiffnesses


def ours(record, masses, stiffnesses, damping, coefficient, theta):
    motion = tp.motions.from_array(ground()[record], DT)
    building = Building.from_storeys(
        masses, stiffnesses, damping, HEIGHT,
        yielding=Yielding(coefficient, HARDENING, theta if theta.any() else None),
    )  # fmt: skip
    return building.floor_motions(motion), building.response(motion)


def worst(found, expected):
    """The greatest difference over the greatest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("number", range(20))
def test_floors_drifts_and_ductilities_to_1e_5(number, tmp_path):
    """1 to 10 storeys, every other one with P-delta, up to ductilities of 2 to 15."""
    _, record, *building = case(number)
    accelerations, drifts, plastic, yields = opensees(ground()[record], 100, *building, tmp_path)
    floors, response = ours(record, *building)
    assert 2.0 < float(floors["ductility"].item()) < 15.0
    errors = {
        "floors": worst(floors.values[0, 1:], accelerations),
        "pfa": float(np.abs(response["pfa"].values[0, 0, 1:] / np.abs(accelerations).max(axis=1) - 1.0).max()),
        "drifts": float(np.abs(response["drift"].values[0, 0] / drifts - 1.0).max()),
        "ductility": worst(response["ductility"].values[0, 0], drifts / yields),
        "residual": worst(response["residual"].values[0, 0], plastic),
    }
    assert all(error < 1e-5 for error in errors.values()), errors


def test_opensees_converges_to_ours(tmp_path):
    """A tenth of its step leaves a hundredth of the difference: ours is the limit, not another step."""
    _, record, *building = case(4)
    floors, _ = ours(record, *building)
    coarse, fine = (
        worst(opensees(ground()[record], steps, *building, tmp_path)[0], floors.values[0, 1:]) for steps in (10, 100)
    )
    assert 50.0 < coarse / fine < 200.0
