"""Curves out to other programs and back: values, units, ids, and the command."""

import csv
import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from exchange_cases import FORMATS, LAWS, NAMES, UNITS, isotonic, lognormal, read_table, there_and_back, uplifting
from hypothesis import given, settings, strategies as st
from repeatable import REPEATABLE
from scipy.integrate import quad
from scipy.special import ndtr
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import ExchangeError, read_pelicun, write_curve_csv, write_nrml, write_pelicun
from toppling.fragility.curves import published
from toppling.fragility.curves.curve import curve_probability
from toppling.fragility.exchange.ids import MAX_ID, is_id, make_ids
from toppling.fragility.exchange.nrml.writing import arithmetic
from toppling.studies.command.cli import main


def points(curve):
    return curve["level"].values, curve.values


class TestRoundTrip:
    @pytest.mark.parametrize("im", UNITS)
    @pytest.mark.parametrize("name", FORMATS)
    def test_lognormal_curves_come_back(self, name, im, tmp_path):
        curves = lognormal(im)
        written, found = there_and_back(curves, name, tmp_path)
        assert found["median"].dims == curves["median"].dims
        assert list(written.missing.values()) == ["no overturning"]
        there = curves["median"].notnull().values
        whole = found.reindex(block=NAMES, model=LAWS)  # NRML holds estimates alone
        for key in ("median", "dispersion"):
            np.testing.assert_allclose(whole[key].values, curves[key].values, rtol=1e-12)
        if name == "pelicun":
            assert (found.attrs["im"], found["median"].attrs["units"]) == (im, UNITS[im])
            assert set(whole["status"].values[there]) == {"ok"}
            assert whole["status"].values[~there] == ["no overturning"]
            np.testing.assert_array_equal(whole["converged"].values.astype(bool), there)
            np.testing.assert_allclose(found["width"].values, curves["width"].values, rtol=1e-15)

    def test_what_was_read_is_written_alike(self, tmp_path):
        """Ids, labels and numbers stay: a second round gives the same files to the byte."""
        written, found = there_and_back(published.fema_p58(), "pelicun", tmp_path)
        own = published.fema_p58()["id"].values.tolist()
        assert found["id"].values.tolist() == list(written.ids) == own
        assert list(write_nrml(found, tmp_path / "t.xml").ids) == [one.replace(".", "_") for one in own]
        (tmp_path / "again").mkdir()
        again, _ = there_and_back(found, "pelicun", tmp_path / "again")
        for first, second in zip(written.paths, again.paths, strict=True):
            assert first.read_bytes() == second.read_bytes()
        np.testing.assert_allclose(found["median"], published.fema_p58()["median"], rtol=1e-14)

    def test_floors_come_back_as_numbers(self, tmp_path):
        _, found = there_and_back(lognormal(floors=(0, 3, 10)), "pelicun", tmp_path)
        assert found["floor"].values.tolist() == [0, 3, 10]
        assert found["median"].dims == ("block", "model", "floor")

    @pytest.mark.parametrize("name", FORMATS)
    def test_one_curve_without_dimensions(self, name, tmp_path):
        curves = lognormal().isel(block=0, model=0, drop=True)
        _, found = there_and_back(curves, name, tmp_path)
        assert found["median"].item() == pytest.approx(curves["median"].item(), rel=1e-12)

    @pytest.mark.parametrize("name", FORMATS)
    def test_limit_states_are_of_one_component(self, name, tmp_path):
        states = ["uplift", "rocking", "overturning"]
        curves = xr.Dataset(
            {
                "median": (("limit_state", "block"), [[1.0, 2.0], [2.0, 3.0], [4.0, 9.0]], {"units": "m s-2"}),
                "dispersion": (("limit_state", "block"), [[0.3, 0.4]] * 3, {"units": "1"}),
            },
            {"limit_state": states, "block": ["a", "b"]},
            {"im": "pga"},
        )
        written, found = there_and_back(curves, name, tmp_path)
        assert written.ids == ("a", "b")
        assert found["limit_state"].values.tolist() == states
        np.testing.assert_allclose(found["median"].transpose("limit_state", "block"), curves["median"], rtol=1e-12)

    @pytest.mark.parametrize("name", ["pelicun", "csv"])
    def test_another_limit_state_than_overturning(self, name, tmp_path):
        """As curves of a damage state say it, or their limits of tilt; a file of others keeps its own name."""
        written, found = there_and_back(lognormal().assign_attrs(state="|theta|/alpha > 0.5"), name, tmp_path)
        assert found.attrs["state"] == "|theta|/alpha > 0.5"
        assert found["median"].dims == ("block", "model")
        assert "overturning," not in written.paths[-1].read_text(encoding="utf-8")
        assert there_and_back(lognormal(), name, tmp_path)[1].attrs["state"] == "overturning"
        curves = lognormal()
        scenes = [json.dumps({"tilt_limit": math.radians(5.0)} if i else {}) for i in range(curves.sizes["block"])]
        _, found = there_and_back(curves.assign_coords(scene=("block", scenes)), name, tmp_path)
        assert found.attrs["state"] == "overturning or a tilt of 5° of some blocks"

    def test_intervals_and_the_ground_come_back_in_csv(self, tmp_path):
        curves = lognormal().assign_attrs(im_at="ground")
        curves = curves.assign(median_lower=curves["median"] * 0.9, dispersion_upper=curves["dispersion"] * 1.1)
        _, found = there_and_back(curves, "csv", tmp_path)
        assert found.attrs["im_at"] == "ground"
        np.testing.assert_array_equal(found["median_lower"], curves["median_lower"])
        np.testing.assert_array_equal(found["dispersion_upper"], curves["dispersion_upper"])

    def test_ground_motions_without_a_building_are_of_the_ground(self, tmp_path):
        motions = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(8)
        runs = tp.ida(tp.Block(0.3, 1.5), tp.HousnerImpact(e=0.9), motions, np.linspace(0.5, 8.0, 6), im="pga")
        write_curve_csv(tp.fit_fragility(runs), tmp_path / "curves.csv")
        with (tmp_path / "curves.csv").open(encoding="utf-8", newline="") as table:
            assert {row["measured_at"] for row in csv.DictReader(table)} == {"ground"}

    def test_other_forms_come_back_in_csv(self, tmp_path):
        _, found = there_and_back(uplifting(), "csv", tmp_path)
        assert found.attrs["form"] == "uplift-lognormal"
        for name in uplifting():
            np.testing.assert_array_equal(found[name], uplifting()[name])
        _, found = there_and_back(isotonic(), "csv", tmp_path)
        np.testing.assert_array_equal(found["probability"], isotonic()["probability"])

    @pytest.mark.parametrize(
        ("link", "cumulative"),
        [
            # with a standard deviation b of ln(capacity): pi/(b sqrt 3) of the logistic, pi/(b sqrt 6) of Weibull's
            ("log-logistic", lambda z: 1.0 / (1.0 + np.exp(-z * np.pi / 3.0**0.5))),
            ("weibull", lambda z: 1.0 - 0.5 ** np.exp(z * np.pi / 6.0**0.5)),
        ],
    )
    @pytest.mark.parametrize("name", FORMATS)
    def test_links_keep_their_probabilities(self, name, link, cumulative, tmp_path):
        """A CSV has parameters and the form; the other formats have points between which lines err by < 1e-4."""
        curves = lognormal().assign_attrs(form=link)
        _, found = there_and_back(curves, name, tmp_path)
        if name == "csv":
            assert found.attrs["form"] == link
            np.testing.assert_array_equal(found["median"], curves["median"])
        for block, model in [(0, 0), (1, 1), (2, 0)]:
            where = {"block": block, "model": model}
            x = curves["median"][where].item() * np.linspace(0.5, 2.0, 41)
            want = cumulative(np.log(x / curves["median"][where].item()) / curves["dispersion"][where].item())
            got = (
                curve_probability(found.isel(where), x)
                if name == "csv"
                else np.interp(x, *points(found["probability"].isel(where).dropna("level")))
            )
            np.testing.assert_allclose(got, want, atol=1.01e-4)

    @pytest.mark.parametrize("name", FORMATS)
    def test_certain_uplift_is_no_factor(self, name, tmp_path):
        """A fit puts uplift at the smallest number where every run uplifts."""
        certain = uplifting().isel(block=[0])
        certain["uplift_median"][:] = np.finfo(float).tiny
        _, found = there_and_back(certain, name, tmp_path)
        assert curve_probability(found, [3.0]).item() == pytest.approx(0.5, rel=1e-12)

    def test_curves_without_parameters_come_back_in_nrml(self, tmp_path):
        written, found = there_and_back(isotonic(), "nrml", tmp_path)
        assert len(written.ids) == 3
        np.testing.assert_allclose(found["level"], isotonic()["level"], rtol=1e-12)
        np.testing.assert_array_equal(found["probability"], isotonic()["probability"])


