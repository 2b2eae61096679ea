"""Response histories of one block under one motion, as labelled datasets; the engine computes them."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from ..core import checks
from ..core.aliases import Array
from ..core.doubts import HIGHEST_PGA, HIGHEST_RECORD, IMPOSSIBLE_PGA, Doubt, by_study, warn
from ..core.labelled import spare_dask
from ..core.units import (
    ACCELERATION,
    ANGULAR_ACCELERATION,
    ANGULAR_VELOCITY,
    METRE,
    RADIAN,
    SECOND,
    STANDARD_GRAVITY,
    VELOCITY,
    described,
    provenance,
    variables,
)
from ..core.wording import short_digits
from .block import Block, describe_block
from .engine import tables as engine
from .laws import Law, Model, describe_law, oscillator_of, refuse_endless
from .oscillator import Oscillator, exact_lever
from .outputs import COLUMNS, OUTPUTS, SLIDES
from .plausibility import block_doubts, law_doubts
from .restraint_force import held_by, largest_force
from .runs import Trace, leaves_floor, trace
from .scenes.edge import FALLEN_OFF
from .sliding.law import Sliding
from .sliding.mode import Mode, demand, mode_of
from .sliding.runs import airborne, friction_table, run_sliders
from .sliding_engine import tables as slips

spare_dask()

MAX_FREE_SAMPLES = 10_000_000
MAX_SPEED = 1e6
"""Largest speed of rotation (rad/s) that a run may begin with; at 1e100 its events never end."""
Variable = tuple[Any, str, str]
"""Values, unit and long name."""
_PLAIN = ("peak_rotation", "overturned", "uplifted", "impacts", "overturning_time")
_SIDED = ("peak_front", "peak_back", "wall_impacts", "wall_impact_velocity", "ruptured", "rupture_time", "final_state")


def simulate(
    block: Block,
    model: Model,
    motion: xr.DataArray,
    theta0: float = 0.0,
    omega0: float = 0.0,
) -> xr.Dataset:
    """Return the response history of one block under one motion.

    Parameters
    ----------
    block : Block
    model : law
        Any damping law, e.g. ``DiscreteDamping()``, or `Sliding`.
    motion : xarray.DataArray
        Exactly one motion, ``acceleration`` in m s-2 with a uniform ``time`` (s), as `toppling.motions` makes it. Of
        joined components (`motions.as_recorded`) it is the acting one, with the vertical component if that acts, too.
    theta0, omega0 : float
        Rotation (rad, |theta0| < pi/2) and angular velocity (rad/s) at the first sample.

    Returns
    -------
    xarray.Dataset
        On ``time``: rotation (rad), angular_velocity (rad/s), angular_acceleration (rad/s²), damping_moment and
        restoring_moment (per unit I_O, rad/s²).

        Scalars:

        - peak_rotation: rad, the true maximum of |theta|, also between samples and after the record; pi/2 if the block
          overturns;
        - overturned, uplifted;
        - impacts: inward crossings of the elastic zone's edge, or impacts at theta = 0, during the record and until the
          block rests. It rests when all later bounces would end within one sample;
        - overturning_time: s, NaN without overturning; the rotation then stays at +-pi/2;
        - with a wall, a restraint, an offset or a lean also peak_front, peak_back (rad), wall_impacts,
          wall_impact_velocity (rad/s), ruptured, rupture_time (s);
        - likewise final_state: 0 upright; 1 and -1 held beyond its balance at the front and the back; 2 and -2 fallen;
        - with a restraint also restraint_force (N): the maximum force of each of its parts, its strength if it broke.

        Of `Sliding`: slip (m) and slip_velocity (m/s) on ``time``; slide_peak, slide_forward, slide_backward,
        slide_residual, slide_path, slide_after (m), slide_velocity (m/s), slips, first_slip_time (s) and mode.

    Raises
    ------
    TypeError, ValueError
        An argument that is no Block, law or labelled motion; more than one motion; values that are not finite or out of
        range. A vertical component under a law that is not in exact geometry, or of more than g downward, under which
        the block leaves the floor.

    Notes
    -----
    The equation theta'' + damping_moment + restoring_moment = -gain u''(t) is solved in closed form between events (see
    `toppling.models`). Under a vertical component the restoring moment is from the weight m (g + a_v). At rest, the
    restoring moment of a rigid block balances the motion's moment.

    Examples
    --------
    >>> import toppling as tp
    >>> shake = tp.motions.OneCycleSine(amplitude=3.0, omega=12.0).sample(1)
    >>> run = simulate(Block(0.4, 1.8), tp.HousnerImpact(), shake)
    >>> bool(run.uplifted), bool(run.overturned)
    (True, False)
    """
    acceleration, vertical, dt, label, start = _single_motion(motion)
    _warn(block, model, _strength_doubts(motion, label, float(np.abs(acceleration).max())))
    theta = checks.number("theta0", theta0, above=-0.5 * math.pi, below=0.5 * math.pi, unit="rad")
    omega = checks.number("omega0", omega0, at_least=-MAX_SPEED, at_most=MAX_SPEED, unit="rad/s")
    if isinstance(model, Sliding) and isinstance(block, Block):
        if theta != 0.0 or omega != 0.0:
            raise ValueError(f"a sliding block does not rotate: theta0 and omega0 must be 0, got {theta0} and {omega0}")
        time = start + np.arange(acceleration.size, dtype=np.float64) * dt
        return _slide_history(block, model, acceleration, vertical, time, dt).assign_attrs(motion=label)
    if not isinstance(model, Law):
        raise TypeError(f"model must be a damping law such as DiscreteDamping(), or Sliding, got {checks.kind(model)}")
    oscillator = oscillator_of(block, model)
    if vertical is not None:
        _check_vertical(vertical, dt, start, label, model, oscillator)
    if theta == 0.0 and omega == 0.0:
        refuse_endless(block, model, acceleration.size * dt)
    run = trace(oscillator, acceleration, dt, theta, omega, vertical=vertical)
    time = start + np.arange(acceleration.size, dtype=np.float64) * dt
    dataset = _histories(block, model, oscillator, run, acceleration, time, vertical)
    return dataset.assign_attrs(motion=label)


def free_rocking(block: Block, model: Law, theta0: float, duration: float, dt: float = 0.001) -> xr.Dataset:
    """Return the free rocking of a block that is released from rest at a rotation.

    Parameters
    ----------
    block : Block
    model : law
    theta0 : float
        Initial rotation, rad, 0 < |theta0| < alpha.
    duration : float
        Length of the history, s, > 0.
    dt : float
        Time step of the history, s; it affects the output only, no other result.

    Returns
    -------
    xarray.Dataset
        As `simulate`, and peak_rotations (|theta| at the turning points, rad) and peak_times (s) on ``peak``.  The
        turning points are found exactly; peak 0 is theta0, and the list ends with `duration`, the block's rest or its
        last peak outside the elastic zone.

    Examples
    --------
    >>> import toppling as tp
    >>> block = Block.from_slenderness(0.2, 0.38)
    >>> decay = free_rocking(block, tp.HousnerImpact(e=0.925, geometry="linear"), 0.5 * block.alpha, 10.0)
    >>> (decay.peak_rotations[:3] / block.alpha).values.round(6)
    array([0.5     , 0.401434, 0.328487])
    """
    oscillator = oscillator_of(block, model)
    _warn(block, model)
    theta = checks.number("theta0", theta0, unit="rad")
    if not 0.0 < abs(theta) < block.alpha:
        raise ValueError(f"theta0 must satisfy 0 < |theta0| < alpha = {block.alpha:.4g} rad, got {theta!r}")
    length = checks.number("duration", duration, above=0.0, unit="s")
    step = checks.number("dt", dt, above=0.0, at_most=length, unit="s")
    if length / step >= MAX_FREE_SAMPLES:
        raise ValueError(f"duration/dt must be at most {MAX_FREE_SAMPLES:.0e} samples, got {length / step:.3g}")
    samples = round(length / step) + 1
    acceleration = np.zeros(samples)
    run = trace(oscillator, acceleration, step, theta)
    dataset = _histories(block, model, oscillator, run, acceleration, np.arange(samples, dtype=np.float64) * step)

    times, rotations, impacts = _free_peaks(block, model, oscillator, theta, length)
    peak = np.arange(rotations.size)
    return dataset.assign(
        impacts=((), impacts, dataset["impacts"].attrs),
        peak_rotations=("peak", rotations, described("absolute rotation at turning points", RADIAN)),
        peak_times=("peak", times, described("time of turning points", SECOND)),
    ).assign_coords(peak=("peak", peak, described("number of the turning point")))


def _warn(block: Block, model: Model, of_motion: Sequence[Doubt] = ()) -> None:
    """Warn a script of implausible numbers of a block, its law and its motion; studies note them themselves."""
    if isinstance(block, Block) and isinstance(model, Model) and not by_study():
        warn([*block_doubts([block]), *law_doubts([block], [model], ["mode"]), *of_motion])


def _strength_doubts(motion: xr.DataArray, label: str, peak: float) -> list[Doubt]:
    """Return the input warning on a ground motion that is stronger than any recording; floors have their own."""
    recorded = "recorded" in motion.coords and bool(motion["recorded"].values.any())
    highest = HIGHEST_RECORD if recorded else HIGHEST_PGA
    if "floor" in motion.coords or peak <= highest:
        return []
    name, reached = "record_strong" if recorded else "motion_strong", short_digits(peak / STANDARD_GRAVITY)
    values = {"of": "the motion", "named": f"{label}: {reached} g", "highest": highest / STANDARD_GRAVITY}
    return [Doubt.of(name, peak > IMPOSSIBLE_PGA, **values)]


def _free_peaks(
    block: Block, model: Law, oscillator: Oscillator, theta: float, duration: float
) -> tuple[Array, Array, int]:
    """Return times and |rotations| of the turning points of free rocking, from peak 0, and the number of impacts.

    The run has its own time grid, on the block's time scale, because the block is taken to be at rest if impacts
    accumulate within one step.
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
    inside = np.abs(rotations) < model.zone_edge(block)
    if inside.any():
        keep &= np.arange(rotations.size) < int(inside.argmax())
    impacts = int(run.results[engine.OUT_IMPACTS])
    return np.append(0.0, times[keep]), np.append(abs(theta), np.abs(rotations[keep])), impacts


