"""What reports say first: answers in sentences, the part for the client, plain words."""

import json
import math
import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from report_pages import INVENTORY, STUDIES, loaded, of_client
from scipy.stats import norm
from study_schema import made_schema

import toppling as tp
from toppling.core.wording import about_percent, three_digits, two_digits
from toppling.studies import StudyError
from toppling.studies.facts.fact import CARE, GOOD, INVALID, UNKNOWN, Fact
from toppling.studies.report import page as module
from toppling.studies.report.actions import next_steps
from toppling.studies.report.answers import answer
from toppling.studies.report.basis import basis
from toppling.studies.report.law_choice import law_choice
from toppling.studies.report.summary import plain_answer
from toppling.studies.tables.client import client_rows
from toppling.studies.text.glossary import TERMS
from toppling.studies.text.words import reference_law


class TestAnswer:
    def test_reference_law_first(self, folder):
        results = loaded(folder)
        assert reference_law(results) == (1, True)
        said = answer(results).sentences
        one = results.isel(block=0, model=1)
        g = 9.80665
        interval = (
            f"{three_digits(one['half_level_lower'].item() / g)}–{three_digits(one['half_level_upper'].item() / g)}"
        )
        assert said[0].startswith("“shelf” overturns with a probability of 50 % at a peak")
        half = three_digits(one["half_level"].item() / g)
        assert f"{half} g (95 % interval {interval}) under housner e=e_R, the ref" in said[0]
        assert f"The other law gives {three_digits(results['half_level'].values[0, 0] / g)} g" in said[0]
        assert "the mean return period is" in said[0]
        assert reference_law(results.isel(model=[0])) == (0, False)
        assert "reference" not in answer(results.isel(model=[0])).sentences[0]

    def test_no_median_is_said(self, folder):
        results = loaded(folder).copy(deep=True)
        results["half_level"][:] = np.nan
        results["rate"][:] = np.nan
        results["status"] = results["status"].astype(object)
        results["status"][:] = "no overturning"
        said = answer(results).sentences[0]
        assert (
            "has no such level under housner e=e_R, the reference law: no overturning. No other law has such a" in said
        )
        assert "Without a curve there is no annual rate." in said

    def test_beyond_the_levels_is_said(self, folder):
        results = loaded(folder).copy(deep=True)
        results["half_level"][:, 1] = np.inf
        said = answer(results).sentences[0]
        assert "does not reach a probability of 50 % under" in said
        assert "up to the highest shaking that was run (2.00 g)." in said
        results["half_level"][:, 1] = 0.0
        assert "in half of the runs or more at every level" in answer(results).sentences[0]

    def test_of_an_inventory(self, folder):
        results = loaded(folder, "performance")
        said = answer(results).sentences
        assert "of the 2 pieces that are not anchored overturn a year" in said[0]
        assert "EUR" in said[0]
        assert said[1].startswith("Anchoring “rack” (ground) saves the most of the ")

    def test_of_many_blocks_the_weakest(self, folder):
        results = loaded(folder)
        many = results.isel(block=np.arange(40) % 2).assign_coords(block=[f"b{i:02}" for i in range(40)])
        said = answer(many).sentences
        assert len([one for one in said if one.startswith("“b")]) == 12
        assert all(int(one[2:4]) % 2 == 0 for one in said if one.startswith("“b"))  # shelves fall before racks


