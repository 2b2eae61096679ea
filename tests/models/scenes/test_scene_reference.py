"""The independent integration of scenes against closed forms and published digits, normalised: p = q = gain = 1."""

import math

import numpy as np
import pytest
import scene_kernel as sk
import scene_reference as sr
from scene_reference import G, Restraint, Scene, integrate, integrate_segments, record_segments, sine_segments
from scipy.integrate import quad
from scipy.optimize import brentq

pytestmark = pytest.mark.slow  # (compiling the independent integration takes most of their time)

NONE = np.zeros((0, 7))
ALPHA = 0.2


def unit_scene(x_wall=None, wall_e=0.5, e=0.9, strap=None, both=False, preload=0.0, beta=None, **more) -> Scene:
    """p = 1 rad/s: x are rotations over ALPHA; strap = (kappa, x_s, x_r)."""
    radius = G / (4 / 3)
    width, height = 2 * radius * math.sin(ALPHA), 2 * radius * math.cos(ALPHA)
    inertia = 4 / 3 * radius**2
    hold = None
    arm = 3.0
    if strap is not None:
        kappa, x_s, x_r = strap
        stiffness = kappa * inertia / arm**2
        load = preload * ALPHA * inertia / arm
        strength = load + stiffness * arm * ALPHA * (x_r - x_s)
        hold = Restraint(arm, stiffness, strength, x_s * ALPHA * arm, load, both)
    if beta is not None:
        hold = Restraint(arm, math.inf, beta * ALPHA * inertia / arm, both_sides=both)
    gap = None if x_wall is None else x_wall * ALPHA * height
    return Scene(
        width, height, geometry="linear", restitution=e, restraint=hold, wall_gap=gap, wall_restitution=wall_e, **more
    )


def kinds(result, *wanted):
    return result.log[np.isin(result.log[:, 1], wanted)]


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


# A: walls
def test_a1_one_sided_decay():
    run = integrate_segments(unit_scene(0, e=0.925), NONE, start=(0.5 * ALPHA, 0), follow=True, log=500)
    near(kinds(run, sk.TURN)[:4, 2] / ALPHA, [0.071166135074, 0.012641509286, 0.002301718383, 0.000420872381], 1e-12)
    near(kinds(run, sk.BOUNCE)[:4, 0], [1.316957896925, 2.094954829318, 2.414656377647, 2.550483974094], 1e-12)
    near(kinds(run, sk.REST)[0, 0], 2.651901217266, 2e-12)
    assert run.final_state == "stands"


def test_a2_gap_decay():
    run = integrate_segments(unit_scene(0.1, e=0.925), NONE, start=(0.5 * ALPHA, 0), follow=True, log=500)
    near(np.abs(kinds(run, sk.BOUNCE)[:2, 3]) / ALPHA, [0.672100252939, 0.178249962805], 1e-12)
    near(kinds(run, sk.TURN)[:5, 2] / ALPHA,
         [0.139299247048, 0.088608319005, -0.075290911969, 0.064046621534, -0.054531879570], 1e-12)  # fmt: skip


@pytest.mark.parametrize(("w", "wanted"), [(1, 1.3223965979), (3, 2.2938723134)])
def test_a3_touching_pulses(w, wanted):
    scene = unit_scene(0)
    near(bisect(normal(scene, w, 1, -1), 1.05, 4), wanted, 1e-10)
    near(bisect(normal(scene, w, 2, 1), 1.05, 4), wanted, 1e-10)


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


def test_a5_held_at_the_wall():
    segments = np.array([[0, 6, 1.5 * G * ALPHA, 0, 0, 0, 0]], dtype=float)
    run = integrate_segments(unit_scene(0.1), segments, follow=True, log=500)
    strike = kinds(run, sk.BOUNCE)[0]
    near([strike[0], -strike[3] / ALPHA], [0.622362503715, 0.331662479036], 1e-12)
    near(kinds(run, sk.REST_WALL)[0, 0], 1.744693657813, 1e-12)
    near(kinds(run, sk.LEAVE)[1, 0], 6, 0)
    near(kinds(run, sk.IMPACT)[0, 0], 6.467145308103, 1e-12)
    near(run.peak_front / ALPHA, 0.080163057928, 1e-12)


