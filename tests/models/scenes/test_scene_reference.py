"""The independent integration of scenes against digits that no test of the engine has: p = q = gain = 1."""

import math

import numpy as np
import pytest
from scene_reference import G, Scene, integrate_segments, sine_segments

pytestmark = pytest.mark.slow  # (compiling the independent integration takes most of their time)

ALPHA = 0.2


def unit_scene(x_wall=None) -> Scene:
    """p = 1 rad/s; a wall that is struck at x_wall times ALPHA."""
    radius = G / (4 / 3)
    height = 2 * radius * math.cos(ALPHA)
    gap = None if x_wall is None else x_wall * ALPHA * height
    return Scene(2 * radius * math.sin(ALPHA), height, geometry="linear", restitution=0.9, wall_gap=gap,
                 wall_restitution=0.5)  # fmt: skip


def falls(scene, amplitude, w, halves, sign):
    """sign +1: pushes to the back first (u'' = +A sin), -1: to the front first; amplitude in g alpha."""
    return integrate_segments(scene, sine_segments(sign * amplitude, w, halves)).overturned


def bisect(fall, low, high, rounds=48):
    """The boundary of the verdict between two amplitudes with different ones."""
    first = fall(low) != 0
    assert first != (fall(high) != 0)
    for _ in range(rounds):
        middle = 0.5 * (low + high)
        if (fall(middle) != 0) == first:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def boundaries(fall, grid):
    verdicts = [fall(a) != 0 for a in grid]
    return [bisect(fall, a, b) for a, b, u, v in zip(grid, grid[1:], verdicts, verdicts[1:], strict=False) if u != v]


def normal(scene, w, halves, sign):
    return lambda a: falls(scene, a * G * ALPHA, w, halves, sign)


def near(value, wanted, tolerance):
    np.testing.assert_allclose(value, wanted, rtol=0, atol=tolerance)


@pytest.mark.parametrize(("w", "wanted"), [(1, [1.1320471106]), (3, [1.4035653556, 3.4846627333, 3.6311498724])])
def test_a3_free_block(w, wanted):
    found = boundaries(normal(unit_scene(), w, 2, 1), np.arange(1.05, 5, 0.05))
    near(found, wanted, 1e-10)


@pytest.mark.parametrize(
    ("gap", "sign", "wanted"),
    [
        (None, 1, [3.0185998609, 6.3180705298, 7.1681287971]),
        (0, -1, [7.1681287971]),
        (0, 1, [3.2891467775]),
        (0.05, -1, [7.1681287971]),
        (0.05, 1, [2.3685679514]),
    ],
)
def test_a4_verdicts(gap, sign, wanted):
    near(boundaries(normal(unit_scene(gap), 5, 2, sign), np.arange(1.05, 9, 0.1)), wanted, 1e-10)


@pytest.mark.parametrize(("amplitude", "front"), [(2.2, 0.015895471875), (3.0, 0.081011171505)])
def test_a7_exact(amplitude, front):
    run = integrate_segments(Scene(0.3, 1.8, wall_gap=0.05), sine_segments(-amplitude, 2 * math.pi, 2))
    near([run.peak_front, run.peak_back], [front, 0.027781351264], 1e-12)


CABINET = Scene(0.3, 1.8, geometry="linear")


def test_a8_two_cycles():
    def run(gap, sign):
        return integrate_segments(CABINET._replace(wall_gap=gap), sine_segments(sign * 2.2, 2 * math.pi, 4))

    near(run(0, 1).peak_front, 0.017038271131, 1e-12)
    away = run(0.02, -1)
    near(away.peak_front, 0.140581854330549, 1e-12)  # (closed form, 40 digits)
    assert away.overturned == run(0, 1).overturned == 0
    assert run(None, 1).overturned
    assert run(None, -1).overturned
    assert run(0.02, 1).overturned == run(0.05, 1).overturned == 1
    # with the lever h: the linear stiffness p2 with the gain p2 cos(alpha) / g, so a smaller amplitude here
    smaller = 2.2 * math.cos(math.atan(1 / 6))
    for gap, sign, wanted, tolerance in ((0, 1, 0.015418, 5e-7), (0.02, -1, 0.1174, 5e-5)):
        lever = integrate_segments(CABINET._replace(wall_gap=gap), sine_segments(sign * smaller, 2 * math.pi, 4))
        near(lever.peak_front, wanted, tolerance)


OFFSET = Scene(0.4, 1.8, cm_offset=0.05, geometry="bilinear")


def test_c3_half_sine():
    def fall(sign):
        return lambda a: falls(OFFSET, a, 2 * math.pi, 1, sign)

    near(bisect(fall(-1), 2, 4), 3.122649076149, 1e-11)
    found = boundaries(fall(1), np.arange(2.8, 5.6, 0.05))
    near(found[0], 4.264114686147, 1e-11)
    assert fall(1)(found[0] + 1e-9) == 1
    # the closed form at the back, without the rebound: where the fall turns from front to back
    low, high = 5.0, 5.5
    for _ in range(48):
        middle = (low + high) / 2
        low, high = (low, middle) if fall(1)(middle) == -1 else (middle, high)
    near(low, 5.233550356563, 1e-11)
    mirror = OFFSET._replace(cm_offset=-0.05)
    for a in (3.0, 4.0, 4.5, 5.4):
        one = integrate_segments(OFFSET, sine_segments(a, 2 * math.pi, 1))
        other = integrate_segments(mirror, sine_segments(-a, 2 * math.pi, 1))
        assert one.overturned == -other.overturned
        assert (one.peak_front, one.peak_back) == (other.peak_back, other.peak_front)


def test_energy_law_tends_to_impact():
    """delta -> 0 with a wall, an offset and a lean: Housner's impact, the error of first order."""
    scene = OFFSET._replace(wall_gap=0.02, lean=0.01)
    segments = sine_segments(-2.5, 2 * math.pi, 4)
    rigid = integrate_segments(scene, segments)
    near(rigid.peak_front, 0.136151392982, 1e-11)
    errors = []
    for delta in (1e-3, 1e-4, 1e-5):
        run = integrate_segments(scene._replace(law="energy", delta=delta), segments)
        errors.append(abs(run.peak_front - rigid.peak_front) / rigid.peak_front)
    assert errors[0] < 0.05
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]
