"""Shear buildings that yield or are isolated: floor motions, drifts and collapse under motions of given strength.

Bilinear storeys with kinematic hardening and, if requested, P-delta. Between yielding and unloading the building is
linear and is integrated exactly (`kernels.yielding`). A yielding building does not scale: floor motions belong to their
ground motion, and analyses do not scale them.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, power
from ...core.parameters import POSITIVE, RATIO, SHARE, Seed, check
from ...core.streams import key_of, stream
from ...core.units import ACCELERATION, METRE, STANDARD_GRAVITY, VELOCITY, described, provenance
from ..arrays import OF_OWN_LEVEL, OWN_LEVEL, Record, floor_array, floor_coordinates, motion_coordinates, records
from ..kernels.yielding import storey_response
from ..plausibility import collapse_doubts, record_doubts, strength_doubts, unusual
from .isolation import Isolation, refuse_light

YIELD_COEFFICIENT = POSITIVE
P_DELTA = "p_delta (theta of a storey, P/(k h))"
COLLAPSE_DRIFT = 0.1
"""Drift over the storey's height at which a storey counts as collapsed (assumed)."""


DISPLACEMENT = described("greatest displacement of the isolators", METRE)
COLLAPSED = described("storey that collapsed, from 1; 0 for none")
FACTOR = described("factor on the strengths of the building that the motion meets")


@dataclass(frozen=True, eq=False)
class Yielding:
    """Yield strength of a building's storeys, and their behaviour after yielding.

    Parameters
    ----------
    yield_coefficient : float or sequence of float
        Yield strength of the lowest storey over the weight of the building. The other storeys follow from the
        lateral forces of codes, which grow with w h^k. The exponent is 1 up to a period of 0.5 s and 2 from 2.5 s
        on (ASCE/SEI 7-22, 12.8.3). Or of each storey over the weight of the building.
    hardening : float
        Ratio of a storey's stiffness after and before yielding (0.03 is assumed).
    p_delta : bool, float or sequence of float, optional
        Stability coefficient theta = P/(k h) of the storeys, or True to compute it from the weight above them; none
        if not given. With theta above `hardening` a storey softens after yielding.
    strength_dispersion : float
        Dispersion of the building's real strength about the given one (assumed: 0.3 for real buildings). Each
        motion has its own building, whose strengths are multiplied by one lognormal factor of median 1.
    seed : int
        Seed of the factors, which depend on it and on the names of the motions alone.
    """

    yield_coefficient: Annotated[float | Sequence[float], YIELD_COEFFICIENT]
    hardening: Annotated[float, RATIO] = 0.03
    p_delta: Any = None
    strength_dispersion: Annotated[float, SHARE] = 0.0
    seed: Seed = 0

    def __post_init__(self) -> None:
        YIELD_COEFFICIENT.array("yield_coefficient", self.yield_coefficient)
        if self.p_delta is not None and not isinstance(self.p_delta, bool):
            RATIO.array(P_DELTA, self.p_delta)
        check(self, but=("yield_coefficient",))

    @property
    def text(self) -> str:
        """Its parameters, for the description of a building."""
        values = np.array2string(np.asarray(self.yield_coefficient), threshold=10)
        counted = "counted" if np.any(self.p_delta) else "none"
        random = f", strength dispersion {self.strength_dispersion:g}, seed {self.seed}"
        given = f"yield coefficient {values}, hardening {self.hardening:g}, P-delta {counted}"
        return f"{given}{random if self.strength_dispersion > 0.0 else ''}"


class CollapsingBuilding(UserWarning):
    """Warning of ground motions under which a yielding building collapses."""


class Response(NamedTuple):
    """Response of one building under one motion.

    Absolute accelerations, m/s², and velocities relative to the ground, m/s, are of all floors (floor, time). `peaks`,
    `residual`: of drifts, (storey,), m. `collapsed`: storey from 1, 0 for none. `end`: sample at which it collapsed.
    `ductility`: peaks over yield drifts, (storey,). `strength`: factor on the strengths of the storeys. `isolator`:
    maximum displacement of the isolators, m, 0 without any.
    """

    accelerations: Array
    velocities: Array
    peaks: Array
    residual: Array
    collapsed: int
    end: int
    ductility: Array
    strength: float
    isolator: float


