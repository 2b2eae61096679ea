"""One run of one block under one motion, with its outputs, as `toppling simulate` makes it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from ... import motions as shaking
from ...core.doubts import noted
from ...core.facts import Fact, doubted
from ...core.units import ACCELERATION, STANDARD_GRAVITY
from ...core.writing import whole_file, write_bytes
from ...fragility import ida
from ...fragility.validity.notes import block_facts
from ...fragility.validity.plausibility import level_doubts
from ...fragility.validity.reasons import (
    ELASTIC_MODE,
    REASONS,
    SCALED_FAR,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SLIDES_WHILE_ROCKING,
    SQUAT,
    UNDECIDED,
)
from ...fragility.validity.screen import screen
from ...fragility.validity.slab_screen import FACTORS
from ...models import Block, Law, simulate
from ...models.assembly import Surroundings
from ...models.block import describe_scene
from ...models.laws import describe_law
from ...models.plausibility import stated_restitution_doubts
from ...models.sides import sides, surroundings
from ...motions.arrays import filter_doubts, records
from ...motions.matching.adjustment import matching_doubts
from ...motions.plausibility import record_doubts
from ..facts.say import notes_said
from ..plan.reading import taken_facts, taken_of
from ..text.error import writing
from ..text.histories import last_balance
from .inputs import built


class Around(NamedTuple):
    """A block with its surroundings, the walls and springs as its law meets them, and the response."""

    block: Block
    met: Surroundings
    response: xr.Dataset

    @property
    def held(self) -> bool:
        """True if the block ends beyond its balance and has not fallen."""
        return abs(int(self.response["final_state"])) == 1

    @property
    def walls(self) -> list[float]:
        """The rotations at which the block meets a wall, rad."""
        signed = ((-1.0, self.met.back_wall), (1.0, self.met.front_wall))
        return [sign * contact.rotation for sign, contact in signed if contact is not None]

    @property
    def stands(self) -> str:
        """Final state of a block that does not overturn: upright, leaning on a wall, or hanging on its restraint."""
        if not self.held:
            return "stands"
        front = int(self.response["final_state"]) > 0
        wall = self.met.front_wall if front else self.met.back_wall
        side = "front" if front else "back"
        (_, forward), (_, backward) = self.block.corners
        if wall is not None and wall.rotation >= (forward if front else backward):
            return f"does not overturn: it leans on the wall at the {side}, beyond its balance"
        assert self.block.restraint is not None  # (nothing else holds it there)
        return f"does not overturn: it hangs on its {self.block.restraint.kind}, beyond its balance to the {side}"

    @property
    def peaks(self) -> str:
        """The peak rotations to both sides in words."""
        words = []
        for side, (_, alpha) in zip(("front", "back"), self.block.corners, strict=True):
            peak = float(self.response[f"peak_{side}"])
            words.append(f"{peak:.4g} rad = {100.0 * peak / alpha:.3g} % of α to the {side}")
        return ", ".join(words)

    @property
    def force(self) -> float | None:
        """The largest force in one of the restraints, N; None if there is none or it is not known."""
        force = float(self.response["restraint_force"]) if "restraint_force" in self.response else math.nan
        return force if math.isfinite(force) else None

    def rows(self) -> list[tuple[str, str]]:
        """Return the events at the walls and of the restraint, as rows of a heading and a text."""
        run, rows = self.response, []
        niche = self.met.front_wall is not None
        contacts = [
            (where, contact)
            for where, contact in (("behind " if niche else "", self.met.back_wall), ("in front ", self.met.front_wall))
            if contact is not None
        ]
        if contacts:
            met = ", ".join(
                f"met {where}at {contact.rotation:.3g} rad with restitution {contact.factor:.2f}"
                for where, contact in contacts
            )
            number = int(run["wall_impacts"])
            fastest = f", the fastest at {float(run['wall_impact_velocity']):.3g} rad/s" if number else ""
            rows.append(("wall", f"{met}; {number} impact{'' if number == 1 else 's'}{fastest}"))
        restraint = self.block.restraint
        if restraint is not None:
            force = self.force
            what = "holds"
            if bool(run["ruptured"]):
                what = f"breaks at {float(run['rupture_time']):.2f} s"
            elif force is not None:
                of_each = " in each" if restraint.count > 1 else ""
                what = f"holds, largest force {force:.3g} N{of_each}"
            rows.append(("restraint", f"{restraint.label}: {what}"))
        return rows

    @property
    def content(self) -> dict[str, Any]:
        """Results for programs: SI, None without a number."""
        run = self.response
        breaks = float(run["rupture_time"])
        return {
            "peak_front": float(run["peak_front"]),
            "peak_back": float(run["peak_back"]),
            "wall_impacts": int(run["wall_impacts"]),
            "wall_impact_velocity": float(run["wall_impact_velocity"]),
            "ruptured": bool(run["ruptured"]),
            "rupture_time": breaks if math.isfinite(breaks) else None,
            "restraint_force": self.force,
            "final_state": int(run["final_state"]),
        }


def around_of(block: Block, model: Law, response: xr.Dataset) -> Around | None:
    """Return a block's surroundings, with their form in its law; None for a symmetric, freestanding block."""
    if "final_state" not in response:
        return None
    exact = model.options.get("geometry") == "exact"
    front, back = sides(block, "exact" if exact else "linear")
    return Around(block, surroundings(block, front, back, exact), response)


