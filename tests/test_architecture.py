"""Packages, imports, kernel folders, names and the wheel, held to the code as it is."""

import ast
import functools
import re
import shutil
import sys
import tomllib
from pathlib import Path

import pytest

import toppling as tp
from toppling import fragility, models, motions, studies
from toppling.core.machine_code import STORED
from toppling.models import runs

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[1]
BELOW = {
    "core": set(),
    "models": {"core"},
    "motions": {"core"},
    "fragility": {"core", "models", "motions"},
    "studies": {"core", "models", "motions", "fragility"},
    "benchmarks": {"core", "models", "motions", "fragility", "studies"},
}
"""Packages and those that each may use."""
KERNEL_FOLDERS = {
    *("core/kernels", "models/engine", "models/sliding_engine", "motions/kernels", "fragility/kernels"),
    "benchmarks/kernels",
}
NUMBA = {"core/machine_code.py"}
"""Files that import numba: what compiles kernels."""
DECORATOR = "core/compiled.py"
PAGES = Path("benchmarks/pages")
"""Pages of the documentation: not in the wheel, and written as a user's script, by `import toppling as tp`."""


def code(root=ROOT):
    """Return every module of the packages as a path below the root."""
    return [path.relative_to(root) for package in BELOW for path in sorted((root / package).rglob("*.py"))]


@functools.cache
def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def from_elsewhere(path):
    """The packages that a file imports by their full names."""
    found = set()
    for node in ast.walk(tree(ROOT / path)):
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add(node.module.split(".")[0])
    return found


def imported(path, root=ROOT):
    """Return the files that a file imports, wherever the import stands: modules, or the `__init__` of a folder."""
    found = set()
    for node in ast.walk(tree(root / path)):
        if not (isinstance(node, ast.ImportFrom) and node.level):
            continue
        folder = path.parts[: len(path.parts) - node.level]
        base = Path(*folder, *(node.module or "").split("."))
        for name in node.names:
            inside = [base / f"{name.name}.py", base / name.name / "__init__.py", base / "__init__.py"]
            places = [*inside, Path(f"{base}.py")]
            place = next((place for place in places if (root / place).is_file()), None)
            assert place, f"{path} imports {name.name} of {base}"
            found.add(place)
    return found


def wrong_arrows(root=ROOT):
    """Return the imports from a package that a module may not use."""
    return {
        (str(path), str(used))
        for path in code(root)
        for used in imported(path, root)
        if len(used.parts) > 1 and used.parts[0] not in BELOW[path.parts[0]] | {path.parts[0]}
    }


def circle(root=ROOT):
    """Return the files of a circle of imports, if there is one; a package's `__init__` counts as what it names."""
    uses = {path: imported(path, root) for path in code(root)}
    done, way = set(), []

    def follow(path):
        if path in way:
            return [*way[way.index(path) :], path]
        if path in done or path not in uses:
            return None
        way.append(path)
        found = next(filter(None, map(follow, sorted(uses[path]))), None)
        way.pop()
        done.add(path)
        return found

    return next(filter(None, map(follow, uses)), None)


class TestImports:
    @pytest.mark.slow
    def test_packages_use_only_those_below_them(self):
        assert wrong_arrows() == set()

    @pytest.mark.slow
    def test_files_form_no_circle(self):
        """Not even inside a folder, imports inside functions among them."""
        assert circle() is None

    @pytest.mark.slow
    def test_imports_inside_the_package_are_relative(self):
        assert [path for path in code() if path.parent != PAGES and "toppling" in from_elsewhere(path)] == []

    @pytest.mark.parametrize("package", [*sorted(BELOW.keys() - {"benchmarks"}), "golden/scripts"])
    def test_tests_of_the_product_need_no_benchmark(self, package):
        files = (ROOT / "tests" / package).rglob("*.py")
        assert [path for path in files if "toppling.benchmarks" in path.read_text(encoding="utf-8")] == []

    @pytest.mark.parametrize(
        "text",
        [
            "def late():\n    from ...models.block import Block\n",
            "if TYPE_CHECKING:\n    from ...models.block import Block\n",
            "from ... import models\n",
        ],
    )
    def test_a_forbidden_import_is_seen(self, tmp_path, text):
        files = {
            "models/__init__.py": "from .block import Block\n",
            "models/block.py": "from ..motions.readers.lines import read\n",
            "motions/__init__.py": "",
            "motions/readers/__init__.py": "",
            "motions/readers/lines.py": text,
        }
        for name, content in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(content, encoding="utf-8")
        arrows = wrong_arrows(tmp_path)
        assert ("models/block.py", "motions/readers/lines.py") in arrows
        assert any(user == "motions/readers/lines.py" for user, _ in arrows)
        assert Path("motions/readers/lines.py") in circle(tmp_path)


