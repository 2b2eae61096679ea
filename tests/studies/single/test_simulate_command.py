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
from toppling.studies.film import writers as movies
from toppling.studies.single.inputs import factor_of, motion_of
from toppling.studies.single.run import Simulation

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
        assert found["block"]["width"] == 0.4
        assert found["block"]["name"] is None
        assert found["motion"]["factor"] == 1.0
        assert found["overturned"] is False
        assert found["overturning_time"] is None
        assert found["uplift_acceleration"] == pytest.approx(G * 0.4 / 1.8, rel=1e-12)
        assert found["friction"]["uplift"] == pytest.approx(0.4 / 1.8, rel=1e-12)
        assert found["model"] == {
            "law": "housner",
            "e": pytest.approx(tp.Block(0.4, 1.8).restitution),
            "geometry": "exact",
            "lever": "h",
            "restitution_factor": 1.0,
            "label": "housner e=e_R",
        }
        assert [Path(one).name for one in found["files"]] == ["history.csv", "history.png"]
        assert all(Path(one).is_file() for one in found["files"])

    @pytest.mark.parametrize(("factor", "doubted"), [(34.0, False), (350.0, True)])
    def test_a_peak_beyond_any_shaking_is_doubted(self, factor, doubted):
        """3.4 and 35 g, of a pulse of 1 m/s²; 35 was meant per cent."""
        one = Simulation(tp.Block(0.3, 1.8), tp.HousnerImpact(), motion_of("ricker", period="1s"), factor)
        found = [note for note in one.notes if "beyond any shaking" in note]
        meant = "g written where m/s² is meant, or per cent of g?"
        assert [note.partition(" shaking: ")[2] for note in found] == [meant] * doubted

    @pytest.mark.slow
    def test_overturned_after_the_record(self, tmp_path, capsys):
        """The history continues without shaking until the block lies on its side."""
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
        """The figure shows block, scale and PGA, the shaking, and the times of the last balance and of lying flat."""
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
        arguments = ["bookcase-5-shelf", "half-sine", "--period", "0.4s", "--out", tmp_path]
        run(capsys, *arguments)
        assert sorted(one.name for one in tmp_path.iterdir()) == ["history.csv", "history.png", "notes.txt"]

    @pytest.mark.slow
    def test_film(self, tmp_path, capsys, monkeypatch):
        """Without ffmpeg only the GIF is written, and a note says so."""
        monkeypatch.setattr(movies, "ffmpeg", lambda: None)
        arguments = ["bookcase-5-shelf", "half-sine", "--period", "0.8s", "--pga", "0.2g", "--set", "tail_s=0.4"]
        assert main(["simulate", *arguments, "--animate", "--out", str(tmp_path)]) == 0
        said = capsys.readouterr()
        assert "no ffmpeg" in said.err
        assert "animation.gif: 100 %" in said.err
        assert f"written: {tmp_path / 'animation.gif'}" in said.out
        assert sorted(one.name for one in tmp_path.iterdir()) == ["animation.gif", "history.csv", "history.png"]
        with Image.open(tmp_path / "animation.gif") as film:
            assert film.n_frames == 21

    @pytest.mark.slow
    def test_a_long_film_says_beforehand_how_long_it_takes(self, tmp_path, capsys, monkeypatch):
        from toppling.studies.film import animate

        def drawn(response, path, **options):
            return path

        monkeypatch.setattr(animate, "animate", drawn)
        monkeypatch.setattr(movies, "ffmpeg", lambda: "ffmpeg")
        arguments = ["bookcase-5-shelf", "half-sine", "--period", "0.8s", "--pga", "0.2g", "--animate"]
        for tail, said in (("60", "1,209 frames each, some 44 s\n"), ("0.4", "")):
            assert main(["simulate", *arguments, "--set", f"tail_s={tail}", "--out", str(tmp_path)]) == 0
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
        from toppling.studies.film.scene import Scene

        def interrupt(self, i):
            raise KeyboardInterrupt

        monkeypatch.setattr(Scene, "frame", interrupt)
        monkeypatch.setattr(movies, "ffmpeg", lambda: "ffmpeg")  # (without one there is a note more)
        said = run(capsys, "bookcase-5-shelf", "kanai-tajimi", *SHORT, "--animate", "--out", tmp_path, code=130)
        assert said.startswith("toppling: interrupted: animation.gif")
        assert sorted(one.name for one in tmp_path.iterdir()) == ["history.csv", "history.png"]

    @pytest.mark.slow
    def test_nothing_shakes(self, tmp_path, capsys):
        (tmp_path / "quiet.csv").write_text(
            "time (s),acceleration (g)\n" + "\n".join(f"{0.01 * i:.2f},0" for i in range(50))
        )
        found = json.loads(run(capsys, "bookcase-5-shelf", tmp_path / "quiet.csv", "--json", "--out", tmp_path / "out"))
        assert found["peak_rotation"] == 0.0
        assert found["uplifted"] is False
        assert found["friction"] == {}
        error = run(capsys, "bookcase-5-shelf", tmp_path / "quiet.csv", "--pga", "0.1g", code=2)
        assert error.startswith("toppling: --pga: ")

    def test_notes(self, tmp_path, capsys):
        """A squat block, far scaling of a record, an elastic mode in the band: each has a note of one sentence."""
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

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ([], "which MOTION? A record file, or the name of a generator such as site-based-scenario"),
            (["bookcase-5-shelf"], "which MOTION?"),
            (["clough-penzien", "--width", "0.4"], "which block? A name of `toppling catalogue`, or --width"),
            (["bookcase-5-shelve", "clough-penzien"], "nearest: bookcase-5-shelf"),
            (["bookcase-5-shelf", "clough-penzien", "--height", "2m"], "a block is a catalogue name or sizes, got"),
            (["bookcase-5-shelf", "clough-penzian"], "did you mean 'clough-penzien'?"),
            (["bookcase-5-shelf", "none.AT2"], "no file matches 'none.AT2'"),
            (["bookcase-5-shelf", "clough-penzien", "--pga", "0.4"], "--pga 0.4: say the unit, such as 0.4g or 3.9"),
            (["bookcase-5-shelf", "clough-penzien", "--pga", "0.4G"], "got 'G'; did you mean 0.4g?"),
            (["bookcase-5-shelf", "clough-penzien", "--pga", "0,4g"], "(a decimal point, no comma)"),
            (["bookcase-5-shelf", "clough-penzien", "--pga=-1g"], "--pga -1g: must be finite and > 0"),
            (["bookcase-5-shelf", "clough-penzien", "--pga", "1g", "--scale", "2"], "give --scale or --pga, not both"),
            (["bookcase-5-shelf", "clough-penzien", "--scale", "nan"], "--scale must be finite and > 0, got nan"),
            (["--width", "45", "--height", "2", "ricker"], "45: a number alone is in m, up to 10 (beyond that 45m)"),
            (["--width", "45", "--height", "2", "ricker"], "; did you mean 0.45 (45cm)?"),
            (["--width", "0.4", "--height", "1800", "ricker"], "did you mean 1.8 (1800mm)?"),
            (["--width", "40km", "--height", "2m", "ricker"], "--width 40km: unit must be one of m, cm, mm, got 'km'"),
            (["bookcase-5-shelf", "clough-penzien", "--law", "discreet"], "did you mean 'discrete'?"),
            (["bookcase-5-shelf", "clough-penzien", "--delta", "0.1"], "unknown key 'delta'"),
            (["bookcase-5-shelf", "clough-penzien", "--e", "1.5"], "--law housner: e: must be > 0 and <= 1"),
            (["bookcase-5-shelf", "clough-penzien", "--law", "viscous"], "key 'zeta' is missing"),
            (["--width", "2m", "--height", "1m", "clough-penzien"], "so squat a block needs an explicit e"),
            (["bookcase-5-shelf", "ricker"], "pulse 'ricker' needs its --period, such as 0.5s"),
            (["bookcase-5-shelf", "ricker", "--period", "2"], "--period 2: say the unit, such as 0.5s"),
            (["bookcase-5-shelf", "ricker", "--period", "1s", "--seed", "1"], "--seed belongs to generators"),
            (["bookcase-5-shelf", "clough-penzien", "--period", "1s"], "--period belongs to pulses"),
            (["bookcase-5-shelf", "ricker", "--period", "1s", "--index", "1"], "ricker holds 1 motion (0 only)"),
            (["bookcase-5-shelf", "clough-penzien", "--index", "-1"], "--index must be 0 or more, got -1"),
            (["bookcase-5-shelf", "clough-penzien", "--seed", "-1"], "seed"),
            (["bookcase-5-shelf", "clough-penzien", "--seed", "1.5"], "--seed: must be a whole number, got '1.5'"),
            (["bookcase-5-shelf", "clough-penzien", "--index", "0.4"], "--index: must be a whole number, got '0.4'"),
            (["bookcase-5-shelf", "Ricker", "--period", "1s"], "did you mean 'ricker'?"),
            (["bookcase-5-shelf", "ac156"], "s_ds"),
            (["bookcase-5-shelf", "clough-penzien", "--set", "duration=20"], "did you mean 'duration_s'?"),
            (["bookcase-5-shelf", "clough-penzien", "--set", "duration_s"], "must be key=value"),
            (["bookcase-5-shelf", "clough-penzien", "--set", "duration_s=-1"], "duration_s: must be"),
            (["bookcase-5-shelf", "clough-penzien", "--set", "seed=3"], "is said by MOTION, --seed and --index"),
            (["bookcase-5-shelf", "study.toml"], "study.toml: no such file"),
            (["bookcase-5-shelf", "clough-penzien", "--out", "noise.txt/out"], "cannot be written"),
            (["bookcase-5-shelf", "noise.txt"], "noise.txt"),
            (["bookcase-5-shelf", "noise.txt", "--set", "xi_g=0.5"], "--set xi_g: belongs to generators and pulses"),
            (["bookcase-5-shelf", "ricker", "--period", "1s", "--animate", "--speed", "0"], "--speed 0: speed must be"),
            (["bookcase-5-shelf", "clough-penzien", "--speeed", "1"], "--speed"),
        ],
    )  # fmt: skip
    def test_errors_are_one_sentence(self, tmp_path, monkeypatch, capsys, arguments, message):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(movies, "ffmpeg", lambda: "ffmpeg")  # (without one there is a note more)
        Path("noise.txt").write_text("nothing of use\n")
        error = run(capsys, *arguments, code=2)
        assert message in error
        assert error.startswith("toppling: ")
        assert error.count("\n") == 1


