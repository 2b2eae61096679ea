"""A table of coverage by room from coverage's own JSON: `python coverage_table.py coverage.json coverage.csv`.

Rooms that fall below the table that is there are printed before it is replaced.
"""

import csv
import json
import sys
from collections import Counter, defaultdict
from pathlib import Path, PurePosixPath

HEADINGS = ("room", "statements", "statements covered %", "branches", "branches covered %")


def table(report):
    """Return a row of each room: its statements and branches, and the share of each that tests reach, %."""
    rooms = defaultdict(Counter)
    for file, measured in report["files"].items():
        room = PurePosixPath(file.replace("\\", "/")).parent
        rooms["/".join(room.parts[:2])].update(measured["summary"])
        rooms["all"].update(measured["summary"])
    return [
        (
            room,
            counts["num_statements"],
            share(counts["covered_lines"], counts["num_statements"]),
            counts["num_branches"],
            share(counts["covered_branches"], counts["num_branches"]),
        )
        for room, counts in sorted(rooms.items())
    ]


def share(covered, number):
    """Return a share in %, to two digits after the point; 100 of nothing."""
    return f"{100.0 * covered / number if number else 100.0:.2f}"


def main(report, file):
    rows = table(json.loads(Path(report).read_text(encoding="utf-8")))
    if Path(file).exists():
        with open(file, encoding="utf-8", newline="") as before:
            shares = {room: (lines, branches) for room, _, lines, _, branches in list(csv.reader(before))[1:]}
        for room, _, lines, _, branches in rows:
            for kind, now, was in zip(
                ("statements", "branches"), (lines, branches), shares.get(room, ()), strict=False
            ):
                if float(now) < float(was):
                    print(f"{room}: {now} % of its {kind} are covered, {was} % before")
    with open(file, "w", encoding="utf-8", newline="") as after:
        csv.writer(after, lineterminator="\n").writerows([HEADINGS, *rows])


if __name__ == "__main__":
    main(*sys.argv[1:])
