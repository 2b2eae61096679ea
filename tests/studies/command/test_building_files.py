"""Performance studies for pelicun: quantities by floor, fragility and values, ids and laws; what is refused."""

import csv
import json
import re

import jsonschema
import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from library_metadata import SCHEMAS

from toppling.core.units import STANDARD_GRAVITY as G
from toppling.studies.command import building_files, export as export_module
from toppling.studies.command.cli import main
from toppling.studies.inventory.consequences import Consequence
from toppling.studies.store.outputs import RECORD
from toppling.studies.text.error import StudyError

LEVELS = np.array([1.0, 2.0, 4.0, 8.0])
LINES = {
    "entrance shelf": ("0", 3, 350.0, "", False, [0.0, 0.2, 0.1, 0.8]),
    "rack": ("2", 2, 26_000.0, "injury | records", False, [0.1, 0.4, 0.9, 1.0]),
    "cylinder": ("2", 6, 0.0, "", True, [0.0, 0.0, 0.0, 0.0]),
}


def results(laws=("exact", "linear"), **changes):
    floor, count, value, words, held, chance = zip(*LINES.values(), strict=True)
    chances = np.array(chance)
    attributes = {"im": "pga", "currency": "EUR", "pieces": "alike", "title": "A clinic", "kind": "performance"}
    units = {"units": "m s-2", "long_name": "peak ground acceleration", "im": "pga"}
    return xr.Dataset(
        {"probability": (("model", "block", "level"), np.stack([chances * 0.5**i for i in range(len(laws))]))},
        {
            "block": [*LINES],
            "floor": ("block", [*floor]),
            "room": ("block", ["hall", "", ""]),
            "count": ("block", [*count]),
            "value": ("block", [*value]),
            "anchored": ("block", [*held]),
            "consequences": ("block", [*words]),
            "level": ("level", LEVELS, units),
            "model": [f"{law} e=0.9" for law in laws],
            "law": ("model", [*laws]),
        },
        {**attributes, **changes},
    )


@pytest.fixture
def export(tmp_path, monkeypatch):
    """Export these results into a folder: the lines of the terminal, and the folder."""

    def written(found, **options):
        class Opened:
            def __enter__(self):
                return found

            def __exit__(self, *_):
                return None

        monkeypatch.setattr(building_files, "read_results", lambda path: Opened())
        monkeypatch.setattr(building_files, "check_content", lambda *_: None)
        folder = tmp_path / "pelicun"
        return building_files.write_building_files(tmp_path / "results.nc", folder, **options), folder

    return written


def table(path):
    with path.open(encoding="utf-8", newline="") as lines:
        return [*csv.DictReader(lines)]


def test_quantities_by_floor(export):
    """Floor k is location k + 1; pieces that are alike are one row, others a row each."""
    _, folder = export(results(), model="exact")
    assert [tuple(row.values()) for row in table(folder / "components.csv")] == [
        ("entrance_shelf", "ea", "1", "1", "3", "1"),
        ("rack", "ea", "3", "1", "2", "1"),
        ("cylinder", "ea", "3", "1", "6", "1"),
    ]
    _, folder = export(results(pieces="independent"), model="exact")
    rows = table(folder / "components.csv")
    assert [row["ID"] for row in rows] == ["entrance_shelf"] * 3 + ["rack"] * 2 + ["cylinder"] * 6
    assert {(row["Theta_0"], row["Blocks"]) for row in rows} == {("1", "1")}


def test_the_demand_is_the_ground_s(export):
    """The offset takes every component back to location 0; the curve is that of the chosen law, in g."""
    for law, share in (("exact", 1.0), ("linear", 0.5)):
        _, folder = export(results(), model=law)
        rows = {row["ID"]: row for row in table(folder / "fragility.csv")}
        places = {row["ID"]: int(row["Location"]) for row in table(folder / "components.csv")}
        for name, row in rows.items():
            assert (row["Demand-Type"], row["Demand-Directional"]) == ("Peak Ground Acceleration", "1")
            assert int(row["Demand-Offset"]) + places[name] == 0
        x, y = (np.array(part.split(","), dtype=float) for part in rows["rack"]["LS1-Theta_0"].split("|"))
        np.testing.assert_allclose(np.interp(LEVELS, x * G, y), share * np.array([0.1, 0.4, 0.9, 1.0]), atol=1e-6)
        x, y = (np.array(part.split(","), dtype=float) for part in rows["cylinder"]["LS1-Theta_0"].split("|"))
        assert np.interp(8.0 / G, x, y) == 0.0
        x, y = (np.array(part.split(","), dtype=float) for part in rows["entrance_shelf"]["LS1-Theta_0"].split("|"))
        rising = share * np.array([0.0, 0.15, 0.15, 0.8])  # the mean of 0.2 and 0.1 at both
        np.testing.assert_allclose(np.interp(LEVELS, x * G, y), rising, atol=2e-6)


