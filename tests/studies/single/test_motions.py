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
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.single.motions import draw_spectra, measures_table, read_motions

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"

STUDY = """
title = "Tiny"
[[blocks]]
catalogue = "bookcase-5-shelf"
[[models]]
law = "housner"
geometry = "linear"
[motions]
{motions}
{building}
[ida]
im = "pga"
{im_at}
levels = {{ values = [0.1, 0.3, 0.9], unit = "g" }}
"""
NOISE = 'generator = "clough-penzien"\nnumber = 8\nduration_s = 6\ndt_s = 0.02'
TOWER = '[building]\nkind = "flexural-shear"\nperiod_s = 0.8\nstoreys = 4\nfloors = [0, 2, 4]'
FRAME = '[building]\nkind = "storeys"\nmasses_kg = [1e5, 1e5]\nstiffnesses_n_m = [4e7, 4e7]\nstorey_height_m = [4, 3]'

# The parameters with which each generator makes short motions.
SHORT = {
    "kanai-tajimi": "duration_s = 5\ndt_s = 0.02",
    "clough-penzien": "duration_s = 5\ndt_s = 0.02",
    "evolutionary-kanai-tajimi": "duration_s = 5\ndt_s = 0.02\nomega_g_rad_s = [25, 10]",
    "evolutionary-clough-penzien": "duration_s = 5\ndt_s = 0.02\nomega_g_rad_s = [25, 10]",
    "site-based": "arias_m_s = 0.3\nd5_95_s = 8\nt_mid_s = 5\ndt_s = 0.02",
    "site-based-scenario": "magnitude = 6.5\ndistance_m = 20000\nvs30_m_s = 500\ndt_s = 0.02",
    "near-fault": "magnitude = 6.5\ndistance_m = 8000\nalong_m = 10000\ndt_s = 0.02",
    "seismological": "magnitude = 6\ndistance_m = 20000\ndt_s = 0.02",
    "spectrum-compatible": 'target = "target.csv"\ndt_s = 0.01',
    "ac156": "s_ds = 1\nduration_s = 20\ndt_s = 0.01",
}


def write(folder, motions=NOISE, building="", im_at="", name="study.toml"):
    path = folder / name
    path.write_text(STUDY.format(motions=motions, building=building, im_at=im_at))
    return path


@pytest.mark.parametrize("name", tp.motions.GENERATORS)
def test_every_generator_by_name(tmp_path, name):
    """A small study that names a generator has the motions of the generator's class."""
    (tmp_path / "target.csv").write_text("period (s), sa (g)\n0.1, 1\n0.5, 1\n2, 0.25\n")
    study = tp.Study.from_toml(write(tmp_path, f'generator = "{name}"\nnumber = 2\nseed = 3\n{SHORT[name]}'))
    assert study.design.arrays[0].motion.values[0] == f"{tp.motions.GENERATORS[name].__name__} 3-0"
    result = study.run()
    assert result.sizes["motion"] == 2
    assert bool(result.overturned.any()) or float(result.peak_rotation.max()) > 0.0


@pytest.mark.parametrize("name", tp.motions.PULSES)
def test_every_pulse_by_name(tmp_path, name):
    study = tp.Study.from_toml(write(tmp_path, f'pulse = "{name}"\nomega_rad_s = 5\ndt_s = 0.01'))
    result = study.run()
    assert result.sizes["motion"] == 1
    assert bool(result.overturned.sel(level=0.9 * G, method="nearest").all())


