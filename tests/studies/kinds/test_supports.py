"""Studies of blocks on benches and isolators: every run is that of the same steps in Python; what does not scale."""

import numpy as np
import pytest
from check_facts import check as check_of, doubts_of, numbers_in
from study_texts import motions, study_in

import toppling as tp
from toppling.motions import Building, CloughPenzien, Isolator, Support, scale_to
from toppling.studies.facts.notes import notes_of

HEAD = f"""
title = "A vase on a platform"
[[blocks]]
name = "vase"
width_m = 0.15
height_m = 0.75
[[models]]
law = "energy-consistent"
{motions(6, 8, 0.01, 3)}"""
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
    return study_in(folder, HEAD + "".join(parts))


def ground(level=None):
    made = CloughPenzien(duration=8.0, dt=0.01).sample(6, 3)
    return made if level is None else scale_to(made, level, "pga")


BLOCK, LAW = tp.Block(0.15, 0.75, name="vase"), tp.EnergyConsistent()


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
    results = study_in(tmp_path, text + PENDULUM + one_stripe).run()
    (sentence,) = (fact.names[0] for fact in notes_of(results) if fact.what == "input.doubt")
    assert numbers_in(sentence) == [2, 3, 0.2, 5, 0.67, 40]
    check = check_of(results, "scaling")
    assert check.word == "use with care"
    assert check.more["sentences"]


def test_refused(refusal):
    refusal()
