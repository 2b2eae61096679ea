"""The command `toppling simulate`, run as a user runs it."""

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from plot_cases import faults

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.facts.say import notes_said
from toppling.studies.file.table import quantity
from toppling.studies.film import animate, writers as movies
from toppling.studies.film.scene import Scene
from toppling.studies.single.inputs import factor_of, motion_of, scene_of
from toppling.studies.single.run import Simulation, around_of

PULSE = ["one-cycle-sine", "--period", "1s", "--set", "dt_s=0.005"]
KIT = "strap,height=1.75m,strength=267N,stiffness=20N/mm,slack=5mm"
STRAP = tp.Restraint.strap(1.75, 267.0, 20e3, 0.005)
SCENE = ["--width", "30cm", "--height", "1.8m", *PULSE]
HELD = [*SCENE, "--wall-gap", "20mm", "--mass", "100kg", "--restraint", KIT, "--geometry", "linear"]
BLOCK = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02), restraint=STRAP)
FILM = ["simulate", "bookcase-5-shelf", "half-sine", "--period", "0.8s", "--pga", "0.2g", "--animate"]
SHORT = ["--set", "duration_s=6", "--set", "dt_s=0.01"]


def run(capsys, *arguments, code=0):
    assert main(["simulate", *map(str, arguments)]) == code
    said = capsys.readouterr()
    return said.out if code == 0 else said.err