class TestPelicun:
    def table(self, curves, folder, **options):
        path = write_pelicun(curves, folder / "t.csv", **options).paths[0]
        with path.open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    def test_columns_and_units(self, tmp_path):
        curves = lognormal(blocks=["vase"], models=LAWS)
        first, second = self.table(curves, tmp_path)
        assert list(first)[:7] == [
            "ID", "Incomplete", "Demand-Type", "Demand-Unit", "Demand-Offset", "Demand-Directional", "LS1-Family",
        ]  # fmt: skip
        assert first["Demand-Type"], first["Demand-Unit"] == ("Peak Floor Acceleration", "g")
        assert float(first["LS1-Theta_0"]) == pytest.approx(curves["median"].values[0, 0] / G, rel=1e-15)
        assert (second["Incomplete"], second["LS1-Theta_0"], second["LS1-Theta_1"]) == ("1", "", "")

    @pytest.mark.parametrize(
        ("im", "ground", "demand", "unit"),
        [
            ("pga", True, "Peak Ground Acceleration", "g"),
            ("pgv", False, "Peak Floor Velocity", "mps"),
            ("pgv", True, "Peak Ground Velocity", "mps"),
            ("Sa(0.7)", False, "Spectral Acceleration|0.7", "g"),
        ],
    )
    def test_demands(self, im, ground, demand, unit, tmp_path):
        curves = lognormal(im).assign_attrs({"im_at": "ground"} if ground else {})
        row = self.table(curves, tmp_path)[0]
        assert (row["Demand-Type"], row["Demand-Unit"]) == (demand, unit)
        found = read_pelicun(tmp_path / "t.csv")
        assert (found.attrs["im"], found.attrs.get("im_at") == "ground") == (im, ground)
        assert "offset" not in found
        if ground:  # as results say it
            stated = lognormal(im).assign_attrs(configuration=json.dumps({"im": im, "im_at": "ground"}))
            assert self.table(stated, tmp_path)[0] == row

    def test_directional(self, tmp_path):
        """Ours are directional, or pelicun multiplies by 1.2; FEMA's are not, as FEMA has them."""
        ours, fema = lognormal(), published.fema_p58()
        assert {row["Demand-Directional"] for row in self.table(ours, tmp_path)} == {"1"}
        assert {row["Demand-Directional"] for row in self.table(ours, tmp_path, directional=False)} == {"0"}
        assert {row["Demand-Directional"] for row in self.table(fema, tmp_path)} == {"0"}
        assert {row["Demand-Directional"] for row in self.table(fema, tmp_path, directional=True)} == {"1"}

    def test_the_table_holds_no_words_of_people(self, tmp_path):
        path, about = write_pelicun(lognormal(), tmp_path / "t.csv").paths
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            assert all(cell[:1].isalnum() or not cell for cell in line.split(","))
        written = json.loads(about.read_text(encoding="utf-8"))
        comments = [entry["Comments"] for name, entry in written.items() if name[0] != "_"]
        labels = [json.loads(one.partition("\nLabels for toppling: ")[2])["labels"]["block"] for one in comments]
        assert set(labels) == set(NAMES)
        assert all({"Description", "Comments", "LimitStates"} <= set(v) for k, v in written.items() if k[0] != "_")

    @needs_shared
    def test_reads_the_library_itself(self, tmp_path):
        path = SHARED / "data" / "fema_p58_contents.csv"
        with pytest.raises(ExchangeError, match="holds curves of pga, pgv: choose one with im"):
            read_pelicun(path)
        velocity = read_pelicun(path, im="pgv")
        nine = published.fema_p58()
        assert set(velocity["block"].values[velocity["converged"]]) == set(nine["id"].values)
        assert velocity["block"].values[~velocity["converged"]].tolist() == ["E.20.22.112b", "E.20.22.114b"]
        assert set(velocity["status"].values) == {"ok", "incomplete"}
        np.testing.assert_array_equal(velocity["median"].sel(block=nine["id"].values), nine["median"])
        acceleration = read_pelicun(path, im="pga")
        assert float(acceleration["median"].sel(block="E.20.22.001")) == pytest.approx(G, rel=1e-15)
        assert set(acceleration["directional"].values) == {0.0}
        assert acceleration.attrs["state"] == "LS1"
        some = read_pelicun(path, ids=["E.20.22.105a", "E.20.22.102a"])
        assert some["block"].values.tolist() == ["E.20.22.102a", "E.20.22.105a"]

    def test_weights_and_limit_states_of_others_stay(self, tmp_path):
        heading = "ID,Incomplete,Demand-Type,Demand-Unit,Demand-Offset,Demand-Directional"
        heading += "".join(f",LS{i}-Family,LS{i}-Theta_0,LS{i}-Theta_1,LS{i}-DamageStateWeights" for i in (1, 2))
        rows = [
            "B.10.1,0,Peak Floor Acceleration,ftps2,1,1,lognormal,10.0,0.4,0.95 | 0.05,lognormal,20.0,0.3,",
            "B.10.2,0,Peak Floor Acceleration,g,0,0,lognormal,1.0,0.5,,,,,",
        ]
        (tmp_path / "t.csv").write_text("\n".join([heading, *rows]), encoding="utf-8")
        found = read_pelicun(tmp_path / "t.csv")
        assert found["median"].dims == ("block", "limit_state")
        np.testing.assert_allclose(found["median"], [[3.048, 6.096], [G, np.nan]])
        assert found["weights"].values.tolist() == [["0.95 | 0.05", ""], ["", ""]]
        assert found["offset"].values[0].tolist() == [1.0, 1.0]
        write_pelicun(found.sel(block=["B.10.1"]), tmp_path / "u.csv")
        written = (tmp_path / "u.csv").read_text(encoding="utf-8").splitlines()[1].split(",")
        assert (written[4], written[9]) == ("1", "0.95 | 0.05")