@dataclass(frozen=True, eq=False)
class YieldingBuilding:
    """Shear building that does not scale: its storeys yield (made by `Building.from_storeys` with `yielding`), or it is
    on isolators (`Building.isolated`).

    Attributes
    ----------
    masses, stiffnesses, strengths : ndarray, shape (storey,)
        Mass of every floor, kg; initial stiffness, N/m, and yield strength, N, of the storey below it, infinite if it
        is elastic.
    hardening, p_delta : ndarray, shape (storey,)
        Stiffness after yielding over the initial one; stability coefficient theta = P/(k h).
    damping : tuple of float
        Factors of the masses, 1/s, and of the initial stiffnesses, s, in the damping matrix.
    heights : ndarray, shape (floor,)
        Height of the floors above the ground, or above the slab on isolators, m.
    collapse_drift : float
        Drift over the storey's height at which a storey has collapsed.
    strength_dispersion : float
        Standard deviation of the logarithm of the strength about the one given, 0 for none.
    seed : int
        Seed of the strengths.
    isolation : Isolation, optional
        The isolators below it.
    description : str
        Text that states the parameters of the building.

    Notes
    -----
    The storey force is V = k[(rho - theta) d + (1 - rho) e], with the drift d and its elastic part e = d - d_p, |e| <=
    d_y = V_y/k. With a dispersion beta each motion has its own building: all strengths are multiplied by exp(beta z).
    The standard normal number z is drawn from the stream of the seed and the motion's name. It is the same at every
    level and with any other motions. The absolute acceleration of a floor is the sum of all forces on it, including
    damping forces, over its mass. A storey with theta > rho softens after yielding.
    """

    masses: Array
    stiffnesses: Array
    strengths: Array
    hardening: Array
    p_delta: Array
    damping: tuple[float, float]
    heights: Array
    collapse_drift: float
    strength_dispersion: float
    seed: int
    isolation: Isolation | None
    description: str

    def __repr__(self) -> str:
        return self.description

    @property
    def floors(self) -> tuple[int, ...]:
        """The floors: 0 (ground, or the slab on isolators) to the number of storeys (roof)."""
        return tuple(range(self.heights.size))

    @property
    def yield_drifts(self) -> Array:
        """Drifts at which the storeys yield, (storey,), m."""
        return self.strengths / self.stiffnesses

    def floor_motions(
        self, motions: xr.DataArray, floors: Sequence[int] | None = None, factor: float = 1.0
    ) -> xr.DataArray:
        """Return the absolute acceleration histories of floors under ground motions of one strength.

        Parameters
        ----------
        motions, floors
            As for `Building.floor_motions`, but of one array without pairs.
        factor : float
            Factor on the ground motions, > 0: the floors are of ground motions of that strength.

        Returns
        -------
        xarray.DataArray
            ``acceleration`` (motion, floor, time), m s-2, with ``height`` on floor. On motion, ``ductility`` is the
            maximum drift of a storey over its yield drift, and ``collapsed`` the storey that collapsed, 0 for none. A
            building of uncertain strength has ``strength_factor``, the factor on its strengths. An isolated one has
            ``isolator_displacement``, the maximum of its isolators (m). Floors of a collapsed building do not move from
            then on; motions that collapse it cause a warning. The coordinate ``own_level`` bars analyses from scaling
            them.

        Raises
        ------
        TypeError, ValueError
            As `Building.floor_motions`; pairs of components, a vertical component, a factor <= 0.

        Examples
        --------
        >>> from toppling import motions
        >>> ground = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        >>> weak = motions.Building.from_storeys([1e5, 1e5], [4e7, 4e7], yielding=motions.Yielding(0.1))
        >>> floors = weak.floor_motions(ground, factor=2.0)
        >>> dict(floors.sizes), bool((floors["ductility"] > 1.0).all())
        ({'motion': 2, 'floor': 3, 'time': 2624}, True)
        """
        scale = checks.number("factor", factor, above=0.0)
        chosen = chosen_floors(floors, self.floors)
        plain = _ground(motions)
        n = plain[0].acceleration.size
        values = np.empty((len(plain), len(chosen), n))
        ductility = np.empty(len(plain))
        strength, isolator = np.empty((2, len(plain)))
        collapsed = np.zeros(len(plain), np.int64)
        for i, record in enumerate(plain):
            response = self._respond(record, scale)
            for j, floor in enumerate(chosen):
                values[i, j] = response.accelerations[floor]
                if response.collapsed:
                    values[i, j, response.end :] = 0.0
            ductility[i] = response.ductility.max()
            strength[i], isolator[i] = response.strength, response.isolator
            collapsed[i] = response.collapsed
        of = f" times {scale:g}" if scale != 1.0 else ""
        labels = [record.label for record in plain]
        sources = [f"{self.description}, {record.source}{of}" for record in plain]
        amplitudes = [record.own_amplitude for record in plain]
        drift = "greatest drift of a storey over its yield drift"
        array = (
            floor_array(values, plain[0].dt, labels, sources, chosen, self.heights[chosen], amplitudes)
            .assign_coords(
                {
                    "ductility": ("motion", ductility, described(drift)),
                    "collapsed": ("motion", collapsed, COLLAPSED),
                    OWN_LEVEL: ("motion", np.full(len(plain), True), OF_OWN_LEVEL),
                }
            )
            .assign_attrs(building=json.dumps(self._described() | {"factor": scale}, ensure_ascii=False))
        )
        if self.strength_dispersion > 0.0:
            array = array.assign_coords(strength_factor=("motion", strength, FACTOR))
        if self.isolation is not None:
            array = array.assign_coords(isolator_displacement=("motion", isolator, DISPLACEMENT))
        warn(collapse_doubts(labels, collapsed, scale), CollapsingBuilding)
        return array

    def response(self, motions: xr.DataArray, factors: Any = 1.0) -> xr.Dataset:
        """Return peaks of floors and storeys under ground motions times factors.

        Parameters
        ----------
        motions : xarray.DataArray
            Ground motions (motion, time), m s-2.
        factors : float or array_like, shape (factor,)
            Factors on all of them, > 0.

        Returns
        -------
        xarray.Dataset
            On (factor, motion, floor): ``pfa`` (m s-2) and ``pfv`` (m s-1), the peak absolute acceleration and
            velocity, at the samples. On (factor, motion, storey): ``drift``, the maximum (m), ``ductility``, over the
            yield drift, and ``residual`` plastic drift (m). On (factor, motion): ``collapsed``, the storey, 0 for none,
            and for an isolated building ``isolator_displacement``, the maximum (m). Peaks of a collapsed building are
            until its collapse. On motion ``strength_factor``, if the strength is uncertain.
        """
        scales = np.atleast_1d(checks.finite_array("factors", factors, ndim=(0, 1)))
        if scales.min() <= 0.0:
            raise ValueError(f"factors must be > 0, got {scales.min():g}")
        plain = _ground(motions)
        storeys = self.masses.size
        floor = np.empty((2, scales.size, len(plain), storeys + 1))
        storey = np.empty((3, scales.size, len(plain), storeys))
        collapsed, isolator = np.zeros((scales.size, len(plain)), np.int64), np.empty((scales.size, len(plain)))
        for k, scale in enumerate(scales.tolist()):
            for i, record in enumerate(plain):
                response = self._respond(record, scale)
                ground = scale * record.acceleration[: response.end + 1]
                speed = np.concatenate([[0.0], np.cumsum(0.5 * record.dt * (ground[1:] + ground[:-1]))])
                floor[0, k, i] = np.abs(response.accelerations[:, : response.end + 1]).max(axis=1)
                floor[1, k, i] = np.abs(response.velocities[:, : response.end + 1] + speed).max(axis=1)
                isolator[k, i] = response.isolator
                storey[:, k, i] = response.peaks, response.ductility, response.residual
                collapsed[k, i] = response.collapsed
            warn(collapse_doubts([record.label for record in plain], collapsed[k], scale), CollapsingBuilding)
        on_floor, on_storey = ("factor", "motion", "floor"), ("factor", "motion", "storey")
        numbers = np.arange(1, storeys + 1)
        isolated = {"isolator_displacement": (("factor", "motion"), isolator, DISPLACEMENT)} if self.isolation else {}
        strengths = [self.strength_of(record.label) for record in plain]
        uncertain = {"strength_factor": ("motion", strengths, FACTOR)} if self.strength_dispersion > 0.0 else {}
        return xr.Dataset(
            {
                "pfa": (on_floor, floor[0], described("peak absolute floor acceleration", ACCELERATION)),
                "pfv": (on_floor, floor[1], described("peak absolute floor velocity", VELOCITY)),
                "drift": (on_storey, storey[0], described("greatest drift", METRE)),
                "ductility": (on_storey, storey[1], described("drift over yield drift")),
                "residual": (on_storey, storey[2], described("residual plastic drift", METRE)),
                "collapsed": (("factor", "motion"), collapsed, COLLAPSED),
                **isolated,
            },
            coords={
                **motion_coordinates(plain),
                **uncertain,
                **floor_coordinates(list(self.floors), self.heights),
                "factor": ("factor", scales, described("factor on the ground motions")),
                "storey": ("storey", numbers, described("storey, from the lowest")),
            },
            attrs={
                "title": "Response of a yielding building",
                **provenance({"building": self._described(), "factors": scales.tolist()}),
                "building": json.dumps(self._described(), ensure_ascii=False),
            },
        )

    def strength_of(self, label: str) -> float:
        """Return the factor on all strengths of the building that a motion of this name meets.

        Examples
        --------
        >>> from toppling import motions
        >>> weak = motions.Yielding(0.2, strength_dispersion=0.3)
        >>> frame = motions.Building.from_storeys([1e5], [4e7], yielding=weak)
        >>> [round(frame.strength_of(name), 3) for name in ("Kobe", "Imperial Valley")]
        [1.45, 0.884]
        """
        if self.strength_dispersion == 0.0:
            return 1.0
        return math.exp(self.strength_dispersion * float(stream(self.seed, *key_of(label)).standard_normal()))

    def _respond(self, record: Record, factor: float) -> Response:
        strength = self.strength_of(record.label)
        yields = strength * self.yield_drifts
        mass = np.array(self.masses)
        of_mass, of_stiffness = self.damping
        storeys = np.array([self.stiffnesses, yields, self.hardening, self.p_delta, of_stiffness * self.stiffnesses])
        limits = self.collapse_drift * np.diff(self.heights)
        below = 0  # (storeys below the building)
        if self.isolation is not None:
            base = self.isolation.storey(float(mass.sum()))
            mass, below = np.append(base.mass, mass), 1
            column = np.array([base.stiffness, base.yield_drift, base.hardening, 0.0, base.viscosity])
            storeys, limits = np.column_stack([column, storeys]), np.append(np.inf, limits)
        size, first = record.acceleration.size, 1 - below
        accelerations, velocities = np.zeros((2, mass.size + first, size))
        peaks, residual = np.empty((2, mass.size))
        ground = factor * record.acceleration
        _, storey, end = storey_response(
            ground,
            record.dt,
            mass,
            storeys,
            of_mass,
            limits,
            accelerations[first:],
            velocities[first:],
            peaks,
            residual,
        )
        if self.isolation is None:
            accelerations[0] = ground
        drifts = peaks[below:]
        return Response(
            accelerations,
            velocities,
            drifts,
            residual[below:],
            storey + first if storey >= 0 else 0,
            end,
            drifts / yields,
            strength,
            float(peaks[0]) if below else 0.0,
        )

    def _described(self) -> dict[str, Any]:
        return {
            "description": self.description,
            "strengths": self.strengths.tolist() if np.isfinite(self.strengths).all() else "elastic",
            "isolation": "" if self.isolation is None else self.isolation.text,
            "hardening": self.hardening.tolist(),
            "p_delta": self.p_delta.tolist(),
            "collapse_drift": self.collapse_drift,
            "strength_dispersion": self.strength_dispersion,
            "seed": self.seed,
        }


