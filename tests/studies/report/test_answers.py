"""What reports say first: the facts of the answer and of what to do, the part for the client, plain words."""

import json
import re
from html import unescape

import numpy as np
import pytest
import xarray as xr
from check_facts import check, facts_of
from report_pages import INVENTORY, STUDIES, loaded, of_client

import toppling as tp
from toppling.core.facts import INVALID
from toppling.core.wording import two_digits
from toppling.studies.command.cli import main
from toppling.studies.command.verdict import verdict
from toppling.studies.facts import answer_building as building, answer_curves as curves
from toppling.studies.facts.bars import MOST, bars_of
from toppling.studies.facts.method import inputs_of
from toppling.studies.facts.say import say
from toppling.studies.file import json_schema
from toppling.studies.report import page as module
from toppling.studies.tables.blocks import lead_blocks
from toppling.studies.text.glossary import used
from toppling.studies.text.words import reference_law

G = 9.80665
ENDS = ("", "_lower", "_upper")


def of_range(values, name):
    return tuple(float(values[f"{name}{end}"]) for end in ENDS)


def of(fact):
    return fact.value, fact.lower, fact.upper


class TestAnswer:
    def test_without_a_median(self, results):
        results["half_level"][:], results["rate"][:] = np.nan, np.nan
        results["status"] = xr.full_like(results["status"].astype(object), "no overturning")
        (fact,) = curves.answer(results)
        assert (fact.what, fact.value, fact.names) == ("curve.unknown", 0, ("no overturning",))
        assert fact.more["cases"] == 2
        none = check(results, "hazard curve")
        assert (none.what, none.word) == ("rate.none", INVALID)

    @pytest.mark.parametrize(("half", "at", "end"), [(np.inf, -1, "strongest"), (0.0, 0, "weakest")])
    def test_half_at_no_level(self, results, half, at, end):
        results["half_level"][:, 1] = half
        facts, case = facts_of(curves.answer, results), results.isel(block=0, model=1, level=at)
        assert "curve.half_level" not in facts
        last = facts["curve.at_end"]
        assert of(last) == pytest.approx([float(case[name]) for name in ("probability", "lower", "upper")])
        assert (last.more["end"], last.unit, last.level) == (end, "g", pytest.approx(float(case["level"]) / G))

    def test_of_many_blocks_the_weakest(self, results):
        many = results.isel(block=np.arange(40) % 2).assign_coords(block=[f"b{i:02}" for i in range(40)])
        rank = facts_of(curves.answer, many)["curve.rank"]
        assert (rank.value, rank.more["name"]) == (40, "“b00”")
        bars = bars_of(many)
        assert (len(bars.groups["all"]), bars.left_out) == (MOST, 40 - MOST)
        assert bars.highest == bars.groups["all"][0].value == float(results["risk_probability"][0, 1])
        assert all(int(bar.name[1:]) % 2 == 0 for bar in bars.groups["all"])  # (shelves fall before racks)

    def test_recommended_pieces_beyond_the_budget_are_apart(self, folder):
        results = loaded(folder, "performance")
        assert [*bars_of(results).groups] == ["anchor"]
        flags = results["rate"].dims, np.zeros(results["rate"].shape, dtype=bool)
        assert [*bars_of(results.assign(budget_chosen=flags)).groups] == ["dear"]
        held = results.assign_coords(anchored_with=("block", ["strap"]))
        assert [*bars_of(held).groups] == ["kit"]


class TestJson:
    def test_facts_of_the_page_with_their_numbers(self, folder, capsys):
        results, path = loaded(folder), folder / "fragility" / "results.nc"
        assert main(["report", str(path), "--json"]) == 0
        found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
        (chance,) = (fact for fact in found["answer"] if fact["what"] == "rate.chance")
        assert chance["value"] == float(results["risk_probability"][0, 1])
        page = module.content(results, path, "as written")
        assert [fact["sentence"] for fact in found["answer"]][: len(page["answer"])] == page["answer"]
        assert [fact["sentence"] for fact in found["notes"]] == page["notes"]
        assert {fact["word"] for fact in found["passed"]} == {"good"}
        curves = next(table for table in found["tables"] if table["title"].startswith("Fragility"))
        (half,) = (row["level"] for row in curves["rows"][1:2])
        assert half["value"] == pytest.approx(float(results["half_level"][0, 1]) / G)

    def test_writes_no_file(self, folder, tmp_path, capsys):
        path = folder / "fragility" / "results.nc"
        assert main(["report", str(path), "--json", "--out", str(tmp_path / "report.html")]) == 2
        assert "--json prints" in capsys.readouterr().err
        assert not list(tmp_path.iterdir())


