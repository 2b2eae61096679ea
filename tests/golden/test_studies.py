"""Every study of the corpus has the numbers that are expected of it."""

import pytest
import xarray as xr
from check_results import check_results
from expect import PAGE, compute, differences, otherwise_said, read, said, tolerances
from study_cases import cases, folders, settings

from toppling.studies.report.page import content
from toppling.studies.store.content import ATTRIBUTE, content_digest

STUDIES = [
    pytest.param(folder, id=folder.name, marks=() if settings(folder).get("fast") else pytest.mark.slow)
    for folder in folders()
]


@pytest.mark.slow
@pytest.mark.parametrize("folder", STUDIES)
def test_numbers_of_a_study(folder, tmp_path):
    results = compute(folder, tmp_path / "study")
    assert not list(differences(read(folder), results, tolerances(folder)))
    assert not list(otherwise_said(read(folder, PAGE), said(results)))
    check_results(results)
    with xr.open_dataset(tmp_path / "study" / "out" / "results.nc") as stored:
        assert content_digest(stored) == content_digest(results) == results.attrs[ATTRIBUTE]
    page = content(results, tmp_path / "study" / "out" / "results.nc", "as written")
    assert page["answer"]


def test_a_third_is_fast_and_every_study_is_a_case():
    assert len(cases()) == len(STUDIES) >= 60
    assert 0.25 < sum(bool(settings(folder).get("fast")) for folder in folders()) / len(STUDIES) < 0.4