def test_a_spectral_measure_is_the_ground_s_too(export):
    found = results(im="Sa(0.5)")
    found["level"].attrs["im"] = "Sa(0.5)"
    _, folder = export(found, model="exact")
    row = table(folder / "fragility.csv")[1]
    assert (row["Demand-Type"], row["Demand-Unit"], row["Demand-Offset"]) == ("Spectral Acceleration|0.5", "g", "-3")


def test_values_and_currency(export):
    said, folder = export(results(), model="exact")
    rows = table(folder / "consequence_repair.csv")
    assert [(row["ID"], row["DV-Unit"], float(row["DS1-Theta_0"])) for row in rows] == [
        ("entrance_shelf-Cost", "EUR", 350.0),
        ("rack-Cost", "EUR", 26_000.0),
        ("cylinder-Cost", "EUR", 0.0),
    ]
    units = json.loads((folder / "units.json").read_text(encoding="utf-8"))
    known = {name: value for group in units.values() for name, value in group.items()}
    assert sum(map(len, units.values())) == len(known)  # (pelicun refuses a unit given twice)
    assert (known["EUR"], known["ea"], known["g"]) == (1.0, 1.0, G)
    assert any("UnitsFile" in line for line in said)


@pytest.mark.parametrize(("currency", "unit", "needed"), [("USD", "USD", False), ("€", "money", True)])
def test_currencies(currency, unit, needed, export):
    _, folder = export(results(currency=currency), model="exact")
    assert {row["DV-Unit"] for row in table(folder / "consequence_repair.csv")} == {unit}
    assert (folder / "units.json").exists() == needed


def with_distributions(found):
    """The shelf's cost is lognormal, the rack's normal; the shelf has a downtime, too, and the cylinder a value."""
    nothing = [np.nan] * 3
    columns = {
        "cost_median": ([300.0, 26_000.0, np.nan], "EUR"),
        "cost_dispersion": ([0.6, 0.3, np.nan], "1"),
        "cost_distribution": (np.array(["lognormal", "normal", ""], dtype=object), "1"),
        "downtime_median": ([20.0, *nothing[1:]], "day"),
        "downtime_dispersion": ([0.5, *nothing[1:]], "1"),
        "downtime_distribution": (np.array(["lognormal", "", ""], dtype=object), "1"),
        "value": ([300.0 * np.exp(0.18), 26_010.0, 80.0], "EUR"),
    }
    return found.assign_coords({name: ("block", values, {"units": unit}) for name, (values, unit) in columns.items()})