def _check_vertical(vertical: Array, dt: float, start: float, label: str, model: Law, oscillator: Oscillator) -> None:
    """Raise ValueError for a vertical component that the law does not take, or that lifts the block off the floor."""
    if not oscillator.exact:
        raise ValueError(
            f"vertical shaking needs exact geometry, and {model.label!r} is linear in the rotation; take "
            'HousnerImpact() (the law "housner")'
        )
    left = np.flatnonzero(leaves_floor(1.0, -vertical))
    if left.size:
        raise ValueError(
            f"motion {label!r} must not fall faster than g, under which the block leaves the floor: its vertical "
            f"acceleration is {vertical[left[0]]:.4g} m/s² at {start + left[0] * dt:.4g} s"
        )


def _single_motion(motion: Any) -> tuple[Array, Array | None, float, str, float]:
    """Return acceleration, vertical acceleration (or None), step, label and start of exactly one labelled motion.

    The models do not import `toppling.motions`; the labelled array is read by its dims, coordinates and units alone.
    """
    if not isinstance(motion, xr.DataArray):
        raise TypeError(f"motion must be a labelled array as toppling.motions makes it, got {type(motion).__name__}")
    checks.plain("the motion", motion)
    vertical = None
    if "component" in motion.dims and "shakes" in motion.coords:
        if bool(motion.coords.get("lifts", False)):
            vertical = motion.sel(component="v", drop=True)
        motion = motion.sel(component=str(motion.coords["shakes"].values), drop=True)
    extra = [d for d in motion.dims if d != "time"]
    if "time" not in motion.dims or any(motion.sizes[d] != 1 for d in extra):
        raise ValueError(f"motion must be exactly one motion over time, got sizes {dict(motion.sizes)}; select one")
    checks.stated_unit("motion", motion, "m s-2")
    single = motion.isel(dict.fromkeys(extra, 0)).compute()
    label = str(single["motion"].item()) if "motion" in single.coords else "motion"
    values = checks.acceleration("motion", single.values)
    if values.size < 2:
        raise ValueError(f"motion must have at least 2 samples, got {values.size}")
    time = single["time"].values if "time" in single.coords else None
    dt = checks.time_step("motion", time, float(single["dt"].item()) if "dt" in single.coords else None)
    upward = None
    if vertical is not None:
        upward = checks.acceleration("motion", vertical.isel(dict.fromkeys(extra, 0)).values)
    return values, upward, dt, label, 0.0 if time is None else float(time[0])