class TestClientPart:
    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_without_keys_parameters_and_toml(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name]))
        assert not re.search(r"e=|δ=|\[\[?[a-z]|\]\]|_[a-z]+_|= \[|`|--[a-z]", text)
        tables = json_schema.study_schema()["$defs"].values()
        keys = {key for table in tables for key in table.get("properties", {}) if "_" in key}
        assert keys
        assert not [key for key in keys if re.search(rf"\b{key}\b", text)]
        if name != "sensitivity":
            assert not re.search(r"[αδζ]", text)

    @pytest.mark.slow
    @pytest.mark.parametrize("name", [name for name in STUDIES if name != "sensitivity"])
    def test_numbers_have_two_digits(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name]))
        numbers = re.findall(r"(?<![\d.,])\d+\.\d+", text)
        assert numbers
        assert [one for one in numbers if len(one.replace(".", "").lstrip("0")) > 2] == []
        # whole numbers, too, but those that are exact: years, and what the study or its inventory gives
        whole = re.findall(r"(?<![\w.,])\d{3,}(?![\w.])|(?<![\w.,])\d{1,3}(?:,\d{3})+(?!\d)", text)
        given = {float(one) for one in re.findall(r"\d+(?:\.\d+)?", STUDIES[name] + INVENTORY)} | {100.0, 1000.0}
        given.add(1963.0)  # (Housner's paper)
        computed = [one for one in whole if float(one.replace(",", "")) not in given]
        assert [one for one in computed if len(one.replace(",", "").rstrip("0")) > 2] == []

    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_each_term_is_defined_once_where_it_is_used(self, pages, name):
        text = pages[name].read_text(encoding="utf-8")
        terms = text.partition('<details id="terms">')[2].partition("</details>")[0]
        defined = [unescape(one) for one in re.findall(r"<dt>([^<]+)</dt><dd>", terms)]
        before = text.partition('<details id="terms">')[0]
        hidden = r'<style.*?</style>|<details id="figures">.*?</details>|<svg.*?</svg>|<[^>]+>'
        plain = unescape(re.sub(hidden, " ", before, flags=re.DOTALL))
        assert defined == [term.name for term in used([plain])]
        assert len(defined) >= 2

    @pytest.mark.slow
    def test_cover_changes_no_results(self, folder, results, tmp_path):
        study, source = tmp_path / "study.toml", folder / "fragility" / "results.nc"
        cover = '[report]\nclient = "A <client>"\nsite = "Here"\nauthor = "Me"\ndate = "1 May"\n'
        study.write_text(STUDIES["fragility"] + cover, encoding="utf-8")
        renamed = tp.Study.from_toml(study)
        assert renamed.identity == results.attrs["identity"]
        covered = results.assign_attrs(study=json.dumps(renamed.configuration))
        found = module.content(covered, source, "as written")
        assert found["cover"] == [("Client", "A <client>"), ("Site", "Here"), ("Author", "Me"), ("Date", "1 May")]
        assert "Client: A &lt;client&gt; · Site: Here" in module.html_page(covered, source, "as written")
        assert module.content(results, source, "as written")["cover"] == []

    def test_inputs_name_the_motions_that_were_run(self, folder):
        results = loaded(folder)

        def motions(results, **more):
            with_more = results.assign_attrs(study=json.dumps(json.loads(results.attrs["study"]) | more))
            return facts_of(inputs_of, with_more)["motion.given"]

        given = motions(results)
        assert (given.value, given.more["origin"], given.more["levels"]) == (12, "simulated", 8)
        assert given.more["scaled"]
        read = motions(results, motions={"records": ["simulated-01.AT2"]})
        assert (read.value, read.more["origin"]) == (12, "records")
        stripes = motions(loaded(folder, "stripes"))
        assert (stripes.value, stripes.more["origin"]) == (24, "varied")
        assert motions(results, motion_sets=[{}, {}]).more["sets"] == 2
        hazard = facts_of(inputs_of, results)["hazard.given"]
        assert (hazard.value, hazard.names) == (1, ("PGA", "study file"))
        assert hazard.more == {"levels": {"475": "0.21 g", "2475": "0.38 g"}}  # (by logarithms by hand)
        floors = xr.concat([results, results], "floor", data_vars="minimal").assign_coords(floor=["1", "2"])
        assert motions(floors).value == 6

    def test_of_many_blocks_and_floors(self, results):
        table = lead_blocks(results)
        at, _ = reference_law(results)
        case = results.isel(block=0, model=at)
        assert [column.key for column in table.columns] == ["block", "level", "chance", "model_range"]
        assert table.columns[1].heading == "half overturn at PGA of the ground, g"
        row = table.lines[0]
        assert row["block"] == "shelf"
        assert row["level"].value == pytest.approx(float(case["median"]) / G)
        assert row["chance"] == of_range(case, "risk_probability")
        bare = results.copy(deep=True)
        bare["half_level"][:] = np.nan
        bare["status"] = bare["status"].astype(object)
        bare["status"][0], bare["status"][1] = "no overturning", "all overturned"
        for end in ("", "_lower", "_upper", "_modelling_lower"):
            bare[f"rate{end}"][:] = np.nan
            bare[f"risk_probability{end}"][:] = np.nan
        table = lead_blocks(bare)
        assert table.column("level") == ["never seen", "at every level"]
        assert [column.key for column in table.columns] == ["block", "level"]


