"""The faults that tests must find: patches with their meanings, and the table of them."""

import ast
import re
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests/faults"
README = FOLDER / "README.md"
NAME = re.compile(r"(\d\d)_([a-z0-9_]+)\.patch")
FIELDS = ("Meaning", "Kind", "Chosen", "Found by")
KERNELS = ("kernels", "engine", "sliding_engine")
NOT_SEARCHED = "not yet searched"
HEADING = "| no. | file | meaning | kind | chosen by | found by |\n|---|---|---|---|---|---|\n"


class Fault(NamedTuple):
    """A fault in one file: its header, the lines that it takes away with their context, and the lines in their place.

    place: the file, relative to the repository's root.  header: values of each field, in the order of the lines.
    """

    path: Path
    header: dict[str, list[str]]
    place: str
    before: str
    after: str

    @property
    def name(self) -> str:
        """The file's name without its end, such as 01_lost_weight."""
        return self.path.stem

    def applied(self, text: str) -> str:
        """Return the source with the fault; ValueError if the lines are not there exactly once."""
        if text.count(self.before) != 1:
            raise ValueError(f"{self.path.name}: applies to {text.count(self.before)} places of {self.place}")
        return text.replace(self.before, self.after)

    def lines(self, root: Path = ROOT) -> dict[str, set[int]]:
        """Return the lines by file that a test must execute: the changed statement, or all calls of a changed kernel.

        For a statement in no function they are all lines in functions of the file.
        """
        text = (root / self.place).read_text("utf-8")
        tree = ast.parse(text)
        if Path(self.place).parent.name in KERNELS:
            public = [node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name[0] != "_"]
            call = re.compile(rf"\b({'|'.join(public)})\(")
            callers: dict[str, set[int]] = {}
            for path in (root / self.place.partition("/")[0]).rglob("*.py"):
                for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1):
                    if path.parent.name not in KERNELS and call.search(line):
                        callers.setdefault(str(path.relative_to(root)), set()).add(number)
            return callers
        pairs = zip_longest(self.before.splitlines(), self.after.splitlines())
        changed = (
            text[: text.index(self.before)].count("\n") + 1 + [before == after for before, after in pairs].index(False)
        )
        functions: set[int] = set()
        statements = []
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                functions |= {line for part in node.body for line in range(part.lineno, part.end_lineno + 1)}
            if isinstance(node, ast.stmt):
                last = node.body[0].lineno - 1 if hasattr(node, "body") else node.end_lineno
                statements.append({*range(node.lineno, last + 1)})
        whole = [lines for lines in statements if changed in lines]
        return {self.place: min(whole, key=len) if changed in functions and whole else functions}

    def record(self, found_by: list[str]) -> None:
        """Write which tests find it into its file."""
        kept = [line for line in self.path.read_text("utf-8").splitlines(True) if not line.startswith("Found by: ")]
        at = next(i for i, line in enumerate(kept) if not line.strip())
        kept[at:at] = [f"Found by: {test}\n" for test in found_by]
        self.path.write_text("".join(kept), encoding="utf-8")


def read(path: Path) -> Fault:
    """Return the fault of a patch with one hunk."""
    head, _, diff = path.read_text("utf-8").partition("\n\n")
    header: dict[str, list[str]] = {}
    for line in head.splitlines():
        field, _, value = line.partition(": ")
        header.setdefault(field, []).append(value)
    files, hunk = re.split(r"^@@ .* @@.*\n", diff, flags=re.MULTILINE)
    lines = [line if line.strip() else " \n" for line in hunk.splitlines(True)]  # (editors trim a blank line)
    before = "".join(line[1:] for line in lines if line[0] in " -")
    after = "".join(line[1:] for line in lines if line[0] in " +")
    return Fault(path, header, re.search(r"^--- a/(\S+)$", files, re.MULTILINE)[1], before, after)


def faults() -> list[Fault]:
    """Return all faults in the order of their numbers."""
    return [read(path) for path in sorted(FOLDER.glob("*.patch"))]


def table(of: list[Fault]) -> str:
    """Return the table of faults as it stands in the README."""
    rows = []
    for fault in of:
        number = fault.name.partition("_")[0]
        words = " ".join(fault.header["Meaning"] + [f"Changed: {why}" for why in fault.header.get("Changed", [])])
        tests = "<br>".join(f"`{test}`" if "::" in test else test for test in fault.header["Found by"])
        cells = (number, f"`{fault.place}`", words, *fault.header["Kind"], *fault.header["Chosen"], tests)
        rows.append(f"| {' | '.join(cells)} |\n")
    return HEADING + "".join(rows)


def write_table() -> None:
    """Write the table into the README, below its text."""
    text = README.read_text("utf-8").partition(HEADING)[0]
    README.write_text(text + table(faults()), encoding="utf-8")
