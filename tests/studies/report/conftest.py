"""Results and pages of a study of every kind, a page of hostile names, and a browser."""

import browser
import pytest
from report_pages import INVENTORY, STUDIES, loaded, write_hostile

import toppling as tp
from toppling.studies.report.page import write_report


@pytest.fixture(scope="package")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("report")
    (made / "inventory.csv").write_text(INVENTORY, encoding="utf-8")
    for name, text in STUDIES.items():
        (made / f"{name}.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(made / f"{name}.toml").run(made / name)
    return made


@pytest.fixture
def results(folder):
    """Results of two blocks under two laws with a hazard, which a test may change."""
    return loaded(folder)


@pytest.fixture(scope="package")
def pages(folder):
    for name in STUDIES:
        write_report(folder / name / "results.nc")
    return {name: folder / name / "report.html" for name in STUDIES}


@pytest.fixture(scope="package")
def hostile(folder):
    """The page of results with hostile names of blocks and laws, and with missing medians and rates."""
    return write_hostile(folder, 3)


@pytest.fixture(scope="package")
def chromium():
    if browser.CHROMIUM is None:
        pytest.skip("Chromium is not there (Debian: apt install chromium)")
    opened = browser.Browser()
    yield opened
    opened.close()
