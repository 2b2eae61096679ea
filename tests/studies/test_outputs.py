"""docs/study.md says what comes out: its tables name every variable of every kind of study, and no other."""

import re
import shutil
from pathlib import Path

import pytest
import xarray as xr

import toppling as tp
from toppling.studies.store.content import ATTRIBUTE, content_digest

pytestmark = [pytest.mark.slow, pytest.mark.longest]  # (every kind of study is run, once, for all of these tests)

ROOT = Path(tp.__file__).parent
EXAMPLES = ROOT / "studies/examples"
PAGE = (ROOT / "docs/study.md").read_text(encoding="utf-8")
SMALLER = (
    (r"\bnumber = (\d+)", lambda found: f"number = {min(6, int(found[1]))}"),
    (r"\bsamples = \d+", "samples = 4"),
    (r"\bsobol = \d+", "sobol = 8\nmorris = 2"),
    (r"\[building\]", "[building]\nmodes = 2"),
)
"""What makes an example small: the kinds of its results stay."""
EVERY_OUTPUT = (
    'outputs = ["peak_rotation", "uplifted", "impacts", "overturning_time", "impact_velocity", "direction", '
    '"top_displacement", "peak_front", "peak_back", "wall_impacts", "wall_impact_velocity", "ruptured", '
    '"rupture_time", "final_state", "airborne", "restraint_force"]\n'
)
FIT = "[fit]\nfractiles = [0.1]\nreplicates = 100\n"
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
STUDIES = {
    "stripes": ("stripes", "", ""),
    "selected": ("selected", "", ""),
    "adaptive": ("adaptive", "", ""),
    "adaptive_chance": ("adaptive", "", ""),
    "adaptive_rate": ("adaptive_rate", "", '[friction]\ncontact = "vinyl"\n'),
    "region": ("region", "", ""),
    "region_own": ("region", "", ""),
    "cloud": ("cloud", "", ""),
    "bookcase": ("bookcase", "", FIT),
    "risk": ("risk", EVERY_OUTPUT, FIT + "[friction]\nstatic = 0.4\ndispersion = 0.2\ntrip_mm = 5\n"),
    "tower": ("tower", "", FIT),
    "branches": ("branches", "", ""),
    "uplift": ("cloud", "", FIT + 'form = "uplift-lognormal"\n' + ENDS),
    "first": ("bookcase", "", '[fit]\nmethod = "first-overturning"\nreplicates = 100\n'),
    "isotonic": ("stripes", "", '[fit]\nform = "isotonic"\nreplicates = 100\n'),
    "uncertainty": ("uncertainty", "", YEAR + FIT),
    "clinic": ("clinic", "", ""),
    "level": ("laboratory", "", ""),
    "laboratory": ("laboratory", "", ""),
    "gallery": ("gallery", "", ""),
    "clinic_branches": ("clinic_branches", "", ""),
    "own_building": ("own_building", "", ""),
    "yielding": ("clinic", "", ""),
    "kits": ("kits", "", ""),
    "sensitivity": ("sensitivity_delta", "", ""),
    "pairs": ("cloud", "", FIT),
    "both_directions": ("both_directions", "", ""),
}
"""Examples by name, with what is put before and after their text."""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Every variable of each kind of study, as its dimensions and unit; the same in memory and on the disk."""
    folder = tmp_path_factory.mktemp("studies")
    for table in EXAMPLES.glob("*.csv"):
        shutil.copy(table, folder)
    found = {}
    for name, (example, before, after) in STUDIES.items():
        text = (EXAMPLES / f"{example}.toml").read_text(encoding="utf-8")
        for pattern, smaller in SMALLER:
            text = re.sub(pattern, smaller, text)
        if name == "clinic_branches":  # with downtimes and injuries, too
            text = text.replace('"inventory.csv"', '"laboratory.csv"')
        if name == "level":  # in one earthquake, not in a year
            text = re.sub(r"(?ms)^\[hazard\]$.*?(?=^\[|\Z)", "", text)
        if name == "yielding":  # in a building that does
            text = text[: text.index("[building]")] + YIELDING + text[text.index("[performance]") :]
        if name == "bookcase":  # with a strength that is looked for
            text = re.sub(r"(strength_n = .*)", r"\1\ntarget = 0.1", text)
        if name == "pairs":  # shaken about both axes
            text = text.replace("number =", 'component = "pair"\nnumber =').replace('"pgv"', '"RotD50(pgv)"')
            text = text.replace("[[blocks]]", "[[blocks]]\ndepth_m = 0.9")
        if "[stripes.select]" in text:  # (few motions do not agree with the hazard)
            text = text.replace("[stripes.select]", '[stripes.select]\noutside = "keep"')
        if name.startswith("adaptive"):
            text = text.replace("number = 6", "number = 40") + "\n[until.motions]\nleast = 32\n\n"
        if name == "region":
            text = re.sub(r"number = 6\b.*", "number = 400", text).replace("median = 0.1", "median = 0.5")
        if name == "region_own":  # blocks with their own e and delta, which events do not take
            text = re.sub(r"number = 6\b.*", "number = 400", text).replace("median = 0.1", "median = 0.5")
            text = re.sub(r"\[events\]\nlevels.*\n", "", text).replace("region_blocks.csv", "own_blocks.csv")
            _, headings, *lines = (EXAMPLES / "region_blocks.csv").read_text(encoding="utf-8").splitlines()
            own = [
                f"{line},{0.86 + 0.003 * (i % 30):.3f},{0.02 + 0.001 * (i % 47):.3f}" for i, line in enumerate(lines)
            ]
            (folder / "own_blocks.csv").write_text("\n".join([f"{headings},e,delta", *own]), encoding="utf-8")
        if name == "adaptive_chance":
            text = text.replace("median = 0.1", 'probability = { level = 0.5, unit = "m/s", within = 0.2 }')
        if name == "risk":  # near an edge, too
            text = text.replace("[[blocks]]", "[[blocks]]\nedge_distance_mm = 1", 1)
        if name == "laboratory":  # near obstacles, too
            text = text.replace('contact = "vinyl"', 'contact = "vinyl"\ntrip_mm = 20')
        if name == "sensitivity":  # has no Morris screening, and many laws at many values
            text = re.sub(r"values = \[1e-4.*\]", "values = [1e-3, 0.05]", text.replace("\nmorris = 2", ""))
        (folder / f"{name}.toml").write_text(f"{before}{text}{after}", encoding="utf-8")
        study = tp.Study.from_toml(folder / f"{name}.toml")
        data = study.run(folder / name)
        with xr.open_dataset(folder / name / "results.nc") as stored:
            assert content_digest(stored) == content_digest(data) == data.attrs[ATTRIBUTE], name
        kind = found.setdefault(study.kind, {})
        for label, one in data.data_vars.items():
            kind.setdefault(str(label), set()).add((one.dims, one.attrs["units"], one.attrs["long_name"]))
    return found


TABLES = (
    *(
        "runs",
        "adaptive",
        "surface",
        "chosen",
        "curves",
        "year",
        "branches",
        "measures",
        "slides",
        "slips",
        "samples",
        "varied",
    ),
    *("given", "annual", "spread", "ranking", "duties", "kits", "sliding", "standing", "screen", "sparse", "shares"),
)
"""The page's tables in their order."""
OF_KIND = {
    "fragility": ("runs", "chosen", "curves", "year", "branches", "measures", "slides", "standing", "screen"),
    "sequential": ("adaptive", "curves", "year", "slips", "standing", "sparse"),
    "pooled": ("surface", "curves", "year"),
    "uncertainty": ("samples", "curves", "year", "standing", "shares"),
    "sensitivity": ("varied", "standing", "shares"),
    "performance": ("given", "annual", "spread", "ranking", "duties", "kits", "sliding", "standing", "shares"),
}
UNITS = {
    "1/year": {"year-1"},
    "day/year": {"day year-1"},
    "rad/s": {"rad s-1"},
    "im": {"m s-2", "m s-1"},
    "as asked": {"m s-2", "m s-1", "1", "year-1"},
    "m/s2": {"m s-2"},
    "currency": {"EUR"},
    "currency/year": {"EUR year-1"},
    "objective": {"EUR year-1", "EUR"},
    "objective/currency": {"year-1", "1"},
}
"""Units on the page that are others in files."""
SECTION = PAGE.split("## What comes out")[1]