class TestNrml:
    def functions(self, curves, folder, **options):
        """Every function of a written model as (attributes of imls, text of imls, rows), read by another parser."""
        path = write_nrml(curves, folder / "t.xml", **options).paths[0]
        ns = "{http://openquake.org/xmlns/nrml/0.5}"
        model = ET.parse(path).getroot().find(f"{ns}fragilityModel")
        assert [child.tag for child in model][:2] == [f"{ns}description", f"{ns}limitStates"]
        return {f.attrib["id"]: (f.attrib, f[0], list(f)[1:]) for f in model.findall(f"{ns}fragilityFunction")}

    @pytest.mark.parametrize(("median", "dispersion"), [(1.0, 0.5), (0.3, 0.05), (7.0, 1.5)])
    def test_mean_and_stddev_are_the_variables_own(self, median, dispersion):
        """By integration over the density; and back."""
        mean, stddev = arithmetic(median, dispersion)

        def moment(k):
            def weighted(z):
                return (median * math.exp(dispersion * z)) ** k * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)

            return quad(weighted, -12.0, 20.0, epsabs=0.0, epsrel=1e-12, limit=200)[0]

        assert mean == pytest.approx(moment(1), rel=1e-10)
        assert stddev == pytest.approx(math.sqrt(moment(2) - moment(1) ** 2), rel=1e-8)
        assert mean > median

    @pytest.mark.parametrize("dispersion", [1e-4, 0.01, 0.4, 3.0, 20.0])
    def test_no_digits_are_lost_at_the_ends(self, dispersion):
        mean, stddev = arithmetic(2.5, dispersion)
        ratio = stddev / mean
        assert mean / math.hypot(1.0, ratio) == pytest.approx(2.5, rel=1e-12)
        assert math.sqrt(math.log1p(ratio**2)) == pytest.approx(dispersion, rel=1e-12)

    @pytest.mark.parametrize(
        ("im", "imt", "factor"), [("pga", "PGA", G), ("pgv", "PGV", 0.01), ("Sa(0.7)", "SA(0.7)", G)]
    )
    def test_openquakes_rules_give_back_the_curve(self, im, imt, factor, tmp_path):
        """Its formula and its clipping, written here from its documentation, in its units."""
        curves = lognormal(im, blocks=["a", "b"])
        for i, (attributes, imls, (params,)) in enumerate(self.functions(curves, tmp_path).values()):
            assert (attributes["format"], attributes["shape"], imls.attrib["imt"]) == ("continuous", "logncdf", imt)
            mean, stddev = float(params.attrib["mean"]), float(params.attrib["stddev"])
            low, high, nothing = (float(imls.attrib[key]) for key in ("minIML", "maxIML", "noDamageLimit"))
            median, dispersion = (curves[key].values.ravel()[i] for key in ("median", "dispersion"))
            x = np.geomspace(1e-4, 1e4, 81) * median
            iml = np.clip(x / factor, low, high)
            sigma = math.sqrt(math.log(stddev**2 / mean**2 + 1.0))
            theirs = ndtr(np.log(iml / (mean**2 / math.sqrt(stddev**2 + mean**2))) / sigma)
            theirs[x / factor <= nothing] = 0.0
            ours = ndtr(np.log(x / median) / dispersion)
            inside = (ours > 1e-4) & (ours < 1.0 - 1e-4)
            np.testing.assert_allclose(theirs[inside], ours[inside], rtol=1e-9)
            np.testing.assert_allclose(theirs, ours, atol=1.0001e-4)
            assert inside.any()
            # nothing at all in the lower tail, or every tremor would topple a few
            assert theirs[0] == 0.0
            assert set(theirs[ours < 0.99e-4]) == {0.0}

    def test_uplift_is_straight_between_enough_levels(self, tmp_path):
        curves = uplifting()
        for name, (attributes, imls, (poes,)) in self.functions(curves, tmp_path, tail=1e-6).items():
            assert attributes["format"] == "discrete"
            levels, p = (np.array(element.text.split(), dtype=float) for element in (imls, poes))
            assert np.all(np.diff(levels) > 0.0)
            assert np.all(np.diff(p) >= 0.0)
            m, b, u, c = (float(curves[key].sel(block=name)) for key in curves)
            x = np.geomspace(0.05, 60.0, 3001)
            exact = ndtr(np.log(x / m) / b) * ((x >= u) if c == 0.0 else ndtr(np.log(x / u) / c))
            np.testing.assert_allclose(np.interp(x / G, np.append(0.0, levels), np.append(0.0, p)), exact, atol=1e-4)

    def test_missing_ones_are_named(self, tmp_path):
        written = write_nrml(lognormal(), tmp_path / "t.xml")
        assert len(written.ids) == 7
        (name,) = written.missing
        assert f"{name} (no overturning)" in written.paths[0].read_text(encoding="utf-8")


