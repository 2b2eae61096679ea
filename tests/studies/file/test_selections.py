"""Stripes whose motions are selected: what a study file asks for, what its results say, and what is refused."""

import json

import numpy as np
import pytest
from check_facts import check as check_of, numbers_in
from study_texts import study_in

import toppling as tp
from toppling.studies.command.starters import write_starter
from toppling.studies.facts.notes import notes_of
from toppling.studies.file.schema import read_study_file
from toppling.studies.text.reached import levels_run, other_levels

STUDY = """title = "selected"
[[blocks]]
width_m = 0.3
height_m = 1.5
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 60
duration_s = 10
dt_s = 0.01
omega_g_dispersion = 0.4
[stripes]
im = "pga"
unit = "g"
[stripes.select]
number = 10
target = "target.csv"
factor = [0.01, 100]
correlations = "rho.csv"
[[stripes.at]]
level = 0.3
[[stripes.at]]
level = 3.0
"""
RHO = ",pga,pgv\npga,1,0.6\npgv,0.6,1\n"


@pytest.fixture(scope="module")
def target():
    """What the candidates are like where their PGA is 0.3 g."""
    pool = tp.motions.CloughPenzien(duration=10.0, dt=0.01, omega_g_dispersion=0.4).sample(60)
    found = tp.motions.measures(pool, ["pga", "pgv"])
    ratio = np.log((found["pgv"] / found["pga"]).values)
    pga = 0.3 * 9.80665
    sigma = float(ratio.std() / 0.8)  # (given the PGA what is left of the scatter is 0.8 of it)
    return f"measure,unit,median,sigma\npga,m/s2,{pga},0.5\npgv,m/s,{pga * np.exp(ratio.mean())},{sigma}\n"


def study(tmp_path, target, text=STUDY, **files):
    return study_in(tmp_path, text, target=target, rho=RHO, **files)


def test_stripes_that_agree_are_run_and_others_left_out(tmp_path, target):
    """At ten times the level the target's PGV grows less than the PGA, and scaled motions have ten times the PGV."""
    found = study(tmp_path, target)
    assert found.design.levels.tolist() == pytest.approx([0.3 * 9.80665])
    left = [one.sentence for one in found.doubts if one.kind == "selection"]
    assert len(left) == 1
    assert numbers_in(left[0])[0] == 3
    assert "(pgv: median +" in left[0]
    results = found.run()
    assert results["selection_consistent"].values.tolist() == [True]
    assert results.sizes["motion"] == 10
    (agreement,) = (fact for fact in notes_of(results) if fact.what == "selection.agreement")
    assert (agreement.value, agreement.more["stripes"]) == (1, 1)
    # (a stripe above the highest is there: it was left out; below, another one helps)
    asked = json.loads(results.attrs["study"])
    assert other_levels(asked, True, levels_run(results)).startswith("select the stripes")
    assert other_levels(asked, False, levels_run(results)).startswith("add a stripe")
    blank = results.assign(status=results["status"].copy(data=[["no overturning"]]))
    assert check_of(blank.assign(converged=blank["converged"] & False), "curves").more["higher"].startswith("select")
    for name, one in results.variables.items():
        assert {"units", "long_name"} <= set(one.attrs), name


def test_kept_where_asked(tmp_path, target):
    found = study(tmp_path, target, STUDY.replace("number = 10", 'number = 10\noutside = "keep"'))
    assert found.design.levels.size == 2
    assert any("all the same" in doubt.sentence for doubt in found.doubts)
    results = found.run()
    assert results["selection_consistent"].values.tolist() == [True, False]
    assert results.sizes["motion"] == 20


