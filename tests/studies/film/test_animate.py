"""Films of a rocking block: geometry, times of frames, contents of the files, and no incomplete files."""

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import toppling as tp
from toppling.studies.film import writers as movies
from toppling.studies.film.frames import FLAT, STAYS, corners, frames_of, rigid_fall, rotated
from toppling.studies.film.scene import PALETTE, Scene
from toppling.studies.text.histories import block_of

BLOCK = tp.catalogue["bookcase-5-shelf"]
QUIET = tp.motions.from_array(np.zeros(101), 0.01)
PUSH = tp.motions.OneCycleSine(amplitude=3.0, omega=12.0, dt=0.005, tail=0.5).sample(1)
FELLS = tp.motions.OneCycleSine(amplitude=8.0, omega=6.0, dt=0.005, tail=1.0).sample(1)
SHORT = tp.motions.OneCycleSine(amplitude=5.0, omega=6.0, dt=0.005, tail=0.3).sample(1)


def simulate(motion, **options):
    return tp.simulate(BLOCK, tp.HousnerImpact(), motion, **options)


def read(path):
    """Return the frames as RGB, and the time that each frame is shown, s."""
    with Image.open(path) as film:
        frames, shown = [], []
        for i in range(film.n_frames):
            film.seek(i)
            frames.append(np.asarray(film.convert("RGB")))
            shown.append(film.info["duration"] / 1000.0)
    return frames, shown


class TestGeometry:
    @pytest.mark.parametrize("theta", [0.0, 0.1, BLOCK.alpha, 1.0, FLAT])
    def test_to_the_right(self, theta):
        """The right corner stays; the top corner above it stands at height H cos θ, H sin θ to its right."""
        (_, _), right, top, (_, _) = corners(BLOCK, theta, floor=0.3)
        np.testing.assert_allclose(right, [0.3 + BLOCK.b, 0.0], atol=1e-15)
        expected = [0.3 + BLOCK.b + BLOCK.height * math.sin(theta), BLOCK.height * math.cos(theta)]
        np.testing.assert_allclose(top, expected, atol=1e-15)
        left = corners(BLOCK, theta, floor=0.3)[0]
        np.testing.assert_allclose(left, right - BLOCK.width * np.array([math.cos(theta), -math.sin(theta)]))
        assert corners(BLOCK, theta)[:, 1].min() >= -1e-15

    @pytest.mark.parametrize("theta", [0.05, 0.9, FLAT])
    def test_to_the_left_is_the_mirror_image(self, theta):
        mirrored = corners(BLOCK, -theta)[[1, 0, 3, 2]] * [-1.0, 1.0]
        np.testing.assert_allclose(mirrored, corners(BLOCK, theta), atol=1e-15)

    def test_centre_of_mass_is_highest_at_alpha(self):
        """The centre of mass is at the distance R from the pivot, and vertically above it at θ = α."""
        centre = np.array([[0.0, BLOCK.h]])
        x, y = rotated(BLOCK, BLOCK.alpha, 0.0, centre)[0]
        assert x == pytest.approx(BLOCK.b, abs=1e-15)
        assert y == pytest.approx(BLOCK.R, rel=1e-14)
        assert rotated(BLOCK, -FLAT, 0.0, centre)[0] == pytest.approx([-BLOCK.b - BLOCK.h, BLOCK.b])

    def test_floor_to_the_right_block_to_the_left(self):
        """A floor that starts to the right leaves the block's top behind."""
        run = tp.simulate(BLOCK, tp.HousnerImpact(), tp.motions.HalfSine(amplitude=4.0, omega=8.0).sample(1))
        frames = frames_of(run)
        i = int(np.flatnonzero(frames.rotation)[0])
        assert frames.displacement[i] > 0.0
        assert corners(BLOCK, frames.rotation[i])[3, 0] < -BLOCK.b

    def test_block_of_a_run(self):
        block = tp.Block(0.4, 1.6, cm_height=0.6, inertia_factor=1.4, name="low")
        assert block_of(tp.simulate(block, tp.HousnerImpact(), QUIET)) == block


