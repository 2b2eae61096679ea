"""Studies in which the vertical components of recordings shake the blocks, too."""

import numpy as np
import pytest

import toppling as tp
from toppling import motions
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions.arrays import LIFTS
from toppling.studies.facts.method import method_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import say

DT = 0.01
STUDY = """
title = "Vertical shaking"
accept = ["drift", "displacement", "offset", "PGA", "spectra", "PGV/PGA", "level", "ringing"]
[[blocks]]
name = "cabinet"
width_m = 0.4
height_m = 1.6
[[models]]
law = "{law}"
{model}
[motions]
{motions}
[ida]
im = "pga"
levels = {{ values = [0.2, 0.5, 3.0], unit = "g" }}
{more}
"""


def write(folder, law="housner", model="", keys='component = "h1"\nvertical = true', columns=3, more=""):
    """A study of two recordings; the vertical component is as strong as half the horizontal one."""
    for number in (1, 2):
        drawn = [motions.CloughPenzien(duration=8.0, dt=DT).sample(1, seed=10 * number + k).values[0] for k in range(3)]
        drawn[2] = drawn[2] * 0.5 * np.abs(drawn[0]).max() / np.abs(drawn[2]).max()
        heading = ",".join(f"{name} (m/s2)" for name in ("NS", "EW", "UD")[:columns])
        rows = "".join(
            f"{i * DT:.2f},{','.join(f'{one[i]:.9f}' for one in drawn[:columns])}\n" for i in range(drawn[0].size)
        )
        (folder / f"event{number}.csv").write_text(f"time (s),{heading}\n{rows}", encoding="utf-8")
    path = folder / "study.toml"
    text = STUDY.format(law=law, model=model, motions=f'records = "*.csv"\n{keys}', more=more)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return tp.Study.from_toml(write(tmp_path_factory.mktemp("vertical")))


def test_the_runs_are_those_of_ida(study, tmp_path):
    results = study.run(tmp_path)
    arrays = study.arrays
    assert all(LIFTS in array.coords for array in arrays)
    runs = tp.ida(tp.Block(0.4, 1.6), tp.HousnerImpact(), arrays, np.array([0.2, 0.5, 3.0]) * G)
    np.testing.assert_array_equal(results["overturned"], runs["overturned"])
    np.testing.assert_array_equal(results["verdict"].values & 128, runs["verdict"].values & 128)
    assert (runs["verdict"].values & 128).any()
    said = {fact.what: fact for fact in notes_of(results)}
    assert said.keys() >= {"motion.vertical", "motion.airborne"}
    assert said["validity.not_modelled"].more["vertical"]
    model, *_, left_out = method_of(results)
    assert model.more["lifted"]
    assert "vertical" not in say(left_out, "method")
