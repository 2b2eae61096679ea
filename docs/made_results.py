"""Results of small studies of every kind, and the page of their variables, docs/_made/results.md.

tests/golden/test_studies.py checks units, names and dimensions of results.
"""

import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import xarray as xr

from toppling.fragility.validity.reasons import REASONS
from toppling.models.outputs import AXIS, OF_ROCKING
from toppling.studies import Study

EXAMPLES = Path(__file__).parents[1] / "studies/examples"
SMALLER = (
    (r"\bsamples = \d+", "samples = 4"),
    (r"\bsobol = \d+", "sobol = 8"),
    (r"\[building\]", "[building]\nmodes = 2"),
)
"""Patterns that make an example small, with their replacements; numbers of motions and levels are `NUMBER` at most."""
NUMBER = 6
EVERY_OUTPUT = f"outputs = {[name for name in OF_ROCKING if name not in ('overturned', AXIS)]}\n"
FIT = "[fit]\nfractiles = [0.1]\nreplicates = 100\n"
FRICTION = "[friction]\nstatic = 0.4\ndispersion = 0.2\ntrip_mm = 5\n"
YEAR = '[hazard]\nk0 = 1e-3\nk = 2\nunit = "m/s"\n'
ENDS = '[hazard]\nlevels = [0.1, 0.5, 1]\nrates = [1e-1, 1e-2, 1e-3]\nunit = "m/s"\nabove = "none"\n'
YIELDING = """[building]
kind = "storeys"
masses_kg = [2e5, 2e5, 2e5, 2e5]
stiffnesses_n_m = [2e8, 2e8, 2e8, 2e8]
yield_coefficient = 0.2
strength_dispersion = 0.3
[building.isolation]
kind = "bilinear"
period_s = 2.5
strength = 0.05
base_mass_kg = 2e5
"""


def table(name: str) -> str:
    """The pattern of a table of a study file and of the tables in it."""
    return rf"(?ms)^\[{name}\]$.*?(?=^\[(?!{name}\.)|\Z)"


@dataclass(frozen=True)
class Small:
    """An example that is made small: patterns of its text with their replacements, and text in front and at the end."""

    example: str
    changed: tuple[tuple[str, str], ...] = ()
    before: str = ""
    after: str = ""

    def text(self) -> str:
        """The study file."""
        text = (EXAMPLES / f"{self.example}.toml").read_text(encoding="utf-8")
        text = re.sub(r"\bnumber = (\d+)", lambda number: f"number = {min(NUMBER, int(number[1]))}", text)
        for pattern, replacement in (*SMALLER, *self.changed):
            text = re.sub(pattern, replacement, text)
        return f"{self.before}{text}{self.after}"


LEAST = "\n[until.motions]\nleast = 32\n"
ADAPTIVE = ("number = 6", "number = 40")
REGION = (
    (r"number = 6\b.*", "number = 160"),
    ("omega_g_dispersion = .*", ""),
    ("median = 0.1", "median = 0.9"),
    (r"(?m)^\[events\]", "[events]\nmotions = 8\nsample = 100"),
)
STUDIES = {
    "adaptive": Small(
        "adaptive",
        (ADAPTIVE, ("median = 0.1", 'probability = { level = 0.5, unit = "m/s", within = 0.2 }')),
        after=LEAST,
    ),
    "adaptive_rate": Small("adaptive_rate", (ADAPTIVE,), after=f'{LEAST}[friction]\ncontact = "vinyl"\n'),
    "region": Small("region", REGION),
    # blocks with their own e and delta, which events do not take
    "own": Small("region", (*REGION, (table("events"), ""), ("region_blocks.csv", "own_blocks.csv"))),
    # few motions do not agree with the hazard
    "risk": Small(
        "risk",
        (
            (r"\[stripes.select\]", '[stripes.select]\noutside = "keep"'),
            (r"(?s)\A(.*?\[\[blocks\]\])", r"\1\nedge_distance_mm = 1"),
        ),
        EVERY_OUTPUT,
        FIT + FRICTION,
    ),
    "tower": Small("tower", after=FIT + FRICTION),
    "branches": Small("branches"),
    "uplift": Small("cloud", after=f'{FIT}form = "uplift-lognormal"\n{ENDS}'),
    # with a strength that is looked for
    "bookcase": Small("bookcase", ((r"(strength_n = .*)", r"\1\ntarget = 0.1"),), EVERY_OUTPUT, FIT),
    "first": Small("bookcase", after='[fit]\nmethod = "first-overturning"\nreplicates = 100\n'),
    "isotonic": Small("stripes", after='[fit]\nform = "isotonic"\nreplicates = 100\n'),
    "pairs": Small(
        "cloud",
        (
            ("number =", 'component = "pair"\nnumber ='),
            ('"pgv"', '"RotD50(pgv)"'),
            (r"\[\[blocks\]\]", "[[blocks]]\ndepth_m = 0.9"),
        ),
        after=FIT,
    ),
    "uncertainty": Small("uncertainty", after=YEAR + FIT),
    # with many laws at many values
    "sensitivity": Small("sensitivity_delta", ((r"values = \[1e-4.*\]", "values = [1e-3, 0.05]"),)),
    # in one earthquake, not in a year
    "level": Small("laboratory", ((table("hazard"), ""),)),
    "gallery": Small("gallery", ((r"static = 0.4", "static = 0.4\ntrip_mm = 20"),)),
    # with downtimes and injuries, too
    "clinic_branches": Small("clinic_branches", (('"inventory.csv"', '"laboratory.csv"'),)),
    # in a building that does
    "yielding": Small("clinic", ((table("building"), YIELDING),)),
    "kits": Small("kits"),
    "both_directions": Small("both_directions"),
}
"""Studies by name, in which every variable of every kind occurs."""