class TestClientPart:
    """The first part of a report: no key names, no parameters of laws, two digits, every term defined once."""

    @pytest.mark.slow
    @pytest.mark.parametrize("name", STUDIES)
    def test_without_keys_parameters_and_toml(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name]))
        rules = text.partition("What this answer rests on")[0]
        assert not re.search(r"e=|δ=|\[\[?[a-z]|\]\]|_[a-z]+_|= \[|`|--[a-z]", text)
        tables = made_schema.study_schema()["$defs"].values()
        keys = {key for table in tables for key in table.get("properties", {}) if "_" in key}
        assert keys
        assert not [key for key in keys if re.search(rf"\b{key}\b", text)]
        if name != "sensitivity":
            assert not re.search(r"[αδζ]", rules)

    @pytest.mark.slow
    @pytest.mark.parametrize("name", [name for name in STUDIES if name != "sensitivity"])
    def test_numbers_have_two_digits(self, pages, name):
        text = re.sub(r"<[^>]+>", " ", of_client(pages[name])).partition("What this answer rests on")[0]
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
        defined = [unescape(one) for one in re.findall(r"<dt>([^<]+)</dt><dd>", text)]
        assert len(set(defined)) == len(defined) >= 8
        assert set(defined) <= {one.name for one in TERMS}
        plain = unescape(re.sub(r"<dl.*?</dl>|<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", text, flags=re.DOTALL))
        for one in ("hazard curve", "median", "fragility curve", "damping law", "uplift", "bootstrap", "payback"):
            if re.search(rf"\b{one}s?\b", plain.partition("Provenance")[0]):
                assert one in defined, one

    @pytest.mark.slow
    def test_cover_changes_no_results(self, folder, tmp_path):
        source = Path(folder / "fragility")
        study = tmp_path / "study.toml"
        study.write_text(STUDIES["fragility"], encoding="utf-8")
        before = tp.Study.from_toml(study).identity
        cover = '[report]\nclient = "A <client>"\nsite = "Here"\nauthor = "Me"\ndate = "1 May"\n'
        study.write_text(f"{STUDIES['fragility']}{cover}", encoding="utf-8")
        renamed = tp.Study.from_toml(study)
        assert renamed.identity == before
        with xr.open_dataset(source / "results.nc") as results:
            covered = results.load().assign_attrs(study=json.dumps(renamed.configuration))
        found = module.content(covered, source / "results.nc", "as written")
        assert found["cover"] == [("Client", "A <client>"), ("Site", "Here"), ("Author", "Me"), ("Date", "1 May")]
        page = module.html_page(covered, source / "results.nc", "as written")
        assert "<dt>Client</dt><dd>A &lt;client&gt;</dd>" in page
        assert module.content(loaded(folder), source / "results.nc", "as written")["cover"] == []

    @pytest.mark.parametrize("cover", ["", 'client = " "', 'client = "a"\ntitle = "b"', "date = 2026-01-01"])
    def test_covers_that_are_refused(self, tmp_path, cover):
        (tmp_path / "study.toml").write_text(f"{STUDIES['fragility']}[report]\n{cover}\n", encoding="utf-8")
        with pytest.raises(StudyError, match="report"):
            tp.Study.from_toml(tmp_path / "study.toml")

    def test_basis_names_the_motions_that_were_run(self, folder):
        said = basis(loaded(folder))[0]
        assert said == "The pieces are shaken by 12 simulated ground motions, scaled to 8 levels of shaking."
        assert any(
            one.startswith("Ranges in brackets, apart from model ranges, are 95 %") for one in basis(loaded(folder))
        )
        read_from = json.loads(loaded(folder).attrs["study"]) | {"motions": {"records": ["simulated-01.AT2"]}}
        said = basis(loaded(folder).assign_attrs(study=json.dumps(read_from)))[0]
        assert said == "The pieces are shaken by 12 ground motions read from files, scaled to 8 levels of shaking."
        stripes = basis(loaded(folder, "stripes"))[0]
        assert "24 ground motions, from different earthquakes for each level of shaking" in stripes
        results = loaded(folder)
        study = json.loads(results.attrs["study"]) | {"motion_sets": [{}, {}], "hazards": [{}]}
        branched = results.assign_attrs(study=json.dumps(study))
        assert "; 2 further sets of motions are weighted with it." in basis(branched)[0]
        assert "How often the ground shakes, and how strongly, is taken from 2 weighted hazard curves." in basis(
            branched
        )
        floors = xr.concat([results, results], "floor", data_vars="minimal").assign_coords(floor=["1", "2"])
        assert "are shaken by 6 simulated" in basis(floors)[0]

    def test_of_many_blocks_and_floors(self, folder):
        results = loaded(folder)
        rows = client_rows(results)
        at, _ = reference_law(results)
        one = results.isel(block=0, model=at)
        assert rows.headings == (
            "piece",
            "PGA of the ground at which half of the motions overturn it, g",
            "mean return period, years",
            "chance in 50 years",
            "model range of this chance",
        )
        assert rows.rows[0][0] == "shelf"
        assert rows.rows[0][1].startswith(f"{two_digits(float(one['median']) / 9.80665)} (")
        assert rows.rows[0][2] == two_digits(1.0 / float(one["rate"]))
        assert rows.rows[0][3].startswith(about_percent(float(one["risk_probability"])))
        bare = results.copy(deep=True)
        bare["half_level"][:] = np.nan
        bare["status"] = bare["status"].astype(object)
        bare["status"][0], bare["status"][1] = "no overturning", "all overturned"
        for end in ("", "_lower", "_upper", "_modelling_lower"):
            bare[f"rate{end}"][:] = np.nan
            bare[f"risk_probability{end}"][:] = np.nan
        assert [row[1:] for row in client_rows(bare).rows] == [
            ("never seen", "not known", "not known"),
            ("at every level", "not known", "not known"),
        ]


