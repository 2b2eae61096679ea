"""Keys that change no run: finished and begun studies keep their runs, and what the keys decide is computed anew."""

import json

import numpy as np
import pytest
import xarray as xr
from real_processes import broken_off
from study_texts import motions, study_of

from toppling.studies import StudyError
from toppling.studies.buildings.pieces import pieces_of
from toppling.studies.kinds.performance import PerformanceStudy
from toppling.studies.store import folder as folders
from toppling.studies.store.content import AS_WRITTEN, content_state

INVENTORY = """item,width_m,height_m,floor,count,value,currency,consequence,anchoring_cost,mass_kg,code_class
shelf,0.35,1.7,0,4,300,EUR,injury,40,80,
rack,0.45,1.9,0,2,9000,EUR,exits,200,,
"""
TEXT = (
    '[[models]]\nlaw = "housner"\n'
    + motions(8)
    + """
[performance]
inventory = "things.csv"
im = "pga"
levels = { values = [1.5, 3.0, 6.0], unit = "m/s2" }
replicates = 100
KEYS

[hazard]
k0 = 1e-3
k = 2
unit = "m/s2"
"""
)
CODE = 'code = { standard = "ec8", ag_g = 0.25, soil_factor = 1.2, component_period_s = 0 }'
DECISIONS = {
    "sort": 'sort = "value"',
    "safety": 'safety = ["exits"]',
    "code": CODE,
    "budget": "budget = 500.0",
    "all": f'sort = "cost"\nsafety = ["exits", "injury"]\n{CODE}\nbudget = 300.0',
}


def study(folder, keys="", text=TEXT):
    return study_of(folder, text.replace("KEYS", keys), things=INVENTORY)


def stored(folder):
    with xr.open_dataset(folder / "results.nc") as found:
        return found.load()


def refuse_runs(monkeypatch):
    def refused(*_):
        raise AssertionError("runs are computed again")

    monkeypatch.setattr(PerformanceStudy, "_compute", refused)


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    made = tmp_path_factory.mktemp("fresh")
    for name, keys in {"none": "", **DECISIONS}.items():
        study(made, keys).run(made / name)
    return {name: stored(made / name) for name in ("none", *DECISIONS)}


@pytest.mark.slow
@pytest.mark.parametrize("name", DECISIONS)
def test_a_finished_study_keeps_its_runs(tmp_path, monkeypatch, fresh, name):
    """There and back: the results are those of a study of its own, and no run is made."""
    study(tmp_path).run(tmp_path / "out")
    refuse_runs(monkeypatch)
    counts = []
    for keys, expected in ((DECISIONS[name], fresh[name]), ("", fresh["none"]), (DECISIONS["all"], fresh["all"])):
        returned = study(tmp_path, keys).run(tmp_path / "out", progress=lambda *done: counts.append(done))
        found = stored(tmp_path / "out")
        xr.testing.assert_identical(found, expected)
        assert content_state(found) == AS_WRITTEN
        assert [piece.item for piece in pieces_of(returned)] == [piece.item for piece in pieces_of(expected)]
        assert found.attrs["identity"] == fresh["none"].attrs["identity"]
    assert counts == []


def test_decisions_differ(fresh):
    """The results of the decisions are not those without them: else the test above would say nothing."""
    texts = [json.dumps([one._asdict() for one in pieces_of(found)], default=str) for found in fresh.values()]
    assert len({*texts}) == len(texts)
    assert "consequence.misspelt" not in fresh["safety"].attrs["input_notes"]
    assert "code.mass_not_given" in fresh["code"].attrs["input_notes"]
    assert "code.mass_not_given" not in fresh["none"].attrs["input_notes"]


@pytest.mark.slow
def test_an_interrupted_study_goes_on_with_its_runs(tmp_path, small_chunks, fresh):
    broken_off(study(tmp_path), tmp_path / "out", 0.4)
    assert [*(tmp_path / "out" / "shards").glob("*.nc")]
    watches = []
    study(tmp_path, DECISIONS["all"]).run(tmp_path / "out", watching=watches.append)
    assert watches[0].kept > 0
    xr.testing.assert_identical(stored(tmp_path / "out"), fresh["all"])


@pytest.mark.slow
def test_a_disk_that_is_full_leaves_the_earlier_results(tmp_path, monkeypatch, fresh):
    study(tmp_path).run(tmp_path / "out")
    before = (tmp_path / "out" / "results.nc").read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(folders, "write", full)
        with pytest.raises(StudyError, match="cannot be written"):
            study(tmp_path, DECISIONS["budget"]).run(tmp_path / "out")
    assert (tmp_path / "out" / "results.nc").read_bytes() == before
    refuse_runs(monkeypatch)
    study(tmp_path, DECISIONS["budget"]).run(tmp_path / "out")
    xr.testing.assert_identical(stored(tmp_path / "out"), fresh["budget"])


@pytest.mark.slow
def test_edited_results_are_not_decided_anew(tmp_path):
    study(tmp_path).run(tmp_path / "out")
    found = stored(tmp_path / "out")
    found["rate"][:] *= 0.1
    found.to_netcdf(tmp_path / "out" / "results.nc")
    with pytest.raises(StudyError, match="edited"):
        study(tmp_path, DECISIONS["budget"]).run(tmp_path / "out")


@pytest.mark.slow
def test_a_key_that_changes_runs_is_another_study(tmp_path):
    study(tmp_path).run(tmp_path / "out")
    other = TEXT.replace("3.0, 6.0", "3.0, 7.0")
    with pytest.raises(StudyError, match=r"another study \(performance\.levels\.values\[3\] was 6.0, is 7.0\)"):
        study(tmp_path, DECISIONS["all"], other).run(tmp_path / "out")
    assert np.isfinite(stored(tmp_path / "out")["rate"]).all()


def test_the_discount_rate_of_the_file_decides_paybacks(tmp_path):
    """Savings A a year have paid C after -ln(1 - rC/A)/ln(1 + r) years."""
    often = TEXT.replace("k0 = 1e-3", "k0 = 0.1")
    found = pieces_of(study(tmp_path, "discount_rate = 0.06", often).run())
    (rack,) = (one for one in found if one.item == "rack")
    interest = 0.06 * 2 * 200.0 / rack.saving.value  # (two racks, 200 for each)
    assert 0.0 < interest < 1.0
    assert rack.payback == pytest.approx(-np.log1p(-interest) / np.log(1.06), rel=1e-9)