class TestFloors:
    @pytest.mark.slow
    def test_a_curve_for_each_floor(self, tmp_path):
        study = tp.Study.from_toml(write(tmp_path, building=TOWER))
        assert study.design.shakes == 24
        assert study.runs == 72
        result = study.run(tmp_path / "out")
        assert result.probability.dims == ("block", "model", "floor", "level")
        assert result["median"].dims == ("block", "model", "floor")
        np.testing.assert_array_equal(result.floor, [0, 2, 4])
        assert (result.runs == 8).all()
        for floor in (0, 2, 4):
            own = result.overturned.isel(motion=result.motion_floor.values == str(floor))
            np.testing.assert_array_equal(result.overturnings.sel(floor=floor), own.sum("motion"))
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            xr.testing.assert_identical(stored.load(), result)
        for name in result.variables:
            assert {"units", "long_name"} <= set(result[name].attrs), name

    def test_probabilities_of_stored_results_keep_floors_apart(self, tmp_path):
        result = tp.Study.from_toml(write(tmp_path, building=TOWER)).run()
        flags = result[["overturned"]].drop_vars("floor", errors="ignore")
        again = tp.overturning_probability(flags)
        np.testing.assert_array_equal(again.probability, result.probability)
        pooled = tp.overturning_probability(flags.drop_vars("motion_floor"))
        assert pooled.probability.dims == ("block", "model", "level")
        np.testing.assert_allclose(pooled.probability, result.probability.mean("floor"), rtol=1e-12)

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
        by_hand = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(geometry="linear"), roof, [1.0], im="scale")
        roof_of_study = at_ground.isel(motion=at_ground.motion_floor.values == "4", level=1)
        np.testing.assert_array_equal(roof_of_study.overturned, by_hand.overturned.isel(level=0))

    @pytest.mark.parametrize("im", ["Sa(0.8)", "arias", "pga_normalised"])
    def test_other_measures_of_the_ground(self, im):
        """Factors on floor motions are those of the ground motions, for powers and for blocks too."""
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

    def test_a_frame_with_all_floors(self, tmp_path):
        study = tp.Study.from_toml(write(tmp_path, building=FRAME))
        np.testing.assert_allclose(study.design.arrays[0].height, [0.0, 4.0, 7.0])

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

    @pytest.mark.parametrize(
        ("motions", "building", "im_at", "message"),
        [
            (NOISE, "", 'im_at = "ground"', "ida.im_at 'ground' needs a building"),
            (NOISE, TOWER, 'im_at = "roof"', "ida.im_at: must be one of floor, ground, got 'roof'"),
            ('floors_file = "x.csv"', TOWER, "", "a building needs ground motions, got motions.floors_file"),
            ('floors_file = "x.csv"', "", "", "floors_file: no file matches 'x.csv'"),
            ('floors_file = "x.csv"\ndt_s = 1', "", "", "unknown key 'motions.dt_s'"),
            (NOISE, TOWER.replace("[0, 2, 4]", "[5]"), "", r"building: floors must be different numbers from 0"),
            (NOISE, TOWER.replace("period_s = 0.8\n", ""), "", "key 'building.period_s' is missing"),
            (NOISE, TOWER.replace("0.8", "-1"), "", "building.period_s: must be"),
            (NOISE, FRAME + "\nalpha0 = 3", "", 'alpha0 belongs to building.kind = "flexural-shear"'),
            (NOISE, FRAME.replace("[1e5, 1e5]", "[1e5]"), "", "building: masses and stiffnesses must be one a storey"),
            (
                NOISE,
                TOWER.replace("flexural-shear", "frame"),
                "",
                "building.kind: must be one of ground, flexural-shear",
            ),
            (NOISE, TOWER.replace("period_s", "periods"), "", "key 'building.periods'; did you mean 'period_s'"),
        ],
    )
    def test_bad_floors(self, tmp_path, motions, building, im_at, message):
        with pytest.raises(StudyError, match=message) as error:
            tp.Study.from_toml(write(tmp_path, motions, building, im_at))
        assert "\n" not in str(error.value)

    @pytest.mark.slow
    def test_the_tower(self, tmp_path, capsys):
        """The example with fewer motions, as a user runs it: blocks on higher floors fall at lower levels."""
        text = (EXAMPLES / "tower.toml").read_text()
        study = tp.Study.from_toml(EXAMPLES / "tower.toml")
        assert study.runs == 2 * 2 * 60 * 3 * 16
        path = tmp_path / "tower.toml"
        path.write_text(text.replace("number = 60", "number = 16").replace("[motions]", "[motions]\ndt_s = 0.01"))
        assert main(["run", str(path), "--out", str(tmp_path / "out"), "--verbose"]) == 0
        printed = " ".join(capsys.readouterr().out.split())
        assert "= 3,072 runs" in printed
        assert "Bookcase, 5 shelves, floor 10" in printed
        assert "Fragility curves" in printed
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            median = stored["median"].load()
        assert (median.diff("floor") < 0.0).all()
        assert (tmp_path / "out" / "fragility.png").stat().st_size > 40_000

    def test_a_plot_needs_to_know_the_floor(self, tmp_path):
        result = tp.Study.from_toml(write(tmp_path, building=TOWER)).run()
        with pytest.raises(ValueError, match="several floors, say which: 0, 2, 4"):
            tp.plot.fragility(result, block="bookcase-5-shelf")
        drawn = tp.plot.fragility(result, block="bookcase-5-shelf", floor=4)
        assert drawn.get_title("left").replace("\u00a0", " ").endswith("floor 4")