class TestMoments:
    def test_real_time(self):
        run = simulate(PUSH)
        frames = frames_of(run)
        assert frames.fps == 25
        np.testing.assert_allclose(np.diff(frames.time), 0.04, rtol=1e-12)
        assert frames.time[-1] <= float(run.time[-1]) < frames.time[-1] + 0.04
        assert not frames.drawn.any()

    def test_rotation_and_floor_are_the_runs_own(self):
        """At samples the film has the engine's rotation, and the displacement of a sine in closed form."""
        run = simulate(PUSH)
        frames = frames_of(run, fps=50)
        np.testing.assert_allclose(frames.rotation, run.rotation.interp(time=frames.time), atol=1e-15)
        during = frames.time < 2.0 * math.pi / 12.0
        t = frames.time[during]
        closed = 3.0 / 12.0 * t - 3.0 / 144.0 * np.sin(12.0 * t)
        np.testing.assert_allclose(frames.displacement[during], closed, atol=3.0 * 0.005**2 * 12.0**2 / 8.0 * 0.1)

    def test_slow_motion(self):
        fast, slow = frames_of(simulate(PUSH)), frames_of(simulate(PUSH), speed=0.25)
        assert slow.time.size == pytest.approx(4 * fast.time.size, abs=4)
        np.testing.assert_allclose(np.diff(slow.time), 0.01, rtol=1e-9)

    def test_overturned_and_stays(self):
        run = simulate(FELLS, theta0=0.0)
        frames = frames_of(run)
        assert bool(run.overturned)
        assert abs(frames.rotation[-1]) == FLAT
        lies = frames.time >= float(run.overturning_time) + float(run.time[1])
        assert (np.abs(frames.rotation[lies]) == FLAT).all()
        assert frames.time[-1] == pytest.approx(float(run.overturning_time) + STAYS, abs=0.05)

    def test_overturning_at_the_first_sample(self):
        frames = frames_of(simulate(QUIET, theta0=-1.55, omega0=-10.0))
        assert frames.rotation[0] == -1.55
        assert (frames.rotation[1:] == -FLAT).all()
        assert frames.time.size == 51

    def test_a_fall_after_the_record_is_drawn(self):
        run = simulate(SHORT)
        end = float(run.time[-1])
        assert bool(run.overturned)
        assert abs(float(run.rotation[-1])) < FLAT
        frames = frames_of(run)
        assert (frames.drawn == (frames.time > end)).all()
        assert abs(frames.rotation[-1]) == FLAT
        # Housner's exact law without shaking is the fall that is drawn
        falls = frames.time[np.argmax(np.abs(frames.rotation) >= FLAT)]
        assert falls == pytest.approx(float(run.overturning_time), abs=0.041)
        # the floor keeps its velocity, which is zero here
        np.testing.assert_allclose(frames.displacement[frames.drawn], frames.displacement[~frames.drawn][-1], atol=1e-9)

    def test_drawn_fall_keeps_its_energy(self):
        """Energy gives ω² = ω0² + 2 p² [cos(θ0 − α) − cos(θ − α)], and the integral of 1/ω the time of the fall."""
        alpha, p = BLOCK.alpha, BLOCK.p
        theta0, omega0 = 1.2 * alpha, 0.1
        fall = rigid_fall(-theta0, -omega0, BLOCK)
        assert fall[-1] == -FLAT
        theta = np.linspace(theta0, FLAT, 200_001)
        omega = np.sqrt(omega0**2 + 2.0 * p**2 * (math.cos(theta0 - alpha) - np.cos(theta - alpha)))
        taken = np.trapezoid(1.0 / omega, theta)
        assert 1e-3 * (fall.size - 1) == pytest.approx(taken, abs=1.1e-3)

    def test_no_fall_where_it_turns_back(self):
        assert rigid_fall(0.5 * BLOCK.alpha, 0.01, BLOCK) is None
        assert rigid_fall(0.5 * BLOCK.alpha, -1.0, BLOCK) is None
        assert rigid_fall(BLOCK.alpha, 0.0, BLOCK) is None

    def test_velocity_that_a_record_leaves_goes_on(self):
        motion = tp.motions.from_array([0.0, 60.0, 60.0, 0.0], 0.05)
        run = simulate(motion)
        frames = frames_of(run)
        assert frames.drawn.any()
        np.testing.assert_allclose(np.diff(frames.displacement[frames.drawn]), 6.0 * 0.04, rtol=1e-9)

    def test_long_films_have_fewer_frames(self):
        # (60 s of frames from 0.1 s steps; more than 1,500 of them at 25 a second)
        assert frames_of(simulate(tp.motions.from_array(np.zeros(1000), 0.1))).fps == 10
        with pytest.raises(ValueError, match="at most 1200 s long, got 2000 s"):
            frames_of(simulate(tp.motions.from_array(np.zeros(20_001), 0.1)))


