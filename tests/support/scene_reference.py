"""An independent reference for rocking blocks with walls, straps, rupture, offsets and lean.

Signs: rotation > 0 is towards the front, F = -u'' pushes towards the front, gaps are seen from the block at rest.
Method: Dormand-Prince 8(5,3) with step control, restarted at every sample and every event. Inside one side of the
block the state is (y, v): y = side * rotation >= 0 outward, side = +1 front, -1 back. A step is cut at its first turn
(v = 0, found on the step itself by repeating it with a shorter length) so that every piece is monotone; an
edge is then crossed exactly when the end of a monotone piece lies beyond it. Roots are safeguarded Newton iterations.

Rest (own rule): at an impact or bounce the later hops last T = 2 (v + v') / (D (1 - f f')), D the deceleration towards
the edge. The block rests if T <= 1e-9 s and D stays above D/2 for the next 2 T, inside the segment (the record is
linear there, so the bound is a proof but for softening over heights below 1e-16). With T < 1e-15 s D > 0 is enough.
It leaves when the acceleration away from the edge exceeds 0. Counts of impacts therefore depend on this rule.
"""

import math
from typing import NamedTuple

import numpy as np
from scene_kernel import (
    ALPHA,
    EDGE,
    FACTOR,
    GAIN,
    HALF_PI,
    HELD,
    INERTIA,
    KAPPA,
    MA,
    MK,
    O_BACK,
    O_BOUNCES,
    O_END,
    O_END_RATE,
    O_FALL,
    O_FRONT,
    O_HELD,
    O_IMPACTS,
    O_LOG,
    O_MODE,
    O_RUPT,
    O_SPEED,
    O_STATE,
    O_TAUT_B,
    O_TAUT_F,
    O_TIME,
    OPEN,
    PI0,
    PULL,
    Q2,
    R_WALL,
    RUPTURE,
    SLACK,
    WALL,
    Z_EQ,
    Z_ETA,
    Z_GAIN,
    Z_INERTIA,
    Z_K,
    Z_LAW,
    Z_STEP,
    Z_W2,
    run,
)  # fmt: skip

G = 9.80665
STATES = ("stands", "leans", "hangs", "fell front", "fell back", "undecided")


class Restraint(NamedTuple):
    """Strap, bracket or adhesive: SI, `arm` about the active corner, on the front side only or mirrored on both."""

    arm: float
    stiffness: float  # N/m; inf: rigid or adhesive
    strength: float  # N; inf: unbreakable
    slack: float = 0.0  # m
    preload: float = 0.0  # N
    both_sides: bool = False


class Scene(NamedTuple):
    """A block and what stands round it. None: no such thing, or the formula."""

    width: float
    height: float
    cm_height: float | None = None
    cm_offset: float = 0.0  # m, towards the front
    lean: float = 0.0  # rad, towards the front
    inertia: float = 4 / 3  # of the centred block
    geometry: str = "exact"  # linear, bilinear, exact
    restitution: float | None = None  # eta; None: Housner's
    wall_gap: float | None = None
    wall_height: float | None = None  # height of contact; None: the block's height
    wall_restitution: float | None = None  # also of the front contact
    front_gap: float | None = None
    front_height: float | None = None
    restraint: Restraint | None = None
    mass: float = 1.0  # used by restraints only
    law: str = "housner"  # housner, discrete, energy (both with rest="rigid", bilinear)
    delta: float = 0.05  # half width of the zone, in alpha


class Result(NamedTuple):
    """What happened; rotations in rad (pi/2 on the side of a fall), angular speeds in rad/s."""

    overturned: int  # 1 front, -1 back, 0 none
    peak_front: float
    peak_back: float
    base_impacts: int  # up to the end of the record and before rest
    wall_impacts: int
    wall_impact_velocity: float  # largest |angular velocity| just before a strike, free motion included
    ruptured: bool
    rupture_time: float  # s; nan: none
    restraint_force: float  # N, largest
    end_rotation: float  # at the end of the record, signed
    end_mode: str  # none, intact, broken
    final_state: str  # stands, leans, hangs, fell front, fell back, undecided
    end_rate: float
    log: np.ndarray  # (n, 4): time, kind, rotation, angular velocity just before