class TestCommand:
    @pytest.mark.slow
    def test_says_and_writes_what_the_run_found(self, tmp_path, capsys):
        out = tmp_path / "out"
        said = run(capsys, "bookcase-5-shelf", "kanai-tajimi", "--seed", 1, "--pga", "0.3g", *SHORT, "--out", out)
        motion = tp.motions.KanaiTajimi(duration=6.0, dt=0.01).sample(1, seed=1)
        block = tp.catalogue["bookcase-5-shelf"]
        expected = tp.simulate(block, tp.HousnerImpact(), tp.motions.scale_to(motion, 0.3 * G))
        assert re.search(r"bookcase-5-shelf, 0\.321.*1\.8.*0\.176", said)
        assert f"e_R = {block.restitution:.3f}" in said
        assert re.search(r"PGA 0\.3.*0\.01", said)
        assert re.search(rf"= {math.tan(block.alpha):.3g} .* {0.3 / math.tan(block.alpha):.3g} times", said)
        assert re.search(rf"impacts: +{int(expected.impacts)} during the record\n", said)
        assert not bool(expected.overturned)
        share = 100.0 * float(expected.peak_rotation) / block.alpha
        assert f"{float(expected.peak_rotation):.4g} rad = {share:.3g} % of α" in said
        rocked = re.search(r"end: +stands, rocking until ([\d.]+) s after the record\n", said)
        assert rocked
        assert "friction needed: 0.18" in said
        assert sorted(one.name for one in out.iterdir()) == ["history.csv", "history.png"]
        with (out / "history.csv").open(encoding="utf-8") as file:
            rows = list(csv.reader(file))
        assert rows[0][:3] == ["time (s)", "rotation (rad)", "angular velocity (rad/s)"]
        values = np.array(rows[1:], dtype=float)
        assert values[-1, 0] == pytest.approx(6.0 + float(rocked[1]) + 1.0, rel=2e-3)
        names = ("time", "rotation", "angular_velocity", "angular_acceleration", "floor_acceleration")
        for column, name in zip(values.T, names, strict=True):
            # (scaled by a factor here, sample by sample there; in quiet until the block stands)
            np.testing.assert_allclose(column[: expected.sizes["time"]], expected[name].values, rtol=1e-9, atol=1e-9)

    def test_json(self, tmp_path, capsys):
        said = run(capsys, "--width", "40cm", "--height", 1.8, "clough-penzien", *SHORT, "--json", "--out", tmp_path)
        found = json.loads(said)
        assert (found["block"]["width"], found["block"]["name"], found["motion"]["factor"]) == (0.4, None, 1.0)
        assert (found["overturned"], found["overturning_time"]) == (False, None)
        assert found["uplift_acceleration"] == pytest.approx(G * 0.4 / 1.8, rel=1e-12)
        assert found["friction"]["uplift"] == pytest.approx(0.4 / 1.8, rel=1e-12)
        law = found["model"]
        assert (law["law"], law["label"], law["geometry"]) == ("housner", "housner e=e_R", "exact")
        assert law["e"] == pytest.approx(tp.Block(0.4, 1.8).restitution)
        assert [Path(file).name for file in found["files"] if Path(file).is_file()] == ["history.csv", "history.png"]

    @pytest.mark.parametrize(("factor", "doubted"), [(34.0, False), (350.0, True)])
    def test_a_peak_beyond_any_shaking_is_doubted(self, factor, doubted):
        """3.4 and 35 g, of a pulse of 1 m/s²; 35 was meant per cent."""
        one = Simulation(tp.Block(0.3, 1.8), tp.HousnerImpact(), motion_of("ricker", period="1s"), factor)
        found = [note for note in one.notes if "beyond any shaking" in note]
        meant = "g written where m/s² is meant, or per cent of g?"
        assert [note.partition(" shaking: ")[2] for note in found] == [meant] * doubted

    @pytest.mark.slow
    def test_overturned_after_the_record(self, tmp_path, capsys):
        pulse = ["one-cycle-sine", "--set", "omega_rad_s=6", "--set", "tail_s=0.3", "--pga", "5m/s2"]
        said = run(capsys, "bookcase-5-shelf", *pulse, "--json", "--out", tmp_path)
        found = json.loads(said)
        motion = tp.motions.OneCycleSine(amplitude=5.0, omega=6.0, tail=0.3).sample(1)
        expected = tp.simulate(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), motion)
        at = float(expected.overturning_time)
        assert at > float(expected.time[-1])
        assert found["overturning_time"] == pytest.approx(at, rel=1e-12)
        assert found["direction"] == -1.0
        values = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1)
        lies = values[np.argmax(np.abs(values[:, 1]) >= 0.5 * math.pi), 0]
        assert at <= lies <= at + 0.0011
        assert values[-1, 0] == pytest.approx(at + 1.0, abs=0.002)
        plain = run(capsys, "bookcase-5-shelf", *pulse, "--out", tmp_path)
        assert re.search(rf"left at {at:.2f} s \(after", plain)

    @pytest.mark.slow
    def test_it_goes_on_until_the_block_stands(self, tmp_path, capsys):
        """A pulse ends long before its block rests: the history ends a second after that, or is marked as cut."""
        pulse = ["bookcase-5-shelf", "one-cycle-sine", "--period", "0.6s", "--pga", "0.25g", "--out", tmp_path]
        alpha = tp.catalogue["bookcase-5-shelf"].alpha
        found = json.loads(run(capsys, *pulse, "--json"))
        assert (found["overturned"], found["cut"]) == (False, False)
        time, theta = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1, usecols=(0, 1)).T
        rocks = np.abs(theta) > 0.01 * alpha
        assert time[rocks].max() > found["motion"]["duration"] + 1.0
        assert time[-1] - time[rocks].max() == pytest.approx(1.0, abs=0.002)
        lossless = run(capsys, *pulse, "--e", 1)
        assert re.search(r"does not overturn;.*36\.3", lossless)
        assert json.loads(run(capsys, *pulse, "--e", 1, "--json"))["cut"] is True

    @pytest.mark.slow
    def test_a_pulse_is_as_strong_as_one_says(self, tmp_path, capsys):
        """A pulse has its amplitude as a parameter, so that no factor on it is reported as far scaling."""
        said = run(capsys, "bookcase-5-shelf", "ricker", "--period", "1s", "--pga", "0.7g", "--out", tmp_path)
        assert re.search(r"6\.865: PGA 0\.7", said)
        assert "less than 0.2" not in said
        assert not bool(motion_of("ricker", period="1s").own_amplitude.item())
        assert bool(motion_of(str(tp.motions.example_path())).own_amplitude.item())

    def test_the_figure_says_what_is_seen(self, tmp_path, capsys):
        motion = motion_of("one-cycle-sine", period="1s")
        one = Simulation(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), motion, 0.6 * G)
        drawn = one.figure()
        heading = drawn.get_suptitle()
        for text in ("bookcase-5-shelf, 0.321 m × 1.8 m, α = 0.176 rad", "scaled by 5.884: PGA 0.6 g"):
            assert text in heading
        shaking, history = drawn.axes[:2]
        np.testing.assert_allclose(shaking.lines[0].get_ydata(), one.shown["floor_acceleration"] / G)
        lies = float(one.response["overturning_time"])
        words = [text.get_text() for text in history.get_legend().get_texts()]
        assert f"on its side, {lies:.2f} s" in words
        passed = next(float(word.split()[-2]) for word in words if word.startswith("past its balance for good"))
        ratio = np.abs(one.shown["rotation"].values) / one.block.alpha
        at = one.shown["time"].values
        assert at[ratio <= 1.0].max() == pytest.approx(passed, abs=0.006)
        assert f" at {passed:.2f} s" in "\n".join(one.lines())
        assert faults(drawn) == []

    def test_nothing_stale_stays(self, tmp_path, capsys):
        """A film of an earlier call is removed, since it would be taken for the film of this call."""
        for name in ("animation.gif", "animation.mp4", "notes.txt"):
            (tmp_path / name).write_text("of an earlier call")
        run(capsys, "bookcase-5-shelf", "half-sine", "--period", "0.4s", "--out", tmp_path)
        assert sorted(path.name for path in tmp_path.iterdir()) == ["history.csv", "history.png", "notes.txt"]

    @pytest.mark.slow
    def test_film(self, tmp_path, capsys, monkeypatch):
        """Without ffmpeg only the GIF is written, and a note says so; a long film says how long it takes."""
        monkeypatch.setattr(movies, "ffmpeg", lambda: None)
        assert main([*FILM, "--set", "tail_s=0.4", "--out", str(tmp_path)]) == 0
        said = capsys.readouterr()
        assert "no ffmpeg" in said.err
        assert "animation.gif: 100 %" in said.err
        assert f"written: {tmp_path / 'animation.gif'}" in said.out
        assert sorted(path.name for path in tmp_path.iterdir()) == ["animation.gif", "history.csv", "history.png"]
        with Image.open(tmp_path / "animation.gif") as film:
            assert film.n_frames == 21
        monkeypatch.setattr(animate, "animate", lambda response, path, **options: path)
        monkeypatch.setattr(movies, "ffmpeg", lambda: "ffmpeg")
        for tail, said in (("60", "1,209 frames each, some 44 s\n"), ("0.4", "")):
            assert main([*FILM, "--set", f"tail_s={tail}", "--out", str(tmp_path)]) == 0
            told = capsys.readouterr().err
            assert told.endswith(said)
            assert ("animation.gif and animation.mp4" in told) == bool(said)

    @pytest.mark.slow
    @pytest.mark.skipif(movies.ffmpeg() is None, reason="ffmpeg is not on the PATH")
    def test_film_as_mp4_too(self, tmp_path, capsys):
        arguments = ["bookcase-5-shelf", "half-sine", "--period", "0.4s", "--set", "tail_s=0.1", "--speed", 2]
        said = json.loads(run(capsys, *arguments, "--animate", "--json", "--out", tmp_path))
        assert [Path(one).name for one in said["files"]][2:] == ["animation.gif", "animation.mp4"]

    @pytest.mark.slow
    def test_interrupted_film(self, tmp_path, capsys, monkeypatch):
        def interrupt(self, i):
            raise KeyboardInterrupt

        monkeypatch.setattr(Scene, "frame", interrupt)
        monkeypatch.setattr(movies, "ffmpeg", lambda: "ffmpeg")  # (without one there is a note more)
        said = run(capsys, "bookcase-5-shelf", "kanai-tajimi", *SHORT, "--animate", "--out", tmp_path, code=130)
        assert said.startswith("toppling: interrupted: animation.gif")
        assert sorted(path.name for path in tmp_path.iterdir()) == ["history.csv", "history.png"]

    @pytest.mark.slow
    def test_nothing_shakes(self, tmp_path, capsys):
        quiet = tmp_path / "quiet.csv"
        quiet.write_text("time (s),acceleration (g)\n" + "\n".join(f"{0.01 * i:.2f},0" for i in range(50)))
        found = json.loads(run(capsys, "bookcase-5-shelf", quiet, "--json", "--out", tmp_path / "out"))
        assert (found["peak_rotation"], found["uplifted"], found["friction"]) == (0.0, False, {})
        error = run(capsys, "bookcase-5-shelf", quiet, "--pga", "0.1g", code=2)
        assert error.startswith("toppling: --pga: ")

    def test_notes(self, tmp_path, capsys):
        record = tp.motions.example_path()
        arguments = ["--width", "1m", "--height", "1.5m", record, "--law", "discrete", "--scale", 7, "--out", tmp_path]
        said = run(capsys, *arguments)
        one = Simulation(tp.Block(1.0, 1.5), tp.DiscreteDamping(), tp.motions.read(record), 7.0)
        facts = {fact.what: fact for fact in one.facts}
        assert {"block.squat", "single.elastic_mode", "validity.not_modelled"} <= {*facts}
        scaled = facts["single.scaled_far"]
        assert (scaled.value, scaled.lower, scaled.upper) == (7.0, 0.2, 5.0)
        assert one.notes == notes_said(one.facts)
        assert said.count("note: ") == len(one.notes)

    @pytest.mark.slow
    def test_a_missed_spectrum_is_noted(self, tmp_path, capsys):
        target = tmp_path / "target.csv"
        target.write_text("period (s), sa (g)\n0.05, 0.8\n0.3, 0.8\n0.31, 0.05\n0.33, 0.05\n0.34, 0.8\n4, 0.1\n")
        settings = [f"target={target}", "duration_s=10", "dt_s=0.02"]
        chosen = [word for one in settings for word in ("--set", one)]
        said = run(capsys, "bookcase-5-shelf", "spectrum-compatible", *chosen, "--out", tmp_path / "out")
        assert "target spectrum (SpectrumCompatible" in said