def test_a6_wide_gap():
    run = integrate_segments(unit_scene(1.2), NONE, start=(-1.1 * ALPHA, -0.1 * ALPHA), follow=True, log=500)
    strike = kinds(run, sk.BOUNCE)[0]
    near([strike[0], -strike[3] / ALPHA], [math.log(2), 0.2], 1e-12)
    assert run.final_state == "leans"
    assert run.overturned == 0
    near(run.peak_back / ALPHA, 1.2, 1e-15)


def test_a7_exact():
    scene = Scene(0.3, 1.8, wall_gap=0.05)
    par, _ = sr.tables(scene)
    near(par[1, sk.WALL], 0.027781351264, 1e-12)
    near(par[1, sk.R_WALL], 1.5 * math.cos(par[1, sk.ALPHA]) ** 2 - 1, 1e-15)
    run = integrate_segments(scene, NONE, start=(0.5 * par[0, sk.ALPHA], 0), follow=True, log=500)
    near(0.5 * par[0, sk.ALPHA], 0.082574338707, 1e-12)
    near(kinds(run, sk.TURN)[:5, 2],
         [0.032828448309, 0.025781980211, -0.023563490464, 0.021551327789, -0.019723448780], 1e-12)  # fmt: skip
    for amplitude, front in ((2.2, 0.015895471875), (3.0, 0.081011171505)):
        run = integrate_segments(scene, sine_segments(-amplitude, 2 * math.pi, 2))
        near([run.peak_front, run.peak_back], [front, par[1, sk.WALL]], 1e-12)


CABINET = Scene(0.3, 1.8, geometry="linear")


def test_a8_quantities():
    par, _ = sr.tables(CABINET._replace(wall_gap=0))
    near([par[0, sk.ALPHA], par[0, sk.Q2]], [0.165148677415, 8.061016644290], 1e-12)
    near(par[1, [sk.FACTOR, sk.R_WALL]], [0.959459459459, 0.459459459459], 1e-12)
    near(par[0, sk.FACTOR], 0.422961127673, 1e-12)
    near(G * par[0, sk.ALPHA], 1.6195, 1e-4)


def test_a8_two_cycles():
    def run(gap, sign, **more):
        return integrate_segments(CABINET._replace(wall_gap=gap, **more), sine_segments(sign * 2.2, 2 * math.pi, 4))

    near(run(0, 1).peak_front, 0.017038271131, 1e-12)
    first = integrate_segments(CABINET._replace(wall_gap=0), sine_segments(2.2, 2 * math.pi, 4), log=10)
    near(kinds(first, sk.TURN)[0, 2], 0.017036467457, 1e-12)
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


def test_a9_limits_and_symmetries():
    rng = np.random.default_rng(1)
    record = np.convolve(rng.normal(size=400), np.ones(5), "same") * 0.7 * np.hanning(400)
    free = integrate(CABINET, record, 0.02)
    assert free.peak_front > 0.01
    assert free.peak_back > 0.01
    wide = integrate(CABINET._replace(wall_gap=1e3), record, 0.02)
    assert free[:3] == wide[:3]
    assert free.base_impacts == wide.base_impacts
    touching = integrate(CABINET._replace(wall_gap=0), record, 0.02)
    close = integrate(CABINET._replace(wall_gap=1e-9), record, 0.02)
    near(close.peak_front, touching.peak_front, 1e-6)
    niche = CABINET._replace(wall_gap=0.02, front_gap=0.02)
    one, other = integrate(niche, record, 0.02), integrate(niche, -record, 0.02)
    assert (one.peak_front, one.peak_back) == (other.peak_back, other.peak_front)
    behind = integrate(CABINET._replace(wall_gap=0.02), record, 0.02)
    before = integrate(CABINET._replace(front_gap=0.02), -record, 0.02)
    assert (behind.peak_front, behind.peak_back) == (before.peak_back, before.peak_front)
    still = integrate(CABINET._replace(wall_gap=0), np.abs(record), 0.02)
    assert still.peak_front == still.peak_back == still.wall_impacts == 0
    lossless = unit_scene(0.1, wall_e=1, e=1)
    run = integrate_segments(lossless, record_segments(np.zeros(3000), 0.01), start=(0.5 * ALPHA, 0), log=500)
    assert run.wall_impacts > 5
    near(np.array(kinds(run, sk.TURN)[:5, 2]) / ALPHA, 0.5, 1e-11)