def chosen_floors(floors: Any, known: Sequence[int]) -> list[int]:
    """Return the requested floors of a building, by default all known floors."""
    if floors is None:
        return list(known)
    if isinstance(floors, str) or not checks.is_several(floors):
        raise TypeError(f"floors must be a sequence of floors, got {checks.kind(floors)}")
    chosen = [checks.count("floors", floor) for floor in floors]
    if not chosen or len(set(chosen)) != len(chosen) or max(chosen) > known[-1]:
        raise ValueError(f"floors must be different numbers from 0 (ground) to {known[-1]} (roof), got {chosen!r:.80}")
    return chosen


def yielding_building(
    masses: Array,
    stiffnesses: Array,
    omega: Array,
    damping: Any,
    heights: Array,
    text: str,
    yielding: Yielding | None,
    isolation: Isolation | None = None,
) -> YieldingBuilding:
    """Return the yielding building of checked masses, stiffnesses and frequencies omega (mode,), rad/s, lowest first.

    Rayleigh damping has the ratio at the first and the last mode; one storey has mass-proportional damping. On
    isolators it is proportional to stiffness alone, with the ratio at the first mode on a fixed base. Storeys are
    elastic without `yielding`.
    """
    if yielding is not None and not isinstance(yielding, Yielding):
        raise TypeError(f"yielding must be Yielding(yield_coefficient, …), got {checks.shown(yielding)}")
    ratio = RATIO.number("damping", damping)
    weight = STANDARD_GRAVITY * masses
    strengths = np.full(masses.size, math.inf)
    if yielding is not None:
        strengths = _strengths(yielding.yield_coefficient, weight, heights, 2.0 * math.pi / float(omega[0]))
    after = yielding or Yielding(1.0)  # (storeys that do not yield have the defaults)
    theta = _stability(after.p_delta, weight, stiffnesses, heights)
    if isolation is not None:
        factors = (0.0, 2.0 * ratio / float(omega[0]))
        below = isolation.storey(float(masses.sum()))
        refuse_light(
            np.append(below.mass, masses),
            np.append(below.stiffness, stiffnesses),
            np.append(below.viscosity, factors[1] * stiffnesses),
        )
    elif masses.size == 1:
        factors = (2.0 * ratio * float(omega[0]), 0.0)
    else:
        of_stiffness = 2.0 * ratio / float(omega[0] + omega[-1])
        factors = (of_stiffness * float(omega[0] * omega[-1]), of_stiffness)
    texts = [text, *([isolation.text] if isolation else []), *([yielding.text] if yielding else [])]
    return YieldingBuilding(
        masses,
        stiffnesses,
        strengths,
        np.full(masses.size, float(after.hardening)),
        theta,
        factors,
        heights,
        COLLAPSE_DRIFT,
        float(after.strength_dispersion),
        int(after.seed),
        isolation,
        ", ".join(texts),
    )


