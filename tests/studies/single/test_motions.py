"""Tables and figures of motions, and floors in study files."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_texts import CABINET

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions.arrays import records
from toppling.motions.intensity.cumulative import husid, significant_duration_5_75
from toppling.studies.command.cli import main
from toppling.studies.single.motions import draw_spectra, measures_table, read_motions

EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"

REST = CABINET + '[ida]\nim = "pga"\nlevels = { values = [0.1, 0.3, 0.9], unit = "g" }\n'
SPECTRUM = "period (s), sa (g)\n0.1, 1\n0.5, 1\n2, 0.25\n"
NOISE = 'generator = "clough-penzien"\nnumber = 8\nduration_s = 6\ndt_s = 0.02'
TOWER = '[building]\nkind = "flexural-shear"\nperiod_s = 0.8\nstoreys = 4\nfloors = [0, 2, 4]'


def write(folder, motions=NOISE, building="", im_at="", name="study.toml"):
    path = folder / name
    path.write_text(f'title = "Tiny"\n[motions]\n{motions}\n{building}\n{REST}{im_at}')
    return path


@pytest.fixture(scope="module")
def of_tower(tmp_path_factory):
    study = tp.Study.from_toml(write(tmp_path_factory.mktemp("tower"), building=TOWER))
    assert (study.design.shakes, study.runs) == (24, 72)
    return study.run()


class TestFloors:
    def test_a_curve_for_each_floor(self, of_tower):
        assert of_tower.probability.dims == ("block", "model", "floor", "level")
        assert of_tower["median"].dims == ("block", "model", "floor")
        np.testing.assert_array_equal(of_tower.floor, [0, 2, 4])
        assert (of_tower.runs == 8).all()
        for floor in (0, 2, 4):
            own = of_tower.overturned.isel(motion=of_tower.motion_floor.values == str(floor))
            np.testing.assert_array_equal(of_tower.overturnings.sel(floor=floor), own.sum("motion"))
        with pytest.raises(ValueError, match="several floors, say which: 0, 2, 4"):
            tp.plot.fragility(of_tower)
        assert tp.plot.fragility(of_tower, floor=4).get_title("left").replace("\u00a0", " ").endswith("floor 4")

    def test_probabilities_of_stored_results_keep_floors_apart(self, of_tower):
        flags = of_tower[["overturned"]].drop_vars("floor", errors="ignore")
        np.testing.assert_array_equal(tp.overturning_probability(flags).probability, of_tower.probability)
        pooled = tp.overturning_probability(flags.drop_vars("motion_floor"))
        assert pooled.probability.dims == ("block", "model", "level")
        np.testing.assert_allclose(pooled.probability, of_tower.probability.mean("floor"), rtol=1e-12)

    def test_one_floor_is_no_dimension(self, tmp_path):
        result = tp.Study.from_toml(write(tmp_path, building=TOWER.replace("[0, 2, 4]", "[4]"))).run()
        assert result.probability.dims == ("block", "model", "level")
        assert set(result.floor.values) == {"4"}

    @pytest.mark.slow
    def test_levels_of_the_ground_motion(self, tmp_path):
        """Floor 0 at a level of the ground is the ground motion's own study; floors move with the same factors."""
        at_ground = tp.Study.from_toml(write(tmp_path, building=TOWER, im_at='im_at = "ground"')).run()
        plain = tp.Study.from_toml(write(tmp_path, name="plain.toml")).run()
        lowest = at_ground.isel(motion=at_ground.motion_floor.values == "0")
        np.testing.assert_array_equal(lowest.overturned, plain.overturned)
        np.testing.assert_array_equal(lowest.peak_rotation, plain.peak_rotation)
        assert at_ground.level.attrs["long_name"] == "peak ground acceleration"
        np.testing.assert_array_equal(at_ground.ground_pga.values.reshape(8, 3), plain.pga.values[:, None].repeat(3, 1))
        # the roof by hand: its motions times level over the ground's PGA
        building = tp.motions.Building.flexural_shear(0.8, storeys=4)
        ground = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(8)
        factors = 0.3 * G / tp.motions.measures(ground, "pga").pga
        roof = building.floor_motions(ground, [4]) * factors.drop_vars(["floor"], errors="ignore")
        roof = roof.assign_attrs(units="m s-2")
        by_hand = tp.ida(tp.Block(0.4, 1.8), tp.HousnerImpact(e=0.9), roof, [1.0], im="scale")
        roof_of_study = at_ground.isel(motion=at_ground.motion_floor.values == "4", level=1)
        np.testing.assert_array_equal(roof_of_study.overturned, by_hand.overturned.isel(level=0))

    @pytest.mark.parametrize("im", ["Sa(0.8)", "arias", "pga_normalised"])
    def test_other_measures_of_the_ground(self, im):
        building = tp.motions.Building.flexural_shear(0.8, storeys=4)
        ground = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(3)
        case = (tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact())
        found = tp.ida(*case, building.floor_motions(ground, [0, 4]), [0.5, 1.5], im=im, ground=ground)
        alone = tp.ida(*case, ground, [0.5, 1.5], im=im)
        np.testing.assert_array_equal(found.peak_rotation.values[..., ::2], alone.peak_rotation.values)
        assert f"ground_{im}" in found.coords

    def test_ground_must_fit(self):
        ground = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(2)
        floors = tp.motions.Building.flexural_shear(0.8, storeys=4).floor_motions(ground, [4])
        with pytest.raises(ValueError, match="ground must hold the ground motion 'CloughPenzien 0-1'"):
            tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), floors, [1.0], ground=ground[:1])

    @pytest.mark.parametrize("kind", ["csv", "nc"])
    def test_floor_histories_of_another_program(self, tmp_path, kind):
        time = np.arange(200) * 0.02
        values = 3.0 * np.sin(5.0 * time) * np.exp(-0.5 * time)
        heading = "time, A/1 [m/s2], A/roof [g], B/1 [m/s2], B/roof [g]\n"
        rows = [
            f"{t:.2f}, {a!r}, {2 * a / G!r}, {-a!r}, {-2 * a / G!r}" for t, a in zip(time, values.tolist(), strict=True)
        ]
        table = tmp_path / "floors.csv"
        table.write_text(heading + "\n".join(rows))
        if kind == "nc":
            tp.motions.read_floors(table).to_netcdf(tmp_path / "floors.nc")
        result = tp.Study.from_toml(write(tmp_path, f'floors_file = "floors.{kind}"')).run()
        assert list(result.floor.values) == ["1", "roof"]
        assert (result.runs == 2).all()
        np.testing.assert_allclose(result.pga, np.array([1.0, 2.0, 1.0, 2.0]) * np.abs(values).max(), rtol=1e-12)

    @pytest.mark.slow
    def test_the_tower(self, tmp_path, capsys):
        """The example with fewer motions, as a user runs it: blocks on higher floors fall at lower levels."""
        text = (EXAMPLES / "tower.toml").read_text()
        assert tp.Study.from_toml(EXAMPLES / "tower.toml").runs == 2 * 2 * 60 * 3 * 16
        path = tmp_path / "tower.toml"
        path.write_text(text.replace("number = 60", "number = 16").replace("[motions]", "[motions]\ndt_s = 0.01"))
        assert main(["run", str(path), "--out", str(tmp_path / "out"), "--verbose"]) == 0
        printed = " ".join(capsys.readouterr().out.split())
        assert all(words in printed for words in ("= 3,072 runs", "Bookcase, 5 shelves, floor 10", "Fragility curves"))
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            assert (stored["median"].diff("floor") < 0.0).all()
        assert (tmp_path / "out" / "fragility.png").stat().st_size > 40_000