# B: restraints
STRAPS = [(20, 0, 0.05), (20, 0.02, 0.07), (200, 0.01, 0.03), (0.5, 0.1, 0.6)]


@pytest.mark.parametrize(
    ("strap", "fall", "rupture"),
    list(
        zip(
            STRAPS,
            [1.024695076596, 1.024695076596, 1.039230484541, 1.060660171780],
            [0.384057287393, 0.430232495286, 0.372961123979, 0.982344135219],
            strict=False,
        )
    ),
)
def test_b1_release(strap, fall, rupture):
    scene = unit_scene(strap=strap)

    def run(speed):
        return integrate_segments(scene, NONE, start=(0.0, speed * ALPHA))

    near(bisect(lambda speed: run(speed).overturned, 0.9, 1.1), fall, 1e-12)
    near(bisect(lambda speed: int(run(speed).ruptured), 0.1, 1.05), rupture, 2e-12)


@pytest.mark.parametrize(
    ("w", "wanted"),
    [
        (1, [1.587605951063, 1.444920897240, 3.354271801020]),
        (3, [2.484459484856, 2.412281255969, 2.816038387001]),
    ],
)
def test_b2_half_sine(w, wanted):
    for strap, value in zip(STRAPS, wanted, strict=False):
        near(bisect(normal(unit_scene(strap=strap), w, 1, -1), 1.05, 12), value, 2e-12)


@pytest.mark.parametrize(("w", "wanted"), [(1, 1.3223965979), (3, 2.2938723134)])
def test_b2_no_strength(w, wanted):
    for strap in STRAPS:
        weak = (strap[0], strap[1], strap[1] + 1e-9)
        near(bisect(normal(unit_scene(strap=weak), w, 1, -1), 1.05, 12), wanted, 1e-7)


@pytest.mark.parametrize(
    ("beta", "w", "wanted"),
    [(0.25, 1, 1.3710889433), (0.25, 3, 2.3055769193), (1, 1, 2), (1, 3, 2.4853645333), (0, 1, 1.3223965979),
     (0, 3, 2.2938723134)],
)  # fmt: skip
def test_b3_adhesive(beta, w, wanted):
    near(bisect(normal(unit_scene(beta=max(beta, 1e-14)), w, 1, -1), 1.01, 6), wanted, 1e-10)


def test_b4_tendon():
    scene = unit_scene(strap=(0.3, 0, 1e6), both=True, preload=0.2)
    near(bisect(normal(scene, 3, 1, -1), 1.05, 9), 3.1016010062, 1e-10)


@pytest.mark.parametrize(
    ("stiffness", "slack", "theta_s", "theta_r", "wanted", "tolerance"),
    [
        (None, 0, 0, 0, 3.085563481, 1e-9),
        (200e3, 0, 0, 0.000762857, 6.241040152, 1e-9),
        (20e3, 0, 0, 0.007628571, 4.923596911, 1e-9),
        (20e3, 0.005, 0.002857143, 0.010485714, 3.908156812, 1e-9),
    ],
)
def test_b5_strap_and_wall(stiffness, slack, theta_s, theta_r, wanted, tolerance):
    hold = None if stiffness is None else Restraint(1.75, stiffness, 267.0, slack)
    scene = CABINET._replace(wall_gap=0, mass=100, restraint=hold)
    if hold:
        par, _ = sr.tables(scene)
        near(par[0, [sk.SLACK, sk.RUPTURE]], [theta_s, theta_r], 1e-9)
        near(par[0, sk.KAPPA] / stiffness, 5518.018018 / 200e3, 1e-8)
    grid = np.arange(1.7, 8, 0.25)
    found = boundaries(lambda a: falls(scene, a, 2 * math.pi, 2, 1), grid)
    near(found[0], wanted, tolerance)
    if stiffness == 200e3:
        run = integrate_segments(scene, sine_segments(6.0, 2 * math.pi, 2))
        assert run.overturned == 0
        assert not run.ruptured
        near(run.peak_front, 0.000722451053, 1e-12)


