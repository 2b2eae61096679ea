"""The whole benchmark: its parts, and all their results as one plain dictionary (JSON)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..models.runs import prepare
from .flags import flags
from .measure import Row, machine
from .mixing import mixing
from .precision import precision
from .problems import HARD, LAWS
from .scale import scale
from .scenes import scenes
from .sliding.cost import sliding_cost
from .sliding.newmark import newmark
from .speed import exact_over_linear, skipping, speed
from .whole.first_use import first_use
from .whole.making import making
from .whole.studies import frozen_studies

PARTS = (
    "speed",
    "mixing",
    "scenes",
    "sliding",
    "skipping",
    "scale",
    "motions",
    "start",
    "studies",
    "precision",
    "flags",
)
COMMAND = "python -m toppling.benchmarks"


def _speed(full: bool) -> Row:
    rows = speed(repeats=15 if full else 7)
    return {"rows": rows, "exact_over_linear": exact_over_linear(rows)}


def _sliding(full: bool) -> Row:
    return {"cost": sliding_cost(repeats=15 if full else 7), "newmark": newmark()}


_MEASURES: dict[str, Callable[[bool], Any]] = {
    "speed": _speed,
    "mixing": lambda full: mixing(repeats=15 if full else 7),
    "scenes": lambda full: scenes(repeats=15 if full else 7),
    "sliding": _sliding,
    "skipping": lambda full: skipping(repeats=9 if full else 5),
    "scale": lambda full: scale(),
    "motions": lambda full: making(repeats=9 if full else 5),
    "start": lambda full: first_use(repeats=9 if full else 5),
    "precision": lambda full: precision(full=full),
    "flags": lambda full: flags(),
}


def parts_of(text: str) -> list[str]:
    """Return the parts that a comma-separated list names, in the order in which they are run.

    Raises
    ------
    ValueError
        A part that does not exist, or an empty list.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    allowed = f"allowed: {', '.join(PARTS)}"
    if not names:
        raise ValueError(f"names no part; {allowed}")
    for name in names:
        if name not in PARTS:
            raise ValueError(f"{name!r} is no part of the benchmark; {allowed}")
    return [part for part in PARTS if part in names]


def command(parts: Sequence[str], full: bool, against: str | None = None) -> str:
    """Return the command that measures these parts; another installation's Python is not named by its path."""
    chosen = "" if tuple(parts) == PARTS else f" --parts {','.join(parts)}"
    other = "" if against is None else " --against PYTHON"
    return f"{COMMAND}{chosen}{' --full' if full else ''}{other}"


def run(
    parts: Sequence[str] = PARTS,
    full: bool = False,
    tell: Callable[[str], None] = lambda _: None,
    against: str | None = None,
) -> Row:
    """Measure `parts`; `tell` is called with each part before it starts.

    against: the Python of another installation, with whose whole studies those of this one are compared.
    """
    tell("the engine (compiled once after installation)")
    prepare([LAWS[0].oscillator(HARD)])
    results: Row = {"command": command(parts, full, against), "full": full, "machine": machine()}
    for part in parts:
        tell(part)
        if part == "studies":
            results[part] = frozen_studies(5 if full else 3, against)
        else:
            results[part] = _MEASURES[part](full)
    return results
