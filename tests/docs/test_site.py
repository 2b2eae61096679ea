"""The built site: its search finds every key and variable, and old addresses lead on."""

import json
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[2]
BUILT = ROOT / "docs/_build/html"
INDEX = BUILT / "searchindex.js"


@pytest.mark.skipif(not INDEX.is_file(), reason="the site is not built: `make docs`")
class TestSearch:
    @pytest.fixture(scope="class")
    @staticmethod
    def terms():
        """Words of the index; Sphinx stems what is searched for, too."""
        index = json.loads(re.search(r"\{.*\}", INDEX.read_text("utf-8"), re.DOTALL)[0])
        return {*index["terms"], *index["titleterms"]}

    @pytest.mark.parametrize("page", ["study-file", "results"])
    def test_it_finds_every_key_and_variable(self, terms, page):
        stemmer = pytest.importorskip("snowballstemmer").stemmer("english")
        text = (ROOT / "docs/_made" / f"{page}.md").read_text("utf-8")
        names = {
            word for cell in re.findall(r"(?m)^\| (`\w+`(?:, `\w+`)*) \|", text) for word in re.findall(r"\w+", cell)
        }
        assert len(names) > 100
        missing = {name for name in names if stemmer.stemWord(name.lower()) not in terms and name.lower() not in terms}
        assert not {name for name in missing if len(name) > 2}

    def test_old_addresses_lead_on(self):
        for name in ("use", "decisions", "scaling", "scaling_measured", "questions", "coverage", "kits", "sensitivity"):
            target = re.search(r'url=([^"]+)"', (BUILT / f"{name}.html").read_text("utf-8"))[1]
            assert (BUILT / target).is_file(), name