def documented():
    """The rows of each table: name, dimensions that must be there, those that may, unit."""
    found = []
    for text in SECTION.split("| variable | on | unit | meaning |\n|---|---|---|---|\n")[1:]:
        rows = {}
        for line in text.partition("\n\n")[0].strip().splitlines():
            names, on, unit, meaning = (cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip("|")))
            name = re.fullmatch(r"`(\w+)`( ±)?( ≈)?", names)
            dims = [] if on == "–" else [one.strip() for one in on.split(",")]
            must = {one for one in dims if not one.startswith("[")}
            may = {one.strip("[]") for one in dims if one.startswith("[")}
            assert meaning
            ends = ("", *(("_lower", "_upper") if name[2] else ()))
            for end in (*ends, *(("_modelling_lower", "_modelling_upper") if name[3] else ())):
                assert name[1] + end not in rows
                rows[name[1] + end] = must, may, unit
        found.append(rows)
    return dict(zip(TABLES, found, strict=True))


@pytest.mark.parametrize("kind", OF_KIND)
def test_every_variable_is_named_and_none_invented(results, kind):
    tables = documented()
    named = {name for table in OF_KIND[kind] for name in tables[table]}
    assert set(results[kind]) - named == set()
    shared = {"curves", "year", "standing", "shares"}  # what only one kind has of these is in the other test
    assert {name for table in OF_KIND[kind] if table not in shared for name in tables[table]} - set(
        results[kind]
    ) == set()


