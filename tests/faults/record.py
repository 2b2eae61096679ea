"""Write which tests execute the changed lines of each fault, from a run of all tests by `make covered-lines`.

    python tests/faults/record.py COVERAGE DURATIONS    the data of coverage with contexts, the file of fault_reports.py

What a test's fixtures execute counts for all tests of its file, because a shared fixture is made once.  Processes that
tests start are not measured: find.py also runs the tests of a file's own folder.
"""

import csv
import gzip
import io
import sys
from pathlib import Path

from coverage import CoverageData
from find import COVERED, read_report

from faults import faults  # isort: skip - (find puts its folder on the path)

MOST_SECONDS = 300.0


def main(data_file: str, durations: str) -> None:
    """Write the tests of each fault, those of its folder and the quickest first, up to so many seconds."""
    data = CoverageData(data_file)
    data.read()
    known = {test: seconds for test, (outcome, seconds) in read_report(Path(durations)).items() if outcome != "skipped"}
    of_file: dict[str, set[str]] = {}
    for test in known:
        of_file.setdefault(test.partition("::")[0], set()).add(test)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    for fault in faults():
        tests: set[str] = set()
        for place, lines in fault.lines().items():
            measured = [file for file in data.measured_files() if Path(file).as_posix().endswith(f"/{place}")]
            of_line = data.contexts_by_lineno(measured[0]) if measured else {}
            for context in {context for line in lines for context in of_line.get(line, ())}:
                test, _, part = context.rpartition("|")
                test = test.partition("[")[0]
                tests |= {test} if part == "run" else of_file.get(test.partition("::")[0], set())
        own, total = f"{fault.place.rpartition('/')[0]}/", 0.0
        for test in sorted(tests & known.keys(), key=lambda test: (not test.startswith(own), known[test], test)):
            total += known[test]
            if total < MOST_SECONDS:
                rows.writerow((fault.name, test, f"{known[test]:.2f}"))
        print(f"{fault.name}: {len(tests)} tests, {total:.0f} s")
    with COVERED.open("wb") as file, gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed:
        packed.write(text.getvalue().encode())


if __name__ == "__main__":
    main(*sys.argv[1:])