def test_generators_of_candidates_are_doubted_once(tmp_path, target):
    """Those that make what is chosen from, of the table and of further tables."""
    text = STUDY.replace("omega_g_dispersion = 0.4", "omega_g_dispersion = 0.4\nxi_g = 60").replace("= 3.0", "= 0.4")
    also = '[[stripes.select.also]]\ngenerator = "seismological"\nnumber = 2\nq0 = 1.8\n'
    text = text.replace("number = 10", 'number = 10\noutside = "keep"')
    notes = study(tmp_path, target, text.replace("[[stripes.at]]", f"{also}[[stripes.at]]", 1)).notes
    assert [note.partition(",")[0] for note in notes if "usual are" in note] == ["xi_g: 60", "q0: 1.8"]


@pytest.mark.slow
def test_measures_are_ranked_where_motions_are_in_several_stripes(tmp_path, target):
    """A stripe has motions of several tables, and shares some with the next: each is found in its own set."""
    also = """[[stripes.select.also]]
generator = "clough-penzien"
number = 60
duration_s = 10
dt_s = 0.01
omega_g_dispersion = 0.4
seed = 1
[measures]
also = ["Sa(0.5)"]
"""
    text = STUDY.replace("level = 3.0", "level = 0.33").replace(
        'target = "target.csv"', 'target = "target.csv"\noutside = "keep"'
    )
    found = study(tmp_path, target, text.replace("number = 10\n", "number = 30\n", 1) + also)
    assert len({str(name) for array in found.design.arrays for name in array["motion"].values}) < 60
    results = found.run()
    own = tp.fragility.rank_measures(results, list(found.design.motions), ("Sa(0.5)",), replicates=0)
    assert "Sa(0.5)" in own["measure"].values
    np.testing.assert_allclose(results["measure_dispersion"].values, own["dispersion"].values, rtol=1e-12)


@pytest.mark.slow
def test_the_target_is_part_of_the_identity(tmp_path, target):
    first = study(tmp_path, target).identity
    assert study(tmp_path, target).identity == first
    assert study(tmp_path, f"# the same\n{target}").identity == first
    assert study(tmp_path, f"{target[:-5]}1\n").identity != first  # (the last digits of a dispersion)


def test_further_candidates(tmp_path, target):
    also = (
        '[[stripes.select.also]]\ngenerator = "clough-penzien"\nnumber = 30\nduration_s = 10\ndt_s = 0.01\nseed = 3\n'
    )
    found = study(tmp_path, target, STUDY.replace("[[stripes.at]]", f"{also}[[stripes.at]]", 1))
    assert found.run()["selection_candidates"].values.tolist() == [90.0]


@pytest.mark.slow
def test_a_building_moves_the_chosen_motions(tmp_path, target):
    building = '[building]\nkind = "flexural-shear"\nperiod_s = 0.5\nstoreys = 3\nfloors = [0, 3]\nmodes = 2\n'
    text = STUDY.replace("[stripes]\n", f'{building}[stripes]\nim_at = "ground"\n')
    found = study(tmp_path, target, text)
    plain = study(tmp_path, target).run()
    results = found.run()
    assert results["selection_median"].equals(plain["selection_median"])
    on_ground = results.isel(motion=(results["motion_floor"] == "0").values)
    np.testing.assert_array_equal(on_ground["overturned"].values, plain["overturned"].values)


def disaggregated(folder, target, bins, more=""):
    """The study with two bins in the place of its target: of each the level and the `poe`."""
    head = '#,,,,,"generated_by=OpenQuake, investigation_time=50.0"\nimt,iml,poe,mag,dist,mean\n'
    rows = "".join(f"PGA,{of},{at}\n" for of, at in zip(bins, ("6.5,20.0,0.06", "7.0,30.0,0.04"), strict=True))
    keys = 'disaggregation = "d.csv"\nvs30_m_s = 400\nmeasures = ["pga", "pgv"]\noutside = "keep"'
    text = STUDY.replace('target = "target.csv"', keys) + more
    return study(folder, target, text, d=head + rows)