class TestPlainWords:
    """The summary in plain words at the top of a report."""

    def test_of_a_hundred_earthquakes(self, folder):
        results = loaded(folder)
        one = results.isel(block=0, model=1)
        seen = one["probability"].values
        below = np.flatnonzero((seen > 0) & (seen < 0.5) & (one["level"].values < float(one["half_level"])))
        at = below[np.abs(np.log(10.0 * seen[below])).argmin()]
        g = 9.80665
        first, second, third, modelled, laws = plain_answer(results)
        assert "one factor, 0.68 to 1.5 (10 to 90 %" in modelled
        assert laws.endswith(law_choice(results))  # (the laws agree: none of their results is given)
        assert first == (
            "By these motions “shelf” is the more vulnerable of the 2 pieces, but not with certainty: its interval "
            "overlaps with that of “rack”."
        )
        strong = f"Of 100 earthquakes with a peak ground acceleration of {two_digits(float(one['level'][at]) / g)} g, "
        few = [round(100 * float(one[end][at])) for end in ("probability", "lower", "upper")]
        assert second.startswith(f"{strong}about {few[0]} ({few[1]} to {few[2]}; model range ")
        off = [math.exp(1.28 * 0.3 * sign) for sign in (-1.0, 1.0)]
        of_curve = [norm.cdf(np.log(one["level"][at] / one["median"] / factor) / one["dispersion"]) for factor in off]
        assert f" model range {100 * of_curve[1]:.0f} to {100 * of_curve[0]:.0f}) would overturn “shelf”; at " in second
        ends = [two_digits(float(one["half_level"]) * factor / g) for factor in off]
        level, low, high = (two_digits(float(one[f"half_level{end}"]) / g) for end in ("", "_lower", "_upper"))
        assert second.endswith(
            f"; at {level} g ({low}–{high}; model range {ends[0]}–{ends[1]}) about half of them would. "
            "The first ranges in brackets are 95 % intervals for the limited number of motions."
        )
        chance = float(one["risk_probability"])
        assert f"overturns within 50 years is about {100 * chance:.2g}\u00a0%" in third

    def test_without_what_it_needs(self, folder):
        results = loaded(folder).copy(deep=True)
        results["probability"][:] = 0.0
        said = plain_answer(results)
        assert "about 50 would overturn “shelf”" in said[1]
        results["half_level_upper"][:] = np.inf
        assert re.search(r" g \(above [\d.]+; model range [\d.–]+\), about 50 would", plain_answer(results)[1])
        results["half_level_lower"][:] = 0.0
        assert "(these motions do not show how precisely that level is known; model range" in plain_answer(results)[1]
        results["half_level"][:] = np.nan
        results["status"] = results["status"].astype(object)
        results["status"][:] = "no overturning"
        assert plain_answer(results) == ["The runs do not show how strong the shaking must be: no overturning."]
        assert plain_answer(loaded(folder, "cloud"))[1].startswith("Of 100 earthquakes with a ")

    def test_of_a_building(self, folder):
        results = loaded(folder, "performance")
        one = results.sel(model="housner e=e_R", place="building")
        rate = float(one["any_rate"])
        said = plain_answer(results)
        assert said[0].startswith(
            f"At least one piece in this building overturns about once in {two_digits(1 / rate)} years ("
        )
        assert f", which is a probability of about {about_percent(1 - np.exp(-50 * rate))} (" in said[0]
        assert said[0].endswith(" in 50 years.")
        other = float(results["any_rate"].sel(model="energy-consistent e=e_R δ=0.05", place="building"))
        assert said[1] == (
            "The answer depends on the damping law that is assumed: under the other law of this study, this happens "
            f"about once in {two_digits(1 / other)} years. {law_choice(results)}"
        )
        alike = results.copy(deep=True)
        alike["any_rate"][:] = alike["any_rate"].values[1]
        assert plain_answer(alike) == [said[0], *said[2:]]
        assert said[2].startswith(
            f"The expected loss (the value of what falls) is about {two_digits(float(one['annual_loss']))} EUR a year ("
        )
        rate = float(one["consequence_rate"].sel(consequence="injury"))
        assert said[3].startswith(
            f"At least one piece that can injure people overturns about once in {two_digits(1 / rate)} years ("
        )
        assert "one factor, 0.68 to 1.5 (10 to 90 %" in said[4]
        assert said[5].startswith("All other ranges here are 95 % intervals that reflect only the limited number of")
        assert len(said) == 6
        held = results.assign_coords(anchored=("item", [True]))
        assert plain_answer(held)[4] == "2 of 2 pieces are anchored and assumed not to overturn: 2 × rack."

    def test_other_laws_where_they_disagree(self, folder):
        """Chances with a hazard, levels without; nothing where no law differs by a tenth."""
        results = loaded(folder).copy(deep=True)
        results["risk_probability"][0] = [0.03, 0.02]
        assert "overturns within 50 years is 3.0\u00a0%." in plain_answer(results)[-1]
        results["risk_probability"][0] = [0.021, 0.02]
        assert not [one for one in plain_answer(results) if "damping law that is assumed" in one]
        bare = loaded(folder, "stripes").copy(deep=True)
        bare["half_level"][0] = [6.0, 4.0]
        said = plain_answer(bare)[-1]
        assert "about half of the earthquakes would overturn “shelf” at a peak ground acceleration of 0.61 g." in said

    def test_of_an_uncertain_piece(self, folder):
        """The headline's range holds what is not known of the piece: nine tenths of its samples, by hand."""
        results = loaded(folder, "uncertainty").copy(deep=True)
        g = 9.80665
        results["sample_median"][0] = np.array([[0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0]] * 2) * g
        first = next(one for one in plain_answer(results) if one.startswith("Of 100 earthquakes"))
        assert "this level may lie between 0.25 and 2.0 g (90 % range)" in first
        ends = [two_digits(float(results[f"half_level_{end}"][0, 1]) / g) for end in ("lower", "upper")]
        assert first.endswith(f"The 95 % interval for the limited number of motions is {'–'.join(ends)} g.")
        rows = client_rows(results)
        assert dict(zip(rows.headings, rows.rows[0], strict=True))["90 % range over its uncertain properties, g"] == (
            "0.25–2.0"
        )
        results["sample_median"][0, :, -1] = 2.1 * g  # (above the levels that were run: not reached)
        assert any("may lie above 0.25 g (90 % range)" in one for one in plain_answer(results))
        # the reference law is found among laws of which each sample names its own
        assert reference_law(results) == (1, True)

    @pytest.mark.parametrize(("half", "at", "which"), [(np.inf, -1, "strongest"), (0.0, 0, "weakest")])
    def test_of_an_uncertain_piece_of_which_half_fall_at_no_level(self, folder, half, at, which):
        """The count at the outermost level, with the range over the samples in place of an interval."""
        results = loaded(folder, "uncertainty").copy(deep=True)
        results["half_level"][:] = half
        results["probability"][..., at] = 0.29
        results["sample_probability"][..., at] = np.linspace(0.2, 0.34, results.sizes["sample"])
        said = " ".join(plain_answer(results))
        assert f", the {which} shaking that was run, about 29 would overturn “" in said
        assert "this number may lie between 20 and 34 (90 % range)." in said

    def test_names_of_the_catalogue_are_titles(self, folder):
        results = loaded(folder).assign_coords(block=["bookcase-5-shelf", "rack"])
        assert plain_answer(results)[0].startswith("By these motions “Bookcase, 5 shelves” is the more vulnerable of")
        assert client_rows(results).rows[0][0] == "Bookcase, 5 shelves"

    def test_the_size_that_is_needed(self, folder):
        """Of what, for which target, and the pieces that miss it, which can be anchored instead."""
        results = loaded(folder).copy(deep=True)
        results["risk_probability"][:, 1] = [0.02, 0.001]
        for end, values in {"": [0.5, 0.38], "_lower": [0.4, 0.37], "_upper": [0.6, 0.4]}.items():
            results[f"size_width{end}"] = ("model", values, {"units": "m"})
        results = results.assign_attrs(size_along="width", size_probability=0.01)
        assert next_steps(results, []) == [
            "For the chance that a piece like these overturns to meet the target of this study (no more than "
            "1\u00a0% in 50 years), its width must be at least about 0.38 m (0.37–0.40; 0.50 m under the other law), "
            "with its other dimensions unchanged.",
            "“shelf” does not meet this target: where its width cannot be changed, anchor it.",
        ]
        said = "A width of 0.380 m (0.370–0.400) meets the target of 1 % in 50 years under housner e=e_R."
        assert answer(results).sentences[-1] == said

    def test_the_share_beyond_the_hazard_curve(self, folder):
        """The footnote gives the shares of the marked rows themselves."""
        results = loaded(folder).copy(deep=True)
        results["rate_share_above"][:] = [[0.0, 0.01], [0.0, 0.78]]
        rows = client_rows(results)
        assert [row[2].endswith(" *") for row in rows.rows] == [False, True]
        assert "*: 78\u00a0% of the rate comes from shaking beyond the end of the hazard curve" in rows.title
        results["rate_share_above"][:, 1] = [0.12, 0.78]
        assert "*: 12\u00a0% to 78\u00a0% of the rate" in client_rows(results).title

    def test_what_matters_most(self, folder):
        results = loaded(folder, "uncertainty")
        one = results.isel(block=0)
        share = one["capacity_share"] if "capacity_share" in one else one["flag_share"].isel(level=0)
        assert share.dims == ("component",)
        said = next(line for line in plain_answer(results) if "contribution to that scatter" in line)
        assert f" {about_percent(float(share.max()))}, comes from " in said
        assert not re.search(r"[αδ$×]", said)

    def test_next_steps_count_the_checks_that_are_not_good(self, folder):
        results = loaded(folder, "cloud")
        every = [Fact("rate.none", word=word) for word in (GOOD, CARE, UNKNOWN, CARE, INVALID)]
        first, last = next_steps(results, every)
        assert "If a hazard curve for the site is added to the study" in first
        assert "the validity checks that are not rated “good” (4 of 5)" in last
        assert "the validity check that is not rated “good” (1 of 2)" in next_steps(results, every[:2])[1]
        assert next_steps(results, every[:1]) == [first]
        sliding = Fact("sliding.share", word=CARE)
        assert "with a second person steadying it and nobody where it could fall" in next_steps(results, [sliding])[1]
        assert next_steps(results, [Fact("sliding.share", word=GOOD)]) == [first]
        steps = next_steps(loaded(folder, "performance"), [])
        assert steps == [
            "Anchor first, for safety (injury): “rack” (ground).",
            "Code requirements are not checked. Any piece that the law requires to be anchored must be anchored, "
            "whatever these results say.",
        ]
