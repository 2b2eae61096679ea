"""Memory is bounded by what is worked on, not by the study: real processes that may take less than their results."""

import re
import resource
import shutil
import subprocess
import sys
import tracemalloc
from pathlib import Path

import dask
import netCDF4
import numpy as np
import pytest
import study_texts
import xarray as xr
from check_facts import numbers_in
from study_texts import crate_study, study_in

import toppling as tp
from toppling.fragility.numerics import slabs
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.kinds import study as studies
from toppling.studies.kinds.fragility import STORED_BYTES
from toppling.studies.store import folder as store, netcdf, resources, shards
from toppling.studies.store.content import sealed

DRIVER = Path(study_texts.__file__).with_name("large_study.py")
EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"
ROOM = 200_000_000
"""Bytes of memory beside those of what is loaded: some 100 MB go to threads, their stacks and what loads late."""
BLOCK = '[[blocks]]\nwidth_m = {}\nheight_m = 1.8\nname = "{}"\n'
LAW = '[[models]]\nlaw = "housner"\ngeometry = "linear"\ne = {}\n'
LEVELS = 'levels = {{ from = {}, to = {}, number = {}, unit = "g" }}'


def short(number):
    return f'[motions]\ngenerator = "clough-penzien"\nnumber = {number}\nduration_s = 2\ndt_s = 0.02\n'


BLOCKS = "".join(BLOCK.format(f"{0.3 + 0.02 * i:g}", f"b{i}") for i in range(8))
LAWS = "".join(LAW.format(f"{0.9 - 0.02 * i:g}") for i in range(10))
LARGE = f"""
title = "More than memory"
{BLOCKS}
{LAWS}
{short(15000)}
[ida]
im = "pga"
{LEVELS.format(0.05, 1.0, 20)}
[fit]
replicates = 100
[screen]
undecided = 0.05
[friction]
static = 0.4
"""
BUILDING = f"""
title = "More lines than memory"
{LAW.format(0.9)}
{short(700)}
[building]
kind = "flexural-shear"
period_s = 0.5
alpha0 = 8
storeys = 2
[performance]
inventory = "inventory.csv"
im = "pga"
{LEVELS.format(0.1, 2.0, 20)}
[hazard]
levels = [0.05, 0.2, 0.8, 3.2]
rates = [4e-2, 6.5e-3, 3.5e-4, 3e-6]
unit = "g"
"""
UNCERTAIN = f"""
title = "More samples than memory"
{BLOCK.format(0.4, "block")}
{LAW.format(0.9)}
{short(1000)}
[ida]
im = "pga"
{LEVELS.format(0.05, 1.0, 40)}
[uncertainty]
samples = 850
[uncertainty.inputs]
R_factor = {{ distribution = "uniform", lower = 0.9, upper = 1.1 }}
"""
LINES = "".join(
    f"line {i},{0.3 + 1e-4 * i:g},1.8,{i % 3},{1 + i % 4},{100 + i},{'' if i % 5 else 'exit'}\n" for i in range(2500)
)
of_linux = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc to know what is taken")


def run(folder, place, limit, text=LARGE, **options):
    (folder / "study.toml").write_text(text)
    arguments = [place, str(limit), str(folder / "study.toml"), str(folder / place)]
    return subprocess.run(
        [sys.executable, str(DRIVER), *arguments], capture_output=True, text=True, check=False, timeout=300, **options
    )


@pytest.mark.slow
@pytest.mark.longest
@of_linux
def test_results_larger_than_the_memory(tmp_path):
    """The same bytes under a limit of memory below the size of the results, and with everything in memory."""
    done = run(tmp_path, "disk", ROOM)
    assert done.returncode == 0, done.stderr
    results = tmp_path / "disk" / "results.nc"
    assert results.stat().st_size > 1.2 * ROOM
    names = ["fragility.png", "laws.png", "results.nc", "run.log"]
    assert sorted(path.name for path in results.parent.iterdir()) == names
    held = run(tmp_path, "memory", ROOM)
    assert held.returncode == 1
    assert re.fullmatch("toppling: .*memory.*\n", held.stderr)
    free = run(tmp_path, "memory", "none")
    assert free.returncode == 0, free.stderr
    assert (tmp_path / "memory" / "results.nc").read_bytes() == results.read_bytes()