def _histories(
    block: Block,
    model: Law,
    oscillator: Oscillator,
    run: Trace,
    acceleration: Array,
    time: Array,
    vertical: Array | None = None,
) -> xr.Dataset:
    theta = run.history[engine.HISTORY_THETA]
    omega = run.history[engine.HISTORY_OMEGA]
    region = run.history[engine.HISTORY_REGION].astype(int)
    damping = run.history[engine.HISTORY_DAMPING] * omega
    forcing = -oscillator.gain * acceleration
    # At rest the reaction of the floor balances the shaking; after overturning the block does not move either.
    restoring = forcing.copy()
    for index, part in enumerate(oscillator.regions):
        samples = region == index
        forcing[samples] *= part.gain
        if oscillator.exact:
            tilt = part.offset / part.stiffness
            weight = 1.0 if vertical is None else 1.0 + vertical[samples] / STANDARD_GRAVITY
            restoring[samples] = -part.stiffness * weight * np.sin(tilt - theta[samples])
            forcing[samples] *= np.cos(tilt - theta[samples]) * exact_lever(oscillator)
        else:
            restoring[samples] = part.stiffness * theta[samples] - part.offset
    on_time: dict[str, Variable] = {
        "rotation": (theta, RADIAN, "rotation"),
        "angular_velocity": (omega, ANGULAR_VELOCITY, "angular velocity"),
        "angular_acceleration": (forcing - damping - restoring, ANGULAR_ACCELERATION, "angular acceleration"),
        "damping_moment": (damping, ANGULAR_ACCELERATION, "damping moment per unit moment of inertia"),
        "restoring_moment": (restoring, ANGULAR_ACCELERATION, "restoring moment per unit moment of inertia"),
        "floor_acceleration": (acceleration, ACCELERATION, "floor acceleration"),
    }
    if vertical is not None:
        on_time["vertical_acceleration"] = (vertical, ACCELERATION, "vertical acceleration of the floor, upward")
    results = run.results
    scalars: dict[str, Variable] = {}
    for name in (*_PLAIN, *(_SIDED if oscillator.sided else ())):
        value = results[COLUMNS[name]] + (time[0] if OUTPUTS[name].units == SECOND else 0.0)
        scalars[name] = _of(name, OUTPUTS[name].kind(value).item())
    if block.restraint is not None:
        force = largest_force(
            held_by(block, oscillator),
            results[engine.OUT_FRONT],
            results[engine.OUT_BACK],
            results[engine.OUT_BROKEN] > 0.0,
            max(0.0, -acceleration.min()),
            max(0.0, acceleration.max()),
        )
        scalars["restraint_force"] = _of("restraint_force", float(force))
    title = "Rocking history of a freestanding block"
    return _dataset(title, block, model, time, on_time, scalars, alpha=block.alpha, R=block.R, p=block.p)


