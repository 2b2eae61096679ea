"""One block under one motion, in full: labelled histories.  Labels only; the engine does the rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..units import (
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    RADIAN,
    SECOND,
    provenance,
)
from . import _piecewise as engine
from .block import Block
from .laws import Law
from .oscillator import Oscillator
from .runs import Trace, trace

MAX_FREE_SAMPLES = 10_000_000


def simulate(
    block: Block,
    model: Law,
    motion: xr.DataArray,
    theta0: float = 0.0,
    omega0: float = 0.0,
) -> xr.Dataset:
    """The history of one block under one motion.

    Parameters
    ----------
    block : Block
    model : law
        Any damping law, e.g. ``DiscreteDamping()``.
    motion : xarray.DataArray
        Exactly one motion, ``acceleration`` in m s-2 with a uniform ``time`` (s), as `toppling.motions` makes it.
    theta0, omega0 : float
        Rotation (rad, |theta0| < pi/2) and angular velocity (rad/s) at the first sample.

    Returns
    -------
    xarray.Dataset
        On ``time``: rotation (rad), angular_velocity (rad/s), angular_acceleration (rad/s²), damping_moment and
        restoring_moment (per unit I_O, rad/s²); scalars peak_rotation (rad: the true maximum of |theta|, between
        samples and after the record too; pi/2 if overturned), overturned, uplifted, impacts (inward crossings of the
        elastic zone's edge, or impacts at theta = 0, during the record and before rest, which comes when all later
        bounces would end within one sample), overturning_time (s, NaN if it stands).
        After overturning the rotation stays at +-pi/2.

    Raises
    ------
    TypeError, ValueError
        No Block, law or labelled motion; more than one motion; values that are not finite or out of range.

    Notes
    -----
    theta'' + damping_moment + restoring_moment = -gain u''(t), solved in closed form between events (see
    `toppling.models`).  At rest, the restoring moment of a rigid block balances the shaking.

    Examples
    --------
    >>> import toppling as tp
    >>> shake = tp.motions.OneCycleSine(amplitude=3.0, omega=12.0).sample(1)
    >>> run = simulate(Block(0.4, 1.8), tp.HousnerImpact(), shake)
    >>> bool(run.uplifted), bool(run.overturned)
    (True, False)
    """
    oscillator = oscillator_of(block, model)
    acceleration, dt, label, start = _single_motion(motion)
    theta = checks.number("theta0", theta0, above=-0.5 * math.pi, below=0.5 * math.pi, unit="rad")
    omega = checks.number("omega0", omega0, unit="rad/s")
    run = trace(oscillator, acceleration, dt, theta, omega)
    time = start + np.arange(acceleration.size, dtype=np.float64) * dt
    dataset = _histories(block, model, oscillator, run, acceleration, time)
    return dataset.assign_attrs(motion=label)


def free_rocking(block: Block, model: Law, theta0: float, duration: float, dt: float = 0.001) -> xr.Dataset:
    """A block released from rest at a rotation, without shaking.

    Parameters
    ----------
    block : Block
    model : law
    theta0 : float
        Initial rotation, rad, 0 < |theta0| < alpha.
    duration : float
        Length of the history, s, > 0.
    dt : float
        Time step of the history, s: output only, it changes no result.

    Returns
    -------
    xarray.Dataset
        As `simulate`, and peak_rotations (|theta| at the turning points, rad) and peak_times (s) on ``peak``: found
        exactly, peak 0 is theta0, as far as `duration`, the block's rest or its last peak outside the elastic zone.

    Raises
    ------
    TypeError, ValueError
        As `simulate`; |theta0| >= alpha (it would just fall over).

    Examples
    --------
    >>> import toppling as tp
    >>> block = Block.from_slenderness(0.2, 0.38)
    >>> decay = free_rocking(block, tp.HousnerImpact(e=0.925, geometry="linear"), 0.5 * block.alpha, 10.0)
    >>> (decay.peak_rotations[:3] / block.alpha).values.round(6)
    array([0.5     , 0.401434, 0.328487])
    """
    oscillator = oscillator_of(block, model)
    theta = checks.number("theta0", theta0, unit="rad")
    if not 0.0 < abs(theta) < block.alpha:
        raise ValueError(f"theta0 must satisfy 0 < |theta0| < alpha = {block.alpha:.4g} rad, got {theta!r}")
    length = checks.number("duration", duration, above=0.0, unit="s")
    step = checks.number("dt", dt, above=0.0, at_most=length, unit="s")
    samples = round(length / step) + 1
    if samples > MAX_FREE_SAMPLES:
        raise ValueError(f"duration/dt must be at most {MAX_FREE_SAMPLES:.0e} samples, got {samples:.3g}")
    acceleration = np.zeros(samples)
    run = trace(oscillator, acceleration, step, theta)
    dataset = _histories(block, model, oscillator, run, acceleration, np.arange(samples, dtype=np.float64) * step)

    times, rotations, impacts = _free_peaks(block, model, oscillator, theta, length)
    peak = np.arange(rotations.size)
    return dataset.assign(
        impacts=((), impacts, dataset["impacts"].attrs),
        peak_rotations=("peak", rotations, {"units": RADIAN, "long_name": "absolute rotation at turning points"}),
        peak_times=("peak", times, {"units": SECOND, "long_name": "time of turning points"}),
    ).assign_coords(peak=("peak", peak, {"units": DIMENSIONLESS, "long_name": "number of the turning point"}))


def _free_peaks(
    block: Block, model: Law, oscillator: Oscillator, theta: float, duration: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Times and |rotations| of the turning points of free rocking, from peak 0, and the number of impacts.

    A grid of its own, of the block's time scale: where impacts accumulate within one step the block is at rest.
    """
    step = 0.01 / block.p
    quiet = np.zeros(max(2, min(math.ceil(duration / step) + 1, MAX_FREE_SAMPLES)))
    room = 4096
    while True:
        run = trace(oscillator, quiet, duration / (quiet.size - 1), theta, max_turning_points=room)
        if run.turning_points.shape[1] < room:
            break
        room *= 4
    times, rotations = run.turning_points
    keep = times <= duration
    delta = getattr(model, "delta", None)
    if delta is not None:
        inside = np.abs(rotations) < delta * block.alpha
        if inside.any():
            keep &= np.arange(rotations.size) < int(inside.argmax())
    impacts = int(run.results[engine.OUT_IMPACTS])
    return np.append(0.0, times[keep]), np.append(abs(theta), np.abs(rotations[keep])), impacts


