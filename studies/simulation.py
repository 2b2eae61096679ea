"""One block under one motion, in full: what `toppling simulate` does.

A run, its lines for people, its JSON for programs, its table and its figure; `simulation_inputs` reads what it is told.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from .. import motions as shaking
from ..fragility import ida
from ..fragility.notes import NOT_MODELLED, block_notes
from ..fragility.reasons import (
    ELASTIC_MODE,
    REASONS,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SLIDES_WHILE_ROCKING,
    SQUAT,
    UNDECIDED,
)
from ..fragility.screen import screen
from ..models import Block, Law, simulate
from ..models.simulate import describe_law
from ..motions.arrays import records
from ..units import STANDARD_GRAVITY
from .simulation_inputs import built
from .tables import StudyError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AFTER = 1.0
"""Time that a history goes on after overturning, s, where that comes after the record."""
HISTORY = "history.csv"
_SLIDES = (SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT)


@dataclass(frozen=True)
class Simulation:
    """One block under one law and one motion (as it is before it is multiplied by `factor`)."""

    block: Block
    model: Law
    motion: xr.DataArray
    factor: float = 1.0

    @cached_property
    def shaken(self) -> xr.DataArray:
        """The motion as the block stands on it."""
        return (self.motion * self.factor).assign_attrs(self.motion.attrs)

    @cached_property
    def response(self) -> xr.Dataset:
        """As `toppling.simulate` returns it; StudyError where the block needs an explicit e."""
        return built(self.block.label, lambda: simulate(self.block, self.model, self.shaken))

    @cached_property
    def shown(self) -> xr.Dataset:
        """The history to look at: with quiet behind the record, as long as a block that falls then takes."""
        run = self.response
        late = float(run["overturning_time"]) - float(run["time"][-1])
        if not bool(run["overturned"]) or not late > 0.0:  # (NaN: it falls, at a time that rounding decides)
            return run
        longer = simulate(self.block, self.model, shaking.pad(self.shaken, 0.0, late + AFTER))
        # the ramp from the last sample to zero is more shaking: where it decides, the record's own run stands
        return longer if bool(longer["overturned"]) else run

    @cached_property
    def screened(self) -> xr.Dataset | None:
        """What speaks against the run; None where nothing shakes."""
        if not bool(self.motion.any()):
            return None
        outputs = ("overturned", "peak_rotation", "uplifted")
        runs = ida(self.block, self.model, self.motion, [self.factor], im="scale", outputs=outputs, screen=False)
        return screen(runs, self.motion, undecided=1.0)

    @property
    def pga(self) -> float:
        """Peak acceleration, m/s²."""
        return float(np.abs(self.shaken.values).max())

    @property
    def threshold(self) -> float:
        """Acceleration that just lifts a rigid block, g tan α, m/s²."""
        return STANDARD_GRAVITY * math.tan(self.block.alpha)

    @property
    def friction(self) -> dict[str, float]:
        """Coefficients of friction without which it slides instead: at uplift, while it rocks, at impact."""
        if self.screened is None:
            return {}
        names = {"uplift": "friction_uplift", "rocking": "friction_rocking_demand", "impact": "friction_impact"}
        found = {name: float(self.screened[variable].max()) for name, variable in names.items()}
        return {name: value for name, value in found.items() if math.isfinite(value)}

    @property
    def notes(self) -> list[str]:
        """What a user should know before trusting the run: one sentence each."""
        found = block_notes([self.block])
        if self.screened is not None:
            verdict = int(self.screened["verdict"].max())
            held = [reason for reason in REASONS if verdict & reason.bit and reason is not SQUAT]
            for reason in held:
                if reason is UNDECIDED:
                    found.append(f"undecided: {reason.text}; one motion tells little here, `toppling run` counts many")
                elif reason is ELASTIC_MODE:
                    found.append(f"{reason.text}: blocks uplift that should not")
                else:
                    more = ": that needs more friction than hardly any floor has" if reason in _SLIDES else ""
                    found.append(f"{reason.text}{more}")
        return [*found, NOT_MODELLED]

    def lines(self) -> list[str]:
        """All that the run found, for people."""
        run, block, motion = self.response, self.block, records(self.motion)[0]
        restitution = self.model.restitution(block)
        e = "" if restitution is None or self.model.options["e"] is not None else f", e_R = {restitution:.3f}"
        by = "" if self.factor == 1.0 else f", scaled by {self.factor:.4g}"
        ratio = self.pga / self.threshold
        peak = float(run["peak_rotation"])
        uplift = "uplifts" if bool(run["uplifted"]) else "does not uplift"
        if bool(run["overturned"]):
            side = "right" if float(self.shown["rotation"][-1]) > 0.0 else "left"
            at = float(run["overturning_time"])
            late = " (after the record)" if at > float(run["time"][-1]) else ""
            end = (
                f"overturned to the {side} at {at:.2f} s{late}" if math.isfinite(at) else "overturned after the record"
            )
            turned = f"{peak:.4g} rad: it lies on its side"
        else:
            end, turned = "stands", f"{peak:.4g} rad = {100.0 * peak / block.alpha:.3g} % of α"
        need = self.friction
        words = {"uplift": "at uplift", "rocking": "at the peak of the motion", "impact": "at impact"}
        name = "" if block.name is None else f"{block.name}, "
        sizes = f"{block.width:.3g} m × {block.height:.3g} m"
        rows = [
            ("block", f"{name}{sizes}, α = {block.alpha:.4g} rad, p = {block.p:.3g} rad/s"),
            ("law", f"{self.model.label}{e}"),
            ("motion", f"{motion.label}{by}: PGA {_g(self.pga)}, {motion.duration:g} s at {motion.dt:g} s"),
            ("uplift", f"{uplift}; g tan α = {_g(self.threshold)}, PGA is {ratio:.3g} times that"),
            ("peak rotation", turned),
            ("impacts", f"{int(run['impacts'])}"),
            ("end", end),
        ]
        if need:
            rows.append(("friction needed", ", ".join(f"{value:.2f} {words[name]}" for name, value in need.items())))
        return [f"{name + ':':<17}{text}" for name, text in rows]

    def content(self, files: Sequence[Path] = ()) -> dict[str, Any]:
        """All that the run found, for programs: SI, null where there is no number."""
        run, block, motion = self.response, self.block, records(self.motion)[0]
        at = float(run["overturning_time"])
        overturned = bool(run["overturned"])
        return {
            "block": {
                "name": block.name,
                "width": block.width,
                "height": block.height,
                "alpha": block.alpha,
                "R": block.R,
                "p": block.p,
            },
            "model": {**describe_law(self.model), "label": self.model.label, "e": self.model.restitution(block)},
            "motion": {
                "label": motion.label,
                "source": motion.source,
                "dt": motion.dt,
                "duration": motion.duration,
                "factor": self.factor,
                "pga": self.pga,
            },
            "uplift_acceleration": self.threshold,
            "uplifted": bool(run["uplifted"]),
            "peak_rotation": float(run["peak_rotation"]),
            "peak_rotation_over_alpha": float(run["peak_rotation"]) / block.alpha,
            "impacts": int(run["impacts"]),
            "overturned": overturned,
            "overturning_time": at if math.isfinite(at) else None,
            "direction": float(np.sign(self.shown["rotation"].values[-1])) if overturned else None,
            "friction": self.friction,
            "notes": self.notes,
            "files": [str(path) for path in files],
        }

    def write(self, folder: Path) -> list[Path]:
        """Write history.csv and history.png into a folder, made where missing; StudyError where that cannot be."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            table, figure = folder / HISTORY, folder / "history.png"
            write_history(self.shown, table)
            history_figure(self.shown).savefig(figure, dpi=150)
        except OSError as error:
            raise StudyError(f"{folder}: cannot be written ({error.strerror or error})") from None
        return [table, figure]