class TestCommand:
    @pytest.mark.slow
    def test_target_spectrum(self, tmp_path, capsys):
        (tmp_path / "target.csv").write_text(SPECTRUM)
        motions = 'generator = "spectrum-compatible"\ntarget = "target.csv"\nnumber = 2\nseed = 3\ndt_s = 0.01'
        study = str(write(tmp_path, motions))
        command = ["motions", study, "--out", str(tmp_path / "out"), "--target"]
        assert main([*command, str(tmp_path / "target.csv")]) == 0
        said = capsys.readouterr().out
        mean, worst = (float(one) for one in re.findall(r"([\d.]+) %", said)[-2:])
        assert 0.0 < mean <= worst < 8.0
        assert main([*command, str(tmp_path / "none.csv")]) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1

    @pytest.mark.slow
    def test_study_file(self, tmp_path, capsys):
        path = write(tmp_path, building=TOWER)
        assert main(["motions", str(path), "--out", str(tmp_path / "out")]) == 0
        printed = capsys.readouterr().out
        assert "24 motions" in printed
        assert "12 more motions are not listed." in printed
        assert "median, floor 4" in printed
        for name in ("histories.png", "spectra.png", "husid.png"):
            picture = (tmp_path / "out" / name).read_bytes()
            assert picture[:8] == b"\x89PNG\r\n\x1a\n"
            assert str(tmp_path / "out" / name) in printed

    @pytest.mark.slow
    def test_records_as_json(self, tmp_path, capsys):
        shaking = tp.motions.CloughPenzien(duration=4.0).sample(3)
        for i in range(3):
            tp.motions.write_at2(shaking[i : i + 1], tmp_path / f"R{i}[x].AT2")
        command = ["motions", str(tmp_path / "R*.AT2"), str(tmp_path / "R1[x].AT2"), "--json", "--damping", "0.02"]
        assert main([*command, "--out", str(tmp_path / "out")]) == 0
        content = json.loads(capsys.readouterr().out)
        assert content["motions"] == ["R0[x]", "R1[x]", "R2[x]"]
        assert content["measures"]["pga"]["units"] == "m s-2"
        np.testing.assert_allclose(
            content["measures"]["pga"]["values"], abs(shaking).max("time").values, rtol=1e-6
        )  # as AT2 rounds
        assert "Sa(1.0, 0.02)" in content["measures"]
        assert all(Path(path).is_file() for path in content["figures"])

    def test_nothing_shakes(self, tmp_path, capsys):
        (tmp_path / "quiet.csv").write_text("time,a (g)\n" + "\n".join(f"{0.01 * i:.2f},0" for i in range(50)))
        assert main(["motions", str(tmp_path / "quiet.csv"), "--json", "--out", str(tmp_path)]) == 0
        content = json.loads(capsys.readouterr().out)
        assert content["measures"]["d5_95"]["values"] == [None]


