"""Results that a study calls not valid: Python warns of them where the package is called, once a call."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.facts import INVALID
from toppling.fragility import notes, screen

LEVELS = np.geomspace(1.0, 20.0, 6)
SLENDER, LAW = tp.Block(0.4, 1.8, name="shelf"), tp.HousnerImpact()
STUDY = """
title = "Few"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 5
seed = 2
duration_s = 6
dt_s = 0.02
[ida]
im = "pga"
levels = { from = 1.0, to = 20.0, number = 6, unit = "m/s2" }
[fit]
replicates = 100
[hazard]
k0 = 1e-4
k = 2.5
unit = "m/s2"
"""


def shakes(number):
    return tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(number, seed=2)


def told(call):
    """Return what is said of results that are not valid; every sentence names this file as the place of the call."""
    with warnings.catch_warnings(record=True, action="always") as caught:
        call()
    found = [one for one in caught if str(one.message).startswith("results are not valid: ")]
    assert {Path(one.filename).name for one in found} <= {Path(__file__).name}
    assert {one.category for one in found} <= {ImplausibleInput}
    return [str(one.message).removeprefix("results are not valid: ") for one in found]


@pytest.mark.parametrize(("number", "half"), [(1, "0.45"), (6, "0.31"), (7, ""), (20, "")])
def test_few_motions(number, half):
    """0.98 / sqrt(n + 3.84): 0.445 of one motion, 0.312 of six and 0.298, which will do, of seven."""
    counted = "1 motion leaves" if number == 1 else f"{number} motions leave"
    said = [re.compile(rf"{counted} .* to ±{half}: take 7 or more")] if half else []
    runs = tp.ida(SLENDER, LAW, shakes(number), LEVELS)
    for call in (tp.overturning_probability, lambda one: tp.fit_fragility(one, replicates=20)):
        found = [one for one in told(lambda call=call: call(runs)) if "probability of 1/2" in one]
        assert len(found) == len(said)
        assert all(pattern.fullmatch(one) for pattern, one in zip(said, found, strict=True))


def test_copies_of_motions():
    """Runs joined with themselves; those with other outcomes, or under other labels, are motions of their own."""
    runs = tp.ida(SLENDER, LAW, shakes(20), LEVELS)
    twice = runs.isel(motion=[*range(20), 3, 7])
    assert any(
        one.startswith("2 motions of 22 repeat another by label and outcomes")
        for one in told(lambda: tp.fit_fragility(twice, replicates=20))
    )
    renamed = twice.assign_coords(motion=[f"motion {i}" for i in range(22)])
    other = twice.copy(deep=True)
    other["overturned"].values[..., 20:] ^= True
    for data in (runs, renamed, other):
        assert not any("repeat another" in one for one in told(lambda data=data: tp.overturning_probability(data)))


def test_few_motions_of_a_stripe():
    """The stripe with the fewest counts; polarities of one motion are one."""
    runs = tp.stripes(SLENDER, LAW, [shakes(20), shakes(4), shakes(20)], [2.0, 4.0, 8.0])
    assert any(one.startswith("4 motions leave") for one in told(lambda: tp.overturning_probability(runs)))
    both = tp.ida(SLENDER, LAW, shakes(5), LEVELS, polarity="both")
    for call in (tp.overturning_probability, lambda one: tp.fit_fragility(one, replicates=20)):
        assert any(one.startswith("5 motions leave") for one in told(lambda call=call: call(both)))


def test_runs_outside_of_the_model():
    """By the screen, where every block and law has more than half of its runs outside."""
    runs = tp.ida([SLENDER, tp.Block(0.5, 1.8, name="case")], LAW, shakes(20), LEVELS)
    assert told(lambda: tp.overturning_probability(runs)) == []
    for reason, words in (
        ("slides_at_impact", "would slide in more than half"),
        ("elastic_mode", "elastic mode"),
        ("squat", "bounces"),
    ):
        one = runs.copy(deep=True)
        one["outside"].loc[{"reason": reason}] = 0.51
        (sentence,) = told(lambda one=one: tp.overturning_probability(one))
        assert words in sentence
        one["outside"].loc[{"reason": reason, "block": "case"}] = 0.3
        both = told(lambda one=one: tp.overturning_probability(one))
        assert both == []  # (one block is within the model)


@pytest.mark.parametrize("reasons", [slice(0, 1), [0, 0], slice(None, None, -1)])
def test_reasons_that_a_caller_has_selected(reasons):
    """Without all of them nothing is said of them; in another order all is."""
    runs = tp.ida(SLENDER, LAW, shakes(20), LEVELS).isel(reason=reasons)
    runs["outside"] = runs["outside"] * 0.0 + 0.51
    assert len(told(lambda: tp.overturning_probability(runs))) == (3 if reasons == slice(None, None, -1) else 0)


def test_notes_of_selected_blocks_laws_and_reasons():
    """One block, law or run is one; what the notes need and lack is one sentence."""
    blocks = [tp.Block(0.6, 0.9, name="squat"), tp.Block(0.3, 1.8, name="vase", round=True)]
    whole = screen(tp.ida(blocks, [LAW, tp.EnergyConsistent()], shakes(20), LEVELS), shakes(20), friction=0.3)
    for block, first in enumerate(("squat: the mass centre", "“vase” has a round base")):
        for dims in ({}, {"model": 0}, {"model": 1, "level": 0, "motion": 0}):
            sentences = notes(whole.isel(block=block, **dims))
            assert sentences == notes(whole.isel(block=[block], **{dim: [i] for dim, i in dims.items()}))
            assert any(sentence.startswith(first) for sentence in sentences)
    for lacking in (whole.isel(reason=0), whole.drop_vars("squat"), whole.isel(block=0, drop=True)):
        with pytest.raises(TypeError, match="notes need all variables and reasons"):
            notes(lacking)


def test_curves_without_a_fit_or_far_too_wide():
    weak = tp.ida(SLENDER, LAW, shakes(20), [0.01, 0.02, 0.04])
    assert ["(no overturning)" in sentence for sentence in told(lambda: tp.fit_fragility(weak))] == [True]
    some = tp.ida(SLENDER, LAW, shakes(20), LEVELS)
    assert told(lambda: tp.fit_fragility(some, replicates=50)) == []
    counts = xr.Dataset(
        {"overturnings": ("level", [1, 1, 2]), "runs": ("level", [4, 4, 4])}, {"level": [1.0, 10.0, 100.0]}
    )
    (said,) = told(lambda: tp.fit_fragility(counts))
    assert "interval" in said
    assert said.endswith("take more motions")


@pytest.mark.parametrize(
    ("levels", "said"),
    [
        ([1e-3, 1e3], []),
        ([1e-3, 0.01], ["above the hazard curve's last level: give the curve at higher levels"]),
        ([100.0, 1e3], ["below the hazard curve's first level: give the curve at lower levels"]),
    ],
)
def test_rates_from_beyond_the_hazard_curve(levels, said):
    """Rates of a power law of exponent 2.5 come from about the median exp(-2.5 beta²) = 0.67."""
    curves = xr.Dataset({"median": ((), 1.0, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    hazard = tp.HazardCurve(levels, [1e-2 * level**-2.5 for level in levels], "pga")
    found = told(lambda: tp.annual_rate(curves, hazard))
    assert [one.partition("shaking ")[2] for one in found] == said


@pytest.mark.slow
def test_studies_say_it_themselves(tmp_path):
    (tmp_path / "few.toml").write_text(STUDY, encoding="utf-8")
    found = []
    assert told(lambda: found.append(tp.Study.from_toml(tmp_path / "few.toml").run(tmp_path / "out"))) == []
    assert check_of(found[0], "number of motions").word == INVALID


def test_levels_that_were_changed_after_the_runs():
    """Divided by g, which keeps the unit; of other levels or another measure; joined twice. Scale factors show it."""
    runs = tp.ida(SLENDER, LAW, shakes(20), LEVELS)
    velocities = tp.ida(SLENDER, LAW, shakes(20), LEVELS / 10.0, im="pgv").assign_coords(level=LEVELS + 0.5)
    building = tp.motions.Building.flexural_shear(period=0.5, alpha0=8.0, storeys=2)
    floors = tp.ida(SLENDER, LAW, building.floor_motions(shakes(20), floors=[1, 2]), LEVELS)
    changed = (
        (runs.assign_coords(level=runs["level"] / 9.80665), "levels are 0.102 times the pga of the scaled motions"),
        (
            runs.assign_coords(level=(100.0 * runs["level"]).assign_attrs(runs["level"].attrs, units="cm s-2")),
            "levels are 100 times the pga of the scaled motions: keep them in m s-2",
        ),
        (runs.reindex(level=1.1 * LEVELS**1.1, method="nearest"), "scale factors do not grow with the levels"),
        (xr.concat([runs, velocities], "level", data_vars="minimal"), "scale factors do not grow with the levels"),
        (xr.concat([runs, runs.isel(level=[2])], "level", data_vars="minimal"), "a level stands there twice"),
        *((data, "") for data in (runs, runs.isel(level=[3, 1], motion=slice(8)), floors)),
    )
    sets = [shakes(10)] * 2
    own = [tp.cloud(SLENDER, LAW, shakes(20)), tp.stripes(SLENDER, LAW, sets, [2.0, 4.0], scale=True)]
    divided = "levels are 0.102 times the pga of the scaled motions"
    changed += tuple((data.assign_coords(intensity=data["intensity"] / 9.80665), divided) for data in own)
    plain = [tp.ida(SLENDER, LAW, shakes(20), LEVELS, screen=False), tp.cloud(SLENDER, LAW, shakes(20), screen=False)]
    plain += [tp.stripes(SLENDER, LAW, sets, [2.0, 4.0], scale=True, screen=False)]  # (none has scale factors)
    changed += tuple((data, "") for data in [*own, *plain])
    for data, sentence in changed:
        found = told(lambda data=data: tp.fit_fragility(data, replicates=20))
        of_levels = [text for text in found if text.startswith(("levels are", "scale factors do", "a level stands"))]
        assert [text.startswith(sentence) for text in of_levels] == [True] * bool(sentence)