def test_b6_limits():
    rng = np.random.default_rng(4)
    record = np.cumsum(rng.normal(size=300)) * 0.25 * np.hanning(300)
    scene = CABINET._replace(mass=100)
    free = integrate(scene, record, 0.02)
    for hold in (Restraint(1.75, 1e-9, 1e9), Restraint(1.75, 1e5, 1e9, slack=1e4), Restraint(1.75, 1e5, 1e-9)):
        other = integrate(scene._replace(restraint=hold), record, 0.02)
        near(other[1:3], free[1:3], 1e-9)
    both = scene._replace(restraint=Restraint(1.0, 3e4, 150.0, 0.002, 10.0, True))
    one, other = integrate(both, 2 * record, 0.02), integrate(both, -2 * record, 0.02)
    assert one.ruptured
    assert (one.peak_front, one.peak_back) == (other.peak_back, other.peak_front)
    # an unbreakable strap never lets it fall forward, even under anything
    strong = scene._replace(restraint=Restraint(1.75, 1e5, math.inf, 0.005))
    for factor in (3, 10, 30):
        assert integrate(strong, factor * record, 0.02).overturned <= 0
    # kappa < q2: a saddle at (q2 alpha + pi0 - kappa theta_s) / (q2 - kappa)
    weak = unit_scene(strap=(0.5, 0.1, 1e6))
    saddle = (1 - 0.5 * 0.1) / 0.5
    for shift, wanted in ((-1e-9, 0), (1e-9, 1)):
        run = integrate_segments(weak, NONE, start=((saddle + shift) * ALPHA, 0.0))
        assert max(run.overturned, 0) == wanted  # at the back, where nothing holds it, it may fall
    # slack beyond alpha: it hangs
    hanging = unit_scene(strap=(4, 1.5, 100))
    assert integrate_segments(hanging, NONE, start=(1.2 * ALPHA, 0.0)).final_state == "hangs"
    # it stands, and the peak at the back is known
    run = integrate_segments(unit_scene(strap=(400, 0.02, 1e6)), NONE, start=(0.01 * ALPHA, ALPHA))
    assert run.overturned == 0
    near(run.peak_back / ALPHA, 0.583009592436, 1e-12)
    # broken mode = a free block restarted from the rupture
    scene = unit_scene(strap=(20, 0, 0.05))
    segments = sine_segments(-1.7 * G * ALPHA, 1, 1)
    log = integrate_segments(scene, segments, log=50).log
    when, _, theta, rate = log[log[:, 1] == sk.RUPTURED][0]
    cut = segments[segments[:, 0] + segments[:, 1] > when].copy()
    cut[0, 6] += cut[0, 5] * (when - cut[0, 0])
    cut[0, 1] -= when - cut[0, 0]
    cut[0, 0] = when
    whole = integrate_segments(scene, segments)
    rest = integrate_segments(unit_scene(), cut, start=(theta, rate))
    assert whole.overturned == rest.overturned
    near([whole.end_rotation, whole.end_rate], [rest.end_rotation, rest.end_rate], 1e-12)


# C: offset and lean
OFFSET = Scene(0.4, 1.8, cm_offset=0.05, geometry="bilinear")


def test_c3_quantities():
    par, _ = sr.tables(OFFSET)
    near(par[:, sk.INERTIA], [1.115833333333, 1.155833333333], 1e-12)
    near(par[:, sk.ALPHA], [0.165148677415, 0.270946850338], 1e-12)
    near(par[:, sk.Q2], [7.982473834508, 7.828550588724], 1e-12)
    near(par[:, sk.GAIN], [0.806572068708, 0.778658976208], 1e-12)
    near(par[:, sk.FACTOR], [0.913482335977, 0.946228528753], 1e-12)
    near(math.sqrt(par[0, sk.FACTOR] * par[1, sk.FACTOR]), 0.929711270671, 1e-12)
    near(par[:, sk.Q2] * par[:, sk.ALPHA] / par[:, sk.GAIN], [1.634441666667, 2.724069444444], 1e-12)


