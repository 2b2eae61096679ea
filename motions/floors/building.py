"""Elastic buildings, and the floor motions that they make of ground motions.

Modes are integrated exactly for ground acceleration that is linear between samples (`kernels.oscillators`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, overload

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import warn
from ...core.parameters import RATIO, Parameter
from ...core.units import ACCELERATION, VELOCITY, described, provenance
from ..arrays import (
    BOTH_AXES,
    HORIZONTAL,
    WEAK_AXIS,
    Record,
    floor_array,
    floor_coordinates,
    motion_coordinates,
    records,
    shakes_of,
)
from ..kernels import oscillators as engine
from ..plausibility import building_doubts, record_doubts, ringing_doubts, storey_doubts, unusual
from ..supports.isolator import Isolator
from ..supports.support import Support
from .isolation import BaseMass, Isolation
from .modes import MOST_BEAM_MODES, beam_modes, storey_modes
from .yielding import Yielding, YieldingBuilding, chosen_floors, yielding_building

PERIOD = Parameter("s", at_least=1e-3, at_most=100.0)
ALPHA0 = Parameter(at_least=0.0, at_most=1e4)
MAX_STOREYS = 500
MOST_PARTS = 1000
Damping = Annotated[float | Sequence[float], RATIO]
USUAL_DAMPING = 0.05
StoreyHeight = Annotated[float | Sequence[float], Parameter("m", above=0.0)]
USUAL_STOREY = 3.0
Modes = Annotated[int, Parameter(at_least=1)]
MASS, STIFFNESS = Parameter("kg", above=0.0), Parameter("N/m", above=0.0)
Masses = Annotated[Any, MASS]
Stiffnesses = Annotated[Any, STIFFNESS]
MOST_SAMPLES = 500_000_000  # 4 GB


@dataclass(frozen=True, eq=False)
class Building:
    """Elastic building, described by its modes at the floors; made by `flexural_shear` or `from_storeys`.

    Attributes
    ----------
    periods, damping : ndarray, shape (mode,)
        Periods, s, longest first, and damping ratios.
    shares : ndarray, shape (mode, floor)
        Modal participation times shape at every floor; the shares of the roof are the participation factors of shapes
        that are 1 at the roof.
    heights : ndarray, shape (floor,)
        Height of the floors above the ground, m.  Floor 0 is the ground, the last floor the roof.
    description : str
        Text that states the parameters of the building.

    Notes
    -----
    With u_i the relative displacement of an oscillator of mode i, the absolute acceleration of floor f is a + sum_i
    shares[i, f] u_i''. Its absolute velocity is v + sum_i shares[i, f] u_i'. Omitted modes are thereby rigid: their
    share 1 - sum_i shares[i, f] moves with the ground (the static correction of the missing mass). Every floor thus
    follows a slow ground motion exactly, with any number of modes.
    """

    periods: Array
    damping: Array
    shares: Array
    heights: Array
    description: str

    def __post_init__(self) -> None:
        for name in ("periods", "damping", "shares", "heights"):
            values = checks.numbers(name, getattr(self, name))
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    def __repr__(self) -> str:
        return self.description

    @classmethod
    def flexural_shear(
        cls,
        period: Annotated[float, PERIOD],
        damping: Damping = USUAL_DAMPING,
        alpha0: Annotated[float, ALPHA0] = 5.0,
        storeys: Annotated[int, Parameter(at_least=1, at_most=MAX_STOREYS)] = 5,
        storey_height: StoreyHeight = USUAL_STOREY,
        modes: Modes = 6,
    ) -> Building:
        """Return a uniform cantilever with flexural and shear deformation.

        Parameters
        ----------
        period : float
            Fundamental period, s.
        damping : float or sequence of float
            Damping ratio of all modes, or of each.
        alpha0 : float
            Flexural-shear parameter: a bending beam has 0, a shear beam 10 000. It is roughly below 2 for walls, above
            5 for moment frames, and between 2 and 5 for both together.
        storeys : int
            Number of storeys; its floors are 0 (ground) to storeys (roof).
        storey_height : float or sequence of float
            Height of all storeys, or of each, m.
        modes : int
            Number of modes; the others move with the ground.

        Notes
        -----
        Mode shapes, period ratios and participation factors of the uniform beam (`modes.beam_modes`).

        References
        ----------
        Miranda, E. and Taghavi, S. (2005). Approximate floor acceleration demands in multistory buildings. I:
        Formulation. Journal of Structural Engineering 131(2), 203-211.

        Examples
        --------
        >>> building = Building.flexural_shear(1.0, alpha0=5.0, storeys=10)
        >>> [round(float(period), 3) for period in building.periods[:3]], round(float(building.shares[0, -1]), 3)
        ([1.0, 0.283, 0.132], 1.394)
        """
        PERIOD.check("period", period)
        ALPHA0.check("alpha0", alpha0)
        first, shape = float(period), float(alpha0)
        number = _up_to("storeys", storeys, MAX_STOREYS)
        count = _up_to("modes", modes, MOST_BEAM_MODES)
        heights = storey_heights(storey_height, number)
        of_modes = _damping(damping, count)
        warn(building_doubts(first, damping, heights))
        ratios, shares = beam_modes(shape, count, heights / heights[-1])
        text = (
            f"flexural-shear building, {number} storeys, {heights[-1]:g} m, T1 = {first:g} s, alpha0 = {shape:g}, "
            f"{count} modes, {_damping_text(damping)}"
        )
        return cls(first / ratios, of_modes, shares, heights, text)

    @classmethod
    def from_storeys(
        cls,
        masses: Masses,
        stiffnesses: Stiffnesses,
        damping: Damping = USUAL_DAMPING,
        storey_height: StoreyHeight = USUAL_STOREY,
        modes: Modes | None = None,
        *,
        yielding: Yielding | None = None,
    ) -> Building | YieldingBuilding:
        """Return a shear building: storeys as masses on springs, from the lowest storey upwards.

        Parameters
        ----------
        masses : array_like, shape (storey,)
            Mass of each floor from the lowest up, kg.
        stiffnesses : array_like, shape (storey,)
            Stiffness of the storey below each floor, N/m.
        damping : float or sequence of float
            Damping ratio of all modes, or of each.
        storey_height : float or sequence of float
            Height of all storeys, or of each, m.
        modes : int, optional
            Number of modes; all if not given.  A building that yields has all of them.
        yielding : Yielding, optional
            Strength of the storeys; the building is elastic if not given.

        Returns
        -------
        Building or YieldingBuilding
            The latter with `yielding`. Its storeys are bilinear, and damped in proportion to masses and
            initial stiffnesses, with the ratio `damping` (one number) at the first and the last mode.

        Raises
        ------
        TypeError, ValueError
            Masses and stiffnesses of different number or not positive, a value out of range; modes of a building that
            yields.

        Examples
        --------
        >>> building = Building.from_storeys([1e5, 1e5], [4e7, 4e7])
        >>> [round(float(period), 3) for period in building.periods]
        [0.508, 0.194]
        """
        m, k, omega, shares = _chain(masses, stiffnesses)
        count = m.size if modes is None else _up_to("modes", modes, m.size)
        heights = storey_heights(storey_height, m.size)
        of_modes = _damping(damping, count)
        warn([*building_doubts(2.0 * math.pi / float(omega[0]), damping, heights), *storey_doubts(m, k)])
        if yielding is not None:
            if modes is not None:
                raise ValueError("modes must be left out where storeys yield: the building has all of them")
            text = f"shear building, {m.size} storeys, {heights[-1]:g} m, T1 = {2.0 * math.pi / omega[0]:.4g} s"
            text += f", {_damping_text(damping)}"
            return yielding_building(m, k, omega, damping, heights, text, yielding)
        at_floors = np.concatenate([np.zeros((count, 1)), shares[:count]], axis=1)
        text = (
            f"shear building, {m.size} storeys, {heights[-1]:g} m, T1 = {2.0 * math.pi / omega[0]:.4g} s, {count} "
            f"modes, {_damping_text(damping)}"
        )
        return cls(2.0 * math.pi / omega[:count], of_modes, at_floors, heights, text)

    @classmethod
    def isolated(
        cls,
        isolator: Isolator | Support,
        base_mass: BaseMass,
        masses: Masses,
        stiffnesses: Stiffnesses,
        damping: Annotated[float, RATIO] = USUAL_DAMPING,
        storey_height: StoreyHeight = USUAL_STOREY,
        *,
        yielding: Yielding | None = None,
    ) -> YieldingBuilding:
        """Return a shear building on isolators: a slab on an isolation storey, and the storeys above it.

        Parameters
        ----------
        isolator : Isolator or Support
            `Isolator.linear(period, damping)` or `Isolator.bilinear(period, strength, yield_displacement)`, of the
            whole weight.
        base_mass : float
            Mass of the slab above the isolators, kg.
        masses, stiffnesses, storey_height
            As of `from_storeys`; floor 0 is the slab.
        damping : float
            Damping ratio of the storeys at their first mode on a fixed base. It is proportional to stiffness, so that
            higher modes have more and the isolators have none.
        yielding : Yielding, optional
            As of `from_storeys`, with the weight above the slab.

        Returns
        -------
        YieldingBuilding
            A building whose floors do not scale; its motions give the displacement of the isolators.

        Raises
        ------
        TypeError, ValueError
            As `from_storeys`; a pendulum, or stops; a slab or a floor so light that steps which follow it take minutes.

        Notes
        -----
        Uplift and torsion of the isolators, their P-delta and the wall of the moat are left out.

        Examples
        --------
        >>> from toppling import motions
        >>> ground = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        >>> lead = motions.Isolator.bilinear(2.5, 0.06)
        >>> building = motions.Building.isolated(lead, 2e5, [2e5, 2e5], [2e8, 2e8])
        >>> floors = building.floor_motions(ground, [0, 2])
        >>> bool((abs(floors).max("time") < abs(ground).max("time")).all()), floors["isolator_displacement"].dims
        (True, ('motion',))
        """
        m, k, omega, _ = _chain(masses, stiffnesses)
        isolation = Isolation(isolator, base_mass)
        heights = storey_heights(storey_height, m.size)
        slab = unusual({"mass of the slab on isolators over a floor's": isolation.base_mass / m.mean()})
        warn([*building_doubts(2.0 * math.pi / float(omega[0]), damping, heights), *storey_doubts(m, k), *slab])
        text = f"isolated shear building, {m.size} storeys, {heights[-1]:g} m, T1 on a fixed base = "
        text += f"{2.0 * math.pi / omega[0]:.4g} s, {_damping_text(damping)}"
        return yielding_building(m, k, omega, damping, heights, text, yielding, isolation)

    @property
    def floors(self) -> tuple[int, ...]:
        """The floors: 0 (ground) to the number of storeys (roof)."""
        return tuple(range(self.heights.size))

    @property
    def participation(self) -> Array:
        """Participation factors (mode,) of mode shapes that are 1 at the roof."""
        return self.shares[:, -1].copy()

    @overload
    def floor_motions(
        self, motions: xr.DataArray, floors: Sequence[int] | None = None, parts: int = 1
    ) -> xr.DataArray: ...

    @overload
    def floor_motions(
        self, motions: Sequence[xr.DataArray], floors: Sequence[int] | None = None, parts: int = 1
    ) -> list[xr.DataArray]: ...

    def floor_motions(
        self, motions: xr.DataArray | Sequence[xr.DataArray], floors: Sequence[int] | None = None, parts: int = 1
    ) -> xr.DataArray | list[xr.DataArray]:
        """Return the absolute acceleration histories of floors.

        Parameters
        ----------
        motions : xarray.DataArray or a sequence of them
            Ground motions (motion, time), m s-2, from rest.  The response ends with them: add zeros for free vibration.
            Or pairs of components (motion, component, time), as `motions.both_axes` returns them: h1 is in the
            direction x of the building and h2 in y.
        floors : sequence of int, optional
            Floors, 0 (ground) to the number of storeys (roof); all if not given.
        parts : int
            Samples of the result per step of the ground motion (default 1): take more if the shortest period of
            interest is not long compared with the time step.  The response at a sample is exact for any number.

        Returns
        -------
        xarray.DataArray or a list of them
            One array for each array of ground motions: ``acceleration`` (motion, floor, time), m s-2, with ``height``
            (m) on floor, ready for `toppling.ida` and `toppling.motions.measures`. On motion, ``ringing`` is the
            maximum acceleration of the highest of the floors relative to the ground in the last fundamental period,
            over its peak. Floor motions that end with more than a fifth of it cause a warning. Of pairs (motion,
            component, floor, time): the building is the same in x and y, and does not twist.

        Raises
        ------
        TypeError, ValueError
            As `toppling.motions.records`; floor motions instead of ground motions, a floor that the building has not,
            more than 5e8 samples.

        Examples
        --------
        >>> from toppling import motions
        >>> ground = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        >>> dict(Building.flexural_shear(0.8, storeys=4).floor_motions(ground, floors=[2, 4]).sizes)
        {'motion': 2, 'floor': 2, 'time': 2624}
        """
        chosen = chosen_floors(floors, self.floors)
        cut = _up_to("parts", parts, MOST_PARTS)
        arrays = [motions] if isinstance(motions, xr.DataArray) else _several(motions)
        moved = [self._moved(array, chosen, cut) for array in arrays]
        warn(ringing_doubts(moved))
        return moved[0] if isinstance(motions, xr.DataArray) else moved

    def peaks(
        self, motions: xr.DataArray | Iterable[xr.DataArray], floors: Sequence[int] | None = None, parts: int = 1
    ) -> xr.Dataset:
        """Return peak absolute floor acceleration and velocity, without histories.

        Parameters
        ----------
        motions, floors, parts
            As in `floor_motions`; the peaks are those at the samples.

        Returns
        -------
        xarray.Dataset
            ``pfa`` (m s-2) and ``pfv`` (m s-1) on (motion, floor), with ``height`` on floor and dt, duration and source
            on motion.  The velocity is absolute: the velocity of the ground, from zero and not corrected, plus the
            velocity of the building.

        Examples
        --------
        >>> from toppling import motions
        >>> ground = motions.CloughPenzien(duration=5.0, dt=0.01).sample(3)
        >>> dict(Building.flexural_shear(0.8, storeys=4).peaks(ground).sizes)
        {'motion': 3, 'floor': 5}
        """
        chosen = chosen_floors(floors, self.floors)
        cut = _up_to("parts", parts, MOST_PARTS)
        arrays = [motions] if isinstance(motions, xr.DataArray) else _several(motions)
        for array in arrays:
            _ground(array)
        plain = records(arrays)
        peaks = np.empty((2, len(plain), len(chosen)))
        none = np.empty((0, 0))
        for i, record in enumerate(plain):
            self._respond(record, chosen, cut, none, peaks[0, i], peaks[1, i])
        dims = ("motion", "floor")
        return xr.Dataset(
            {
                "pfa": (dims, peaks[0], described("peak absolute floor acceleration", ACCELERATION)),
                "pfv": (dims, peaks[1], described("peak absolute floor velocity", VELOCITY)),
            },
            coords={**motion_coordinates(plain), **floor_coordinates(chosen, self.heights[chosen])},
            attrs={
                "title": "Peak floor motions",
                **provenance({"building": self._described(), "parts": cut}),
                "building": json.dumps(self._described(), ensure_ascii=False),
            },
        )

    def _moved(self, array: xr.DataArray, floors: list[int], parts: int) -> xr.DataArray:
        """Return the motions of floors under one array of ground motions, of each component of pairs."""
        if not isinstance(array, xr.DataArray) or shakes_of(array) not in (BOTH_AXES, WEAK_AXIS):
            return self._histories(_ground(array), floors, parts)
        _refuse_vertical(records(array))
        both = array.sel(component=list(HORIZONTAL))
        x, y = (self._histories(_ground(both.sel(component=name, drop=True)), floors, parts) for name in HORIZONTAL)
        ringing = np.maximum(x["ringing"].values, y["ringing"].values)
        return xr.DataArray(
            np.stack([x.values, y.values], axis=1),
            dims=("motion", "component", "floor", "time"),
            coords={
                **{name: coordinate.variable for name, coordinate in x.coords.items()},
                "ringing": ("motion", ringing, x["ringing"].attrs),
                **{name: both.coords[name].variable for name in ("component", "azimuth", "shakes")},
            },
            name=x.name,
            attrs=x.attrs,
        )

    def _described(self) -> dict[str, Any]:
        return {"description": self.description, "periods": self.periods.tolist(), "damping": self.damping.tolist()}

    def _respond(self, record: Record, floors: list[int], parts: int, history: Array, pfa: Array, pfv: Array) -> None:
        engine.floor_response(
            record.acceleration,
            record.dt,
            parts,
            2.0 * math.pi / self.periods,
            self.damping,
            np.ascontiguousarray(self.shares[:, floors]),
            history,
            pfa,
            pfv,
        )

    def _histories(self, ground: list[Record], floors: list[int], parts: int) -> xr.DataArray:
        n = (ground[0].acceleration.size - 1) * parts + 1
        if len(ground) * len(floors) * n > MOST_SAMPLES:
            raise ValueError(
                f"floor motions must have at most {MOST_SAMPLES:.0e} samples in all, got {len(ground)} motions x "
                f"{len(floors)} floors x {n}: make them in parts, or take peaks"
            )
        values = np.empty((len(ground), len(floors), n))
        unused = np.empty((2, len(floors)))
        highest = int(np.argmax(floors))
        ringing = np.zeros(len(ground))
        last = math.ceil(float(self.periods[0]) / ground[0].dt * parts)
        for i, record in enumerate(ground):
            self._respond(record, floors, parts, values[i], unused[0], unused[1])
            moved = np.interp(np.arange(n) / parts, np.arange(record.acceleration.size), record.acceleration)
            relative = np.abs(values[i, highest] - moved)
            if floors[highest] > 0 and relative.max() > 0.0:
                ringing[i] = relative[-last:].max() / relative.max()
        step = ground[0].dt / parts
        labels = [record.label for record in ground]
        sources = [f"{self.description}, {record.source}" for record in ground]
        amplitudes = [record.own_amplitude for record in ground]
        text = "relative acceleration of the highest floor in the last fundamental period, over its peak"
        return (
            floor_array(values, step, labels, sources, floors, self.heights[floors], amplitudes)
            .assign_coords(ringing=("motion", ringing, described(text)))
            .assign_attrs(building=json.dumps(self._described(), ensure_ascii=False))
        )


def _several(motions: Any) -> list[xr.DataArray]:
    """Return a sequence of arrays as a list; ValueError if a label is used twice."""
    arrays = list(motions) if checks.is_several(motions) else [motions]
    records(arrays)
    return arrays


def _ground(array: Any) -> list[Record]:
    """Return the plain records of one array of ground motions."""
    if isinstance(array, xr.DataArray) and "floor" in array.dims:
        raise ValueError("motions must be ground motions (motion, time), got floor motions")
    plain = records(array)
    if any(record.axes for record in plain):
        raise ValueError("motions must be of one component (motions.as_recorded): peaks are of one direction")
    _refuse_vertical(plain)
    warn(record_doubts(plain))
    return plain


def _refuse_vertical(plain: list[Record]) -> None:
    """Raise a ValueError for motions with a vertical component, because its change by floors is not modelled."""
    if any(record.vertical is not None for record in plain):
        raise ValueError(
            "a building answers horizontal shaking alone: its floors have no vertical motion "
            "(motions.as_recorded without vertical, motions.vertical = false in a study)"
        )


def _up_to(name: str, value: Any, most: int) -> int:
    number = checks.count(name, value, at_least=1)
    if number > most:
        raise ValueError(f"{name} must be at most {most}, got {number}")
    return number


def storey_heights(storey_height: Any, storeys: int) -> Array:
    """Return the heights of the floors (storeys + 1,), m, with the ground at 0."""
    values = checks.finite_array("storey_height", storey_height, ndim=(0, 1), unit="m")
    if values.ndim == 1 and values.size != storeys:
        raise ValueError(f"storey_height must be one number or {storeys}, one a storey, got {values.size}")
    if values.min() <= 0.0:
        raise ValueError(f"storey_height must be > 0 (in m), got {values.min():g}")
    with np.errstate(over="ignore"):
        heights = np.concatenate([[0.0], np.cumsum(np.broadcast_to(values, storeys))])
    if not np.isfinite(heights[-1]):
        raise ValueError(f"storey_height must have a finite sum (in m), got {values.max():g} and {storeys} storeys")
    return heights


def _chain(masses: Any, stiffnesses: Any) -> tuple[Array, Array, Array, Array]:
    """Return checked masses, kg, and stiffnesses, N/m, with frequencies and shares of their modes (`storey_modes`)."""
    m, k = np.atleast_1d(MASS.array("masses", masses), STIFFNESS.array("stiffnesses", stiffnesses))
    if m.size != k.size or m.size > MAX_STOREYS:
        raise ValueError(f"masses and stiffnesses must be one a storey, 1 to {MAX_STOREYS}, got {m.size} and {k.size}")
    omega, shares = storey_modes(m, k)
    # limits within which the squares of the frequencies do not vanish in rounding
    shortest, longest = PERIOD.bounds["at_least"], PERIOD.bounds["at_most"]
    if not (omega[0] > 0.0 and 2.0 * math.pi / omega[0] <= longest and 2.0 * math.pi / omega[-1] >= shortest):
        raise ValueError(
            f"masses and stiffnesses must give periods between {shortest:g} and {longest:g} s, got "
            f"{2.0 * math.pi / omega[-1]:g} to {2.0 * math.pi / max(omega[0], 1e-300):g} s"
        )
    return m, k, omega, shares


def _damping(damping: Any, modes: int) -> Array:
    values = RATIO.array("damping", damping)
    if values.ndim == 1 and values.size != modes:
        raise ValueError(f"damping must be one number or {modes}, one a mode, got {values.size}")
    return np.array(np.broadcast_to(values, modes))


def _damping_text(damping: Any) -> str:
    return f"damping {np.array2string(np.asarray(damping), threshold=10)}"