def _side(scene: Scene, sign: int) -> dict[str, float]:
    """Quantities of the side a block tips to: derived."""
    b, h = scene.width / 2, scene.cm_height or scene.height / 2
    radius2 = (scene.inertia - 1) * (b * b + h * h)
    near, far = b - sign * scene.cm_offset, b + sign * scene.cm_offset
    alpha, lever = math.atan2(near, h), math.hypot(near, h)
    inertia = radius2 + lever * lever
    tilted = alpha - sign * scene.lean
    if tilted <= 0:
        raise ValueError("the block does not stand: it leans beyond its edge")
    p2 = G * lever / inertia
    if scene.geometry == "bilinear":
        q2, gain = p2 * math.sin(tilted) / tilted, lever * math.cos(tilted) / inertia
    elif scene.geometry in ("linear", "exact"):
        q2, gain = p2, p2 / G
    else:
        raise ValueError("geometry is linear, bilinear or exact")
    moment = inertia * q2 * tilted
    return {"near": near, "far": far, "h": h, "radius2": radius2, "inertia": inertia, "alpha": tilted, "q2": q2,
            "gain": gain, "moment": moment, "slope": inertia * q2}  # fmt: skip


def _wall(scene: Scene, gap: float | None, contact: float | None, side: dict[str, float]) -> tuple[float, float]:
    """Rotation at which a wall is met (inf: none) and restitution there."""
    if gap is None:
        return math.inf, 0.0
    z = scene.height if contact is None else contact
    angle = gap / z
    if scene.geometry == "exact":
        angle = math.asin(gap / z) if z == scene.height else math.atan(gap / z)
    b, h = side["near"], side["h"]
    own = side["radius2"] + b * b
    r = -(own + h * h - h * z) / (own + (z - h) ** 2)
    return angle, min(max(0.0, r), 1.0) if scene.wall_restitution is None else scene.wall_restitution