@pytest.mark.parametrize(("law", "delta"), [("housner", 0.05), ("energy", 0.05), ("energy", 0.01)])
def test_c3_decay(law, delta):
    scene = OFFSET._replace(law=law, delta=delta)
    par, _ = sr.tables(scene)
    run = integrate_segments(scene, NONE, start=(0.5 * par[0, sk.ALPHA], 0.0), follow=True, log=100)
    near(kinds(run, sk.TURN)[:3, 2], [-0.034287938007, 0.055644095867, -0.025165047310], 1e-12)


@pytest.mark.parametrize(
    ("delta", "wanted"),
    [(0.05, [1.4164315640, 1.3348268248, 1.2694282096]), (0.01, [6.5682822888, 6.1211637146, 5.7114990592])],
)
def test_c3_drag(delta, wanted):
    """The coefficients c of the first three crossings from 0.5 alpha_F."""
    scene = OFFSET._replace(law="energy", delta=delta)
    par, zone = sr.tables(scene)
    peaks = [0.5 * par[0, sk.ALPHA], -0.034287938007, 0.055644095867]
    found = []
    for peak in peaks:
        s = 0 if peak > 0 else 1

        def level(x, s=s):
            return par[s, sk.MA] * x - par[s, sk.MK] * x * x / 2

        speed = math.sqrt(2 * (level(abs(peak)) - level(par[s, sk.EDGE])) / zone[sk.Z_INERTIA])
        sign = 1.0 if peak > 0 else -1.0
        found.append(sk.zone_drag(sign * par[s, sk.EDGE], -sign * speed, par, zone))
    near(found, wanted, 2e-10)


def test_c3_zone():
    par, zone = sr.tables(OFFSET._replace(law="energy"))
    near(par[:, sk.EDGE], [0.010904530761821, 0.010900246467627], 1e-15)
    near(zone[[sk.Z_K, sk.Z_EQ, sk.Z_STEP, sk.Z_INERTIA]],
         [170.921318041217, 0.002866506853916, 0.009989372115506, 1.135657237511], 1e-12)  # fmt: skip


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


def test_c3_lean():
    par, _ = sr.tables(Scene(0.4, 1.8, lean=math.radians(1), geometry="bilinear"))
    near(par[:, sk.ALPHA], [0.201215653354, 0.236122238394], 1e-12)
    near(par[:, sk.Q2] * par[:, sk.ALPHA] / par[:, sk.GAIN], [2.000320792121, 2.359583865718], 1e-12)
    near(G * np.tan(par[:, sk.ALPHA]), [2.000320792121, 2.359583865718], 1e-12)


# D: soft supports: formulas only
def test_d_springs():
    b, h = 0.2, 0.9
    alpha, radius = math.atan2(b, h), math.hypot(b, h)
    p2 = G / (4 / 3 * radius)
    for settlement, delta, wanted, springs in (
        (0.0002, 0.004573123065, 6.6057375886, 6.6059802096),
        (0.0005, 0.011432807663, 4.1634152483, 4.1638001838),
        (0.002, 0.045731230651, 2.0452763262, 2.0460597965),
    ):
        near(settlement / (b * alpha), delta, 1e-12)
        n = 1 / delta - 1
        near(math.sqrt(p2 * n * math.sin(alpha) / alpha) / (2 * math.pi), wanted, 1e-9)
        stiffness = G / (2 * settlement)  # of one spring, per unit mass
        inertia = 4 / 3 * radius**2
        near(math.sqrt((2 * stiffness * b * b - G * h) / inertia) / (2 * math.pi), springs, 1e-9)
    for frequency, delta in ((3, 0.021788945753), (6, 0.005537732452), (10, 0.002000674370)):
        n = (2 * math.pi * frequency) ** 2 / p2 * alpha / math.sin(alpha)
        near(1 / (1 + n), delta, 1e-12)