class TestScene:
    def test_the_block_is_drawn_to_scale_where_it_is(self):
        """The outline in pixels has its pivot on the floor's line, and the block's ratio of height to width."""
        run = simulate(FELLS)
        frames = frames_of(run)
        scene = Scene(run, BLOCK, frames, 480)
        for i in (0, int(np.argmax(np.abs(frames.rotation) > 0.5 * BLOCK.alpha)), frames.time.size - 1):
            scene.frame(i)
            outline = scene._stage_ax.transData.transform(scene._body.get_xy()[:4])
            floor = scene._stage_ax.transData.transform([[0.0, 0.0]])[0, 1]
            pivot = 1 if frames.rotation[i] > 0.0 else 0
            assert outline[pivot, 1] == pytest.approx(floor, abs=1e-6)
            sides = np.linalg.norm(outline[1] - outline[0]), np.linalg.norm(outline[2] - outline[1])
            assert sides[1] / sides[0] == pytest.approx(BLOCK.height / BLOCK.width, rel=1e-9)
            # all of it on the stage
            box = scene._stage_ax.get_window_extent()
            assert box.x0 <= outline[:, 0].min()
            assert outline[:, 0].max() <= box.x1
            assert outline[:, 1].max() <= box.y1
        scene.close()

    @pytest.mark.parametrize("law", [tp.HousnerImpact(), tp.DiscreteDamping(e=0.9)])
    def test_words(self, law):
        run = tp.simulate(BLOCK, law, SHORT)
        frames = frames_of(run)
        scene = Scene(run, BLOCK, frames, 240)
        words = list(dict.fromkeys(scene._state_text(i) for i in range(frames.time.size)))
        states = ["stands", "rocks", "past its balance", "record over", "overturned"]
        assert [text.partition(":")[0] for text in words] == states

    def test_elastic_zone_is_standing(self):
        shake = tp.motions.scale_to(tp.motions.CloughPenzien(duration=4.0, dt=0.01).sample(1), 0.5)
        run = tp.simulate(BLOCK, tp.DiscreteDamping(e=0.9), shake)
        frames = frames_of(run)
        assert 0.0 < np.abs(frames.rotation).max() < 0.05 * BLOCK.alpha
        scene = Scene(run, BLOCK, frames, 240)
        assert {scene._state_text(i) for i in range(frames.time.size)} == {"stands"}

    def test_the_view_goes_with_a_floor_that_drifts(self):
        drift = tp.motions.HalfSine(amplitude=1.0, omega=2.0, dt=0.01, tail=6.0).sample(1)
        run = simulate(drift)
        scene = Scene(run, BLOCK, frames_of(run), 240)
        scene.frame(150)
        assert "view moves" in scene._moved.get_text()
        assert scene._body.get_xy()[:, 0].mean() == pytest.approx(0.0, abs=0.2)

    def test_no_words_beyond_the_frame_or_on_each_other(self):
        block = tp.Block(0.3, 1.5, name="a name of a block that is far too long for any figure of this size")
        run = tp.simulate(block, tp.DiscreteDamping(e=0.9, rest="rigid", lever="R"), SHORT)
        frames = frames_of(run, speed=0.25)
        scene = Scene(run, block, frames, 480)
        for i in (0, int(np.flatnonzero(frames.drawn)[0]), frames.time.size - 1):
            scene.frame(i)
            texts = [*scene._figure.texts, *scene._stage_ax.texts]
            boxes = [text.get_window_extent(scene._canvas.get_renderer()) for text in texts if text.get_text()]
            for k, box in enumerate(boxes):
                assert box.x0 >= 0.0
                assert box.x1 <= 480.0
                assert not any(box.overlaps(other) for other in boxes[:k])