class TestLook:
    def test_husid_is_the_arias_intensitys_share(self):
        record = records(tp.motions.CloughPenzien(duration=8.0).sample(1))[0]
        share = husid(record.acceleration, record.dt)
        time = np.arange(share.size) * record.dt
        found = np.interp(0.75, share, time) - np.interp(0.05, share, time)
        assert found == pytest.approx(significant_duration_5_75(record.acceleration, record.dt), abs=record.dt)
        assert np.isnan(husid(np.zeros(5), 0.1)).all()
        # one triangle: the integral of t² is a third of the cube
        np.testing.assert_allclose(husid(np.array([0.0, 1.0, 0.0]), 0.1), [0.0, 0.5, 1.0], rtol=1e-15)

    def test_the_lines_are_the_percentiles(self):
        from matplotlib.figure import Figure

        shaking = tp.motions.CloughPenzien(duration=5.0, dt=0.02).sample(5)
        target = tp.motions.TargetSpectrum((0.1, 1.0), (1.0, 2.0))
        ax = draw_spectra(Figure().subplots(), [shaking], 0.05, target)
        lines = {line.get_label(): line for line in ax.lines}
        periods, median = lines["median"].get_data()
        sa = tp.motions.response_spectrum(shaking, periods).sa
        np.testing.assert_allclose(median, sa.median("motion") / G, rtol=1e-12)
        np.testing.assert_allclose(lines["16 and 84 %"].get_ydata(), sa.quantile(0.16, "motion") / G, rtol=1e-12)
        np.testing.assert_allclose(lines["target"].get_ydata(), np.array([1.0, 2.0]) / G)

    def test_table_medians(self, monkeypatch):
        values = tp.motions.measures(
            tp.motions.from_array([[0.0, G, 0.0], [0.0, 3.0 * G, 0.0], [0.0, 2.0 * G, 0.0]], 0.1),
            [*tp.motions.MEASURES, "Sa(1.0)"],
        )
        monkeypatch.setattr("toppling.studies.single.motions.MOST_ROWS", 1)
        table = measures_table(values)
        assert "2 more motions" in table.note
        assert table.column("motion")[1:] == ["median"]
        assert table.column("pga")[-1] == pytest.approx(2.0)

    def test_reads_components_of_different_lengths(self, tmp_path):
        tp.motions.write_at2(tp.motions.CloughPenzien(duration=4.0).sample(1), tmp_path / "a.AT2")
        tp.motions.write_at2(tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(1, seed=2), tmp_path / "b.AT2")
        found = read_motions([str(tmp_path / "a.AT2"), str(tmp_path / "b.AT2")]).motions
        assert [one.sizes["time"] for one in found] == [5046, 2724]

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("distance", "said"),
        [(30_000, "Medians over those of ground-motion models"), (900_000, "no ground-motion model is of M 6, 900 km")],
    )
    def test_a_scenario_stands_beside_models_where_there_are_any(self, tmp_path, capsys, distance, said):
        motions = f'generator = "seismological"\nnumber = 3\nmagnitude = 6.0\ndistance_m = {distance}\ndt_s = 0.02'
        study = write(tmp_path, motions)
        assert main(["motions", str(study), "--out", str(tmp_path / "figures")]) == 0
        assert said in " ".join(capsys.readouterr().out.split())