def pulse(pga):
    motion = tp.motions.OneCycleSine(amplitude=1.0, omega=2.0 * math.pi, dt=0.005).sample(1)
    return tp.motions.scale_to(motion, pga)


class TestScene:
    def test_the_scene_is_that_of_the_study_file(self, tmp_path, capsys):
        scene = ["--wall-gap", "20mm", "--wall-restitution", 0.3, "--front-gap", "40cm", "--mass", "100kg"]
        more = ["--cm-offset", "-10mm", "--lean", "-0.5deg", "--restraint", KIT, "--geometry", "linear"]
        said = run(capsys, *SCENE, *scene, *more, "--pga", "0.3g", "--json", "--out", tmp_path)
        wall = tp.Wall(0.02, restitution=0.3, front_gap=0.4)
        lean = math.radians(-0.5)
        block = tp.Block(0.3, 1.8, mass=100.0, cm_offset=-0.01, lean=lean, wall=wall, restraint=STRAP)
        expected = tp.simulate(block, tp.HousnerImpact(geometry="linear"), pulse(0.3 * G))
        found = json.loads(said)
        assert found["block"]["wall"]["front_gap"] == pytest.approx(0.4, rel=1e-15)
        assert found["block"]["restraint"]["kind"] == "strap"
        for name in ("peak_front", "peak_back", "wall_impacts", "final_state", "ruptured"):
            assert found[name] == pytest.approx(expected[name].item(), rel=1e-9)
        assert found["uplift_acceleration"] == pytest.approx(G * math.tan(block.corners[1][1]), rel=1e-12)

    @pytest.mark.slow
    def test_a_strap_that_breaks(self, tmp_path, capsys):
        said = run(capsys, *HELD, "--pga", "0.45g", "--out", tmp_path)
        one = tp.simulate(BLOCK, tp.HousnerImpact(geometry="linear"), pulse(0.45 * G))
        assert re.search(rf"267 N.*5 mm:.*{float(one.rupture_time):.2f} s", said)
        assert re.search(r"0\.0111 rad.*0\.46;", said)
        assert re.search(rf"{int(one.wall_impacts)} impacts.* {float(one.wall_impact_velocity):.3g} rad/s", said)
        assert "overturned forward at " in said

    @pytest.mark.slow
    def test_a_strap_that_holds(self, tmp_path, capsys):
        """The largest force is that at the largest rotation to the front."""
        arguments = [*HELD, "--pga", "0.2g", "--out", tmp_path]
        found = json.loads(run(capsys, *arguments, "--json"))
        assert not found["ruptured"]
        assert found["rupture_time"] is None
        force = 20e3 * max(0.0, 1.75 * found["peak_front"] - 0.005)
        assert found["restraint_force"] == pytest.approx(force, rel=1e-12)
        assert 0.0 < force < 267.0
        assert f"holds, largest force {force:.3g} N" in run(capsys, *arguments)

    def test_leans(self, tmp_path, capsys):
        """Behind a wide gap it ends beyond its balance and has not fallen; the history goes on until it is quiet."""
        motion = -pulse(4.0)
        one = Simulation(tp.Block(0.3, 1.8, wall=tp.Wall(0.4, 1.5)), tp.HousnerImpact(geometry="linear"), motion)
        assert int(one.response.final_state) == -1
        text = "\n".join(one.lines())
        assert re.search("does not overturn:.*leans.*back", text)
        assert not one.cut
        assert float(one.shown.rotation[-1]) == pytest.approx(-0.4 / 1.5, rel=1e-3)

    def test_hangs(self):
        """A strap that is slack up to beyond the balance holds the block there."""
        strap = tp.Restraint.strap(1.75, 1e6, 20e3, 0.35)
        block, law = tp.Block(0.3, 1.8, mass=100.0, restraint=strap), tp.HousnerImpact(geometry="linear")
        response = tp.simulate(block, law, tp.motions.from_array([0.0, 0.0, 0.0], 0.01), theta0=0.201)
        around = around_of(block, law, response)
        assert int(response.final_state) == 1
        assert re.search("does not overturn:.*hangs.*front", around.stands)
        assert around.force == pytest.approx(20e3 * (1.75 * float(response.peak_front) - 0.35), rel=1e-12)

    def test_peaks_are_shares_of_the_angles_of_their_own_corners(self):
        """Let go at 0.05 rad with its centre of mass 5 cm towards the front, a block turns no farther to the front."""
        block, law = tp.Block(0.3, 1.8, cm_offset=0.05), tp.HousnerImpact(geometry="linear")
        response = tp.simulate(block, law, tp.motions.from_array([0.0] * 300, 0.01), theta0=0.05)
        back = float(response.peak_back)
        assert back > 0.01
        share, share_back = 5.0 / math.atan(0.10 / 0.9), 100.0 * back / math.atan(0.20 / 0.9)
        said = f"0.05 rad = {share:.3g} % of α to the front, {back:.4g} rad = {share_back:.3g} % of α to the back"
        assert around_of(block, law, response).peaks == said

    def test_as_placed(self, tmp_path, capsys):
        said = run(capsys, "bookcase-5-shelf", *PULSE, "--placed", "--out", tmp_path)
        assert re.match(r"block: +bookcase-5-shelf,.*wall, 0\.321", said)
        error = run(capsys, *SCENE, "--placed", code=2)
        assert "--placed" in error

    def test_figure(self):
        one = Simulation(BLOCK, tp.HousnerImpact(geometry="linear"), pulse(0.45 * G))
        drawn = one.figure()
        words = [text.get_text() for text in drawn.axes[1].get_legend().get_texts()]
        assert "meets the wall" in words
        assert f"restraint breaks, {float(one.response.rupture_time):.2f} s" in words
        assert faults(drawn) == []


