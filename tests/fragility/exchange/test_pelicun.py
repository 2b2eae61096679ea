"""pelicun's tables: metadata that the library allows, and curves that are not lognormal."""

import csv
import json

import jsonschema
import numpy as np
import pytest
import xarray as xr
from exchange_cases import isotonic, lognormal, uplifting
from library_metadata import SCHEMAS
from scipy.special import ndtr

from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import write_pelicun
from toppling.fragility.curves import published


def weighted():
    """Two limit states, the first of two damage states."""
    return xr.Dataset(
        {
            "median": (("block", "limit_state"), [[1.0, 2.0]], {"units": "m s-2"}),
            "dispersion": (("block", "limit_state"), [[0.3, 0.4]], {"units": "1"}),
            "weights": (("block", "limit_state"), [["0.9 | 0.1", ""]]),
        },
        {"block": ["vase"], "limit_state": ["rocking", "overturning"]},
        {"im": "pga"},
    )


CURVES = {
    "fema": published.fema_p58,
    "awkward": lognormal,
    "uplifting": uplifting,
    "isotonic": isotonic,
    "weighted": weighted,
}


def problems(path, collection="fragility"):
    found = json.loads(path.read_text(encoding="utf-8"))
    return [one.message for one in jsonschema.Draft7Validator(SCHEMAS[collection]).iter_errors(found)]


def table(path):
    with path.open(encoding="utf-8", newline="") as lines:
        return [*csv.DictReader(lines)]


def points(cell):
    """Levels and probabilities as pelicun reads them: six digits of each, and in SI."""
    x, y = (np.array([float(one) for one in part.split(",")]) for part in cell.split("|"))
    return np.array([float(f"{one:g}") for one in x * G]), np.array([float(f"{one:g}") for one in y])


class TestMetadata:
    @pytest.mark.parametrize("name", CURVES)
    def test_the_library_s_rules(self, name, tmp_path):
        """Its schema; every id of the table and no other; the limit states that the table has."""
        path, about = write_pelicun(CURVES[name](), tmp_path / "t.csv").paths
        assert problems(about) == []
        written = json.loads(about.read_text(encoding="utf-8"))
        rows = table(path)
        assert {key for key in written if key[0] != "_"} == {row["ID"] for row in rows}
        for row in rows:
            states = {key[:-7] for key, cell in row.items() if key.endswith("-Family") and cell}
            assert {*written[row["ID"]]["LimitStates"]} == states

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (lambda found: found["_GeneralInformation"].pop("ComponentGroups"), "'ComponentGroups' is a required"),
            (lambda found: found["E.20.22.102a"].update(Toppling={}), "'Toppling'"),
            (lambda found: found["E.20.22.102a"].update(RoundUpToIntegerQuantity=True), "True is not one of"),
        ],
    )
    def test_the_rules_can_be_broken(self, change, message, tmp_path):
        _, about = write_pelicun(published.fema_p58(), tmp_path / "t.csv").paths
        found = json.loads(about.read_text(encoding="utf-8"))
        change(found)
        about.write_text(json.dumps(found), encoding="utf-8")
        (said,) = problems(about)
        assert message in said

    def test_damage_states_are_counted_through_the_limit_states(self, tmp_path):
        """As pelicun counts them: a second limit state after two damage states is of the third."""
        path, about = write_pelicun(weighted(), tmp_path / "t.csv").paths
        assert [table(path)[0][f"LS{i}-DamageStateWeights"] for i in (1, 2)] == ["0.9 | 0.1", ""]
        states = json.loads(about.read_text(encoding="utf-8"))["vase"]["LimitStates"]
        assert {key: [*one] for key, one in states.items()} == {"LS1": ["DS1", "DS2"], "LS2": ["DS3"]}

    def test_groups_are_those_of_the_ids(self, tmp_path):
        _, about = write_pelicun(published.fema_p58(), tmp_path / "t.csv").paths
        (group,) = json.loads(about.read_text(encoding="utf-8"))["_GeneralInformation"]["ComponentGroups"]
        assert group.startswith("E.20.22 - ")


class TestMultilinear:
    def check(self, x, y):
        """pelicun's own conditions, with its tolerance (numpy.isclose)."""
        assert (y[0], y[-1]) == (0.0, 1.0)
        assert not np.isclose(np.diff(x), 0.0).any()
        assert not np.isclose(np.diff(y), 0.0).any()
        assert np.all(np.diff(x) > 0.0)
        assert np.all(np.diff(y) > 0.0)

    def test_factors_of_uplift(self, tmp_path):
        """Beside the formula, a step included, at levels between those of the table."""
        curves = uplifting()
        path, _ = write_pelicun(curves, tmp_path / "t.csv").paths
        for i, row in enumerate(table(path)):
            assert (row["LS1-Family"], row["LS1-Theta_1"]) == ("multilinear_CDF", "")
            x, y = points(row["LS1-Theta_0"])
            self.check(x, y)
            median, dispersion, uplift, beta = (float(curves[name].values[i]) for name in curves.data_vars)
            at = np.geomspace(0.01, 300.0, 20_001)
            expected = ndtr(np.log(at / median) / dispersion)
            expected *= ndtr(np.log(at / uplift) / beta) if beta > 0.0 else at >= uplift
            near = np.abs(at / uplift - 1.0) < 3e-5 if beta == 0.0 else np.zeros(at.size, dtype=bool)
            error = np.abs(np.interp(at, x, y) - expected)[~near].max()
            assert error < 2e-4

    @pytest.mark.parametrize(
        ("p", "x", "y"),
        [
            ([0.0, 0.1, 0.1, 1.0], [1, 2, 4, 8], [0.0, 0.1, 0.100001, 1.0]),
            ([0.2, 0.2, 0.5, 0.6], [0.5, 1, 2, 4, 8, 8e6], [0.0, 0.2, 0.200001, 0.5, 0.6, 1.0]),
            ([0.0, 0.0, 0.0, 0.0], [8, 8e6], [0.0, 1.0]),
            ([1.0, 1.0, 1.0, 1.0], [0.5, 1], [0.0, 1.0]),
            ([0.0, 0.0, 1.0, 1.0], [2, 4], [0.0, 1.0]),
            ([0.0, 0.999999, 0.999999, 0.999999], [1, 2, 4, 8, 8e6], [0.0, 0.999997, 0.999998, 0.999999, 1.0]),
        ],
    )
    def test_isotonic_curves(self, p, x, y, tmp_path):
        """By hand: ends of 0 and 1 once, to 0 a step below the lowest level, constant above, rising on a plateau."""
        curves = xr.Dataset(
            {"probability": (("block", "level"), [p], {"units": "1"})},
            {"block": ["a"], "level": ("level", [1.0, 2.0, 4.0, 8.0], {"units": "m s-2"})},
            {"im": "pga", "form": "isotonic"},
        )
        path, about = write_pelicun(curves, tmp_path / "t.csv").paths
        found = points(table(path)[0]["LS1-Theta_0"])
        self.check(*found)
        np.testing.assert_allclose(found[0], x, rtol=1e-6)
        np.testing.assert_allclose(found[1], y, rtol=0.0, atol=1e-12)
        assert "above the highest one it is held constant" in about.read_text(encoding="utf-8")

    def test_no_estimate_is_incomplete(self, tmp_path):
        written = write_pelicun(isotonic(), tmp_path / "t.csv")
        rows = {row["ID"]: row for row in table(written.paths[0])}
        assert [name for name, row in rows.items() if row["Incomplete"] == "1"] == [*written.missing]
        assert len(written.missing) == 1
