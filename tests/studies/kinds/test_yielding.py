"""Studies of blocks in buildings that yield: every run is that of the same steps in Python; what does not scale."""

import numpy as np
import pytest
from check_facts import facts_of, notes_named
from study_texts import changed, motions, study_in

import toppling as tp
from toppling.motions import Building, CloughPenzien, Yielding, scale_to
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


def steps(make):
    """The same in Python: ground motions scaled to each level, and their floors in a building."""
    ground = [scale_to(CloughPenzien(duration=8.0, dt=0.01).sample(6, seed), level, "Sa(0.5)") for level, seed in AT]
    building = make()
    return ground, [building.floor_motions(one, floors=[0, 2]) for one in ground]


AT = ((4.0, 3), (12.0, 5))


def yielding():
    return Building.from_storeys([2e5, 2e5], [2e8, 2e8], yielding=Yielding(0.15, p_delta=True))


@pytest.mark.slow
def test_every_run_is_that_of_the_steps_in_python(tmp_path):
    result = study(tmp_path).run()
    ground, floors = steps(yielding)
    assert all(float(one["ductility"].max()) > 1.0 for one in floors)
    block, law = tp.Block(0.4, 1.8, name="cabinet"), tp.EnergyConsistent()
    runs = tp.stripes(block, law, floors, [4.0, 12.0], "Sa(0.5)", scale=False, ground=ground)
    np.testing.assert_allclose(result["peak_rotation"], runs["peak_rotation"], rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(result["overturned"], runs["overturned"])
    assert notes_named(result, "selection.none")
    np.testing.assert_allclose(result["ground_Sa(0.5)"], np.repeat([4.0, 12.0], 12), rtol=1e-12)
    # on the ground floor it is the ground motion; above, an elastic building moves otherwise
    _, elastic = steps(lambda: Building.from_storeys([2e5, 2e5], [2e8, 2e8]))
    others = tp.stripes(block, law, elastic, [4.0, 12.0], "Sa(0.5)", scale=False, ground=ground)
    apart = (np.abs(others["peak_rotation"] - runs["peak_rotation"]) > 1e-6).values.ravel()
    on_ground = np.array(["floor 0" in one for one in runs["record"].values])
    assert not apart[on_ground].any()
    assert apart[~on_ground].sum() > 6


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


def test_levels_that_scale_are_refused_and_clouds_do_not(tmp_path):
    head = TEXT[: TEXT.index("[stripes]")]
    path = tmp_path / "study.toml"
    path.write_text(head + '[ida]\nim = "pga"\nim_at = "ground"\nlevels = { values = [1.0, 2.0], unit = "m/s2" }\n')
    with pytest.raises(StudyError, match="a building that yields needs stripes or cloud"):
        tp.Study.from_toml(path)
    path.write_text(head + '[cloud]\nim = "pga"\nim_at = "ground"\n')
    ground = CloughPenzien(duration=8.0, dt=0.01).sample(6, 3)
    floors = yielding().floor_motions(ground, [0, 2])
    runs = tp.cloud(tp.Block(0.4, 1.8, name="cabinet"), tp.EnergyConsistent(), floors, "pga", ground=ground)
    np.testing.assert_allclose(tp.Study.from_toml(path).run()["peak_rotation"], runs["peak_rotation"], rtol=1e-9)
