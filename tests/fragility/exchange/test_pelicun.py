"""pelicun's tables: metadata that the library allows, and curves that are not lognormal."""

import csv
import json
import warnings

import jsonschema
import numpy as np
import pytest
import xarray as xr
from exchange_cases import isotonic, lognormal, uplifting
from library_metadata import SCHEMAS
from scipy.special import ndtr

from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import ExchangeError, read_pelicun, write_pelicun
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
        _, about = write_pelicun(weighted(), tmp_path / "t.csv").paths
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
        assert "held constant" in about.read_text(encoding="utf-8")

    def test_no_estimate_is_incomplete(self, tmp_path):
        written = write_pelicun(isotonic(), tmp_path / "t.csv")
        rows = {row["ID"]: row for row in table(written.paths[0])}
        assert [name for name, row in rows.items() if row["Incomplete"] == "1"] == [*written.missing]
        assert len(written.missing) == 1


class TestReading:
    def test_isotonic_curves_there_and_back(self, tmp_path):
        """To a millionth at the levels that were written, on the same dimensions; below them from 0 a step lower."""
        curves = isotonic()
        write_pelicun(curves, tmp_path / "t.csv")
        found = read_pelicun(tmp_path / "t.csv")
        assert (found.attrs["form"], found["probability"].dims) == ("isotonic", ("block", "model", "level"))
        levels = curves["level"].values
        np.testing.assert_allclose(found["level"].values, [0.3**2 / 0.7, *levels], rtol=1e-12)
        assert found["level"].attrs["units"] == "m s-1"
        at = found["probability"].isel(level=slice(1, None))
        np.testing.assert_allclose(at.values[0], curves["probability"].values[0], atol=4e-6)
        np.testing.assert_allclose(at.values[1, 0], 0.0, atol=0.0)
        assert np.isnan(found["probability"].values[1, 1]).all()
        assert found["block"].values.tolist() == ["a", "b"]
        assert list(found["status"].values[1]) == ["ok", "incomplete"]
        np.testing.assert_allclose(found["probability"].isel(level=0).values[0], 0.0, atol=0.0)

    def test_written_again(self, tmp_path):
        """What was read is a curve like any other: the second table has the numbers of the first."""
        write_pelicun(isotonic().isel(block=[0]), tmp_path / "t.csv")
        write_pelicun(read_pelicun(tmp_path / "t.csv"), tmp_path / "again.csv")
        for row, other in zip(table(tmp_path / "t.csv"), table(tmp_path / "again.csv"), strict=True):
            (x, y), (v, w) = points(row["LS1-Theta_0"]), points(other["LS1-Theta_0"])
            np.testing.assert_allclose(np.interp(x, v, w), y, atol=5e-6)

    def test_factors_of_uplift(self, tmp_path):
        curves = uplifting()
        write_pelicun(curves, tmp_path / "t.csv")
        found = read_pelicun(tmp_path / "t.csv")
        x = found["level"].values
        for i in range(curves.sizes["block"]):
            median, dispersion, uplift, beta = (float(curves[name].values[i]) for name in curves.data_vars)
            expected = ndtr(np.log(x / median) / dispersion)
            expected *= ndtr(np.log(x / uplift) / beta) if beta > 0.0 else x >= uplift
            near = np.abs(x / uplift - 1.0) < 3e-5 if beta == 0.0 else np.zeros(x.size, dtype=bool)
            assert np.abs(found["probability"].values[i] - expected)[~near].max() < 2e-4

    HEADING = "ID,Demand-Type,Demand-Unit,LS1-Family,LS1-Theta_0,LS1-Theta_1"

    def read(self, folder, *cells, **options):
        rows = [f"c{i},Peak Floor Acceleration,g,{cell}" for i, cell in enumerate(cells)]
        (folder / "t.csv").write_text("\n".join([self.HEADING, *rows]) + "\n", encoding="utf-8")
        return read_pelicun(folder / "t.csv", **options)

    def test_a_table_of_others(self, tmp_path):
        """By hand: two curves with levels of their own, each linear between them, 0 below and 1 above."""
        found = self.read(tmp_path, 'multilinear_CDF,"1,2|0,1",', 'multilinear_CDF,"1.5,3,5|0,0.5,1",')
        np.testing.assert_allclose(found["level"].values, np.array([1.0, 1.5, 2.0, 3.0, 5.0]) * G)
        np.testing.assert_allclose(found["probability"].values[0], [0.0, 0.5, 1.0, 1.0, 1.0], atol=1e-12)
        np.testing.assert_allclose(found["probability"].values[1], [0.0, 0.0, 1.0 / 6.0, 0.5, 1.0], atol=1e-12)

    TWO = f"{HEADING},LS2-Family,LS2-Theta_0,LS2-Theta_1\n"

    @pytest.mark.parametrize(
        ("states", "refused"),
        [
            ("lognormal,0.9,0.4,lognormal,0.5,0.4", True),
            ("lognormal,0.9,0.4,lognormal,0.5,0.6", False),  # (they cross)
            ("lognormal,0.5,0.4,lognormal,0.9,0.4", False),
            ('multilinear_CDF,"1,2|0,1",,multilinear_CDF,"0.5,2|0,1",', True),
            ('multilinear_CDF,"0.5,2|0,1",,multilinear_CDF,"1,2|0,1",', False),
        ],
    )
    def test_a_worse_state_that_is_more_likely(self, states, refused, tmp_path):
        (tmp_path / "t.csv").write_text(f"{self.TWO}A.1,Peak Floor Acceleration,g,{states}\n", encoding="utf-8")
        if not refused:
            assert read_pelicun(tmp_path / "t.csv").sizes["limit_state"] == 2
            return
        with pytest.raises(ExchangeError, match=r"t\.csv: LS2 of 'A.1' is more likely than LS1, a lesser state"):
            read_pelicun(tmp_path / "t.csv")

    def test_a_median_beyond_any_shaking(self, tmp_path):
        with pytest.warns(ImplausibleInput, match="t.csv: the highest median, 50 g, is beyond any shaking"):
            self.read(tmp_path, "lognormal,50,0.4")

    def test_dispersions_and_periods_of_another_unit(self, tmp_path):
        for row, doubted in {
            "lognormal,0.8,4": "dispersion of a curve: 4, usual are 1e-09 to 1.5: per cent, or a factor",
            **dict.fromkeys(("lognormal,0.8,1.4", "lognormal,0.8,0.01"), ""),
        }.items():
            with warnings.catch_warnings(record=True, action="always") as told:
                self.read(tmp_path, row)
            assert [doubted in str(warning.message) for warning in told] == [True] * bool(doubted)
        for period, doubts in {"200": 1, "0.2": 0, "10": 0}.items():
            rows = f"{self.TWO.splitlines()[0]}\nA.1,Spectral Acceleration|{period},g,lognormal,0.8,0.5,,,\n"
            (tmp_path / "t.csv").write_text(rows, encoding="utf-8")
            with warnings.catch_warnings(record=True, action="always") as told:
                read_pelicun(tmp_path / "t.csv")
            assert len(told) == doubts, period

    def test_multilinear_alone(self, tmp_path):
        """A table of nothing else has no column Theta_1; a lognormal curve needs it."""
        rows = "ID,Demand-Type,Demand-Unit,LS1-Family,LS1-Theta_0\nA.1,Peak Ground Velocity,cmps,{}\n"
        path = tmp_path / "t.csv"
        path.write_text(rows.format('multilinear_CDF,"1,10,50,100|0,0.1,0.6,1"'), encoding="utf-8")
        found = read_pelicun(path)
        np.testing.assert_allclose(found["level"].values, [0.01, 0.1, 0.5, 1.0])
        path.write_text(rows.format("lognormal,20"), encoding="utf-8")
        with pytest.raises(ExchangeError, match=r"has no column LS1-Theta_1, which the curve of LS1 of 'A.1' needs"):
            read_pelicun(path)

    def test_one_measure_of_floor_and_ground(self, tmp_path):
        """The message names what `im` may be."""
        rows = "A.1,Peak Floor Acceleration,g,lognormal,0.3,0.4", "B.1,Peak Ground Acceleration,g,lognormal,0.2,0.5"
        path = tmp_path / "t.csv"
        path.write_text("\n".join([self.HEADING, *rows]) + "\n", encoding="utf-8")
        with pytest.raises(
            ExchangeError, match="holds curves of pga of the floor, pga of the ground: choose one with im"
        ):
            read_pelicun(path, im="pga")
        for im, median in (("pga of the floor", 0.3), ("pga of the ground", 0.2)):
            found = read_pelicun(path, im=im)
            assert found["median"].item() == pytest.approx(median * G)
            assert ("im_at" in found.attrs) == im.endswith("ground")
        with pytest.raises(ExchangeError, match="holds no curves of pgv of the ground, but of pga of the floor"):
            read_pelicun(path, im="pgv of the ground")

    def test_both_families(self, tmp_path):
        cells = "lognormal,1.0,0.5", 'multilinear_CDF,"1,2|0,1",'
        assert "median" in self.read(tmp_path, *cells, ids=["c0"])
        assert "probability" in self.read(tmp_path, *cells, ids=["c1"])


def test_refused(refusal):
    refusal()
