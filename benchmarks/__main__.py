"""The benchmark: `python -m toppling.benchmarks --out docs` measures, prints tables and writes the page."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..models.runs import prepare
from ..studies.tables.terminal import rendered
from ..studies.text.terminal import say, terminal
from . import flags, page, precision, scale, scenes, speed, whole
from .measure import Row, machine
from .problems import HARD, LAWS
from .sliding import newmark, sliding_cost

PARTS: dict[str, Callable[[], Any]] = {
    "speed": speed.speed,
    "scenes": scenes.scenes,
    "sliding": lambda: {"cost": sliding_cost(), "newmark": newmark()},
    "scale": scale.scale,
    "motions": whole.making,
    "start": whole.first_use,
    "studies": whole.frozen_studies,
    "precision": precision.precision,
    "flags": flags.flags,
}
"""Parts of the benchmark in the order in which they are measured."""


def parts_of(text: str) -> list[str]:
    """Return the parts that a comma-separated list names, in order; ValueError for one that does not exist, or none."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    allowed = f"allowed: {', '.join(PARTS)}"
    if not names:
        raise ValueError(f"names no part; {allowed}")
    for name in names:
        if name not in PARTS:
            raise ValueError(f"{name!r} is no part of the benchmark; {allowed}")
    return [part for part in PARTS if part in names]


def measured(parts: Sequence[str]) -> Row:
    """Measure parts of the benchmark; all results are plain values (JSON)."""
    print("measuring: the engine (compiled once after installation)", file=sys.stderr)
    prepare([LAWS[0].oscillator(HARD)])
    chosen = "" if [*parts] == [*PARTS] else f" --parts {','.join(parts)}"
    results: Row = {"command": f"python -m toppling.benchmarks{chosen}", "machine": machine()}
    for part in parts:
        print(f"measuring: {part}", file=sys.stderr)
        results[part] = PARTS[part]()
    return results


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the engine beside other integrators against a 40-digit truth, in about 10 minutes."""
    parser = argparse.ArgumentParser(prog="python -m toppling.benchmarks", description=main.__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/bench"), help="folder of the page and its figures")
    parser.add_argument("--parts", default=",".join(PARTS), help="parts to measure, with commas (all)")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON instead of tables")
    asked = parser.parse_args(arguments)
    try:
        parts = parts_of(asked.parts)
    except ValueError as error:
        parser.error(f"--parts {asked.parts}: {error}")
    asked.out.mkdir(parents=True, exist_ok=True)
    results = measured(parts)
    written = page.write(results, asked.out)
    if asked.json:
        print(json.dumps(results, ensure_ascii=False, allow_nan=False))
        return
    console = terminal()
    for table in page.summary(results):
        console.print(*rendered(table, console.width), sep="\n", end="")
    say(console, *(f"written: {path}" for path in written))


if __name__ == "__main__":
    main()