class TestKernels:
    def test_kernel_folders_import_only_the_decorator(self):
        for path in code():
            if str(path.parent) in KERNEL_FOLDERS:
                assert {str(used) for used in imported(path) if used.parent != path.parent} <= {DECORATOR}, path

    @pytest.mark.slow
    def test_kernels_are_defined_in_kernel_folders_only(self):
        """Only files that import the decorator can define a kernel, for only `NUMBA` knows of numba's own."""
        assert {str(path.parent) for path in code() if Path(DECORATOR) in imported(path)} == KERNEL_FOLDERS
        assert {str(path.parent) for path in code() if path.parent.name == "kernels"} <= KERNEL_FOLDERS

    @pytest.mark.slow
    def test_numba_is_imported_by_what_compiles_alone(self):
        assert {str(path) for path in code() if "numba" in from_elsewhere(path)} == NUMBA

    def test_kernels_use_no_arithmetic_of_numba_s_own(self):
        """numba compiles `x**2` as a function for whichever kernel asks first, with that one's fused operations."""
        for path in (path for path in code() if str(path.parent) in KERNEL_FOLDERS):
            for function in ast.walk(tree(ROOT / path)):
                if isinstance(function, ast.FunctionDef) and "kernel(" in "".join(
                    map(ast.unparse, function.decorator_list)
                ):
                    powers = [node for node in ast.walk(function) if isinstance(node, ast.Pow)]
                    assert not powers, f"{path.name}: {function.name} has a power: write it as a product"

    def test_the_identity_of_the_engine_covers_its_folder(self, tmp_path, monkeypatch):
        """Shards and workers of clusters are compared by it: a changed kernel or compiler option is another engine."""
        shutil.copytree(ROOT / "models", tmp_path / "models", ignore=shutil.ignore_patterns("__pycache__"))
        (tmp_path / "core").mkdir()
        for name in ("compiled.py", "machine_code.py"):
            shutil.copy(ROOT / "core" / name, tmp_path / "core")
        now = runs.engine_identity()
        monkeypatch.setattr(runs, "__file__", str(tmp_path / "models/runs.py"))
        assert runs.engine_identity.__wrapped__() == now
        seen = {now["engine"]}
        files = [*(tmp_path / "core").glob("*.py"), *sorted((tmp_path / "models/engine").glob("*.py"))]
        for path in files:
            with path.open("a", encoding="utf-8") as file:
                file.write("# another line\n")
            seen.add(runs.engine_identity.__wrapped__()["engine"])
        assert len(seen) == 1 + len(files) > 10


class TestWheel:
    """What pyproject.toml lists: a folder or file that it leaves out is missing in the wheel, and nothing says so."""

    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]

    def test_packages_are_the_folders_that_hold_code(self):
        """Those of the product: benchmarks, published tests and claims run from a checkout."""
        names = {".".join(("toppling", *path.parts[:-1])) for path in code() if path.parts[0] != "benchmarks"}
        assert sorted(self.settings["packages"]) == sorted(names | {"toppling"})
        for path in code():
            assert (ROOT / path.parent / "__init__.py").is_file(), path

    def test_data_files_are_listed_and_there(self):
        listed, given = set(), dict(self.settings["package-data"])
        assert given.pop("*") == [f"{STORED}/*.nb?"]  # (there in wheels with compiled code alone)
        for package, patterns in given.items():
            folder = ROOT.joinpath(*package.split(".")[1:])
            for pattern in patterns:
                found = set(folder.glob(pattern))
                assert found, f"{package}: {pattern}"
                listed |= found
        here = {
            path
            for package in BELOW.keys() - {"benchmarks"}
            for path in (ROOT / package).rglob("*")
            if path.is_file() and path.suffix != ".py" and not {"__pycache__", "pages"} & set(path.parts)
        }
        assert listed == here | {ROOT / "py.typed"}


class TestNames:
    @pytest.mark.parametrize("package", [models, motions, fragility, studies], ids=lambda package: package.__name__)
    def test_no_module_bears_a_public_name(self, package):
        """A module or folder of that name would be an attribute of the package, and hide the function."""
        short = package.__name__.split(".")[1]
        names = {path.parts[1].removesuffix(".py") for path in code() if path.parts[0] == short}
        assert len(names) > 5
        assert not names & set(package.__all__)

    def test_the_face_of_a_folder_is_a_docstring(self):
        """It imports nothing, so that importing a folder loads nothing."""
        for path in code():
            if path.name == "__init__.py" and len(path.parts) > 2:
                assert ast.get_docstring(tree(ROOT / path)), path
                assert len(tree(ROOT / path).body) == 1, f"{path}: more than a docstring"

    def test_every_module_says_what_it_is(self):
        assert [path for path in code() if not ast.get_docstring(tree(ROOT / path))] == []


def test_folders_that_the_page_names_are_there():
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    named = re.findall(rf"`((?:{'|'.join(BELOW)})/[\w/.]+)`", text)
    assert len(named) > 8
    for name in named:
        assert (ROOT / name).exists(), name
    rows = [row.split("|")[2:4] for row in text.split("|---|---|---|\n")[1].split("\n\n")[0].splitlines()]
    for files, functions in ((re.findall(r"`(.+?)`", cell) for cell in cells) for cells in rows):
        source = "".join((ROOT / name).read_text(encoding="utf-8") for name in files)
        assert [name for name in functions if not re.search(rf"(def|class) {name}\b", source)] == []


def test_functions_take_few_arguments():
    """At most 12, and above 8 in ten public faces at most; what a class's methods are called on is none of them."""
    numbers = [
        len([argument for argument in every if argument.arg not in ("self", "cls")])
        for path in code()
        if str(path.parent) not in KERNEL_FOLDERS and path.parts[0] in BELOW
        for function in ast.walk(tree(ROOT / path))
        if isinstance(function, ast.FunctionDef)
        for every in [[*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]]
    ]
    assert max(numbers) <= 12
    assert len([number for number in numbers if number > 8]) <= 10


def test_modules_of_core_hide_no_module_of_python():
    names = {path.stem for path in code() if path.parts[0] == "core"} - {"__init__"}
    assert not names & sys.stdlib_module_names
    assert not names & set(tp.__all__)