if TYPE_CHECKING:
    from matplotlib.figure import Figure

AFTER = 1.0
"""Time that a history continues after overturning or coming to rest, s, if either happens after the record."""
QUIET, LONGEST_QUIET = 100.0, 60.0
"""Maximum time that a history continues after the record until the block is at rest: over 1/p, and in s."""
UPRIGHT = 0.01
"""|θ|/α below which a rocking block is not seen to move: it counts as standing, as in its elastic zone."""
HISTORY, FIGURE, FILMS = "history.csv", "history.png", ("animation.gif", "animation.mp4")
_SLIDING = (SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT)


@dataclass(frozen=True)
class Simulation:
    """One block under one law and one motion, which is given before it is multiplied by `factor`."""

    block: Block
    model: Law
    motion: xr.DataArray
    factor: float = 1.0

    @cached_property
    def shaken(self) -> xr.DataArray:
        """The motion of the floor under the block, multiplied by the factor."""
        return (self.motion * self.factor).assign_attrs(self.motion.attrs)

    @cached_property
    def response(self) -> xr.Dataset:
        """The response that `toppling.simulate` returns; StudyError if the block needs an explicit e."""
        return built(self.block.label, lambda: simulate(self.block, self.model, self.shaken))

    @cached_property
    def around(self) -> Around | None:
        """Effects of walls, restraint, offset and lean in the run; None for a symmetric, freestanding block."""
        return around_of(self.block, self.model, self.response)

    @property
    def shown(self) -> xr.Dataset:
        """The shown history: it continues in quiet until the block lies or is at rest, or until it is cut."""
        return self._shown[0]

    @property
    def cut(self) -> bool:
        """True if the block still rocks at the end of the history that is shown."""
        return self._shown[1]

    @cached_property
    def _shown(self) -> tuple[xr.Dataset, bool]:
        run, falls = self.response, bool(self.response["overturned"])
        # (NaN: the block falls at a time that rounding decides)
        late = float(run["overturning_time"]) - float(run["time"][-1])
        if falls and not late > 0.0:
            return run, False
        quiet = late if falls else min(QUIET / self.block.p, LONGEST_QUIET)
        longer = simulate(self.block, self.model, shaking.pad(self.shaken, 0.0, quiet + AFTER))
        # the ramp from the last sample to zero adds shaking: where it changes the outcome, the record's own run holds
        if bool(longer["overturned"]) != falls:
            return run, not falls
        if falls:
            return longer, False
        upright = max(UPRIGHT * self.block.alpha, self.model.zone_edge(self.block))
        theta = longer["rotation"].values
        # (a block that is held beyond its balance rests there)
        rests = theta[-1] if self.around is not None and self.around.held else 0.0
        rocks = np.flatnonzero(np.abs(theta - rests) > upright)
        stands = int(rocks[-1]) + 1 if rocks.size else 0
        if stands <= run.sizes["time"]:
            return run, False
        stop = stands + math.ceil(AFTER / records(self.motion)[0].dt)
        return longer.isel(time=slice(0, stop)), stop > longer.sizes["time"]

    @cached_property
    def screened(self) -> xr.Dataset | None:
        """The reasons against the validity of the run; None if the motion is zero."""
        if not bool(self.motion.any()):
            return None
        outputs = ("overturned", "peak_rotation", "uplifted")
        with noted():
            runs = ida(self.block, self.model, self.motion, [self.factor], im="scale", outputs=outputs, screen=False)
        return screen(runs, self.motion, undecided=1.0)

    @property
    def pga(self) -> float:
        """The peak acceleration, m/s²."""
        return float(np.abs(self.shaken.values).max())

    @property
    def thresholds(self) -> tuple[float, float]:
        """The accelerations that just tip a rigid block without restraint to the front and the back, g tan α, m/s²."""
        (_, front), (_, back) = self.block.corners
        return STANDARD_GRAVITY * math.tan(front), STANDARD_GRAVITY * math.tan(back)

    @property
    def threshold(self) -> float:
        """The lesser of these accelerations."""
        return min(self.thresholds)

    @property
    def friction(self) -> dict[str, float]:
        """The coefficients of friction below which the block slides instead: at uplift, while rocking, at impact."""
        if self.screened is None:
            return {}
        names = {"uplift": "friction_uplift", "rocking": "friction_rocking_demand", "impact": "friction_impact"}
        needed = {name: float(self.screened[variable].max()) for name, variable in names.items()}
        return {name: value for name, value in needed.items() if math.isfinite(value)}

    @property
    def facts(self) -> list[Fact]:
        """The reservations on the validity of the run."""
        doubts = [
            *stated_restitution_doubts([self.model]),
            *record_doubts(records(self.motion)),
            *filter_doubts([self.motion]),
        ]
        doubts += matching_doubts([self.motion])
        doubts += level_doubts(np.array([self.pga]), ACCELERATION) if self.factor != 1.0 else []
        facts = [
            *block_facts([self.block]),
            *taken_facts(taken_of([self.motion])),
            *doubted(doubt.sentence for doubt in doubts),
        ]
        if self.screened is not None:
            verdict = int(self.screened["verdict"].max())
            for reason in (reason for reason in REASONS if verdict & reason.bit and reason is not SQUAT):
                if reason is UNDECIDED:
                    facts.append(Fact("single.undecided"))
                elif reason is SCALED_FAR:
                    facts.append(Fact("single.scaled_far", self.factor, *FACTORS))
                elif reason is ELASTIC_MODE:
                    facts.append(Fact("single.elastic_mode", names=(reason.text,)))
                else:
                    facts.append(Fact("single.outside", names=(reason.text,), more={"slides": reason in _SLIDING}))
        more = {"vertical": False, "slides": False}
        return [*facts, Fact("validity.not_modelled", more=more)]

    @property
    def notes(self) -> list[str]:
        """The reservations on the validity of the run, as sentences."""
        return notes_said(self.facts)

    @property
    def _block_text(self) -> str:
        """The block in words."""
        block = self.block
        name = "" if block.name is None else f"{block.name}, "
        (_, front), (_, back) = block.corners
        alpha = f"{front:.4g} rad" if block.symmetric else f"{front:.4g} rad forward, {back:.4g} rad backward"
        return f"{name}{block.width:.3g} m × {block.height:.3g} m, α = {alpha}"

    @property
    def _motion_text(self) -> str:
        """The motion in words."""
        by = "" if self.factor == 1.0 else f", scaled by {self.factor:.4g}"
        return f"{records(self.motion)[0].label}{by}: PGA {_g(self.pga)}"

    @property
    def _outcome_text(self) -> str:
        """The outcome of the run in words."""
        run, shown = self.response, self.shown
        record, last = float(run["time"][-1]), float(shown["time"][-1])
        if self.cut:
            return f"does not overturn; still rocks where its history is cut, {last - record:.3g} s after the record"
        if not bool(run["overturned"]):
            ends = "stands" if self.around is None else self.around.stands
            quiet = last - record - AFTER
            return f"{ends}, rocking until {quiet:.3g} s after the record" if quiet > 0.0 else ends
        at, (balance, side, passed) = float(run["overturning_time"]), last_balance(shown)
        if not math.isfinite(at):
            return "overturned after the record"
        late = " (after the record)" if at > record else ""
        past = f", past its balance for good at {balance:.2f} s" if passed else ""
        words = ("to the right", "to the left") if self.around is None else ("forward", "backward")
        return f"overturned {words[0] if side > 0.0 else words[1]} at {at:.2f} s{late}{past}"

    def lines(self) -> list[str]:
        """Return all results of the run as lines for people."""
        run, block, motion = self.response, self.block, records(self.motion)[0]
        restitution = self.model.restitution(block)
        e = "" if restitution is None or self.model.options["e"] is not None else f", e_R = {restitution:.3f}"
        ratio = self.pga / self.threshold
        peak = float(run["peak_rotation"])
        uplift = "uplifts" if bool(run["uplifted"]) else "does not uplift"
        turned = f"{peak:.4g} rad = {100.0 * peak / block.alpha:.3g} % of α"
        if bool(run["overturned"]):
            turned = f"{peak:.4g} rad: it lies on its side"
        elif self.around is not None:
            turned = self.around.peaks
        front, back = self.thresholds
        lifts = _g(front) if front == back else f"{_g(front)} forward, {_g(back)} backward"
        times = f"PGA is {ratio:.3g} times {'that' if front == back else 'the lesser'}"
        need = self.friction
        words = {"uplift": "at uplift", "rocking": "at the peak of the motion", "impact": "at impact"}
        bed = []
        if block.bed is not None:
            edge = self.model.zone_edge(block) / block.alpha
            bed = [("bed", f"settles {1000.0 * block.bed.settlement:.4g} mm; uplifts from it at {edge:.3g} of α")]
        rows = [
            ("block", f"{self._block_text}, p = {block.p:.3g} rad/s"),
            ("law", f"{self.model.label}{e}"),
            ("motion", f"{self._motion_text}, {motion.duration:g} s at {motion.dt:g} s"),
            ("uplift", f"{uplift}; g tan α = {lifts}, {times}"),
            ("peak rotation", turned),
            ("impacts", f"{int(run['impacts'])}{' during the record' if self.shown is not run else ''}"),
            *(() if self.around is None else self.around.rows()),
            *bed,
            ("end", self._outcome_text),
        ]
        if need:
            rows.append(("friction needed", ", ".join(f"{value:.2f} {words[name]}" for name, value in need.items())))
        return [f"{name + ':':<17}{text}" for name, text in rows]

    def content(self, files: Sequence[Path] = ()) -> dict[str, Any]:
        """Return all results of the run for programs: SI, None if there is no number."""
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
                **describe_scene(block),
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
            **({} if self.around is None else self.around.content),
            "cut": self.cut,
            "direction": float(np.sign(self.shown["rotation"].values[-1])) if overturned else None,
            "friction": self.friction,
            "notes": self.notes,
            "files": [str(path) for path in files],
        }

    def figure(self) -> Figure:
        """Return the figure of the run, with the block, the law and the outcome in its heading."""
        from ..plots import axes  # noqa: PLC0415 - matplotlib
        from .figure import history_figure  # noqa: PLC0415

        title = f"{self._block_text}, under {axes.model_name(self.model.label)}"
        text = f"{self._motion_text}\n{self._outcome_text}"
        ends = float(self.response["time"][-1])
        walls = () if self.around is None else self.around.walls
        return history_figure(self.shown, title, text, lifts=self.thresholds, ends=ends, walls=walls)

    def write(self, folder: Path) -> list[Path]:
        """Write history.csv and history.png into a folder, and remove the files and films of an earlier run."""
        from ..plots.axes import defaults  # noqa: PLC0415 - matplotlib

        with defaults(), writing(folder):
            drawn = self.figure()
            folder.mkdir(parents=True, exist_ok=True)
            for name in (HISTORY, FIGURE, *FILMS):
                (folder / name).unlink(missing_ok=True)
            table, figure = folder / HISTORY, folder / FIGURE
            columns = {
                "time (s)": "time",
                "rotation (rad)": "rotation",
                "angular velocity (rad/s)": "angular_velocity",
                "angular acceleration (rad/s2)": "angular_acceleration",
                "floor acceleration (m/s2)": "floor_acceleration",
            }
            values = np.column_stack([self.shown[name].values for name in columns.values()])
            lines = [",".join(columns), *(",".join(map(repr, row)) for row in values.tolist())]
            write_bytes(table, ("\n".join(lines) + "\n").encode())
            with whole_file(figure) as temporary:
                drawn.savefig(temporary, format="png", dpi=150)
        return [table, figure]


def _g(acceleration: float) -> str:
    return f"{acceleration / STANDARD_GRAVITY:.3g} g"