def _strengths(coefficient: Any, weight: Array, heights: Array, period: float) -> Array:
    """Return the storeys' yield strengths, N: those given over the total weight, or by the code's lateral forces.

    Forces grow with w h^k, k = 1 up to 0.5 s, 2 from 2.5 s on (ASCE/SEI 7-22, 12.8.3).
    """
    given = np.asarray(coefficient, float)
    warn([*unusual({"yield coefficient": given}), *strength_doubts(np.atleast_1d(given))])
    if given.ndim == 1:
        if given.size != weight.size:
            raise ValueError(f"yield_coefficient must be one number or {weight.size}, one a storey, got {given.size}")
        return np.asarray(given * weight.sum())
    exponent = min(2.0, max(1.0, 1.0 + (period - 0.5) / 2.0))
    forces = weight * power(heights[1:], exponent)
    return np.asarray(float(given) * weight.sum() * np.cumsum(forces[::-1])[::-1] / forces.sum())


def _stability(p_delta: Any, weight: Array, stiffnesses: Array, heights: Array) -> Array:
    """Return theta = P/(k h) of the storeys: none, of the weight above (True), or as given; below 1."""
    if p_delta is None or p_delta is False:
        return np.zeros(weight.size)
    if p_delta is True:
        p_delta = RATIO.array(P_DELTA, np.cumsum(weight[::-1])[::-1] / (stiffnesses * np.diff(heights)))
    theta = np.asarray(p_delta, float)
    if theta.ndim == 1 and theta.size not in (1, weight.size):
        raise ValueError(f"p_delta must be one number or {weight.size}, one a storey, got {theta.size}")
    return np.array(np.broadcast_to(theta, weight.size))


def _ground(motions: Any) -> list[Record]:
    """Return the plain records of ground motions of one component."""
    if isinstance(motions, xr.DataArray) and "floor" in motions.dims:
        raise ValueError("motions must be ground motions (motion, time), got floor motions")
    plain = records(motions)
    if any(record.axes or record.vertical is not None for record in plain):
        raise ValueError("motions must be of one horizontal component (motions.as_recorded) for a yielding building")
    if any(record.own_level for record in plain):
        raise ValueError("motions must be of the ground, got some of a floor that yields or of an isolator")
    warn(record_doubts(plain))
    return plain