def test_units_of_scenes():
    found = scene_of({"mass": "0.1e3kg", "lean": "0.1rad", "wall_gap": "0mm", "restraint": KIT})
    strap = {"kind": "strap", "height_m": 1.75, "strength_n": 267.0, "stiffness_n_per_mm": 20.0, "slack_mm": 5.0}
    lean = pytest.approx(math.degrees(0.1))
    assert found == {"mass_kg": 100.0, "lean_deg": lean, "wall_gap_mm": 0.0, "restraint": strap}
    assert scene_of({"restraint": "strap,stiffness=20kN/m"})["restraint"]["stiffness_n_per_mm"] == 20.0
    assert scene_of({"mass": None}) == {}
    with pytest.raises(StudyError, match="must be finite"):
        scene_of({"lean": "1e999deg"})


class TestMotions:
    @pytest.mark.parametrize("name", tp.motions.PULSES)
    def test_every_pulse(self, name):
        expected = tp.motions.PULSES[name](amplitude=1.0, omega=2.0 * math.pi / 0.5).sample(1)
        np.testing.assert_array_equal(motion_of(name, period="0.5s"), expected)

    def test_generator_by_seed_and_index(self):
        found = motion_of("kanai-tajimi", 7, 3, ["duration_s=5", "dt_s=0.02", "xi_g = 0.4"])
        expected = tp.motions.KanaiTajimi(duration=5.0, dt=0.02, xi_g=0.4).sample(1, seed=7, first=3)
        np.testing.assert_array_equal(found, expected)
        assert found.motion.item() == "KanaiTajimi 7-3"
        assert found.source.item() == expected.source.item()

    def test_words_need_no_quotes(self):
        found = motion_of("seismological", 0, 0, ["magnitude=6", "distance_m=2e4", "site=flat", "dt_s=0.02"])
        assert "flat" in str(found.source.item())

    def test_one_of_a_file(self, tmp_path):
        both = tp.motions.CloughPenzien(duration=4.0).sample(2)
        for i in range(2):
            tp.motions.write_at2(both[i : i + 1], tmp_path / f"r{i}.AT2")
        found = motion_of(str(tmp_path / "*.AT2"), index=1)
        assert found.motion.item() == "r1"
        with pytest.raises(StudyError, match=r"--index 2: .*AT2 holds 2 motions \(0 to 1\)"):
            motion_of(str(tmp_path / "*.AT2"), index=2)

    def test_a_table_without_step_and_unit(self, tmp_path):
        (tmp_path / "a.csv").write_text("\n".join(["0", "1", "-1", "0.5"] * 5))
        found = motion_of(str(tmp_path / "a.csv"), settings=["dt_s=0.02", "unit=g"])
        assert found.dt.item() == 0.02
        assert float(found.max()) == pytest.approx(G, rel=1e-12)
        with pytest.raises(StudyError, match=r"^[^:]*a\.csv: [^:]*states no unit"):
            motion_of(str(tmp_path / "a.csv"), settings=["dt_s=0.02"])

    def test_floors_of_a_study(self, tmp_path):
        text = (Path(tp.__file__).parent / "studies" / "examples" / "tower.toml").read_text()
        tower = tmp_path / "tower.toml"
        tower.write_text(text.replace("number = 60", "number = 2").replace("[motions]", "[motions]\ndt_s = 0.02"))
        assert motion_of(str(tower), index=2).motion.item().endswith(" 1-0 floor 10")

    def test_factors(self):
        motion = tp.motions.from_array([0.0, 2.0, -4.0, 0.0], 0.1)
        assert factor_of(motion, None, None) == 1.0
        assert factor_of(motion, 1.5, None) == 1.5
        assert factor_of(motion, None, "8m/s2") == 2.0
        run = Simulation(tp.Block(0.4, 1.8), tp.HousnerImpact(), motion, 2.0)
        assert run.pga == 8.0
        assert float(run.response.floor_acceleration.max()) == 4.0


