"""Studies of blocks on benches and isolators: every run is that of the same steps in Python; what does not scale."""

import numpy as np
import pytest
from check_facts import check as check_of, doubts_of, facts_of, numbers_in

import toppling as tp
from toppling.motions import Building, CloughPenzien, Isolator, IsolatorStrikes, Support, scale_to
from toppling.studies import StudyError
from toppling.studies.facts.method import method_of
from toppling.studies.facts.notes import notes_of

HEAD = """
title = "A vase on a platform"
[[blocks]]
name = "vase"
width_m = 0.15
height_m = 0.75
[[models]]
law = "energy-consistent"
[motions]
generator = "clough-penzien"
number = 6
duration_s = 8
dt_s = 0.01
seed = 3
"""
BUILDING = '[building]\nkind = "flexural-shear"\nperiod_s = 0.5\nfloors = [5]\n'
STRIPES = """
[stripes]
im = "pga"
im_at = "ground"
unit = "m/s2"
[[stripes.at]]
level = 2
[[stripes.at]]
level = 6
"""
IDA = '[ida]\nim = "pga"\nim_at = "ground"\nlevels = { values = [2, 6], unit = "m/s2" }\n'
BENCH = '[support]\nkind = "bench"\nfrequency_hz = 9\n'
LINEAR = '[support]\nkind = "linear"\nperiod_s = 2.0\ndamping = 0.15\n'
BILINEAR = '[support]\nkind = "bilinear"\nperiod_s = 2.5\nstrength = 0.05\nclearance_mm = 1\n'
PENDULUM = '[support]\nkind = "pendulum"\nradius_m = 1.5\nfriction = 0.05\n'


def study(folder, *parts):
    (folder / "study.toml").write_text(HEAD + "".join(parts))
    return tp.Study.from_toml(folder / "study.toml")


def ground(level=None):
    made = CloughPenzien(duration=8.0, dt=0.01).sample(6, 3)
    return made if level is None else scale_to(made, level, "pga")


BLOCK, LAW = tp.Block(0.15, 0.75, name="vase"), tp.EnergyConsistent()


STOREYS = '[building]\nkind = "storeys"\nmasses_kg = [2e5, 2e5]\nstiffnesses_n_m = [2e8, 2e8]\n'


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((BENCH.replace("9", "0.1"),), "frequency of a bench: 0.1 Hz"),
        ((LINEAR.replace("2.0", "30"),), "period of an isolator: 30 s"),
        ((BUILDING, "damping = 0.5\n"), "damping of a building: 0.5"),
        ((STOREYS.replace("2e5", "200"),), "a building of 2 storeys with a period of 0.0101"),
        ((STOREYS, "yield_coefficient = 0.2\nstorey_height_m = 300\n"), "storey height: 300 m"),
        (
            (STOREYS, '[building.isolation]\nkind = "linear"\nperiod_s = 0.4\ndamping = 0.1\nbase_mass_kg = 2e5\n'),
            "period of an isolator: 0.4 s",
        ),
        ((BUILDING, BENCH), ""),
    ],
)
def test_numbers_of_another_unit_are_questioned(tmp_path, parts, words):
    analysis = STRIPES if "storeys" in parts[0] else IDA
    made = study(tmp_path, *parts, analysis)
    said = [one.sentence for one in made.doubts if one.kind == "building"]
    assert [one.startswith(words) for one in said] == [True] * bool(words)