def _of(name: str, value: Any) -> Variable:
    """Return an output of the run with its unit and long name."""
    return value, OUTPUTS[name].units, OUTPUTS[name].text


def _dataset(
    title: str,
    block: Block,
    model: Model,
    time: Array,
    on_time: dict[str, Variable],
    scalars: dict[str, Variable],
    **about: float,
) -> xr.Dataset:
    """Return histories and results of one run as a dataset, with further attributes `about` its block."""
    return xr.Dataset(
        variables("time", on_time) | variables((), scalars),
        coords={"time": ("time", time, described("time", SECOND))},
        attrs={
            "title": title,
            "block": block.label,
            "model": model.label,
            **about,
            **provenance({"block": describe_block(block), "model": describe_law(model)}),
        },
    )


def _slide_history(
    block: Block, model: Sliding, acceleration: Array, vertical: Array | None, time: Array, dt: float
) -> xr.Dataset:
    """Return the history of one block that slides under one motion (n,), m/s²; `vertical` is the vertical acceleration.

    ValueError if the vertical acceleration takes the whole weight.
    """
    if vertical is not None and airborne(vertical, np.ones(1))[0]:
        at = int(np.argmin(vertical))
        raise ValueError(
            f"the vertical acceleration must stay above -g, so that the block keeps its weight, got {vertical[at]:g} "
            f"m/s² at {time[at]:g} s"
        )
    history = np.zeros((slips.HISTORY_ROWS, acceleration.size))
    slider = model.slider(block)
    run = run_sliders(friction_table([slider]), np.ones((1, 1)), acceleration, vertical, dt, False, None, history)[0, 0]
    results: dict[str, Any] = {name: run[column] for name, column in SLIDES.items()}
    results["slips"] = int(results["slips"])
    results["first_slip_time"] += time[0]
    on_time: dict[str, Variable] = {
        "slip": (history[slips.HISTORY_SLIP], METRE, "slip relative to the floor, to the front"),
        "slip_velocity": (history[slips.HISTORY_SPEED], VELOCITY, "velocity relative to the floor"),
        "floor_acceleration": (acceleration, ACCELERATION, "floor acceleration"),
    }
    if vertical is not None:
        on_time["vertical_acceleration"] = (vertical, ACCELERATION, "of the floor, upward")
    scalars = {name: _of(name, value) for name, value in results.items()}
    mode = Mode(int(mode_of(block, model.static, demand(acceleration, vertical, np.ones(1))[0])))
    scalars["mode"] = _of("mode", mode.value)
    if block.edge is not None:
        fell = block.edge.fallen_off(results["slide_forward"], results["slide_backward"], block.b)
        scalars[FALLEN_OFF] = _of(FALLEN_OFF, fell)
    return _dataset("History of a sliding block", block, model, time, on_time, scalars)