@pytest.mark.slow
@pytest.mark.longest
@of_linux
@pytest.mark.parametrize("text", [BUILDING, UNCERTAIN])
def test_what_is_made_of_all_runs_stays_below_the_memory(tmp_path, text):
    """4e7 runs of an inventory's lines, 3e7 of one uncertain block: 8 bytes a run, several times, would be too much."""
    (tmp_path / "inventory.csv").write_text(f"item,width_m,height_m,floor,count,value,consequence\n{LINES}")
    done = run(tmp_path, "disk", ROOM, text)
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(tmp_path / "disk" / "results.nc") as results:
        assert 8 * results["overturned"].size > 1.3 * ROOM


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    study = study_in(folder, crate_study("A crate", number=30, duration=6, dt=0.02, levels=6))
    study.run(folder)
    return folder, study


@pytest.mark.slow
@pytest.mark.parametrize("name", ["overturned", "peak_rotation", "verdict", "probability", "median", "level"])
def test_a_flipped_bit_is_noticed(finished, tmp_path, capsys, name):
    """One bit of the numbers of a finished file: no table, figure or curve is made of it."""
    folder, study = finished
    content = bytearray((folder / "results.nc").read_bytes())
    with netCDF4.Dataset("results", memory=bytes(content)) as file:
        file.set_auto_maskandscale(False)
        data = file[name][:].tobytes()
    assert content.count(data) == 1
    content[content.find(data) + len(data) // 2] ^= 16
    path = tmp_path / "results.nc"
    path.write_bytes(content)
    (tmp_path / "study.toml").write_bytes((folder / "study.toml").read_bytes())
    commands = [["status", str(tmp_path)], ["run", str(tmp_path / "study.toml"), "--out", str(tmp_path)]]
    if name in ("probability", "median", "level"):  # (what is of every run is not read for these)
        commands += [["report", str(path)], ["export", str(path), "--format", "csv", "--out", str(tmp_path / "export")]]
    for command in commands:
        assert main(command) == 2, command
        assert f"{path}: is damaged" in capsys.readouterr().err
    assert not (tmp_path / "export").exists()
    study.run(tmp_path, resume=False)
    assert path.read_bytes() == (folder / "results.nc").read_bytes()


@pytest.fixture
def large(monkeypatch):
    for module in (netcdf, store):
        monkeypatch.setattr(module, "WHOLE_BYTES", 200)
    monkeypatch.setattr(netcdf, "SLAB_BYTES", 400)


def test_damage_of_large_results_is_noticed(finished, tmp_path, large):
    """What is too large to be read at once is looked through slab by slab."""
    folder, study = finished
    content = bytearray((folder / "results.nc").read_bytes())
    data = xr.open_dataset(folder / "results.nc")["peak_rotation"].values.tobytes()
    content[content.find(data) + len(data) - 3] ^= 1
    (tmp_path / "results.nc").write_bytes(content)
    with pytest.raises(StudyError, match="is damaged"):
        study.run(tmp_path)


@pytest.mark.slow
def test_another_title_for_large_results(finished, tmp_path, large):
    """Results that are read as they are written anew."""
    folder, study = finished
    study.run(tmp_path)
    found = study_in(tmp_path, (folder / "study.toml").read_text().replace("A crate", "Two crates")).run(tmp_path)
    assert found.attrs["title"] == "Two crates"
    xr.testing.assert_equal(found.load(), study.run())
    with xr.open_dataset(tmp_path / "results.nc") as again:
        xr.testing.assert_identical(again.load(), found)


@pytest.mark.slow
def test_large_variables_are_written_as_small_ones(finished, tmp_path, monkeypatch):
    """Slab by slab, by our own hand: the same variables, types, attributes and values as xarray writes."""
    folder, study = finished
    monkeypatch.setattr(netcdf, "SLAB_BYTES", 1000)
    monkeypatch.setattr(netcdf, "CHUNK_BYTES", 300)
    study.run(tmp_path)
    with netCDF4.Dataset(folder / "results.nc") as small, netCDF4.Dataset(tmp_path / "results.nc") as large:
        assert list(small.variables) != list(large.variables)
        small_ones, large_ones = (
            {
                name: (array.dtype, array.dimensions, sorted(map(str, array.__dict__.items())))
                for name, array in file.variables.items()
            }
            for file in (small, large)
        )
        assert small_ones == large_ones
        assert small.__dict__ == large.__dict__
    with xr.open_dataset(folder / "results.nc") as small, xr.open_dataset(tmp_path / "results.nc") as large:
        xr.testing.assert_identical(small.load(), large.load())


def test_the_bytes_are_those_of_xarrays_own_writer(tmp_path):
    """Which loads a cluster's library: numbers, flags, words, coordinates, and attributes of each kind."""
    results = xr.Dataset(
        {
            "median": (("block", "level"), np.array([[1.0, np.nan], [3.0, 4.0]]), {"units": "m s-2"}),
            "converged": ("block", [True, False]),
            "count": ("level", np.array([3, 4], dtype=np.int64)),
            "one": 2.5,
            "empty": ("none", np.empty(0)),
        },
        {
            "block": ["shelf", "Schränkchen"],
            "level": ("level", [0.1, 0.2], {"im": "pga"}),
            "label": ("block", np.array(["a", "bc"], dtype=object)),
        },
        {"title": "Überall", "number": 3, "share": 0.5, "several": [1.0, 2.0]},
    )
    netcdf.write(results, tmp_path / "ours.nc")
    names = ["median", "converged", "count", "level"]
    encoding = {name: {"fletcher32": True, "chunksizes": results[name].shape} for name in names}
    results.to_netcdf(tmp_path / "theirs.nc", engine="netcdf4", encoding=encoding)
    assert (tmp_path / "ours.nc").read_bytes() == (tmp_path / "theirs.nc").read_bytes()
    with xr.open_dataset(tmp_path / "ours.nc", engine="netcdf4") as stored:
        xr.testing.assert_identical(stored.load().drop_encoding(), results)


FIRST = '[fit]\nmethod = "first-overturning"\n'


class TestSlabs:
    def test_together_they_are_everything(self):
        sizes = {"block": 5, "model": 3, "level": 7, "motion": 1 << 19}
        seen = np.zeros((5, 3), np.int64)
        for where in slabs.slabs(sizes, ("block", "model")):
            seen[where.get("block", slice(None)), where.get("model", slice(None))] += 1
        assert (seen == 1).all()

    @pytest.mark.slow
    @pytest.mark.parametrize("runs", [1, 50, 700, 10**9])
    def test_results_do_not_depend_on_them(self, finished, monkeypatch, runs):
        """Also where a slab is one curve, or parts of the motions."""
        _, study = finished
        whole = study.run()
        monkeypatch.setattr(slabs, "RUNS", runs)
        xr.testing.assert_identical(study.run(), whole)

    @staticmethod
    def example(folder, name, number, changed):
        shutil.copytree(EXAMPLES, folder / "examples")
        path = folder / "examples" / f"{name}.toml"
        text = path.read_text()
        for old, new in {r"(?m)^number = \d+": f"number = {number}", **changed}.items():
            text = re.sub(old, new, text)
        path.write_text(text)
        return tp.Study.from_toml(path)

    @pytest.mark.slow
    @pytest.mark.parametrize("name", ["cloud", "tower", "clinic"])
    def test_of_other_studies(self, tmp_path, monkeypatch, name):
        study = self.example(tmp_path, name, 12, {})
        whole = study.run()
        monkeypatch.setattr(slabs, "RUNS", 40)
        monkeypatch.setattr(shards, "IN_MEMORY", 0)
        monkeypatch.setattr(netcdf, "SLAB_BYTES", 2000)
        xr.testing.assert_identical(study.run(tmp_path / "out"), whole)

    @pytest.mark.slow
    @pytest.mark.parametrize("runs", [1, 90])
    @pytest.mark.parametrize(
        ("name", "changed"),
        [
            ("clinic", {"variability = .*": ""}),
            ("clinic", {r"\[performance\]": '[performance]\nobjective = "any"'}),
            ("clinic", {r"\[hazard\](.|\n)*": "", r"\[performance\]": '[performance]\nobjective = "blocks-exit"'}),
            ("uncertainty", {"sobol = 64": ""}),
            ("uncertainty", {"sobol = 64": "", r"\[uncertainty\]": f"{FIRST}[uncertainty]"}),
        ],
    )
    def test_of_lines_and_of_samples(self, tmp_path, monkeypatch, name, changed, runs):
        few = {"number = (14|24)": "number = 5", "samples = 64": "samples = 10"}
        study = self.example(tmp_path, name, 7, {**changed, **few})
        whole = study.run()
        monkeypatch.setattr(slabs, "RUNS", runs)
        monkeypatch.setattr(shards, "IN_MEMORY", 0)
        found = study.run(tmp_path / "out")
        if "flag_share" in whole:  # (variances of flags at several levels are sums in another order)
            for share in ("flag_share", "flag_total_share"):
                np.testing.assert_allclose(found[share], whole[share], rtol=1e-12, atol=1e-13)
                found[share] = whole[share]
            found = sealed(found)
        xr.testing.assert_identical(found, whole)

    def test_arrays_on_the_disk(self, finished, tmp_path, monkeypatch):
        folder, study = finished
        monkeypatch.setattr(shards, "IN_MEMORY", 0)
        study.run(tmp_path)
        assert (tmp_path / "results.nc").read_bytes() == (folder / "results.nc").read_bytes()
        assert sorted(path.name for path in tmp_path.iterdir()) == ["results.nc", "run.log"]


@pytest.mark.slow
def test_no_room_for_arrays(finished, tmp_path, monkeypatch):
    """A disk that is full where the arrays of all runs are to be: one sentence, at the beginning."""
    _, study = finished
    monkeypatch.setattr(shards, "IN_MEMORY", 0)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (600, before[1]))
    try:
        with pytest.raises(StudyError, match=r"cannot be written|has no room for"):
            study.run(tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    study.run(tmp_path)


def test_a_disk_without_room_is_told_before_anything_runs(finished, tmp_path, monkeypatch, capsys):
    folder, study = finished
    monkeypatch.setattr(resources, "free_bytes", lambda folder: 2_000_000)
    assert main(["run", str(folder / "study.toml"), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert numbers_in(said)[-2:] == [2.0, 2.0]
    assert not (tmp_path / "out").exists()
    assert study.room.disk > 2_000_000


def test_memory_is_judged_before_anything_runs(finished, tmp_path, monkeypatch):
    _, study = finished
    monkeypatch.setattr(resources, "memory_bytes", lambda: 1e8)
    with pytest.raises(StudyError, match=r"needs about 4\d\d\.\d MB of memory, this machine has 100\.0 MB"):
        study.run(tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_stored_is_as_was_said(finished):
    """The bytes of every run in a finished file beside those that are forecast."""
    folder, study = finished
    with xr.open_dataset(folder / "results.nc") as results:
        of_runs = sum(one.nbytes for one in results.data_vars.values() if {"motion", "level"} <= {*one.dims})
        beside = results["scale_factor"].nbytes
    assert of_runs - beside == study.stored_bytes - STORED_BYTES * study.curves
    assert (folder / "results.nc").stat().st_size < study.room.left


@pytest.mark.slow
def test_arrays_of_long_motions_are_forecast(tmp_path):
    """Arrays as long as a motion: those that reading and running it take, and those of the forecast."""
    taken, told = [], []
    sizes = 1_000, 100_000, 300_000  # (the first run loads what runs need)
    for samples in sizes:
        text = crate_study("Long", number=1, duration=samples // 100, dt=0.01, levels=3)
        (tmp_path / "study.toml").write_text(text)
        with dask.config.set(num_workers=1):  # (more threads overlap by chance)
            tracemalloc.start()
            study = tp.Study.from_toml(tmp_path / "study.toml")
            study.run(tmp_path / f"{samples}")
            taken.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
            told.append(study.room.memory)
    length = 8 * (sizes[2] - sizes[1])
    arrays = (taken[2] - taken[1]) / length
    assert 7.0 < arrays < (told[2] - told[1]) / length < 2.0 * arrays


def test_every_component_is_forecast(tmp_path, monkeypatch):
    """The memory of pairs and of vertical components, which are not among the accelerations that shake."""
    study = study_in(tmp_path, crate_study("Few", 3, 6, 0.02, 3))
    one = study.room.memory
    plain = studies.records

    def joined(array):
        return [record._replace(companion=record.acceleration, vertical=record.acceleration) for record in plain(array)]

    monkeypatch.setattr(studies, "records", joined)
    again = tp.Study.from_toml(tmp_path / "study.toml")
    samples = sum(record.acceleration.nbytes for array in study.arrays for record in plain(array))
    assert again.room.memory - one == pytest.approx(6.0 * samples)


@pytest.mark.slow
def test_studies_of_other_kinds_say_what_they_take():
    for name in ("uncertainty", "sensitivity_delta", "clinic"):
        found = tp.Study.from_toml(EXAMPLES / f"{name}.toml").room
        assert 2e8 < found.memory < 2e9, name
        assert found.left < found.disk < 1e9, name