def small_results(folder: Path) -> Iterator[tuple[str, str, xr.Dataset]]:
    """Run every study in a folder; yield its name, its kind and its results, which are stored below its name."""
    for file in EXAMPLES.glob("*.csv"):
        shutil.copy(file, folder)
    _, headings, *lines = (EXAMPLES / "region_blocks.csv").read_text(encoding="utf-8").splitlines()
    extended = [f"{line},{0.86 + 0.003 * (i % 30):.3f},{0.02 + 0.001 * (i % 47):.3f}" for i, line in enumerate(lines)]
    (folder / "own_blocks.csv").write_text("\n".join([f"{headings},e,delta", *extended]), encoding="utf-8")
    for name, small in STUDIES.items():
        (folder / f"{name}.toml").write_text(small.text(), encoding="utf-8")
        study = Study.from_toml(folder / f"{name}.toml")
        yield name, study.kind, study.run(folder / name)


TITLES = {
    "fragility": "Fragility studies",
    "sequential": "At adaptive levels",
    "pooled": "With a pooled surface",
    "uncertainty": "Uncertainty studies",
    "sensitivity": "Sensitivity studies",
    "performance": "Performance studies",
}
"""Kinds of studies in the order of the page."""
HEAD = (
    "# Results: every variable\n\nMade from the results of small studies of every kind, so that page and program "
    "cannot differ. [How a study works](../study.md#results) explains ± and ≈. "
    "No study has all variables of its kind, and dimensions in brackets are not in all studies. Levels have the unit "
    "of their measure, here m s-1 or m s-2. Amounts of money are in the inventory's currency, here EUR.\n\n"
)
ENDS_OF = {" ±": ("_lower", "_upper"), " ≈": ("_modelling_lower", "_modelling_upper")}
"""What stands behind a name for two more variables, and how their names end."""


def rows(results: Iterable[Mapping[str, xr.Variable]]) -> Iterator[tuple[str, str, str, str]]:
    """Yield name with marks, dimensions, unit and meaning of each variable of some results, by name."""
    named: dict[str, list[xr.Variable]] = {}
    for variables in results:
        for name, variable in variables.items():
            named.setdefault(name, []).append(variable)
    folded = {name + end for name in named for ends in ENDS_OF.values() for end in ends}
    for name in sorted(set(named) - folded):
        every = [variable.dims for variable in named[name]]
        dims = [
            str(dim) if all(dim in axes for axes in every) else f"[{dim}]"
            for dim in dict.fromkeys(dim for axes in sorted(every, key=len, reverse=True) for dim in axes)
        ]
        marks = "".join(mark for mark, (lower, _) in ENDS_OF.items() if name + lower in named)
        units = dict.fromkeys(variable.attrs["units"] for variable in named[name])
        text = named[name][0].attrs["long_name"].replace("|", "\\|")
        yield f"`{name}`{marks}", ", ".join(dims) or "–", " or ".join(units), text


def results_page() -> str:
    """The variables of every kind of study."""
    kinds: dict[str, list[Mapping[str, xr.Variable]]] = {kind: [] for kind in TITLES}
    with TemporaryDirectory() as folder:
        for _, kind, results in small_results(Path(folder)):
            kinds[kind].append({str(name): array.variable for name, array in results.data_vars.items()})
    parts = []
    for kind, title in TITLES.items():
        lines = "".join(f"| {name} | {meaning} | {on} | {unit} |\n" for name, on, unit, meaning in rows(kinds[kind]))
        parts.append(f"## {title}\n\n| variable | meaning | on | unit |\n|---|---|---|---|\n{lines}")
    bits = "".join(f"| {reason.bit} | `{reason.name}` | {reason.text} |\n" for reason in REASONS)
    parts.append(
        f"## Reasons against a run\n\nBits of `verdict`.\n\n| bit | reason | what it is |\n|---|---|---|\n{bits}"
    )
    return HEAD + "\n".join(parts)
