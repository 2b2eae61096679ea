"""Studies of blocks in buildings that yield: motions as they are, default strengths, and what does not scale."""

import numpy as np
import pytest
from check_facts import facts_of, notes_named
from study_texts import changed, motions, study_in

from toppling.motions import Building
from toppling.motions.floors.strength import code_strength
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.facts.method import method_of

TEXT = f"""
title = "A cabinet in a building that yields"
[[blocks]]
name = "cabinet"
width_m = 0.4
height_m = 1.8
[[models]]
law = "energy-consistent"
{motions(6, 8, 0.01, 3)}[building]
kind = "storeys"
masses_kg = [2e5, 2e5]
stiffnesses_n_m = [2e8, 2e8]
yield_coefficient = 0.15
p_delta = true
floors = [0, 2]
[stripes]
im = "Sa(0.5)"
im_at = "ground"
unit = "m/s2"
[[stripes.at]]
level = 4
[[stripes.at]]
level = 12
motions = {{ seed = 5 }}
"""
STATED = "yield_coefficient = 0.15\n"
FRAME = 'system = "ordinary-masonry-wall"\nsds_g = 0.5\nsd1_g = 0.1\nimportance = 1.25\n'


def study(folder, *changes, more=""):
    return study_in(folder, changed(TEXT, *changes) + more)


@pytest.mark.slow
def test_motions_as_they_are_and_other_buildings_beside(tmp_path):
    scaled = study(tmp_path).run()
    unscaled = ('unit = "m/s2"', 'unit = "m/s2"\nscale = false')
    with pytest.raises(StudyError, match=r"stripes.scale = false: the Sa\(0.5\) of .* not that of 2 stripes"):
        study(tmp_path, unscaled)
    plain = study(tmp_path, unscaled, ("title", 'accept = ["level"]\ntitle')).run()
    assert not np.array_equal(plain["peak_rotation"], scaled["peak_rotation"])
    both = (
        ("[building]", '[[buildings]]\nname = "old"'),
        (
            "floors = [0, 2]",
            'floors = [2]\n[[buildings]]\nname = "new"\nkind = "flexural-shear"\nperiod_s = 0.5\nfloors = [5]',
        ),
    )
    result = study(tmp_path, *both).run()
    assert set(result["floor"].values) == {"old 2", "new 5"}


@pytest.mark.slow
def test_a_default_strength_is_printed_as_a_judgement(tmp_path, capsys):
    first = float(Building.from_storeys([2e5, 2e5], [2e8, 2e8]).periods[0])
    coefficient = code_strength("ordinary-masonry-wall", first, 0.5, 0.1, 1.25).coefficient
    by_code = study(tmp_path, (STATED, FRAME))
    stated = study(tmp_path, (STATED, f"yield_coefficient = {coefficient!r}\n")).run()
    result = by_code.run()
    np.testing.assert_array_equal(result["peak_rotation"], stated["peak_rotation"])
    said = f"C_y = Ω0 C_s = 2.5 × {coefficient / 2.5:.3g} = {coefficient:.3g}"
    (default,) = notes_named(result, "building.default_strength")
    assert said in default.names[1]
    assert result.attrs["storeys"].count(said) == 1
    assert "Default strength" in result.attrs["storeys"]
    assert "Default strength" not in stated.attrs["storeys"]
    assert "building.strength_default" in facts_of(method_of, result)
    study(tmp_path, (STATED, FRAME))
    assert main(["motions", str(tmp_path / "study.toml"), "--out", str(tmp_path / "figures")]) == 0
    assert said in " ".join(capsys.readouterr().out.split())


def test_refused(refusal):
    refusal()
