"""`toppling simulate` with walls, restraints, offset and lean: read from the command line, and what is said of them."""

import json
import math
import re

import pytest
from plot_cases import faults

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.single.inputs import scene_of
from toppling.studies.single.run import Simulation, around_of

SIZES = ["--width", "30cm", "--height", "1.8m"]
PULSE = ["one-cycle-sine", "--period", "1s", "--set", "dt_s=0.005"]
KIT = "strap,height=1.75m,strength=267N,stiffness=20N/mm,slack=5mm"
STRAP = tp.Restraint.strap(1.75, 267.0, 20e3, 0.005)


def run(capsys, *arguments, code=0):
    assert main(["simulate", *map(str, arguments)]) == code
    said = capsys.readouterr()
    return said.out if code == 0 else said.err


def pulse(pga):
    motion = tp.motions.OneCycleSine(amplitude=1.0, omega=2.0 * math.pi, dt=0.005).sample(1)
    return tp.motions.scale_to(motion, pga)


class TestCommand:
    def test_the_scene_is_that_of_the_study_file(self, tmp_path, capsys):
        """Every option becomes the block that its key of a study file makes."""
        scene = ["--wall-gap", "20mm", "--wall-restitution", 0.3, "--front-gap", "40cm", "--mass", "100kg"]
        more = ["--cm-offset", "-10mm", "--lean", "-0.5deg", "--restraint", KIT, "--geometry", "linear"]
        said = run(capsys, *SIZES, *PULSE, *scene, *more, "--pga", "0.3g", "--json", "--out", tmp_path)
        block = tp.Block(
            0.3,
            1.8,
            mass=100.0,
            cm_offset=-0.01,
            lean=math.radians(-0.5),
            wall=tp.Wall(0.02, restitution=0.3, front_gap=0.4),
            restraint=STRAP,
        )
        expected = tp.simulate(block, tp.HousnerImpact(geometry="linear"), pulse(0.3 * G))
        found = json.loads(said)
        assert found["block"]["wall"]["front_gap"] == pytest.approx(0.4, rel=1e-15)
        assert found["block"]["restraint"]["kind"] == "strap"
        for name in ("peak_front", "peak_back", "wall_impacts", "final_state", "ruptured"):
            assert found[name] == pytest.approx(expected[name].item(), rel=1e-9)
        assert found["uplift_acceleration"] == pytest.approx(G * math.tan(block.corners[1][1]), rel=1e-12)

    @pytest.mark.slow
    def test_a_strap_that_breaks(self, tmp_path, capsys):
        kit = ["--wall-gap", "20mm", "--mass", "100kg", "--restraint", KIT, "--geometry", "linear"]
        said = run(capsys, *SIZES, *PULSE, *kit, "--pga", "0.45g", "--out", tmp_path)
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02), restraint=STRAP)
        one = tp.simulate(block, tp.HousnerImpact(geometry="linear"), pulse(0.45 * G))
        assert re.search(rf"267 N.*5 mm:.*{float(one.rupture_time):.2f} s", said)
        assert re.search(r"0\.0111 rad.*0\.46;", said)
        assert re.search(rf"{int(one.wall_impacts)} impacts.* {float(one.wall_impact_velocity):.3g} rad/s", said)
        assert "overturned forward at " in said

    @pytest.mark.slow
    def test_a_strap_that_holds(self, tmp_path, capsys):
        """The largest force is that at the largest rotation to the front."""
        kit = ["--wall-gap", "20mm", "--mass", "100kg", "--restraint", KIT, "--geometry", "linear"]
        arguments = [*SIZES, *PULSE, *kit, "--pga", "0.2g", "--out", tmp_path]
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
        error = run(capsys, *SIZES, *PULSE, "--placed", code=2)
        assert "--placed" in error

    def test_figure(self):
        """Walls and the rupture are in the figure, and no text covers another."""
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02), restraint=STRAP)
        one = Simulation(block, tp.HousnerImpact(geometry="linear"), pulse(0.45 * G))
        drawn = one.figure()
        words = [text.get_text() for text in drawn.axes[1].get_legend().get_texts()]
        assert "meets the wall" in words
        assert f"restraint breaks, {float(one.response.rupture_time):.2f} s" in words
        assert faults(drawn) == []

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--wall-gap", "20"], "--wall-gap 20: say the unit, such as 0.4m or 40cm"),
            (["--wall-gap", "-1mm"], "wall-gap"),
            (["--wall-restitution", "0.5"], "wall_restitution needs wall_gap_mm: there is no wall"),
            (["--restraint", "stripe,height=1m"], "--restraint stripe: must be one of strap, bracket"),
            (["--restraint", "strap,hight=1m"], "--restraint hight: must be one of height, strength"),
            (["--restraint", "strap,height"], "--restraint height: must be part=value"),
            (["--restraint", "strap,height=1m,height=2m"], "--restraint height: is given twice"),
            (["--restraint", "strap,height=1.75m"], "strength_n"),
            (["--restraint", "strap,height=1.75m,strength=60lbf"], "--restraint strength 60lbf: unit must be one of"),
            (["--restraint", "adhesive,front=0.3m,strength=9N,slack=1mm"], "unknown key 'slack_mm'"),
            (["--restraint", KIT + ",count=two"], "--restraint count: must be a whole number, got 'two'"),
            (["--restraint", KIT, "--geometry", "linear"], "a block with a restraint needs its mass (kg)"),
            (["--restraint", KIT, "--mass", "100kg"], "a restraint needs linearised geometry"),
            (["--lean", "20deg"], "lean must leave the block standing"),
            (["--cm-offset", "20cm"], "cm_offset must be"),
        ],
    )
    def test_errors_are_one_sentence(self, tmp_path, monkeypatch, capsys, arguments, message):
        monkeypatch.chdir(tmp_path)
        error = run(capsys, *SIZES, *PULSE, *arguments, code=2)
        assert message in error
        assert error.startswith("toppling: ")
        assert error.count("\n") == 1


class TestWords:
    def test_units(self):
        """Values in the units of the study file's keys, whatever the unit of the command line."""
        found = scene_of({"--mass": "0.1e3kg", "--lean": "0.1rad", "--wall-gap": "0mm"}, None, KIT)
        assert found["mass_kg"] == 100.0
        assert found["lean_deg"] == pytest.approx(math.degrees(0.1))
        assert found["wall_gap_mm"] == 0.0
        assert found["restraint"] == {
            "kind": "strap",
            "height_m": 1.75,
            "strength_n": 267.0,
            "stiffness_n_per_mm": 20.0,
            "slack_mm": 5.0,
        }
        assert scene_of({}, None, "strap,stiffness=20kN/m")["restraint"]["stiffness_n_per_mm"] == 20.0

    def test_nothing_given(self):
        assert scene_of({"--mass": None}, None, None) == {}

    def test_not_finite(self):
        with pytest.raises(StudyError, match="must be finite"):
            scene_of({"--lean": "1e999deg"}, None, None)