@pytest.mark.parametrize(
    ("text", "units", "value"),
    [
        ("0.4 g", "m s-2", 0.4 * G),
        ("3.9m/s2", "m s-2", 3.9),
        ("3.9 m/s²", "m s-2", 3.9),
        ("390cm/s^2", "m s-2", 3.9),
        ("390 gal", "m s-2", 3.9),
        (" 4e2 mm ", "m", 0.4),
        (".5s", "s", 0.5),
        ("500ms", "s", 0.5),
        ("12deg", "rad", math.radians(12.0)),
    ],
)
def test_quantities(text, units, value):
    assert quantity("--x", text, units) == pytest.approx(value, rel=1e-15)


def test_quantities_that_are_none():
    for text in ("", "g", "0.4.1g", "nan g", "inf", "0x4g", "1e999g", "0g", "--4g", "0.4g g", "4 m"):
        with pytest.raises(StudyError, match="--pga"):
            quantity("--pga", text, "m s-2")


def test_a_bare_number_is_in_si_where_that_is_allowed():
    assert quantity("--width", "0.4", "m", bare=10.0) == 0.4
    assert quantity("--width", "12m", "m", bare=10.0) == 12.0
    with pytest.raises(StudyError, match="say the unit"):
        quantity("--width", "0.4", "m")


def test_refused(refusal):
    refusal()