class TestDistributions:
    def rows(self, folder):
        return {row["ID"]: row for row in table(folder / "consequence_repair.csv")}

    def test_of_single_pieces(self, export):
        """As the inventory gives them: a row a piece, for which pelicun draws."""
        found = with_distributions(results(laws=("exact",), pieces="independent", study="{}"))
        said, folder = export(found)
        rows = self.rows(folder)
        assert [*rows["entrance_shelf-Cost"].values()][2:] == ["1 EA", "EUR", "lognormal", "300.0", "0.6"]
        assert [*rows["entrance_shelf-Time"].values()][2:] == ["1 EA", "day", "lognormal", "20.0", "0.5"]
        assert [*rows["rack-Cost"].values()][2:] == ["1 EA", "EUR", "normal", "26000.0", "0.3"]
        assert [*rows["cylinder-Cost"].values()][2:] == ["1 EA", "EUR", "", "80.0", ""]
        assert {"rack-Time", "cylinder-Time"}.isdisjoint(rows)
        assert any("RepairCostAndTimeCorrelation" in line for line in said)
        assert any("largest Time column" in line for line in said)
        about = json.loads((folder / "consequence_repair.json").read_text(encoding="utf-8"))
        jsonschema.Draft7Validator(SCHEMAS["consequence_repair"]).validate(about)
        assert about["entrance_shelf"]["Description"].endswith("downtime of one")
        assert "Comments" not in about["entrance_shelf"]

    def test_of_pieces_that_fall_together(self, export):
        """One draw a row: mean and deviation of the mean cost and of the longest downtime, by brute force."""
        _, folder = export(with_distributions(results(laws=("exact",), study="{}")))
        rows = self.rows(folder)
        cost, time = rows["entrance_shelf-Cost"], rows["entrance_shelf-Time"]
        scores = np.random.default_rng(1).standard_normal((400_000, 3))
        for row, values, unit in (
            (cost, (300.0 * np.exp(0.6 * scores)).mean(axis=1), "1 EA"),
            (time, (20.0 * np.exp(0.5 * scores)).max(axis=1), "3 EA"),
        ):
            assert (row["DS1-Family"], row["Quantity-Unit"]) == ("lognormal", unit)
            median, beta = float(row["DS1-Theta_0"]), float(row["DS1-Theta_1"])
            mean = median * np.exp(0.5 * beta**2)
            assert mean == pytest.approx(values.mean(), rel=5e-3)
            assert mean * np.sqrt(np.expm1(beta**2)) == pytest.approx(values.std(), rel=1e-2)
        rack = rows["rack-Cost"]
        median, beta = float(rack["DS1-Theta_0"]), float(rack["DS1-Theta_1"])
        pair = 26_000.0 * np.maximum(1.0 + 0.3 * scores[:, :2], 0.0).mean(axis=1)
        assert median * np.exp(0.5 * beta**2) == pytest.approx(pair.mean(), rel=2e-3)
        about = json.loads((folder / "consequence_repair.json").read_text(encoding="utf-8"))
        jsonschema.Draft7Validator(SCHEMAS["consequence_repair"]).validate(about)
        said = about["entrance_shelf"]["Comments"]
        assert re.search(r"lognormal.* 20 .*0\.5", said)
        assert "of variation 0.3" in about["rack"]["Comments"]

    @pytest.mark.parametrize(
        ("study", "given"), [('{"performance": {"consequence_correlation": 0.7}}', "0.7"), ("{}", "1")]
    )
    def test_correlation(self, study, given, export):
        said, _ = export(with_distributions(results(laws=("exact",), study=study)))
        assert any(f"give {given} as" in line for line in said)

    def test_results_without_the_name_of_a_distribution(self, export):
        """Those of an older version do not say it, and it is not guessed (the reader of results says so)."""
        found = with_distributions(results(laws=("exact",), study="{}")).drop_vars("cost_distribution")
        with pytest.raises(KeyError, match="cost_distribution"):
            export(found)

    @pytest.mark.slow
    @pytest.mark.parametrize("greatest", [False, True])
    @pytest.mark.parametrize("pieces", [1, 2, 40])
    @pytest.mark.parametrize("one", [Consequence(5.0, 0.0), Consequence(5.0, 0.8), Consequence(5.0, 0.5, "normal")])
    def test_moments_of_several(self, one, pieces, greatest):
        """Beside brute force, and of one piece beside the closed form."""
        values = one.at(np.random.default_rng(2).standard_normal((200_000, pieces)))
        each = values.max(axis=1) if greatest else values.mean(axis=1)
        mean, deviation = one.of_several(pieces, greatest)
        assert mean == pytest.approx(each.mean(), abs=5.0 * each.std() / np.sqrt(200_000) + 1e-12)
        assert deviation == pytest.approx(each.std(), rel=0.05, abs=1e-12)
        if pieces == 1 or not greatest:
            assert mean == pytest.approx(one.mean, rel=1e-9)


def test_files_of_an_earlier_export_are_removed(export):
    _, folder = export(results(), model="exact")
    assert (folder / "units.json").exists()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    export(results().assign_coords(value=("block", [0.0] * 3)), model="exact")
    left = {"fragility.csv", "fragility.json", "components.csv", "notes.txt", RECORD}
    assert {path.name for path in folder.iterdir()} == left