def tables(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The kernel's tables: both sides, and the elastic zone of a zone law."""
    sides = (_side(scene, 1), _side(scene, -1))
    front, back = sides
    common = front["radius2"] + front["h"] ** 2 - front["near"] * back["near"]
    eta = scene.restitution
    if eta is None:
        eta = common / math.sqrt(front["inertia"] * back["inertia"])
    if not 0 < eta <= 1:
        raise ValueError("the restitution must lie in (0, 1]")
    walls = (
        _wall(scene, scene.front_gap, scene.front_height, front),
        _wall(scene, scene.wall_gap, scene.wall_height, back),
    )
    par = np.zeros((2, 17))
    for k, own in enumerate(sides):
        other = sides[1 - k]
        par[k, [Q2, ALPHA, GAIN, MA, MK, INERTIA]] = [
            own[name] for name in ("q2", "alpha", "gain", "moment", "slope", "inertia")
        ]
        par[k, [SLACK, RUPTURE, EDGE]] = math.inf
        par[k, [WALL, R_WALL]] = walls[k]
        par[k, OPEN] = float(walls[k][0] > 0)
        par[k, FACTOR] = eta * math.sqrt(own["inertia"] / other["inertia"])
        if walls[1 - k][0] == 0:
            par[k, FACTOR] = eta * eta * walls[1 - k][1]
        hold = scene.restraint
        if hold is None or (k == 1 and not hold.both_sides):
            continue
        unit = hold.arm / (scene.mass * own["inertia"])
        if hold.strength <= hold.preload:
            raise ValueError("the preload must stay below the strength")
        if math.isinf(hold.stiffness):
            par[k, [HELD, PULL]] = hold.strength * unit, 1 / unit
        else:
            par[k, [PI0, KAPPA]] = hold.preload * unit, hold.stiffness * hold.arm * unit
            par[k, SLACK] = hold.slack / hold.arm
            par[k, RUPTURE] = (hold.slack + (hold.strength - hold.preload) / hold.stiffness) / hold.arm
    if not par[:, OPEN].any():
        raise ValueError("walls touch on both sides: nothing can move")
    return par, _zone(scene, par, eta)


def _zone(scene: Scene, par: np.ndarray, eta: float) -> np.ndarray:
    """The elastic zone of C2 (rest = rigid); writes the edges into the table of the sides."""
    zone = np.zeros(8)
    if scene.law == "housner" or not par[:, OPEN].all():
        return zone
    if scene.geometry != "bilinear" or scene.restraint is not None:
        raise ValueError("zone laws are bilinear and without restraint here")
    (a_f, k_f), (a_b, k_b) = par[0, [MA, MK]], par[1, [MA, MK]]
    width = scene.delta * (par[0, ALPHA] + par[1, ALPHA]) / 2
    shift = (k_f - k_b) / (2 * (a_f + a_b))
    par[0, EDGE], par[1, EDGE] = 1 / (1 / width + shift), 1 / (1 / width - shift)
    if (par[:, WALL] <= par[:, EDGE]).any():
        raise ValueError("the wall stands inside the elastic zone")
    m_f, m_b = a_f - k_f * par[0, EDGE], a_b - k_b * par[1, EDGE]
    k = (m_f + m_b) / (par[0, EDGE] + par[1, EDGE])
    centre = par[0, EDGE] - m_f / k
    inertia = math.sqrt(par[0, INERTIA] * par[1, INERTIA])
    step = a_f * par[0, EDGE] - k_f * par[0, EDGE] ** 2 / 2 - k * (par[0, EDGE] - centre) ** 2 / 2
    # lever arm of the shaking: the height of the mass centre above the middle of the base of the block as it leans
    h = scene.cm_height or scene.height / 2
    lever = h * math.cos(scene.lean) - scene.cm_offset * math.sin(scene.lean)
    law = {"discrete": 1.0, "energy": 2.0}[scene.law]
    zone[[Z_W2, Z_EQ, Z_GAIN, Z_STEP, Z_K, Z_INERTIA, Z_ETA, Z_LAW]] = (
        k / inertia, centre, lever / inertia, step, k, inertia, eta, law)  # fmt: skip
    return zone


def record_segments(record: np.ndarray, dt: float) -> np.ndarray:
    """Segments (start, length, c0, c1, amplitude, frequency, phase) of a piecewise linear record."""
    record = np.asarray(record, dtype=float)
    rows = np.zeros((max(len(record) - 1, 0), 7))
    rows[:, 0] = np.arange(len(rows)) * dt
    rows[:, 1] = dt
    rows[:, 2] = record[:-1]
    rows[:, 3] = np.diff(record) / dt
    return rows


def sine_segments(amplitude: float, frequency: float, halves: float) -> np.ndarray:
    """u'' = amplitude sin(frequency t), exactly, for a number of half-cycles, cut where it is not monotone."""
    quarters = round(2 * halves)
    rows = np.zeros((quarters, 7))
    rows[:, 1] = HALF_PI / frequency
    rows[:, 0] = np.arange(quarters) * rows[:, 1]
    rows[:, 4], rows[:, 5] = amplitude, frequency
    rows[:, 6] = np.arange(quarters) * HALF_PI
    return rows


def integrate_segments(
    scene: Scene,
    segments: np.ndarray,
    tolerance: float = 1e-12,
    start: tuple[float, float] = (0.0, 0.0),
    follow: bool = False,
    log: int = 0,
) -> Result:
    """As `integrate`, for segments, from a rotation and rate; `follow`: to rest; `log`: rows of events to keep."""
    par, zone = tables(scene)
    hold = scene.restraint
    rigid = hold is not None and math.isinf(hold.stiffness)
    notes = np.zeros((log, 4))
    out = run(par, zone, np.ascontiguousarray(segments, dtype=float), scene.geometry == "exact",
               int(hold is not None), rigid, start[0], start[1], tolerance, follow, notes)  # fmt: skip
    force = 0.0
    ruptured = bool(out[O_RUPT])
    if hold is not None:
        stretch = max(out[O_TAUT_F], out[O_TAUT_B] if hold.both_sides else 0.0) * hold.arm - hold.slack
        force = out[O_HELD] if rigid else hold.preload + (hold.stiffness * stretch if stretch > 0 else 0.0)
        force = min(force, hold.strength)
    mode = "none" if hold is None else ("intact" if out[O_MODE] else "ruptured")
    return Result(
        int(out[O_FALL]), out[O_FRONT], out[O_BACK], int(out[O_IMPACTS]), int(out[O_BOUNCES]), out[O_SPEED],
        ruptured, out[O_TIME], force, out[O_END], mode, STATES[int(out[O_STATE])], out[O_END_RATE],
        notes[: int(out[O_LOG])],
    )  # fmt: skip


def random_record(rng: np.random.Generator, threshold: float) -> tuple[np.ndarray, float]:
    """At most 5 s of filtered noise, or a pulse, from below the uplift of a block (m/s^2) to its certain fall."""
    dt = float(rng.choice([0.005, 0.01, 0.02]))
    time = np.arange(round(rng.uniform(1.0, 5.0) / dt)) * dt
    peak = threshold * math.exp(rng.uniform(math.log(0.7), math.log(12)))
    kind = rng.choice(["noise", "sine", "half", "rectangle"], p=[0.6, 0.2, 0.1, 0.1])
    duration = rng.uniform(0.2, 1.5)
    start = rng.uniform(0, 0.3)
    inside = (time >= start) & (time <= start + duration)
    if kind == "noise":
        omega, xi = rng.uniform(4, 40), rng.uniform(0.2, 0.8)
        shape = rng.normal(size=len(time)) * np.sin(np.pi * time / time[-1])
        x = rate = 0.0
        record = np.empty(len(time))
        for i, push in enumerate(shape):
            rate += dt * (push - 2 * xi * omega * rate - omega**2 * x)
            x += dt * rate
            record[i] = omega**2 * x + 2 * xi * omega * rate
    elif kind == "rectangle":
        record = inside.astype(float)
    else:
        record = inside * np.sin((np.pi if kind == "half" else 2 * np.pi) / duration * (time - start))
    record *= rng.choice([-1.0, 1.0]) * peak / np.abs(record).max()
    return record, dt


def random_scene(rng: np.random.Generator, law: str = "housner") -> tuple[Scene, np.ndarray, float]:
    """A realistic or hostile scene that the models allow (no restraint in exact geometry), a record and its dt."""
    while True:
        scene = _draw(rng, law)
        try:
            par, _ = tables(scene)
        except ValueError:
            continue
        record, dt = random_record(rng, float((par[:, Q2] * par[:, ALPHA] / par[:, GAIN]).min()))
        return scene, record, dt


def _draw(rng: np.random.Generator, law: str) -> Scene:
    def log(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def chance(probability: float) -> bool:
        return bool(rng.random() < probability)

    height = log(0.4, 3.0)
    width = height / rng.uniform(1.8, 9.0)
    b, cm = width / 2, height * (rng.uniform(0.3, 0.55) if chance(0.3) else 0.5)
    alpha = math.atan2(b, cm)
    geometry = "bilinear" if law != "housner" else str(rng.choice(["linear", "bilinear", "exact"]))
    offset = 0.0 if chance(0.5) else rng.uniform(-0.5, 0.5) * b
    lean = 0.0 if chance(0.6) else rng.uniform(-0.4, 0.4) * alpha

    def gap() -> float:
        kind = rng.choice(["touching", "micrometre", "any", "wide"], p=[0.2, 0.1, 0.55, 0.15])
        if kind == "wide":
            return min(0.7, rng.uniform(0.8, 2.0) * alpha) * height
        return {"touching": 0.0, "micrometre": 1e-6, "any": log(1e-5, 0.2) * height}[str(kind)]

    mass = log(20, 400)
    hold = None
    if geometry != "exact" and law == "housner" and chance(0.6):
        kind = str(rng.choice(["strap", "bracket", "adhesive", "pole"], p=[0.4, 0.25, 0.2, 0.15]))
        arm = rng.uniform(0.5, 1.0) * height if kind in ("strap", "bracket") else rng.uniform(0.8, 1.8) * b
        strength = math.inf if chance(0.1) and kind != "adhesive" else mass * 9.80665 * b / arm * log(0.03, 5.0)
        stiffness = math.inf if kind == "adhesive" else log(5e3, 5e5)
        slack = rng.choice([0.0, log(1e-4, 0.03), rng.uniform(0.5, 1.6) * alpha * arm], p=[0.3, 0.6, 0.1])
        preload = min(rng.uniform(0.0, 0.9) * strength, 300.0) if kind == "pole" else 0.0
        hold = Restraint(
            arm, stiffness, strength, float(slack) if kind == "strap" else 0.0, preload,
            kind in ("bracket", "pole") or (kind == "adhesive" and chance(0.6)),
        )  # fmt: skip
    return Scene(
        width, height,
        cm_height=None if cm == 0.5 * height else cm,
        cm_offset=offset,
        lean=lean,
        inertia=4 / 3 if chance(0.6) else rng.uniform(1.1, 1.6),
        geometry=geometry,
        restitution=None if chance(0.5) else rng.uniform(0.3, 0.98),
        wall_gap=gap() if chance(0.65) else None,
        wall_height=None if chance(0.7) else rng.uniform(0.5, 1.0) * height,
        wall_restitution=None if chance(0.6) else float(rng.choice([0.0, rng.uniform(0, 0.95), 0.9])),
        front_gap=gap() if chance(0.15) else None,
        front_height=None if chance(0.7) else rng.uniform(0.5, 1.0) * height,
        restraint=hold,
        mass=mass,
        law=law,
        delta=log(0.002, 0.1),
    )  # fmt: skip
