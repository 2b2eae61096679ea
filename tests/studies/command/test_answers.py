"""What a study leaves on a terminal below its short table, and what it says of runs that were there already."""

import re
import warnings

import pytest
import xarray as xr
from check_facts import facts_of
from study_texts import HAZARD, IDA, crate_study, motions, study_in

from toppling.core.doubts import ImplausibleInput
from toppling.studies.command.cli import main
from toppling.studies.facts import answer_building as of_building, answer_sensitivity as sensitivity
from toppling.studies.facts.say import say
from toppling.studies.kinds.study import Study

BUILDING = (
    'title = "Office"\n[[models]]\nlaw = "housner"\n'
    + motions(20)
    + '[performance]\ninventory = "things.csv"\nim = "pga"\nreplicates = 200\nbudget = 100\n'
    + 'levels = { from = 1.0, to = 12.0, number = 7, spacing = "log", unit = "m/s2" }\n'
    + HAZARD.replace('m/s"', 'm/s2"')
)
THINGS = (
    "item,width_m,height_m,floor,count,value,currency,anchoring_cost\n"
    "shelf,0.35,1.7,0,4,300,EUR,1\nrack,0.5,2.0,0,2,9000,EUR,200\n"
)
KIT = '[[blocks]]\nname = "{}"\nwidth_m = 0.3\nheight_m = 1.8\nwall_gap_mm = 20\n'


@pytest.fixture
def building(tmp_path):
    (tmp_path / "things.csv").write_text(THINGS, encoding="utf-8")
    (tmp_path / "study.toml").write_text(BUILDING, encoding="utf-8")
    return tmp_path / "study.toml"


def printed(capsys, study, *more):
    assert main(["run", str(study), "--out", str(study.parent / "out"), *more]) == 0
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
class TestBuilding:
    def test_the_answer_and_what_changed_keys_decide(self, building, capsys):
        text = printed(capsys, building)
        assert "falls in 50" in text
        assert "Expected loss: " in text
        with xr.open_dataset(building.parent / "out/results.nc") as results:
            assert results.sizes["block"] == 2
            lines = facts_of(of_building.actions, results)["anchoring.lines"]
            assert (lines.names, lines.more["budget"]) == (("“shelf” (ground)",), 100.0)
            assert " ".join(say(next(of_building.answer(results)), "page").split()) in text
        assert "of 100 EUR" in text
        assert "were there already" in printed(capsys, building)
        building.write_text(BUILDING.replace("budget = 100", "budget = 500"), encoding="utf-8")
        text = printed(capsys, building)
        assert "runs kept;" in text
        assert "(recommendations, title)" in text
        assert "were there already" not in text
        assert "of 500 EUR" in text


@pytest.mark.slow
def test_sentences_of_a_sensitivity_study(tmp_path, capsys):
    text = 'title = "δ"\n[[blocks]]\nwidth_m = 0.4\nheight_m = 1.8\n[[models]]\nlaw = "discrete"\n'
    more = '[sensitivity]\nparameter = "delta"\nvalues = [0.01, 0.05, 0.1]\nreplicates = 100\n'
    (tmp_path / "study.toml").write_text(text + motions(12) + IDA + more, encoding="utf-8")
    said = printed(capsys, tmp_path / "study.toml")
    assert "Median relative" in said
    with xr.open_dataset(tmp_path / "out/results.nc") as results:
        sentences = [" ".join(say(fact, "page").split()) for fact in sensitivity.answer(results)]
    assert sentences
    assert all(sentence in said for sentence in sentences)


def test_names_with_commas_are_quoted(tmp_path):
    text = 'title = "One"\n' + KIT.format("20 mm, with a kit") + KIT.format("free") + '[[models]]\nlaw = "housner"\n'
    (tmp_path / "study.toml").write_text(text + motions(4) + IDA, encoding="utf-8")
    notes = Study.from_toml(tmp_path / "study.toml").notes
    assert any(re.match("“20 mm,.*kit”, free:", note) for note in notes)


RARE = '[hazard]\nlevels = [0.05, 0.1, 0.25, 0.5, 1.0]\nrates = [0.04, 0.0139, 0.0021, 0.0004, 0.00005]\nunit = "g"\n'


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [["export", "out", "--format", "xlsx"], ["compare", "out", "--laws", "discrete", "housner"]]
)
def test_computed_rates_are_no_given_ones(tmp_path, monkeypatch, words):
    """They are not asked whether they are return periods; the upper end of few motions is any rate."""
    monkeypatch.chdir(tmp_path)
    study_in(tmp_path, crate_study("Few", 3, 6, 0.02, 3) + RARE).run(tmp_path / "out")
    with warnings.catch_warnings(action="error", category=ImplausibleInput):
        assert main(words) == 0