def write_history(response: xr.Dataset, path: Path) -> None:
    """A history as CSV, one line a sample, units in the first line."""
    columns = {
        "time (s)": "time",
        "rotation (rad)": "rotation",
        "angular velocity (rad/s)": "angular_velocity",
        "angular acceleration (rad/s2)": "angular_acceleration",
        "floor acceleration (m/s2)": "floor_acceleration",
    }
    values = np.column_stack([response[name].values for name in columns.values()])
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(columns) + "\n")
        for row in values.tolist():
            file.write(",".join(map(repr, row)) + "\n")


def history_figure(response: xr.Dataset) -> Figure:
    """History, phase portrait and hysteresis of one run, on one page."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - not for an error message

    from .plots import COLOURS, model_name  # noqa: PLC0415
    from .plots_response import HIGHEST, history, hysteresis, phase  # noqa: PLC0415

    figure = Figure(figsize=(8.0, 6.8), layout="constrained")
    axes = figure.subplot_mosaic([["history", "history"], ["phase", "hysteresis"]], height_ratios=(1.0, 1.25))
    history(response, axes["history"], labels=[""], colours=COLOURS[:1]).lines[0].set_linestyle("solid")
    phase(response, axes["phase"])
    hysteresis(response, axes["hysteresis"])
    axes["hysteresis"].set_ylabel("restoring and damping\nmoment over M0 (–)")
    axes["phase"].set_ylabel("angular velocity over pα,\nθ'/(pα) (–)")
    for name in ("phase", "hysteresis"):
        if bool(response["overturned"]):  # the way down would press all before it into the middle
            low, high = axes[name].get_xlim()
            axes[name].set_xlim(max(low, -HIGHEST), min(high, HIGHEST))
            _fit_to_seen(axes[name])
    heading = f"{response.attrs['block']} under {model_name(response.attrs['model'])}\n{response.attrs['motion']}"
    figure.suptitle(heading, fontsize=11)
    return figure


def _fit_to_seen(ax: Axes) -> None:
    """The y-axis for the part of the line that the x-axis shows."""
    low, high = ax.get_xlim()
    x, y = (np.asarray(values) for values in ax.lines[0].get_data())
    seen = y[(x >= low) & (x <= high)]
    if seen.size and np.ptp(seen) > 0.0:
        room = 0.05 * float(np.ptp(seen))
        ax.set_ylim(float(seen.min()) - room, float(seen.max()) + room)


def _g(acceleration: float) -> str:
    return f"{acceleration / STANDARD_GRAVITY:.3g} g"


def as_json(content: dict[str, Any]) -> str:
    """One object, no NaN."""
    return json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False)