class TestIds:
    def test_readable_and_legal(self):
        made = make_ids([(name, "discrete e=0.92 δ=0.05") for name in ("bookcase-5-shelf", "Étagère 3½", "書棚")])
        assert list(made.values())[:2] == [
            "bookcase_5_shelf__discrete_e_0_92_delta_0_05",
            "Etagere_31_2__discrete_e_0_92_delta_0_05",
        ]
        assert all(map(is_id, made.values()))

    @pytest.mark.slow
    @given(st.lists(st.tuples(st.text(max_size=90), st.text(max_size=20)), unique=True, max_size=12))
    @settings(max_examples=300, **REPEATABLE)
    def test_unique_legal_and_independent_of_order(self, labels):
        made = make_ids(labels)
        assert len({one.lower() for one in made.values()}) == len(labels)
        assert all(is_id(one) and len(one) <= MAX_ID for one in made.values())
        assert make_ids(labels[::-1]) == made

    @pytest.mark.parametrize(
        "bad", ["", "1a", "a-b", "a b", "NA", "nan", "Units", "collapse", "a#", "a'", "é", "a.b", "a/b", "a" * 61]
    )
    def test_what_no_program_takes(self, bad):
        assert not is_id(bad)
        assert is_id(make_ids([(bad,)])[(bad,)])

    def test_alike_labels_stay_apart(self):
        made = make_ids([("a b",), ("a-b",), ("A_B",), ("c",)])
        assert len(set(made.values())) == 4
        assert made[("c",)] == "c"
        assert all(one.lower().startswith("a_b_") for key, one in made.items() if key != ("c",))

    @pytest.mark.parametrize("name", FORMATS)
    def test_hostile_labels_make_ids_that_openquake_takes(self, name, tmp_path):
        """Its own rule; labels come back as they were, whatever their ids."""
        alike = [f"a{mark}b" for mark in " /'\"\\.#-é–\n\t;"]
        blocks = [*alike, "x" * 10_000, "x" * 9_999 + "y", "書棚", "🏺 vase", "0.5", "'", "E.20.22.102a"]
        curves = lognormal(blocks=blocks)
        written, found = there_and_back(curves, name, tmp_path)
        every = [*written.ids, *written.missing]
        assert len(set(written.ids)) == len(written.ids) >= 2 * len(blocks) - 1
        assert all(re.fullmatch(r"[A-Za-z0-9_:-]{1,60}", one) for one in every)
        assert set(found["block"].values) == set(blocks)
        one = {"block": "x" * 10_000, "model": LAWS[0]}
        assert found["median"].sel(one).item() == pytest.approx(curves["median"].sel(one).item(), rel=1e-12)

    @pytest.mark.parametrize(("name", "ids"), [("pelicun", "E.1 b_2"), ("nrml", "MUR-H:1 b_2"), ("csv", "E.1 b_2")])
    def test_chosen_by_the_caller(self, name, ids, tmp_path):
        """One a component, also where components have several limit states."""
        write, read, file = FORMATS[name]
        curves = lognormal(blocks=["a", "b"]).isel(model=0, drop=True)
        written = write(curves, tmp_path / file, ids=ids.split())
        assert written.ids == tuple(ids.split())
        found = read(written.paths[0])
        assert found["id"].values.tolist() == ids.split()
        assert found["block"].values.tolist() == ["a", "b"]
        states = curves.expand_dims(limit_state=["rocking", "overturning"])
        assert write(states, tmp_path / file, ids=ids.split()).ids == tuple(ids.split())


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A small result file of a block that falls and one that never does, and its curves."""
    blocks = [tp.catalogue["bookcase-5-shelf"], tp.Block(3.0, 1.0, name="=slab")]
    laws = [tp.DiscreteDamping(e=0.9), tp.HousnerImpact(e=0.9)]
    motions = tp.motions.CloughPenzien(duration=8.0, dt=0.01).sample(20, seed=1)
    runs = tp.ida(blocks, laws, motions, np.geomspace(1.0, 10.0, 6))
    counts = tp.overturning_probability(runs)
    curves = tp.fit_fragility(counts)
    path = tmp_path_factory.mktemp("results") / "results.nc"
    runs.assign({**counts.data_vars, **curves.data_vars}).assign_attrs(title="Trial", confidence=0.95).to_netcdf(path)
    return path, curves


class TestCommand:
    @pytest.mark.parametrize("name", FORMATS)
    def test_export(self, name, results, tmp_path, capsys):
        path, curves = results
        assert main(["export", str(path), "--format", name, "--out", str(tmp_path / "a" / "b")]) == 0
        said = capsys.readouterr().out
        assert f"2 curves for {name}" in said
        assert "(no overturning)" in said
        _, read, file = FORMATS[name]
        found = read(tmp_path / "a" / "b" / file)
        one = {"block": "bookcase-5-shelf"}
        np.testing.assert_allclose(found["median"].sel(one), curves["median"].sel(one), rtol=1e-12)
        np.testing.assert_allclose(found["dispersion"].sel(one), curves["dispersion"].sel(one), rtol=1e-12)

    def test_default_folder_and_one_model(self, results, capsys):
        path, _ = results
        assert main(["export", str(path), "--format", "csv", "--model", "housner"]) == 0
        assert f"written: {path.parent / 'export' / 'curves.csv'}" in capsys.readouterr().out
        assert read_table(path.parent / "export" / "curves.csv")["model"].values.tolist() == ["housner e=0.9"]
        assert main(["export", str(path), "--format", "csv", "--model", "discrete e=0.9 δ=0.05"]) == 0

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["results.nc", "--format", "csv", "--model", "housnr"], "did you mean 'housner'?"),
            (["roof.nc", "--format", "nrml", "--out", "out"], "OpenQuake knows the ground's shaking alone"),
            (["scale.nc", "--format", "pelicun", "--out", "out"], "pelicun has no demand for scale"),
        ],
    )
    def test_mistakes_are_one_sentence(self, arguments, message, results, tmp_path, capsys, monkeypatch):
        """Others are in tests/golden/refused."""
        monkeypatch.chdir(tmp_path)
        Path("results.nc").write_bytes(results[0].read_bytes())
        stored = xr.load_dataset("results.nc")
        if arguments[0] == "roof.nc":
            stored.assign_coords(floor=("motion", np.array(["4"] * 20, dtype=object))).to_netcdf("roof.nc")
        if arguments[0] == "scale.nc":
            stored["level"].attrs.update(im="scale", units="1")
            stored["median"].attrs["units"] = "1"
            stored.to_netcdf("scale.nc")
        before = sorted(tmp_path.iterdir())
        assert main(["export", *arguments]) == 2
        caught = capsys.readouterr()
        assert message in caught.err
        assert caught.err.startswith("toppling: ")
        assert caught.err.count("\n") == 1
        assert sorted(tmp_path.iterdir()) == before


def test_refused(refusal):
    refusal()
