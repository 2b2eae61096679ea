"""Rooms, floors, kernel folders, names and the architecture page, held to the code as it is."""

import ast
import functools
import importlib.util
import re
import shutil
import sys
import tomllib
from pathlib import Path

import pytest

import toppling as tp
from toppling import fragility, models, motions, studies
from toppling.models import runs

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = {
    ("fragility", "models"),
    ("fragility", "motions"),
    ("benchmarks", "models"),
    ("benchmarks", "motions"),
    ("benchmarks", "fragility"),
    ("studies", "models"),
    ("studies", "motions"),
    ("studies", "fragility"),
    ("studies", "benchmarks"),
}
"""Packages and those that they use."""
# From the ground up, a paragraph for each floor: a room uses only rooms of lower floors.
# A new arrow that lifts a room is a decision, made here.
FLOORS = """
benchmarks/kernels benchmarks/multiprecision fragility/kernels models/engine models/scenes models/slip motions/arrays
motions/kernels studies/codes studies/money

fragility/numerics models/block models/oscillator motions/corrections motions/polarity motions/readers

models/assembly models/batches models/columns models/friction models/items models/restraint_force models/statics
models/supports motions/intensity motions/pairs

models/sides motions/plausibility motions/scaling

models/laws motions/simulated motions/supports

benchmarks/problems models/sliding motions/floors motions/matching motions/selection

benchmarks/exact_motion benchmarks/rivals models/runs motions/generators

benchmarks/measure benchmarks/truth fragility/runs models/dissipation models/history

benchmarks/precision benchmarks/scenes benchmarks/speed fragility/hazard fragility/validity

benchmarks/figures benchmarks/mixing benchmarks/sliding fragility/fitting

benchmarks/flags benchmarks/tables fragility/adaptive fragility/curves fragility/efficiency

benchmarks/whole fragility/exchange fragility/risk

benchmarks/selection fragility/exchange/nrml fragility/exchange/pelicun fragility/surfaces

fragility/analyses studies/text

benchmarks/scale benchmarks/sequential fragility/uncertainty

benchmarks/coverage benchmarks/suite studies/plan

benchmarks/page studies/file

studies/inventory studies/reference studies/region studies/sensitivity studies/store

studies/buildings

studies/kits studies/tables

studies/kinds

studies/plots

studies/film studies/plot studies/show

studies/report studies/single studies/validation

studies/comparison

studies/command
"""
KERNEL_FOLDERS = {"models/engine", "models/slip", "motions/kernels", "fragility/kernels", "benchmarks/kernels"}
NUMBA = {"machine_code.py", "benchmarks/rivals/peers.py"}
"""Files that import numba: what compiles kernels, and the integrators of others, which take numba's C callbacks."""
ONE_MODULE = {"benchmarks/kernels": "the rivals are one module, and a kernel folder of their own stamps their cache"}
"""Rooms of a single module, with the reason."""
SAME_PREFIX: dict[tuple[str, str], str] = {}
"""Prefixes that two files of a room share, with the reason."""
PARAGRAPHS = {"models/engine": "the method of the engine is described once, for all of its modules"}
"""Rooms whose docstring has more than one paragraph, with the reason."""


def load(name):
    specification = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


drawing = load("drawing")
FOLDERS = sorted({"/".join(place[:-1]) for place in drawing.modules() if len(place) > 2})
CODE = {
    path: ROOT.joinpath(*path).with_suffix(".py") for path in [*drawing.modules(), *((one,) for one in drawing.BELOW)]
}


@functools.cache  # (seconds of parsing, which each process of a run of tests would take to collect)
def uses():
    return drawing.uses()


@functools.cache
def rooms():
    return drawing.rooms_of(uses())