class TestFiles:
    def test_gif(self, tmp_path):
        """The file has one frame for each time, of the right duration, with the drawn pixels except for the palette."""
        run = simulate(PUSH)
        frames = frames_of(run, fps=10)
        steps = []
        path = tp.animate(run, tmp_path / "film.gif", fps=10, size=240, progress=lambda *step: steps.append(step))
        found, shown = read(path)
        assert len(found) == frames.time.size
        assert shown == [0.1] * len(found)
        assert steps == [(i + 1, len(found)) for i in range(len(found))]
        scene = Scene(run, BLOCK, frames, 240)
        off = [np.abs(scene.frame(i).astype(int) - found[i]) for i in range(len(found))]
        # (where three colours meet at the edge of the marker, a few pixels have none between two)
        assert max((one.max(axis=2) > 40).sum() for one in off) < 10
        assert max(one.mean() for one in off) < 0.6
        assert [one.name for one in tmp_path.iterdir()] == ["film.gif"]

    def test_same_bytes_again(self, tmp_path):
        run = simulate(PUSH)
        first, second = (tp.animate(run, tmp_path / name, fps=5, size=240).read_bytes() for name in ("a.gif", "b.gif"))
        assert first == second

    @pytest.mark.parametrize("colours", [1, 2, 5, 64, 127, 128, 255])
    def test_a_gif_holds_what_it_is_given(self, tmp_path, colours):
        """Random pixels of the palette, partly changed from frame to frame, are read back exactly."""
        random = np.random.default_rng(colours)
        # (the colours are far apart, since Pillow finds the nearest colour on a grid)
        table = np.array([r << 16 | g << 8 | b for r in range(8) for g in range(8) for b in range(8)]) * 32
        table = random.permutation(table)[:colours]
        palette = [f"#{one:06x}" for one in table]
        rgb = np.stack([table >> 16, table >> 8 & 255, table & 255], axis=1).astype(np.uint8)
        pictures = [rgb[random.integers(colours, size=(40, 60))]]
        for _ in range(4):
            then = pictures[-1].copy()
            y, x = random.integers(30), random.integers(40)
            then[y : y + 8, x : x + 15] = rgb[random.integers(colours, size=(8, 15))]
            pictures.append(then)
        pictures.append(pictures[-1])  # nothing moves
        with movies.film(tmp_path / "x.gif", 25, (60, 40), palette) as film:
            for picture in pictures:
                film.add(picture)
        found, shown = read(tmp_path / "x.gif")
        assert len(found) == len(pictures)
        for one, other in zip(found, pictures, strict=True):
            np.testing.assert_array_equal(one, other)
        assert shown == [0.04] * len(pictures)

    @pytest.mark.parametrize("colours", [0, 256])
    def test_too_many_colours(self, tmp_path, colours):
        wrong = pytest.raises(ValueError, match=f"colours must be 1 to 255, got {colours}")
        with wrong, movies.film(tmp_path / "x.gif", 25, (60, 40), ["#000000"] * colours):
            pass
        assert list(tmp_path.iterdir()) == []

    def test_palette(self):
        assert len(PALETTE) <= 128
        assert len(set(PALETTE)) == len(PALETTE)

    @pytest.mark.slow
    @pytest.mark.skipif(movies.ffmpeg() is None, reason="ffmpeg is not on the PATH")
    def test_mp4(self, tmp_path):
        run = simulate(PUSH)
        path = tp.animate(run, tmp_path / "film.mp4", fps=10, size=240)
        assert path.read_bytes()[4:8] == b"ftyp"
        assert [one.name for one in tmp_path.iterdir()] == ["film.mp4"]
        probe = shutil.which("ffprobe")
        if probe is not None:
            entries = ["-count_frames", "-show_entries", "stream=nb_read_frames,width,r_frame_rate"]
            said = subprocess.run(
                [probe, "-v", "error", *entries, "-of", "csv=p=0", path], capture_output=True, text=True, check=True
            ).stdout
            assert said.strip() == f"240,10/1,{frames_of(run, fps=10).time.size}"

    def test_mp4_without_ffmpeg(self, tmp_path, monkeypatch):
        monkeypatch.setenv("PATH", str(tmp_path))
        with pytest.raises(OSError, match="ffmpeg is not on the PATH"):
            tp.animate(simulate(QUIET), tmp_path / "film.mp4")
        assert list(tmp_path.iterdir()) == []

    def test_ffmpeg_that_fails(self, tmp_path, monkeypatch):
        (tmp_path / "bin").mkdir()
        program = tmp_path / "bin" / "ffmpeg"
        program.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 3\n")
        program.chmod(0o755)
        monkeypatch.setenv("PATH", str(program.parent))
        with pytest.raises(OSError, match="ffmpeg failed: Unknown encoder"):
            tp.animate(simulate(QUIET), tmp_path / "film.mp4", fps=5)
        assert [one.name for one in tmp_path.iterdir()] == ["bin"]

    @pytest.mark.parametrize("name", ["film.gif", "film.mp4"])
    def test_interrupted(self, tmp_path, name):
        """No incomplete file is left, and an existing file stays."""
        if name.endswith("mp4") and movies.ffmpeg() is None:
            pytest.skip("ffmpeg is not on the PATH")
        path = tmp_path / name
        path.write_bytes(b"before")

        def interrupt(done, total):
            if done == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            tp.animate(simulate(PUSH), path, size=240, progress=interrupt)
        assert path.read_bytes() == b"before"
        assert [one.name for one in tmp_path.iterdir()] == [name]

    def test_nowhere_to_write(self, tmp_path):
        for name in ("film.gif", *(["film.mp4"] if movies.ffmpeg() else [])):
            with pytest.raises(FileNotFoundError):
                tp.animate(simulate(QUIET), tmp_path / "none" / name)

    @pytest.mark.parametrize(
        ("path", "options", "message"),
        [
            ("film.avi", {}, "must end in .gif or .mp4, got 'film.avi'"),
            ("film.gif", {"size": 100}, "size must be at least 240"),
            ("film.gif", {"size": 301}, "size must be even and at most 2000 pixels, got 301"),
            ("film.gif", {"fps": 24}, "fps must be one of"),
        ],
    )
    def test_wrong_values(self, tmp_path, path, options, message):
        with pytest.raises(ValueError, match=message):
            tp.animate(simulate(QUIET), tmp_path / path, **options)
        with pytest.raises(TypeError, match="path must be a path"):
            tp.animate(simulate(QUIET), 3)
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("theta0", [0.15, -0.15])
    def test_block_is_seen_on_its_side_of_the_frame(self, tmp_path, theta0):
        """Read back from the file: the middle of the block's colour lies where its centre of mass is."""
        run = simulate(QUIET, theta0=theta0)
        found, _ = read(tp.animate(run, tmp_path / "film.gif", fps=5))
        above = np.arange(480)[:, None] < 300
        face = (np.abs(found[0].astype(int) - [0xCC, 0xE3, 0xF0]).sum(axis=2) < 12) & above
        assert face.sum() > 2000
        scene = Scene(run, BLOCK, frames_of(run, fps=5), 480)
        centre = scene._stage_ax.transData.transform(rotated(BLOCK, theta0, 0.0, np.array([[0.0, BLOCK.h]])))[0]
        y, x = (one.mean() for one in np.nonzero(face))
        assert x + 0.5 == pytest.approx(centre[0], abs=0.5)
        assert 480.0 - y - 0.5 == pytest.approx(centre[1], abs=0.5)
        upright = scene._stage_ax.transData.transform([[0.0, 0.0]])[0, 0]
        assert np.sign(x - upright) == np.sign(theta0)


@pytest.mark.slow
def test_lazy():
    """The drawing of films loads slowly, so that it is imported only when a film is asked for."""
    import sys

    code = "import toppling, sys; assert 'PIL' not in sys.modules; toppling.animate; assert 'PIL' in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(tp.__file__).parents[1])
    assert isinstance(simulate(QUIET), xr.Dataset)


def test_refused(refusal):
    refusal()