class TestFacts:
    def test_open_intervals(self, results):
        results["probability"][:] = 0.0
        assert "curve.rare" not in facts_of(curves.answer, results)
        results["half_level_upper"][:] = np.inf
        half = facts_of(curves.answer, results)["curve.half_level"]
        assert f"{two_digits(half.value)} g (above {two_digits(half.lower)})." in say(half, "page")
        results["half_level_lower"][:] = 0.0
        half = facts_of(curves.answer, results)["curve.half_level"]
        assert (half.lower, half.upper) == (0.0, np.inf)
        results["risk_probability_lower"][:] = np.nan
        assert "\u00a0% (interval not known) in 50" in say(facts_of(curves.answer, results)["rate.chance"], "page")

    def test_of_a_building(self, folder):
        """All else is in `tests/golden/studies`: where laws differ, and where all pieces are anchored."""
        results = loaded(folder, "performance")
        fall = facts_of(building.answer, results)["building.any_fall"]
        other = float(results["any_rate"].sel(model="energy-consistent e=e_R δ=0.05", place="building"))
        laws = facts_of(building.answer, results)["law.building_range"]
        assert (laws.lower, laws.upper, laws.more["laws"], laws.more["yearly"]) == (other, other, 1, True)
        alike = results.copy(deep=True)
        alike["any_rate"][:] = alike["any_rate"].isel(model=[1]).values
        assert "law.building_range" not in facts_of(building.answer, alike)
        assert building.rate_without(results, []) == pytest.approx(fall.value, rel=1e-9)
        held = results.assign_coords(anchored=("block", [True]))
        assert "anchoring.all_anchored" in facts_of(building.answer, held)
        inspect = facts_of(building.actions, held)["anchoring.inspect"]
        assert (inspect.value, inspect.names) == (2, ("“rack” (ground)",))

    def test_other_laws_where_they_disagree(self, folder):
        """Chances with a hazard, levels without; nothing where no law differs by a tenth."""
        results = loaded(folder)
        results["risk_probability"][0] = [0.03, 0.02]
        found = facts_of(curves.answer, results)["law.range"]
        assert (found.lower, found.upper, found.more["laws"], found.more["yearly"]) == (0.03, 0.03, 1, True)
        assert found.more["throughout"] == ()
        viscous = results.assign_coords(law=("model", ["vassiliou", "housner"]))
        assert facts_of(curves.answer, viscous)["law.range"].more["throughout"] == ()  # (more falls than impacts)
        viscous["risk_probability"][0] = [0.01, 0.02]
        assert facts_of(curves.answer, viscous)["law.range"].more["throughout"] == ("Vassiliou et al.",)
        results["risk_probability"][0] = [0.021, 0.02]
        assert "law.range" not in facts_of(curves.answer, results)
        bare = loaded(folder, "stripes")
        bare["half_level"][0] = [6.0, 4.0]
        found = facts_of(curves.answer, bare)["law.range"]
        assert (found.lower, found.upper, found.unit) == (pytest.approx(6.0 / G), pytest.approx(6.0 / G), "g")
        assert not found.more["yearly"]

    def test_of_an_uncertain_piece(self, folder):
        """What is not known of the piece: nine tenths of its samples, by hand."""
        results = loaded(folder, "uncertainty")
        results["sample_median"][0] = np.array([[0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0]] * 2) * G
        facts = facts_of(curves.answer, results)
        spread, half = facts["uncertainty.half_level"], facts["curve.half_level"]
        assert (spread.lower, spread.upper, spread.unit) == (pytest.approx(0.25), pytest.approx(2.0), "g")
        assert of(half)[1:] == pytest.approx([float(results[f"half_level{end}"][0, 1]) / G for end in ENDS[1:]])
        assert lead_blocks(results).texts("samples")[0] == "0.25–2.0"
        results["sample_median"][0, :, -1] = 2.1 * G  # (above the levels that were run: not reached)
        above = facts_of(curves.answer, results)["uncertainty.half_level"]
        assert (above.lower, above.upper) == (pytest.approx(0.25), np.inf)
        assert say(above, "page") == "With its uncertain properties that level is above 0.25 g (90\u00a0%)."
        # the reference law is found among laws of which each sample names its own
        assert reference_law(results) == (1, True)

    @pytest.mark.parametrize(("half", "at", "which"), [(np.inf, -1, "strongest"), (0.0, 0, "weakest")])
    def test_of_an_uncertain_piece_of_which_half_fall_at_no_level(self, folder, half, at, which):
        """The share at the outermost level, with the range over the samples in place of an interval."""
        results = loaded(folder, "uncertainty")
        results["half_level"][:] = half
        results["probability"][..., at] = 0.29
        results["sample_probability"][..., at] = np.linspace(0.2, 0.34, results.sizes["sample"])
        found = facts_of(curves.answer, results)["curve.at_end"]
        assert of(found) == pytest.approx((0.29, 0.2, 0.34))
        assert (found.more["end"], found.more["sampled"]) == (which, True)
        assert say(found, "page").endswith("; with its uncertain properties 20–34\u00a0% (90\u00a0%).")

    def test_names_of_the_catalogue_are_titles(self, results):
        results = results.assign_coords(block=["bookcase-5-shelf", "rack"])
        assert facts_of(curves.answer, results)["curve.rank"].more["name"] == "“Bookcase, 5 shelves”"
        assert lead_blocks(results).lines[0]["block"] == "Bookcase, 5 shelves"

    def test_the_size_that_is_needed(self, results):
        """Of what, for which target, and the pieces that miss it, which can be anchored instead."""
        results["risk_probability"][:, 1] = [0.02, 0.001]
        for end, values in {"": [0.5, 0.38], "_lower": [0.4, 0.37], "_upper": [0.6, 0.4]}.items():
            results[f"size_width{end}"] = ("model", values, {"units": "m"})
        results = results.assign_attrs(size_along="width", size_probability=0.01)
        (size,) = curves.actions(results)
        assert (size.what, of(size), size.names) == ("size.target", (0.38, 0.37, 0.4), ("“shelf”",))
        assert (size.more["others"], size.more["target"], size.more["only"]) == ((0.5, 0.5), 0.01, ())
        assert "With other damping it is 0.50 m. “shelf” misses that: anchor it if" in say(size, "page")
        assert say(size, "page") in verdict(results, answered=True)[0]  # (the study asks for it)

    def test_the_share_beyond_the_hazard_curve(self, results):
        results["rate_share_above"][:] = [[0.0, 0.01], [0.0, 0.78]]
        table = lead_blocks(results)
        assert [text.endswith("\u00a0*") for text in table.texts("chance")] == [False, True]
        assert "*: 78\u00a0% of the rate" in table.note
        results["rate_share_above"][:, 1] = [0.12, 0.78]
        assert "*: 12\u00a0% to 78\u00a0% of the rate" in lead_blocks(results).note
