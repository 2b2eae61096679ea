"""Notes on curves of first overturnings."""

import math

import pytest
import xarray as xr
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import notes_said
from toppling.studies.text.curve_notes import spacing_notes

FIRST = '[fit]\nmethod = "first-overturning"\nreplicates = 100\n'


def test_a_study_says_how_much_its_levels_decide(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('title = "a study"\n' + CABINET + motions(40) + IDA + FIRST, encoding="utf-8")
    found = tp.Study.from_toml(path).run()
    (fact,) = (one for one in notes_of(found) if one.what == "curve.first_overturnings")
    later = math.expm1(found["level_shift"].item())
    assert fact.value == pytest.approx(12.0 ** (1.0 / 6.0) - 1.0, rel=1e-9)
    assert (fact.lower, fact.upper) == pytest.approx((later, later), rel=1e-12)


def test_without_a_shift_no_number_is_given():
    curves = xr.Dataset({"level_shift": ("block", [math.nan])}, attrs={"level_spacing": math.nan})
    (fact,) = spacing_notes(curves)
    assert fact.what == "curve.first_overturnings"
    assert all(math.isnan(one) for one in (fact.value, fact.lower, fact.upper))
    assert notes_said([fact])[0].endswith("without an end.")
    assert spacing_notes(xr.Dataset()) == []