@pytest.mark.slow
@pytest.mark.parametrize(("table", "support"), [(BENCH, Support(9.0)), (LINEAR, Isolator.linear(2.0, 0.15))])
def test_what_is_elastic_scales_with_the_ground(tmp_path, table, support):
    result = study(tmp_path, table, IDA).run()
    runs = tp.ida(BLOCK, LAW, support.motions(ground()), [2.0, 6.0], "pga", ground=ground())
    np.testing.assert_allclose(result["peak_rotation"], runs["peak_rotation"], rtol=1e-9, atol=1e-12)
    without = tp.ida(BLOCK, LAW, ground(), [2.0, 6.0], "pga")
    assert np.abs(without["peak_rotation"] - runs["peak_rotation"].values).max() > 0.01
    on_top = study(tmp_path, BUILDING, table, IDA).run()
    floors = support.motions(Building.flexural_shear(0.5).floor_motions(ground(), [5]))
    runs = tp.ida(BLOCK, LAW, floors, [2.0, 6.0], "pga", ground=ground())
    np.testing.assert_allclose(on_top["peak_rotation"], runs["peak_rotation"], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("table", "support"), [(BILINEAR, Isolator.bilinear(2.5, 0.05)), (PENDULUM, Isolator.pendulum(1.5, 0.05))]
)
def test_what_yields_answers_each_level(tmp_path, table, support):
    result = study(tmp_path, table, STRIPES).run()
    below = [ground(level) for level in (2.0, 6.0)]
    runs = tp.stripes(BLOCK, LAW, [support.motions(one) for one in below], [2.0, 6.0], "pga", scale=False, ground=below)
    np.testing.assert_allclose(result["peak_rotation"], runs["peak_rotation"], rtol=1e-9, atol=1e-12)
    assert any(0.001 in numbers_in(doubt) for doubt in doubts_of(result, "strike")) == (table is BILINEAR)
    cloud = study(tmp_path, table, '[cloud]\nim = "pga"\nim_at = "ground"\n').run()
    own = tp.cloud(BLOCK, LAW, support.motions(ground()), "pga", ground=ground())
    np.testing.assert_allclose(cloud["peak_rotation"], own["peak_rotation"], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("floors", ["", BUILDING])
def test_stops_are_modelled_where_their_stiffness_is_stated(tmp_path, floors):
    """Runs as of the same steps in Python; how often and how hard each motion strikes is on motion."""
    stops = "clearance_mm = 15\nstop_frequency_hz = 20\nstop_restitution = 0.5\n"
    table = PENDULUM + stops
    result = study(tmp_path, floors, table, STRIPES).run()
    support = Isolator.pendulum(1.5, 0.05, clearance=0.015, stop_frequency=20.0, stop_restitution=0.5)
    below = [ground(level) for level in (2.0, 6.0)]
    at = [Building.flexural_shear(0.5).floor_motions(one, [5]) for one in below] if floors else below
    with pytest.warns(IsolatorStrikes, match="strikes its stops"):
        tops = [support.motions(one) for one in at]
    runs = tp.stripes(BLOCK, LAW, tops, [2.0, 6.0], "pga", scale=False, ground=below)
    np.testing.assert_allclose(result["peak_rotation"], runs["peak_rotation"], rtol=1e-9, atol=1e-12)
    for name in ("strikes", "strike_acceleration"):
        expected = np.concatenate([one[name].values.ravel() for one in tops])
        np.testing.assert_allclose(result[f"support_{name}"], expected, rtol=1e-12)
    assert result["support_strikes"].dims == ("motion",)
    assert int(result["support_strikes"].sum()) > 6
    assert any("stop_frequency 20 Hz" in doubt for doubt in doubts_of(result, "strike"))
    on = facts_of(method_of, result)["support.on"].more
    assert (on["kind"], on["clearance"], on["frequency"], on["kept"]) == ("pendulum", 15, 20, 50.0)


def test_a_linear_isolator_with_stops_does_not_scale(tmp_path):
    with pytest.raises(StudyError, match="needs stripes or cloud"):
        study(tmp_path, LINEAR, "clearance_mm = 100\n", IDA)


def test_the_report_says_what_the_blocks_stand_on(tmp_path):
    on = facts_of(method_of, study(tmp_path, PENDULUM, STRIPES).run())["support.on"]
    assert (on.names, on.more["kind"], on.more["frequency"]) == ((), "pendulum", None)


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        ((PENDULUM, IDA), "an isolator that yields needs stripes or cloud"),
        ((BENCH, IDA.replace('im_at = "ground"\n', "")), "a support needs im_at = 'ground'"),
        ((PENDULUM, STRIPES.replace('im_at = "ground"\n', "")), "needs stripes.im_at = 'ground'"),
        (('[support]\nkind = "pendulum"\n', STRIPES), "key 'support.friction' is missing"),
        ((BENCH + "radius_m = 1\n", IDA), "unknown key 'support.radius_m'"),
        ((BENCH + "mass_ratio = 0.3\n", IDA), "mass_ratio must be at most 0.1, got 0.3"),
        ((LINEAR.replace("2.0", "200"), IDA), "period"),
        ((PENDULUM + "stop_frequency_hz = 20\n", STRIPES), "stop_frequency needs a clearance"),
        ((PENDULUM + "clearance_mm = 9\nstop_frequency_hz = 900\n", STRIPES), "contact of at least 2 ms"),
        (
            (PENDULUM + "clearance_mm = 9\nstop_frequency_hz = 1e-9\n", STRIPES),
            r"support.stop_frequency_hz: must be >= 0\.01",
        ),
        ((BENCH + "clearance_mm = 9\n", IDA), "unknown key 'support.clearance_mm'"),
        ((BENCH.replace("9", "-9"), IDA), "frequency"),
        (('[support]\nkind = "springs"\n', IDA), "springs"),
    ],
)
def test_what_does_not_go_together_has_one_sentence(tmp_path, parts, text):
    with pytest.raises(StudyError, match=text):
        study(tmp_path, *parts)


def test_recordings_that_are_scaled_far_before_the_isolator_are_named(tmp_path):
    shakes = CloughPenzien(duration=8.0, dt=0.01).sample(3, 3)
    peaks = [0.05, 0.3, 3.0]  # m/s²: times 40, 6.7 and 0.67 to a level of 2
    for i, peak in enumerate(peaks):
        one = scale_to(shakes.isel(motion=[i]), peak, "pga").values[0]
        (tmp_path / f"r{i}.csv").write_text(
            "time (s),acceleration\n" + "".join(f"{0.01 * k:.2f},{value:.9g}\n" for k, value in enumerate(one))
        )
    start, end = HEAD.index("[motions]"), len(HEAD)
    text = f'{HEAD[:start]}[motions]\nrecords = "r*.csv"\nunit = "m/s2"\n{HEAD[end:]}'
    one_stripe = STRIPES.partition("[[stripes.at]]\nlevel = 6")[0]
    (tmp_path / "study.toml").write_text(text + PENDULUM + one_stripe)
    results = tp.Study.from_toml(tmp_path / "study.toml").run()
    (sentence,) = (fact.names[0] for fact in notes_of(results) if fact.what == "input.doubt")
    assert numbers_in(sentence) == [2, 3, 0.2, 5, 0.67, 40]
    check = check_of(results, "scaling")
    assert check.word == "use with care"
    assert check.more["sentences"]


def test_a_bilinear_isolator_yields_after_a_micrometre_at_least():
    with pytest.raises(ValueError, match="yield_displacement"):
        Isolator.bilinear(2.5, 0.05, 1e-15)


def test_floors_of_a_file_do_not_go_through_a_support(tmp_path):
    start, end = HEAD.index("[motions]"), len(HEAD)
    (tmp_path / "study.toml").write_text(f'{HEAD[:start]}[motions]\nfloors_file = "f.csv"\n{HEAD[end:]}{BENCH}{IDA}')
    with pytest.raises(StudyError, match="a support needs ground motions, got motions"):
        tp.Study.from_toml(tmp_path / "study.toml")