def test_d_winkler():
    """Moment of a no-tension bed under a rotation, from its pressure alone (b = 1, weight 1, bed per length k)."""

    def moment(ratio):
        settled = 0.01
        k = 0.5 / settled
        theta = ratio * settled

        def load(sink):
            return quad(lambda x: k * max(0.0, sink + theta * x), -1, 1, points=[max(-1, min(1, -sink / theta))])[0]

        sink = brentq(lambda s: load(s) - 1, -1, 1, xtol=1e-15)
        edge = max(-1, min(1, -sink / theta))
        return quad(lambda x: k * max(0.0, sink + theta * x) * x, -1, 1, points=[edge])[0]

    for ratio, wanted in ((1, 0.333333), (2, 0.528595), (4, 0.666667), (10, 0.789181), (100, 0.933333)):
        near(moment(ratio), wanted, 1e-6)
    near(1 - 2 / 3 * math.sqrt(1 / 40), 0.894591, 1e-6)


# free blocks
def test_free_blocks():
    run = integrate_segments(unit_scene(e=0.925), NONE, start=(0.5 * ALPHA, 0), follow=True, log=500)
    peaks = np.abs(kinds(run, sk.TURN)[:, 2]) / ALPHA
    near(peaks[[0, 1, 4, 9]], [0.401434, 0.328487, 0.190023, 0.082244], 5e-7)
    zhang = Scene(2 * math.sin(0.25), 2 * math.cos(0.25), restitution=0.9)
    p = math.sqrt(0.75 * G)
    for geometry, wanted in (("exact", [3.0323, 6.7430, 7.4930]), ("linear", [3.01860, 6.31807, 7.16813])):
        scene = zhang._replace(geometry=geometry)
        found = boundaries(lambda a, scene=scene: falls(scene, a * G * 0.25, 5 * p, 2, 1), np.arange(1.05, 9, 0.1))
        near(found, wanted, 5e-5)


def test_discrete_rest_rigid():
    """The discrete law takes only the energy above the edge: its first peaks, from energies alone."""
    scene = unit_scene(e=0.925)._replace(geometry="bilinear", law="discrete", delta=0.05)
    run = integrate_segments(scene, NONE, start=(0.5 * ALPHA, 0.0), follow=True, log=200)
    near(np.abs(kinds(run, sk.TURN)[[0, 1, 4, 9], 2]) / ALPHA,
         [0.41131983, 0.34490885, 0.21770197, 0.11808315], 1e-8)  # fmt: skip


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


def test_adhesive_force_and_rupture_time():
    """A ramp of 1 m/s^3 towards the front: force m (F h - g b) / d until F_u."""
    hold = Restraint(1.5, math.inf, 200.0)
    scene = Scene(0.3, 1.8, geometry="bilinear", mass=80, restraint=hold)
    breaks = (200 * 1.5 / 80 + G * 0.15) / 0.9
    run = integrate(scene, -np.arange(0, 4.001, 0.01), 0.01)
    assert not run.ruptured
    assert run.peak_front == 0
    assert run.end_mode == "intact"
    near(run.restraint_force, 80 * (4 * 0.9 - G * 0.15) / 1.5, 1e-10)
    run = integrate(scene, -np.arange(0, 8.001, 0.01), 0.01)
    assert run.ruptured
    assert run.end_mode == "ruptured"
    assert run.overturned == 1
    near([run.rupture_time, run.restraint_force], [breaks, 200], 1e-12)
    assert 4 < breaks < 8
    spring = scene._replace(restraint=Restraint(1.5, 1e5, 200.0, 0.001, 20.0))
    run = integrate(spring, -np.full(300, 3.0), 0.01)
    assert not run.ruptured
    near(run.restraint_force, 20 + 1e5 * (1.5 * run.peak_front - 0.001), 1e-9)


def test_twin_is_close():
    for seed in range(20):
        case = sr.random_scene(np.random.default_rng([3, seed]))
        one, other = integrate(*case), sr.twin(*case)
        assert one.overturned == other.overturned
        near(one[1:3], other[1:3], 1e-9)