class TestMotions:
    @pytest.mark.parametrize("name", tp.motions.PULSES)
    def test_every_pulse(self, name):
        found = motion_of(name, period="0.5s")
        expected = tp.motions.PULSES[name](amplitude=1.0, omega=2.0 * math.pi / 0.5).sample(1)
        np.testing.assert_array_equal(found, expected)

    def test_generator_by_seed_and_index(self):
        """The motion depends on (seed, index) alone, not on the motions before it."""
        found = motion_of("kanai-tajimi", 7, 3, ["duration_s=5", "dt_s=0.02", "xi_g = 0.4"])
        expected = tp.motions.KanaiTajimi(duration=5.0, dt=0.02, xi_g=0.4).sample(1, seed=7, first=3)
        np.testing.assert_array_equal(found, expected)
        assert found.motion.item() == "KanaiTajimi 7-3"
        assert found.source.item() == expected.source.item()

    def test_words_need_no_quotes(self):
        settings = ["magnitude=6", "distance_m=2e4", "site=flat", "dt_s=0.02"]
        found = motion_of("seismological", 0, 0, settings)
        assert "flat" in str(found.source.item())

    def test_one_of_a_file(self, tmp_path):
        both = tp.motions.CloughPenzien(duration=4.0).sample(2)
        for i in range(2):
            tp.motions.write_at2(both[i : i + 1], tmp_path / f"r{i}.AT2")
        found = motion_of(str(tmp_path / "*.AT2"), index=1)
        assert found.motion.item() == "r1"
        with pytest.raises(StudyError, match=r"--index 2: .*AT2 holds 2 motions \(0 to 1\)"):
            motion_of(str(tmp_path / "*.AT2"), index=2)

    def test_a_key_twice(self):
        with pytest.raises(StudyError, match="--set duration_s: must be given once"):
            motion_of("clough-penzien", settings=["duration_s=5", "dt_s=0.01", "duration_s=6"])
        with pytest.raises(StudyError, match="give --period or --set omega_rad_s, not both"):
            motion_of("ricker", settings=["omega_rad_s=3"], period="1s")

    def test_a_table_without_step_and_unit(self, tmp_path):
        (tmp_path / "a.csv").write_text("\n".join(["0", "1", "-1", "0.5"] * 5))
        found = motion_of(str(tmp_path / "a.csv"), settings=["dt_s=0.02", "unit=g"])
        assert found.dt.item() == 0.02
        assert float(found.max()) == pytest.approx(G, rel=1e-12)
        with pytest.raises(StudyError, match=r"^[^:]*a\.csv: [^:]*states no unit"):
            motion_of(str(tmp_path / "a.csv"), settings=["dt_s=0.02"])

    def test_floors_of_a_study(self, tmp_path):
        """The motions of a study file pass through its building, floor after floor."""
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