def oscillator_of(block: Any, model: Any) -> Oscillator:
    """The oscillator of a block under a law; TypeError where either is something else."""
    if not isinstance(block, Block):
        raise TypeError(f"block must be a toppling Block, got {checks.kind(block)}")
    if not isinstance(model, Law):
        raise TypeError(f"model must be a damping law such as DiscreteDamping(), got {checks.kind(model)}")
    return model.oscillator(block)


def _single_motion(motion: Any) -> tuple[NDArray[np.float64], float, str, float]:
    """Acceleration, step, label and start of exactly one labelled motion.

    Models know nothing of the motions room, so the labelled array is read by its contract: dims, units, dt.
    """
    if not isinstance(motion, xr.DataArray):
        raise TypeError(f"motion must be a labelled array as toppling.motions makes it, got {type(motion).__name__}")
    extra = [d for d in motion.dims if d != "time"]
    if "time" not in motion.dims or any(motion.sizes[d] != 1 for d in extra):
        raise ValueError(f"motion must be exactly one motion over time, got sizes {dict(motion.sizes)}; select one")
    checks.acceleration_units("motion", motion.attrs.get("units"))
    one = motion.isel(dict.fromkeys(extra, 0))
    label = str(one["motion"].item()) if "motion" in one.coords else "motion"
    values = checks.acceleration("motion", one.values)
    if values.size < 2:
        raise ValueError(f"motion must have at least 2 samples, got {values.size}")
    time = one["time"].values if "time" in one.coords else None
    dt = checks.time_step("motion", time, float(one["dt"].item()) if "dt" in one.coords else None)
    return values, dt, label, 0.0 if time is None else float(time[0])


