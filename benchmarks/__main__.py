"""The benchmark: `python -m toppling.benchmarks --out docs` measures, prints tables and writes the page."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ..studies.text.rows import plain_table
from ..studies.text.terminal import say, terminal
from . import page, suite


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the engine beside other integrators against a 40-digit truth, in about 10 minutes (--full: 30)."""
    parser = argparse.ArgumentParser(prog="python -m toppling.benchmarks", description=main.__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/bench"), help="folder of the page and its figures")
    parser.add_argument("--parts", default=",".join(suite.PARTS), help="parts to measure, with commas (all)")
    parser.add_argument("--full", action="store_true", help="the slowest rivals as well")
    parser.add_argument("--against", type=Path, help="Python of another installation to compare with")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON instead of tables")
    asked = parser.parse_args(arguments)
    try:
        parts = suite.parts_of(asked.parts)
    except ValueError as error:
        parser.error(f"--parts {asked.parts}: {error}")
    if asked.against is not None and not asked.against.is_file():
        parser.error(f"--against {asked.against}: no such file; name the Python of another installation")
    asked.out.mkdir(parents=True, exist_ok=True)
    other = None if asked.against is None else str(asked.against.absolute())
    results = suite.run(parts, asked.full, lambda part: print(f"measuring: {part}", file=sys.stderr), other)
    written = page.write(results, asked.out)
    if asked.json:
        print(json.dumps(results, ensure_ascii=False, allow_nan=False))
        return
    console = terminal()
    for table in page.summary(results):
        console.print(plain_table(table.title, table.headings, table.rows))
    say(console, *(f"written: {path}" for path in written))


if __name__ == "__main__":
    main()