def test_shared_tables_invent_nothing(results):
    tables = documented()
    every = set().union(*results.values())
    for table in ("curves", "year", "standing", "shares"):
        assert set(tables[table]) <= every


@pytest.mark.parametrize("kind", OF_KIND)
def test_dimensions_and_units(results, kind):
    tables = documented()
    for table in OF_KIND[kind]:
        for name, (must, may, unit) in tables[table].items():
            for dims, units, long_name in results[kind].get(name, ()):
                here = {("item" if "item" in dims else "block") if one == "block or item" else one for one in must}
                assert here <= set(dims) <= here | may, name
                assert units in UNITS.get(unit, {unit}), name
                assert long_name


def test_columns_of_an_inventory():
    from toppling.studies.inventory.reading import COLUMNS

    table = SECTION.split("| column | what it holds |\n|---|---|\n")[1].partition("\n\n")[0]
    named = [name for line in table.splitlines() for name in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert sorted(named) == sorted(COLUMNS)


def test_headings_of_a_hazard_file(tmp_path):
    """What the page says may stand in the first line is read, with the rates that it stands for."""
    table = SECTION.split("| first line | what follows |\n|---|---|\n")[1].partition("\n\n")[0]
    headings = [line.split("`")[1] for line in table.splitlines()]
    plain = [one for one in headings if one.startswith("pga")]
    cells = {
        "rate": ("0.01", "0.001"),
        "probability": ("0.3934693402873666", "0.04877057549928599"),
        "return": ("100", "1000"),
    }
    for heading in plain:
        kinds = [next(one for one in cells if column.startswith(one)) for column in heading.split(",")[1:]]
        rows = [",".join([level, *(cells[one][i] for one in kinds)]) for i, level in enumerate(("0.1", "0.4"))]
        (tmp_path / "site.csv").write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")
        assert tp.read_hazard(tmp_path / "site.csv").rates == pytest.approx((0.01, 0.001), rel=1e-12)
    assert len(plain) == 4


@pytest.mark.parametrize("page", ["README.md", "docs/study.md", "docs/decisions.md"])
def test_commands_are_given_as_toppling(page):
    """One line says how to activate the environment, before the first command that needs it."""
    text = (ROOT / page).read_text(encoding="utf-8")
    assert ".venv/bin/toppling" not in text
    first = re.search(r"^toppling (run|motions|export|bench)", text, re.MULTILINE)
    assert text.index("`. .venv/bin/activate`") < (first.start() if first else len(text))


def test_the_readme_counts_the_example_study():
    work = tp.Study.from_toml(EXAMPLES / "office.toml").work
    assert f"({work:,} analyses)" in (ROOT / "README.md").read_text(encoding="utf-8")