class TestQuantities:
    @pytest.mark.parametrize(
        ("text", "units", "value"),
        [
            ("0.4g", "m s-2", 0.4 * G),
            ("0.4 g", "m s-2", 0.4 * G),
            ("3.9m/s2", "m s-2", 3.9),
            ("3.9 m/s²", "m s-2", 3.9),
            ("390cm/s^2", "m s-2", 3.9),
            ("390 gal", "m s-2", 3.9),
            ("40cm", "m", 0.4),
            (" 4e2 mm ", "m", 0.4),
            (".5s", "s", 0.5),
            ("500ms", "s", 0.5),
            ("12deg", "rad", math.radians(12.0)),
        ],
    )
    def test_read(self, text, units, value):
        assert quantity("--x", text, units) == pytest.approx(value, rel=1e-15)

    @pytest.mark.parametrize(
        "text", ["", "g", "0.4.1g", "nan g", "inf", "0x4g", "1e999g", "0g", "--4g", "0.4g g", "4 m"]
    )
    def test_refused(self, text):
        with pytest.raises(StudyError, match="--pga"):
            quantity("--pga", text, "m s-2")

    def test_a_bare_number_is_in_si_where_that_is_allowed(self):
        assert quantity("--width", "0.4", "m", bare=10.0) == 0.4
        assert quantity("--width", "12m", "m", bare=10.0) == 12.0
        with pytest.raises(StudyError, match="say the unit"):
            quantity("--width", "0.4", "m")
