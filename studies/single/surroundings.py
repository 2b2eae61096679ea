"""What the walls, the restraint, the offset and the lean of a block did in one run, in words and for programs."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import xarray as xr

from ...models import Block, Law
from ...models.assembly import Surroundings
from ...models.sides import sides, surroundings


class Around(NamedTuple):
    """A block with what stands around it, the walls and springs as its law meets them, and the response."""

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
        """How a block ends that does not overturn: it stands, leans on a wall, or hangs on its restraint."""
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
        """The largest force in one of the restraints, N; None where there is none or it is not known."""
        force = float(self.response["restraint_force"]) if "restraint_force" in self.response else math.nan
        return force if math.isfinite(force) else None

    def rows(self) -> list[tuple[str, str]]:
        """Return what happened at the walls and to the restraint, as rows of a heading and a text."""
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
                each = " in each" if restraint.count > 1 else ""
                what = f"holds, largest force {force:.3g} N{each}"
            rows.append(("restraint", f"{restraint.label}: {what}"))
        return rows

    @property
    def content(self) -> dict[str, Any]:
        """What happened, for programs: SI, None where there is no number."""
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
    """Return what stands around a block, with what its law makes of it; None for a symmetric, freestanding block."""
    if "final_state" not in response:
        return None
    exact = model.options.get("geometry") == "exact"
    front, back = sides(block, "exact" if exact else "linear")
    return Around(block, surroundings(block, front, back, exact), response)
