"""Notes on curves of first overturnings."""

import math

import numpy as np
import xarray as xr
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.core.wording import whole_percent
from toppling.studies.text.curve_notes import spacing_notes

FIRST = '[fit]\nmethod = "first-overturning"\nreplicates = 100\n'


def test_a_study_says_how_much_its_levels_decide(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('title = "a study"\n' + CABINET + motions(40) + IDA + FIRST, encoding="utf-8")
    found = tp.Study.from_toml(path).run()
    (text,) = (one for one in found.attrs["notes"].splitlines() if "first overturnings" in one)
    later = whole_percent(float(np.expm1(found["level_shift"].item())))
    assert f"levels are up to 51 % apart, and with every other level first overturnings come {later} later" in text


def test_without_a_shift_no_number_is_given():
    curves = xr.Dataset({"level_shift": ("block", [math.nan])}, attrs={"level_spacing": math.nan})
    (text,) = spacing_notes(curves)
    assert text.endswith("without an end")
    assert spacing_notes(xr.Dataset()) == []
