"""Studies of blocks on isolators: how far recordings are scaled before them."""

from check_facts import check as check_of, numbers_in
from study_texts import study_in

from toppling.motions import CloughPenzien, scale_to
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
records = "r*.csv"
unit = "m/s2"
"""
STRIPE = '[stripes]\nim = "pga"\nim_at = "ground"\nunit = "m/s2"\n[[stripes.at]]\nlevel = 2\n'
PENDULUM = '[support]\nkind = "pendulum"\nradius_m = 1.5\nfriction = 0.05\n'


def test_recordings_that_are_scaled_far_before_the_isolator_are_named(tmp_path):
    shakes = CloughPenzien(duration=8.0, dt=0.01).sample(3, 3)
    peaks = [0.05, 0.3, 3.0]  # m/s²: times 40, 6.7 and 0.67 to a level of 2
    for i, peak in enumerate(peaks):
        one = scale_to(shakes.isel(motion=[i]), peak, "pga").values[0]
        (tmp_path / f"r{i}.csv").write_text(
            "time (s),acceleration\n" + "".join(f"{0.01 * k:.2f},{value:.9g}\n" for k, value in enumerate(one))
        )
    results = study_in(tmp_path, HEAD + PENDULUM + STRIPE).run()
    (sentence,) = (fact.names[0] for fact in notes_of(results) if fact.what == "input.doubt")
    assert numbers_in(sentence) == [2, 3, 0.2, 5, 0.67, 40]
    check = check_of(results, "scaling")
    assert check.word == "use with care"
    assert check.more["sentences"]


def test_refused(refusal):
    refusal()