def test_a_disaggregation(tmp_path, target):
    found = disaggregated(tmp_path, target, ["0.3,0.1"] * 2)
    (said,) = (doubt.sentence for doubt in found.doubts if "disaggregation" in doubt.sentence)
    assert "d.csv" in said
    assert numbers_in(said) == [0.3, 3]
    scenarios = [tp.motions.Scenario(6.5, 20e3, 400.0), tp.motions.Scenario(7.0, 30e3, 400.0)]
    shares = -np.log1p(-np.array([0.06, 0.04]))
    rho = np.array([[1.0, 0.6], [0.6, 1.0]])
    aim = tp.motions.expected_target(scenarios, "pga", ["pga", "pgv"], weights=shares, correlations=rho)
    results = found.run()
    wanted = aim.at(0.3 * 9.80665).medians
    np.testing.assert_allclose(results["selection_target_median"][0, :2], wanted, rtol=1e-9)


@pytest.mark.parametrize(
    ("k0", "poe", "said"),
    [
        (1.85e-4, 0.1, []),  # 1.85e-4/0.3² = 0.002056
        (1.8e-3, 0.1, ["0.3 g is exceeded 0.00205 times per year, by the hazard curve 0.02 times"]),
        (1.85e-4, 0.3, ["the bins of pga = 0.3 g have a rate of 0.00205 per year together, its poe says 0.00713"]),
    ],
)
def test_a_disaggregation_beside_the_hazard_and_its_own_level(tmp_path, target, k0, poe, said):
    """Its rate at 0.3 g is -ln(0.94 × 0.96)/50 = 0.00205 per year."""
    hazard = f'[hazard]\nk0 = {k0}\nk = 2.0\nunit = "g"\n'
    doubts = disaggregated(tmp_path, target, [f"0.3,{poe}"] * 2, hazard).doubts
    found = [one.sentence.partition(": ")[2] for one in doubts if one.kind == "hazard"]
    assert [one[: len(part)] for one, part in zip(found, said, strict=True)] == said


@pytest.mark.slow
def test_what_the_tutorial_says_of_its_example(tmp_path):
    """Selected motions, and all candidates scaled to the same levels."""
    write_starter("hazard", tmp_path / "site")
    study = tp.Study.from_toml(tmp_path / "site/study.toml")
    results = study.run()
    assert results["selection_consistent"].values.all()
    content = read_study_file(tmp_path / "site/study.toml")
    pool = content.stripes.select.pool(content.motions, tmp_path / "site")
    levels = study.design.levels
    scaled = tp.stripes(
        study.blocks, study.models, [list(pool.arrays)] * levels.size, levels, im="Sa(1.0)", screen=False
    )
    at = levels.tolist().index(pytest.approx(0.45 * 9.80665))
    assert round(float(results["probability"].values.ravel()[at]), 2) == pytest.approx(0.38, abs=0.03)
    assert float(scaled["overturned"][..., scaled["stripe"].values == at + 1].mean()) == pytest.approx(0.63, abs=0.02)
    hazard = tp.fragility.read_hazard(tmp_path / "site/hazard.csv")
    of_all = tp.fragility.annual_rate(tp.fragility.fit_fragility(scaled), hazard)["rate"].item()
    assert 1.0 / results["rate"].item() == pytest.approx(1270.0, rel=0.05)
    assert 1.0 / of_all == pytest.approx(820.0, rel=0.05)
    # … and what scaling brings along at that level, over the hazard's medians
    wanted = results["selection_target_median"][at]
    arrays = [tp.motions.scale_to(one, levels[at], "Sa(1.0)") for one in pool.arrays]
    for name, over in (("pgv", 1.34), ("Sa(0.2)", 1.87), ("Sa(2.0)", 1.54), ("d5_95", 0.95)):
        values = np.concatenate([tp.motions.measures(one, name)[name].values for one in arrays])
        assert np.exp(np.log(values).mean()) / wanted.sel(selected_measure=name).item() == pytest.approx(over, abs=0.05)
    factors = np.concatenate(
        [levels[at] / tp.motions.measures(one, "Sa(1.0)")["Sa(1.0)"].values for one in pool.arrays]
    )
    assert np.mean(factors > 1.0) > 0.5
    assert factors.max() > 10.0


def test_refused(refusal):
    refusal()