def test_a_table_of_someone_else_s_is_not_written_over(export):
    _, folder = export(results(), model="exact")
    (folder / "components.csv").write_text("mine\n", encoding="utf-8")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(StudyError, match=r"components[.]csv: was not written by toppling, or was changed since"):
        export(results(), model="linear")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_metadata(export):
    """The library's rules, and what the tables cannot hold."""
    said, folder = export(results(), model="exact")
    found = {}
    for kind, schema in SCHEMAS.items():
        found[kind] = json.loads((folder / f"{kind}.json").read_text(encoding="utf-8"))
        jsonschema.Draft7Validator(schema).validate(found[kind])
        assert {key for key in found[kind] if key[0] != "_"} == {"entrance_shelf", "rack", "cylinder"}
        description = found[kind]["_GeneralInformation"]["Description"]
        assert "do not hold" in description
        assert "law: exact e=0.9" in description
    assert any("do not hold" in line for line in said)
    comments = {name: one.get("Comments", "") for name, one in found["fragility"].items()}
    assert re.search(r"floor 0, hall\..*0\.05", comments["entrance_shelf"], re.DOTALL)
    assert "changed them" not in comments["rack"]
    assert "means: injury, records." in comments["rack"]
    assert "Anchored" in comments["cylinder"]
    assert any(line.startswith("1 component without") for line in said)


def test_ids(export):
    _, folder = export(results(), model="exact", prefix="CLINIC.A")
    named = ["CLINIC.A.001", "CLINIC.A.002", "CLINIC.A.003"]
    for name in ("fragility.csv", "components.csv"):
        assert [row["ID"] for row in table(folder / name)] == named
    for prefix in ("a-b", "1", "", "x" * 58, "nan\n"):
        with pytest.raises(StudyError, match="--ids"):
            export(results(), model="exact", prefix=prefix)


class TestRefused:
    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({}, "--model is needed: pelicun's tables are of one law, and .* holds 'exact e=0.9', 'linear e=0.9'"),
            ({"model": "exakt"}, "did you mean 'exact'"),
        ],
    )
    def test_laws(self, options, message, export):
        with pytest.raises(StudyError, match=message):
            export(results(), **options)

    def test_a_name_of_several_laws(self, export):
        found = results().assign_coords(law=("model", ["exact", "exact"]))
        with pytest.raises(StudyError, match="--model exact names 2 laws"):
            export(found, model="exact")

    def test_one_law_needs_no_choice(self, export):
        said, _ = export(results(laws=("exact",)))
        assert numbers_in(said[0])[:2] == [3, 11]
        assert said[0].endswith("law exact e=0.9")

    def test_floors_without_numbers(self, export):
        found = results().assign_coords(floor=("block", ["0", "roof", "2"]))
        with pytest.raises(StudyError, match="locations are numbers, and rack stands on floor 'roof'"):
            export(found, model="exact")

    def test_scale_factors(self, export, tmp_path):
        found = results(im="scale")
        found["level"].attrs.update(im="scale", units="1")
        with pytest.raises(StudyError, match="pelicun has no demand for scale of the ground"):
            export(found, model="exact")
        assert not (tmp_path / "pelicun").exists()

    def test_too_many_pieces(self, export):
        found = results(pieces="independent").assign_coords(count=("block", [100_000, 1, 1]))
        with pytest.raises(StudyError, match="100,002 are more than 100,000"):
            export(found, model="exact")


def test_the_command(export, tmp_path, monkeypatch, capsys):
    export(results(), model="exact")
    monkeypatch.setattr(export_module, "kind_of", lambda path: "performance")
    command = ["export", str(tmp_path / "results.nc"), "--format", "pelicun", "--out", str(tmp_path / "out")]
    assert main(command) == 2
    assert "--model is needed" in capsys.readouterr().err
    assert main([*command, "--model", "linear", "--ids", "C"]) == 0
    said = capsys.readouterr().out
    assert "law linear e=0.9" in said
    assert [row["ID"] for row in table(tmp_path / "out" / "fragility.csv")] == ["C.001", "C.002", "C.003"]
    assert main([*command, "--model", "linear", "--with-modelling"]) == 2
    assert "--with-modelling" in capsys.readouterr().err
    assert main([*command[:3], "csv", "--ids", "C"]) == 2
    assert "--ids" in capsys.readouterr().err