def _histories(
    block: Block,
    model: Law,
    oscillator: Oscillator,
    run: Trace,
    acceleration: NDArray[np.float64],
    time: NDArray[np.float64],
) -> xr.Dataset:
    theta = run.history[engine.HISTORY_THETA]
    omega = run.history[engine.HISTORY_OMEGA]
    region = run.history[engine.HISTORY_REGION].astype(int)
    damping = run.history[engine.HISTORY_DAMPING] * omega
    forcing = -oscillator.gain * acceleration
    overturned = bool(run.results[engine.OUT_OVERTURNED])
    # At rest the floor's reaction takes whatever the shaking asks for; after overturning nothing moves either.
    restoring = forcing.copy()
    for index, part in enumerate(oscillator.regions):
        here = region == index
        if oscillator.exact:
            tilt = part.offset / part.stiffness
            restoring[here] = -part.stiffness * np.sin(tilt - theta[here])
            forcing[here] *= np.cos(tilt - theta[here]) / math.cos(tilt)
        else:
            restoring[here] = part.stiffness * theta[here] - part.offset
    angular_acceleration = forcing - damping - restoring

    def on_time(values: NDArray[np.float64], units: str, long_name: str) -> tuple[str, NDArray[np.float64], Any]:
        return "time", values, {"units": units, "long_name": long_name}

    def scalar(value: Any, units: str, long_name: str) -> tuple[tuple[()], Any, Any]:
        return (), value, {"units": units, "long_name": long_name}

    return xr.Dataset(
        {
            "rotation": on_time(theta, RADIAN, "rotation"),
            "angular_velocity": on_time(omega, ANGULAR_VELOCITY, "angular velocity"),
            "angular_acceleration": on_time(angular_acceleration, ANGULAR_ACCELERATION, "angular acceleration"),
            "damping_moment": on_time(damping, ANGULAR_ACCELERATION, "damping moment per unit moment of inertia"),
            "restoring_moment": on_time(restoring, ANGULAR_ACCELERATION, "restoring moment per unit moment of inertia"),
            "floor_acceleration": on_time(acceleration, "m s-2", "floor acceleration"),
            "peak_rotation": scalar(run.results[engine.OUT_PEAK], RADIAN, "peak absolute rotation"),
            "overturned": scalar(overturned, DIMENSIONLESS, "whether the block overturned"),
            "uplifted": scalar(bool(run.results[engine.OUT_UPLIFTED]), DIMENSIONLESS, "whether the block uplifted"),
            "impacts": scalar(int(run.results[engine.OUT_IMPACTS]), DIMENSIONLESS, "impacts during the record"),
            "overturning_time": scalar(
                run.results[engine.OUT_OVERTURN_TIME] + time[0], SECOND, "time of overturning, NaN if it stands"
            ),
        },
        coords={"time": on_time(time, SECOND, "time")},
        attrs={
            "title": "Rocking history of a freestanding block",
            "block": block.label,
            "model": model.label,
            "alpha": block.alpha,
            "R": block.R,
            "p": block.p,
            **provenance({"block": describe_block(block), "model": describe_law(model)}),
        },
    )


def describe_block(block: Block) -> dict[str, Any]:
    """Everything that makes the block, as plain values (SI)."""
    return {
        "name": block.label,
        "width": block.width,
        "height": block.height,
        "cm_height": block.cm_height,
        "inertia_factor": block.inertia_factor,
    }


def describe_law(model: Law) -> dict[str, Any]:
    """The law's short name and every option, as plain values."""
    return {"law": model.law, **model.options}