class TestCommand:
    @pytest.mark.slow
    def test_target_spectrum(self, tmp_path, capsys):
        """A target from CSV is drawn and its misfit is printed; a wrong target is refused in one sentence."""
        (tmp_path / "target.csv").write_text("period (s), sa (g)\n0.1, 1\n0.5, 1\n2, 0.25\n")
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
        """A record of zeros has no durations: JSON holds null, not NaN, and the figures have no line."""
        (tmp_path / "quiet.csv").write_text("time,a (g)\n" + "\n".join(f"{0.01 * i:.2f},0" for i in range(50)))
        assert main(["motions", str(tmp_path / "quiet.csv"), "--json", "--out", str(tmp_path)]) == 0
        content = json.loads(capsys.readouterr().out)
        assert content["measures"]["d5_95"]["values"] == [None]

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ([], "usage: toppling motions INPUTS"),
            (["nothing.AT2"], "records: no file matches 'nothing.AT2'"),
            (["nothing.toml"], "nothing.toml: no such file"),
            (["study.toml", "x.AT2"], "a study file must stand alone, got 2 files"),
            (["study.toml", "--damping", "1.5"], "damping must be"),
            (["noise.txt"], "noise.txt"),
            (["study.toml", "--out", "noise.txt/out"], "cannot be written"),
        ],
    )
    def test_errors_are_one_sentence(self, tmp_path, monkeypatch, capsys, arguments, message):
        monkeypatch.chdir(tmp_path)
        write(tmp_path)
        Path("noise.txt").write_text("nothing of use\n")
        assert main(["motions", *arguments]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1


class TestLook:
    def test_husid_is_the_arias_intensitys_share(self):
        record = records(tp.motions.CloughPenzien(duration=8.0).sample(1))[0]
        share = husid(record.acceleration, record.dt)
        assert share[0] == 0.0
        assert share[-1] == 1.0
        assert (np.diff(share) >= 0.0).all()
        time = np.arange(share.size) * record.dt
        expected = significant_duration_5_75(record.acceleration, record.dt)
        found = np.interp(0.75, share, time) - np.interp(0.05, share, time)
        assert found == pytest.approx(expected, abs=record.dt)
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

    def test_table_medians(self):
        values = tp.motions.measures(
            tp.motions.from_array([[0.0, G, 0.0], [0.0, 3.0 * G, 0.0], [0.0, 2.0 * G, 0.0]], 0.1),
            [*tp.motions.MEASURES, "Sa(1.0)"],
        )
        table = measures_table(values, rows=1)
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
        study = tmp_path / "study.toml"
        study.write_text(
            'title = "One"\n[motions]\ngenerator = "seismological"\nnumber = 3\nmagnitude = 6.0\n'
            f"distance_m = {distance}\ndt_s = 0.02\n" + REST,
            encoding="utf-8",
        )
        assert main(["motions", str(study), "--out", str(tmp_path / "figures")]) == 0
        assert said in " ".join(capsys.readouterr().out.split())


REST = CABINET + "[cloud]\n"