def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def from_elsewhere(path):
    """The packages that a file imports by their full names."""
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {one.name.split(".")[0] for one in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add(node.module.split(".")[0])
    return found


def files_of(root, texts):
    """A small package in a folder: files and their texts."""
    for name, text in texts.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


class TestImports:
    def test_rooms_use_only_lower_floors(self):
        """A circle of rooms raises; without one, every room stands above all that it uses."""
        floors = drawing.floors(uses())
        assert len(floors) == len(rooms()) > 50
        for room, used in uses().items():
            assert all(floors.get(one, 0) < floors[room] for one in used), room
        declared = enumerate(FLOORS.strip().split("\n\n"), start=1)
        assert floors == {room: floor for floor, text in declared for room in text.split()}

    @pytest.mark.slow
    def test_files_form_no_circle(self):
        """Not even within a room, imports inside functions among them."""
        files = drawing.modules()
        used = {}
        for module, file in files.items():
            targets = {(*place, name) if (*place, name) in files else place for place, name in drawing.imported(file)}
            used[module] = {one for one in targets if one in files and one[-1] != "__init__"}
        assert sum(map(len, used.values())) > 500
        done, path = set(), []

        def follow(module):
            assert module not in path, [*path[path.index(module) :], module]
            if module in done:
                return
            path.append(module)
            for one in sorted(used[module]):
                follow(one)
            path.pop()
            done.add(module)

        for module in used:
            follow(module)

    def test_packages_use_only_those_below_them(self):
        arrows = drawing.package_arrows(uses())
        assert {pair for pair in arrows if pair[1] not in drawing.BELOW} == ALLOWED
        assert {used for _, used in arrows} <= {*drawing.PACKAGES, *drawing.BELOW}

    def test_root_modules_import_only_each_other(self):
        used = {
            name: {place[0] for place, _ in drawing.imported(ROOT / f"{name}.py")} - {name} for name in drawing.BELOW
        }
        assert set(used) == {
            "aliases",
            "checks",
            "compiled",
            "distributions",
            "doubts",
            "faces",
            "labelled",
            "limits",
            "machine_code",
            "streams",
            "units",
            "wording",
            "writing",
        }
        assert set().union(*used.values()) <= set(drawing.BELOW)
        drawing.floors(used)  # no circle

    @pytest.mark.slow
    def test_imports_inside_the_package_are_relative_and_lead_somewhere(self):
        for path in CODE.values():
            assert "toppling" not in from_elsewhere(path), path
            for place, name in drawing.imported(path):
                whole = ROOT.joinpath(*place)
                assert whole.is_dir() or whole.with_suffix(".py").is_file(), f"{path} imports {name} of {place}"

    def test_a_forbidden_import_is_seen(self, tmp_path):
        """Wherever it stands, through the face of a package, and of a package as a whole."""
        files_of(
            tmp_path,
            {
                "models/__init__.py": "from .block import Block\n",
                "models/block.py": "from ..motions import read\nfrom .. import checks\n",
                "motions/__init__.py": "from .readers.lines import read\n",
                "motions/readers/__init__.py": "",
                "motions/readers/lines.py": "from ...units import METRE\n",
                "motions/readers/csv.py": "from . import lines\nfrom .lines import read\n",
            },
        )
        for package in drawing.PACKAGES:
            (tmp_path / package).mkdir(exist_ok=True)
        used = drawing.uses(tmp_path)
        assert used == {"models/block": {"motions/readers", "checks"}, "motions/readers": {"units"}}
        assert drawing.floors(used) == {"models/block": 2, "motions/readers": 1}
        assert drawing.package_arrows(used) == {("models", "motions"), ("models", "checks"), ("motions", "units")}
        with pytest.raises(ValueError, match="no place is known for the arrows"):
            drawing.svg([], drawing.package_arrows(used))

        circles = (
            "def late():\n    from ...models import Block\n",
            "if TYPE_CHECKING:\n    from ...models.block import Block\n",
            "from ... import models\n",
        )
        for text in circles:
            files_of(tmp_path, {"motions/readers/lines.py": text})
            assert drawing.uses(tmp_path)["motions/readers"] == {"models/block"}
            with pytest.raises(ValueError, match=r"circle: models/block → motions/readers → models/block"):
                drawing.floors(drawing.uses(tmp_path))


class TestKernels:
    def test_kernel_folders_import_only_the_decorator(self):
        for room in KERNEL_FOLDERS:
            assert uses()[room] == {"compiled"}, room

    def test_kernels_are_defined_in_kernel_folders_only(self):
        """Only rooms that import the decorator can define a kernel, for only `NUMBA` knows of numba's own."""
        assert {room for room, used in uses().items() if "compiled" in used} == KERNEL_FOLDERS
        assert {folder for folder in FOLDERS if folder.endswith("/kernels")} <= KERNEL_FOLDERS

    @pytest.mark.slow
    def test_numba_is_imported_by_what_compiles_alone(self):
        found = {str(path.relative_to(ROOT)) for path in CODE.values() if "numba" in from_elsewhere(path)}
        assert found == NUMBA

    @pytest.mark.slow
    def test_kernels_use_no_arithmetic_of_numba_s_own(self):
        """numba compiles `x**2` as a function for whichever kernel asks first, with that one's fused operations."""
        for room in KERNEL_FOLDERS:
            for path in (path for path in CODE.values() if str(path.relative_to(ROOT)).startswith(f"{room}/")):
                for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                    if isinstance(function, ast.FunctionDef) and "kernel(" in "".join(
                        map(ast.unparse, function.decorator_list)
                    ):
                        powers = [one for one in ast.walk(function) if isinstance(one, ast.Pow)]
                        assert not powers, f"{path.name}: {function.name} has a power: write it as a product"

    def test_the_identity_of_the_engine_covers_its_folder(self, tmp_path, monkeypatch):
        """Shards and workers of clusters are compared by it: a changed kernel or compiler option is another engine."""
        shutil.copytree(ROOT / "models", tmp_path / "models", ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("compiled.py", "machine_code.py"):
            shutil.copy(ROOT / name, tmp_path)
        now = runs.engine_identity()
        monkeypatch.setattr(runs, "__file__", str(tmp_path / "models/runs.py"))
        assert runs.engine_identity.__wrapped__() == now
        seen = {now["engine"]}
        files = [*tmp_path.glob("*.py"), *sorted((tmp_path / "models/engine").glob("*.py"))]
        for path in files:
            with path.open("a", encoding="utf-8") as file:
                file.write("# another line\n")
            seen.add(runs.engine_identity.__wrapped__()["engine"])
        assert len(seen) == 1 + len(files) > 10


class TestWheel:
    """What pyproject.toml lists: a folder or file that it leaves out is missing in the wheel, and nothing says so."""

    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]

    def test_packages_are_the_folders_that_hold_code(self):
        folders = {path.parent.relative_to(ROOT) for path in CODE.values()}
        names = [".".join(("toppling", *folder.parts)) for folder in folders]
        assert sorted(self.settings["packages"]) == sorted(names)
        for package in drawing.PACKAGES:
            for path in (ROOT / package).rglob("*.py"):
                assert (path.parent / "__init__.py").is_file(), path

    def test_data_files_are_listed_and_there(self):
        listed = set()
        for package, patterns in self.settings["package-data"].items():
            folder = ROOT.joinpath(*package.split(".")[1:])
            for pattern in patterns:
                found = set(folder.glob(pattern))
                assert found, f"{package}: {pattern}"
                listed |= found
        here = {
            path
            for package in drawing.PACKAGES
            for path in (ROOT / package).rglob("*")
            if path.is_file() and path.suffix != ".py" and "__pycache__" not in path.parts
        }
        assert listed == here | {ROOT / "py.typed"}


class TestNames:
    @pytest.mark.parametrize("package", [models, motions, fragility, studies], ids=lambda one: one.__name__)
    def test_no_room_bears_a_public_name(self, package):
        """A module or folder of that name would be an attribute of the package, and hide the function."""
        short = package.__name__.split(".")[1]
        names = {room.name.split("/")[0].removesuffix(".py") for room in rooms() if room.package == short}
        assert len(names) > 5
        assert not names & set(package.__all__)

    def test_root_modules_hide_no_module_of_python(self):
        assert not set(drawing.BELOW) & sys.stdlib_module_names
        assert not set(drawing.BELOW) & set(tp.__all__)

    def test_rooms_are_of_few_modules(self):
        sizes = {f"{room.package}/{room.name}": len(room.modules) for room in rooms() if room.modules}
        assert {room for room, size in sizes.items() if size < 2} == set(ONE_MODULE)
        assert max(sizes.values()) + 1 <= 18  # (with __init__)
        for package in drawing.PACKAGES:
            assert sum(not room.modules for room in rooms() if room.package == package) <= 18, package

    @pytest.mark.parametrize("folder", FOLDERS)
    def test_the_face_of_a_room_is_one_paragraph(self, folder):
        """It imports nothing, so that importing a room loads nothing."""
        body = tree(ROOT / folder / "__init__.py").body
        assert len(body) == 1, "more than a docstring"
        text = ast.get_docstring(tree(ROOT / folder / "__init__.py"))
        assert text
        assert ("\n\n" in text) == (folder in PARAGRAPHS)

    def test_no_two_files_of_a_room_share_a_prefix(self):
        """Two files with a prefix are a room asking to be made."""
        found = set()
        for folder in [*drawing.PACKAGES, *FOLDERS]:
            names = [path.stem for path in (ROOT / folder).glob("*.py") if path.stem != "__init__"]
            words = [name.split("_")[0] for name in names]
            prefixes = {name.split("_")[0] for name in names if "_" in name}
            found |= {(folder, prefix) for prefix in prefixes if words.count(prefix) > 1}
        assert found == set(SAME_PREFIX)


class TestPage:
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    drawn = (ROOT / "docs/architecture.svg").read_text(encoding="utf-8")

    def test_tables_are_of_today(self):
        assert drawing.page(self.text, rooms()) == self.text, "run `make drawing`"

    def test_the_drawing_is_of_today(self):
        assert drawing.svg(rooms(), drawing.package_arrows(uses())) == self.drawn, "run `make drawing`"
        # as many arrows as there are between packages
        assert len(re.findall(r"marker-end", self.drawn)) == len(ALLOWED)

    def test_every_room_and_module_is_on_the_page(self):
        made = self.text.split(drawing.BEGIN)[1]
        for room in rooms():
            assert room.text, f"{room.package}/{room.name} has no docstring"
            assert f"| `{room.name}{'/' if room.modules else ''}` | " in made
            assert f">{room.name}{'/' if room.modules else ''}</text>" in self.drawn
        listed = sum(len(room.modules) or 1 for room in rooms())
        assert listed == len([place for place in drawing.modules() if place[-1] != "__init__"])

    def test_folders_that_the_page_names_are_there(self):
        before = self.text.split(drawing.BEGIN)[0]
        named = re.findall(rf"`((?:{'|'.join(drawing.PACKAGES)})/[\w/.]+)`", before)
        assert len(named) > 8
        for name in named:
            assert (ROOT / name).exists(), name
