"""The package as others get it: wheel, sdist, documented examples, one-way imports, with and without the compiler."""

import ast
import doctest
import importlib
import importlib.util
import inspect
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared_cases import LAWS, shake

import toppling as tp
from toppling.models.runs import trace

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("core", "models", "motions", "fragility", "studies")
SOURCES = sorted(path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
ROOT_FILES = ("__init__.py", "__main__.py", "py.typed")


def modules_of(paths):
    return sorted(".".join(("toppling", *path.with_suffix("").parts)).removesuffix(".__init__") for path in paths)


MODULES = ["toppling", *modules_of(SOURCES)]
# (the maker of the benchmark's truth needs gmpy2, which nobody else does)
TRUTH = {f"toppling.benchmarks.{name}" for name in ("truth", "exact_motion", "multiprecision")}
IN_A_CHECKOUT = [
    name
    for name in modules_of(path.relative_to(ROOT) for path in (ROOT / "benchmarks").rglob("*.py"))
    if name not in TRUTH or importlib.util.find_spec("gmpy2")
]


def run(arguments, folder, **environment):
    done = subprocess.run(
        [str(a) for a in arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """An sdist, and the wheel built from that sdist, made from a copy of the tracked files."""
    pytest.importorskip("build")
    folder = tmp_path_factory.mktemp("build")
    skip = shutil.ignore_patterns(".*", "results", "build", "dist", "*.egg-info", "__pycache__")
    shutil.copytree(ROOT, folder / "source", ignore=skip)
    run([sys.executable, "-m", "build", "--no-isolation", "--outdir", folder / "dist"], folder / "source")
    wheel, sdist = next((folder / "dist").glob("*.whl")), next((folder / "dist").glob("*.tar.gz"))
    return folder, wheel, sdist


class TestWheel:
    def test_holds_every_module_and_data_file_and_nothing_else(self, built):
        """No benchmark, no published test, no script of a page: these run from a checkout, and the sdist has them."""
        _, wheel, _ = built
        names = {n for n in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in n}
        modules = {f"toppling/{path}" for path in SOURCES}
        modules |= {f"toppling/{name}" for name in ROOT_FILES}
        data = {"toppling/core/doubts.toml", "toppling/models/catalogue.csv", "toppling/motions/example.AT2"}
        data |= {"toppling/fragility/curves/published.csv", "toppling/studies/plan/piece_classes.csv"}
        data |= {"toppling/studies/reference/renamed_variables.csv"}
        data.add("toppling/studies/text/terms.csv")
        examples = {f"toppling/studies/examples/{p.name}" for p in (ROOT / "studies/examples").glob("*.*")}
        folders = [ROOT / package / "templates" for package in ("fragility", "studies")]
        templates = {f"toppling/{p.relative_to(ROOT)}" for folder in folders for p in folder.glob("*.j2")}
        starters = {f"toppling/studies/starters/{p.name}" for p in (ROOT / "studies/starters").iterdir()}
        folder = ROOT / "studies/app"
        page = {
            f"toppling/{p.relative_to(ROOT)}"
            for p in folder.rglob("*.*")
            if p.suffix in (".toml", ".j2", ".css", ".js", ".svg")
        }
        assert names == modules | data | examples | starters | templates | page
        assert {"toppling/fragility/templates/screen.j2", "toppling/studies/templates/notes.j2"} <= templates
        assert starters
        assert any(n.endswith("licenses/LICENSE") for n in zipfile.ZipFile(wheel).namelist())

    @pytest.mark.slow
    def test_imports_elsewhere(self, built):
        """Every module imports from the installed wheel; `.ci/environments` runs a study there."""
        folder, wheel, _ = built
        target = folder / "installed"
        run([sys.executable, "-m", "pip", "install", "--no-deps", "--quiet", "--target", target, wheel], folder)
        code = (
            "import importlib, json, sys, toppling\n"
            f"for name in {MODULES!r}: importlib.import_module(name)\n"
            "shake = toppling.motions.read(toppling.motions.example_path())\n"
            "print(json.dumps([toppling.__file__, toppling.__version__, shake.sizes['time']]))\n"
        )
        path = run([sys.executable, "-c", code], folder, PYTHONPATH=str(target))
        file, version, samples = json.loads(path)
        assert file == str(target / "toppling" / "__init__.py")
        assert version == tp.__version__
        assert samples > 100

    def test_sdist_holds_what_a_build_needs(self, built):
        import tarfile

        _, _, sdist = built
        with tarfile.open(sdist) as archive:
            names = {n.split("/", 1)[1] for n in archive.getnames() if "/" in n}
        assert {"pyproject.toml", "README.md", "LICENSE", "models/engine/tables.py", "models/catalogue.csv"} <= names
        assert {"benchmarks/__main__.py", "benchmarks/truth.nc", "benchmarks/experiments/table.py"} <= names
        # what the tests read beside the package
        assert {"Makefile", "CHANGELOG.md", "requirements.lock", "docs/study.md", "docs/office.png"} <= names
        assert {"tests/pytest.ini", "tests/conftest.py", "tests/data/results_layout_1.nc.gz"} <= names
        assert not [name for name in names if name.endswith(".pyc") or name.startswith("docs/_build/")]

    def test_its_description_stands_by_itself(self, built):
        """Whoever reads it has no checkout: no link to a file of one."""
        _, wheel, _ = built
        with zipfile.ZipFile(wheel) as archive:
            (name,) = (one for one in archive.namelist() if one.endswith(".dist-info/METADATA"))
            described = archive.read(name).decode("utf-8").partition("\n\n")[2]
        assert "How likely is a bookcase" in described
        assert not re.findall(r"\]\((?!https?:)", described)


def test_the_lock_file_holds_what_is_declared():
    """Every dependency at a version that is allowed, with hashes; `make lock` writes it anew."""
    locked = dict(re.findall(r"(?m)^([a-z0-9-]+)==([0-9.]+)", (ROOT / "requirements.lock").read_text("utf-8")))
    for line in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["dependencies"]:
        name, least = re.fullmatch(r"([A-Za-z0-9-]+)(?:\[.*\])?>=([0-9.]+)", line).groups()
        version = locked[name.lower()]
        assert [int(one) for one in re.findall(r"\d+", version)] >= [int(one) for one in least.split(".")], name
    text = (ROOT / "requirements.lock").read_text("utf-8")
    assert text.count("==") == len(re.findall(r"(?m)^[a-z].*\\\n +--hash=sha256:[0-9a-f]{64}", text))


HEAVY = (
    "numba", "xarray", "pandas", "scipy", "dask", "distributed", "matplotlib", "SALib", "jinja2", "PIL",
)  # fmt: skip
"""Libraries that take from 50 ms to a second to load."""
PARTS = (
    "pydantic", "netCDF4", "dask.array", "distributed", "scipy.signal", "scipy.stats", "scipy.optimize",
    "scipy.integrate", "scipy.linalg",
)  # fmt: skip
"""Further libraries, and slow parts of those that are needed."""
LOADED = """
import sys
{code}
print(*(name for name in {heavy} if name in sys.modules), file=sys.stderr)
"""


def loaded(code, heavy=HEAVY):
    """The heavy libraries that a piece of code loads."""
    command = [sys.executable, "-c", LOADED.format(code=code, heavy=heavy)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stderr.split()


@pytest.mark.slow
def test_importing_is_light():
    """No arrays with labels, no compiler, no figures, until they are asked for; nor the faces of the packages."""
    assert loaded("import toppling", (*HEAVY, "numpy", "pydantic")) == []
    packages = "import toppling.models, toppling.motions, toppling.fragility, toppling.studies"
    assert loaded(packages, (*HEAVY, "numpy", "pydantic")) == []
    used = "import toppling; toppling.plot; toppling.Study"
    assert loaded(used) != []  # (the measure can see them)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "further"),
    [
        (["--help"], ("numpy", "pydantic", "netCDF4")),
        (["--version"], ("numpy", "pydantic", "netCDF4")),
        (["run", "--help"], ("numpy", "pydantic", "netCDF4")),
        (["catalogue"], ("pydantic", "netCDF4")),
        (["status", "RESULTS"], ()),
    ],
    ids=" ".join,
)
def test_commands_that_compute_nothing_are_light(arguments, further, tmp_path):
    """Their time is that of the command line, of numpy where there are numbers, and of a file's own library."""
    tiny = xr.Dataset({"a": ("x", [1.0, 2.0])}, attrs={"title": "Tiny"})
    tiny.to_netcdf(tmp_path / "results.nc", engine="netcdf4")
    given = [str(tmp_path) if one == "RESULTS" else one for one in arguments]
    code = f"from toppling.studies.command.cli import main\nassert main({given}) == 0"
    assert loaded(code, (*HEAVY, *further)) == []


@pytest.mark.slow
def test_a_simulation_loads_what_it_needs():
    """What labelled arrays and the compiler load by themselves, and nothing else."""
    code = (
        "import toppling as tp\n"
        "motion = tp.motions.from_array([0.0, 3.0, -3.0, 0.0], dt=0.1)\n"
        "tp.simulate(tp.catalogue['bookcase-5-shelf'], tp.HousnerImpact(), motion)\n"
    )
    # (xarray looks for dask's configuration, and numba's compiler loads scipy.linalg)
    least = "import numba, xarray, dask.base\nnumba.njit(lambda x: x + 1.0)(1.0)"
    assert loaded(code, (*HEAVY, *PARTS)) == loaded(least, (*HEAVY, *PARTS))


STUDY = """
title = "Small"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 4
duration_s = 4
dt_s = 0.02
[ida]
im = "pga"
levels = { values = [2.0, 4.0, 6.0], unit = "m/s2" }
"""


@pytest.mark.slow
def test_a_study_and_its_report_load_what_they_need(tmp_path):
    """A study no statistics, no arrays of dask and no cluster; a report moreover no compiler and no motions."""
    (tmp_path / "study.toml").write_text(STUDY)
    command = "from toppling.studies.command.cli import main\nassert main({}) == 0"
    run_it = command.format(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")])
    assert loaded(run_it, PARTS) == ["pydantic", "netCDF4", "scipy.linalg"]
    report = command.format(["report", str(tmp_path / "out/results.nc")])
    others = ("numba", "scipy", "matplotlib", "toppling.studies.kinds.performance", "toppling.motions.simulated.pulses")
    assert loaded(report, (*PARTS, *others)) == ["pydantic", "netCDF4", "scipy", "matplotlib"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["KanaiTajimi", "CloughPenzien", "SiteBased", "NearFault"])
def test_simulated_motions_load_no_signal_processing(name):
    """`scipy.signal` takes half a second, longer than hundreds of motions."""
    code = f"import toppling as tp\ntp.motions.{name}().sample(1)"
    assert loaded(code, ("scipy.signal", "matplotlib")) == []


@pytest.mark.parametrize("package", [tp.models, tp.motions, tp.fragility, tp.studies], ids=lambda one: one.__name__)
def test_the_names_of_a_package(package):
    """All of them are found where the package says; others are not, and `dir` knows them."""
    for name in package.__all__:
        assert getattr(package, name) is not None
    assert set(package.__all__) <= set(dir(package))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = package.nothing
    # what type checkers read beside it is the same
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    read = {one.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for one in node.names}
    assert read - {"TYPE_CHECKING", "face"} == set(package.__all__)


@pytest.mark.parametrize("name", [*MODULES, *IN_A_CHECKOUT])
def test_docstring_examples(name):
    module = importlib.import_module(name)
    found = doctest.testmod(module, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0


def examples_of_functions():
    """Return the module, the name and the text of each example of a function that is not public."""
    texts = (ROOT / "tests/data/examples.txt").read_text(encoding="utf-8").split("\n\n")
    return [(*text.split("\n", 1)[0].split(" "), text.split("\n", 1)[1]) for text in texts if text.strip()]


@pytest.mark.parametrize(
    ("module", "name", "text"), examples_of_functions(), ids=lambda value: value if "\n" not in value else ""
)
def test_examples_of_functions(module, name, text):
    names = dict(vars(importlib.import_module(module)))
    found = doctest.DocTestParser().get_doctest(text, names, name, "examples.txt", 0)
    assert found.examples
    assert doctest.DocTestRunner(verbose=False).run(found).failed == 0


def test_public_names():
    """The contract's names and signatures."""
    names = {
        "Block", "catalogue", "DiscreteDamping", "GianniniMasiani", "MakrisKonstantinidis", "Vassiliou",
        "ViscousDamping", "EnergyConsistent", "HousnerImpact", "simulate", "free_rocking", "motions", "ida",
        "stripes", "cloud", "overturning_probability", "fit_fragility", "annual_rate", "HazardCurve", "read_hazard",
        "Study", "adaptive_ida", "plot", "animate", "Wall", "Restraint", "Sliding", "Bed", "Edge",
    }  # fmt: skip
    assert set(tp.__all__) == names
    for name in names:
        assert getattr(tp, name) is not None

    def parameters(function):
        return [p.name for p in inspect.signature(function).parameters.values() if p.kind is not p.KEYWORD_ONLY]

    assert parameters(tp.simulate) == ["block", "model", "motion", "theta0", "omega0"]
    assert parameters(tp.free_rocking) == ["block", "model", "theta0", "duration", "dt"]
    assert parameters(tp.ida) == ["blocks", "models", "motions", "levels", "im", "outputs", "client", "skip"]
    assert parameters(tp.annual_rate) == ["curves", "hazard", "years"]
    assert parameters(tp.Study.run) == ["self", "out", "client", "resume"]
    assert parameters(tp.Block) == ["width", "height", "cm_height", "inertia_factor", "name"]
    assert parameters(tp.motions.from_array)[:3] == ["acceleration", "dt", "labels"]
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = tp.nothing


@pytest.mark.slow
def test_without_the_compiler():
    """NUMBA_DISABLE_JIT=1 gives the same runs from plain Python."""
    code = (
        "import json, sys\n"
        f"sys.path.insert(0, {str(ROOT / 'tests' / 'support')!r})\n"
        "import numpy as np, toppling as tp\n"
        "from shared_cases import LAWS, shake\n"
        "from toppling.models.runs import run_many, trace\n"
        "block = tp.Block.from_slenderness(0.2, 0.5)\n"
        "record = 3.0 * shake(np.random.default_rng(9), n=300, dt=0.02)\n"
        "runs = [trace(law.oscillator(block), record, 0.02).results.tolist()[:4] for law in LAWS]\n"
        "runs += [run_many([law.oscillator(block)], np.array([[0.5, 1.5]]), record, 0.02)[0, 1].tolist()[:4]"
        " for law in LAWS]\n"
        "print(json.dumps(runs))\n"
    )
    plain = np.array(json.loads(run([sys.executable, "-c", code], ROOT, NUMBA_DISABLE_JIT="1")))
    block = tp.Block.from_slenderness(0.2, 0.5)
    record = 3.0 * shake(np.random.default_rng(9), n=300, dt=0.02)
    compiled = np.array([trace(law.oscillator(block), record, 0.02).results[:4] for law in LAWS])
    np.testing.assert_array_equal(plain[: len(LAWS), [0, 2, 3]], compiled[:, [0, 2, 3]])
    np.testing.assert_allclose(plain[: len(LAWS), 1], compiled[:, 1], rtol=1e-10)
    assert len(plain) == 2 * len(LAWS)


@pytest.mark.slow
def test_results_do_not_depend_on_what_memory_held():
    """glibc fills every new and every freed block with a pattern on request: the same runs must come out."""
    code = (
        "import sys\n"
        f"sys.path.insert(0, {str(ROOT / 'tests' / 'support')!r})\n"
        "import dataclasses, numpy as np, toppling as tp\n"
        "from shared_cases import LAWS, shake\n"
        "from toppling.models.runs import run_many, trace\n"
        "block = tp.Block.from_slenderness(0.2, 0.5)\n"
        "record = 2.0 * shake(np.random.default_rng(13), n=300, dt=0.02)\n"
        "stiff = [dataclasses.replace(m, delta=0.002) if hasattr(m, 'delta') else m for m in LAWS]\n"
        "oscillators = [m.oscillator(block) for m in [*LAWS, *stiff]]\n"
        "for oscillator in oscillators:\n"
        "    run = trace(oscillator, record, 0.02, max_turning_points=9)\n"
        "    print(run.results.tolist(), run.history.tolist(), run.turning_points.tolist())\n"
        "print(run_many(oscillators, np.full((len(oscillators), 3), [0.5, 1.0, 2.0]), record, 0.02).tolist())\n"
    )
    plain = run([sys.executable, "-c", code], ROOT)
    for pattern in ("1", "85", "254"):
        assert run([sys.executable, "-c", code], ROOT, MALLOC_PERTURB_=pattern) == plain


def test_every_measure_and_unit_of_a_study_file_is_documented():
    from toppling.studies.file import analyses as analysis_tables

    text = (ROOT / "docs/study.md").read_text(encoding="utf-8")
    for word in {*tp.motions.MEASURES, *analysis_tables.LEVEL_UNITS}:
        assert f"`{word}`" in text, word
