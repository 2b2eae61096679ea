"""Checks of reports: what each says of results, and that what is not good is named."""

import json
from pathlib import Path

import pytest
from check_facts import check as check_of, facts_of
from report_pages import STUDIES, Page, loaded

from toppling.core.doubts import KINDS
from toppling.core.facts import CARE, GOOD, INVALID, UNKNOWN, Fact
from toppling.studies.command.verdict import verdict
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.checks import badge, checks_of, worst_word
from toppling.studies.facts.say import SHARED, remedy, say, value_of
from toppling.studies.tables.blocks import lead_blocks
from toppling.studies.text.words import with_law_names


@pytest.mark.repository
def test_every_check_is_explained():
    """The how-to page of reports has a heading for each title of a check, and no other below *The checks*."""
    page = Path(__file__).parents[3] / "docs/howto/read_a_report.md"
    explained = page.read_text("utf-8").partition("\n## The checks\n")[2]
    headings = [line[4:].lower() for line in explained.splitlines() if line.startswith("### ")]
    assert sorted(headings) == sorted(set(value_of("titles", "checks").values()))


class TestChecks:
    @staticmethod
    def word(results, about):
        return check_of(results, about).word

    @pytest.mark.slow
    def test_words_follow_the_numbers(self, results):
        slides = {"reason": results["reason"].values.tolist().index("slides_at_uplift")}
        assert [self.word(results, about) for about in ("rocking", "sliding")] == [GOOD, UNKNOWN]
        assert self.word(results, "number of motions") == CARE  # 12 of them
        results["half_level_lower"][:], results["half_level"][:] = 1.0, 1.1
        results["rate_lower"][:], results["rate"][:], results["rate_upper"][:] = 1e-4, 2e-4, 3e-4
        for about, name, where, value, word in (
            ("rocking", "friction_uplift", ..., 0.6, INVALID),
            ("rocking", "friction_uplift", slice(1), 0.2, CARE),
            ("sliding", "outside", slides, 0.3, CARE),
            ("sliding", "outside", slides, 0.6, INVALID),
            ("number of motions", "interval_half_width", ..., 0.4, INVALID),
            ("number of motions", "interval_half_width", ..., 0.1, GOOD),
            ("intervals", "half_level_upper", ..., 1.2, GOOD),
            ("intervals", "half_level_upper", (0, 0), 9.0, CARE),
            ("intervals", "half_level_upper", ..., 9.0, INVALID),
            ("curves", "converged", (0, 0), False, CARE),
            ("curves", "converged", ..., False, INVALID),
            ("hazard curve", "rate_share_above", ..., 0.0, GOOD),
            ("hazard curve", "rate_share_above", (0, 0), 0.9, CARE),
            ("hazard curve", "rate_share_above", ..., 0.9, INVALID),
        ):
            results[name][where] = value
            assert self.word(results, about) == word, (name, value)

    def test_of_the_zone(self, results):
        wide = results["delta"] * 4.0
        assert self.word(results.isel(model=[1]), "elastic zone") == GOOD
        rigid = results.assign_coords(rest=("model", ["rigid"] * results.sizes["model"]), delta=wide)
        assert self.word(rigid, "elastic zone") == GOOD
        results = results.isel(model=[0]).assign_coords(rest=("model", ["elastic"]))
        for share, word in ((0.0, GOOD), (0.9, INVALID)):
            results["outside"].loc[{"reason": "elastic_mode"}] = share
            assert self.word(results, "elastic zone") == word
            if word == GOOD:
                assert self.word(results.assign_coords(delta=results["delta"] * 4.0), "elastic zone") == CARE

    def test_of_the_laws_that_the_answer_is_given_for(self, results):
        """The elastic mode of a law beside the reference law is named in the appendix, and not in the badge."""
        results["outside"][:] = 0.0
        both = results.assign_coords(rest=("model", ["elastic", "rigid"]))
        both["outside"].loc[{"reason": "elastic_mode", "model": both["model"][0]}] = 0.85
        assert self.word(both, "elastic zone") == GOOD
        (other,) = (fact for fact in checks_of(both) if fact.what == "law.other_elastic_modes")
        assert (other.value, other.names) == (0.85, ("energy-consistent e=e_R δ=0.05",))
        assert "elastic zone" not in badge(checks_of(both)).names
        only = both.isel(model=[0])
        assert check_of(only, "elastic zone").value == 0.85
        assert "elastic zone" in badge(checks_of(only)).names
        # a sensitivity study is about all of its laws, and branches weigh all of theirs
        assert self.word(both.assign_attrs(kind="sensitivity"), "elastic zone") == CARE
        weighted = both.assign_coords(branch_model=("branch", both["model"].values))
        assert self.word(weighted, "elastic zone") == CARE

    def test_of_rates_from_shaking_that_was_not_run(self, results):
        """The word follows how far the rate can be off, whatever a curve that rises on does above the highest level."""
        results["rate"][:], results["rate_share_below_levels"][:] = 1e-3, 0.0
        about = "range of levels"

        def set_to(share, reached, most):
            # of such shaking every run reaches the state at `most` times the rate of the results
            results["rate_share_above_levels"][:] = share
            results["probability_at_highest_level"][:] = reached
            results["rate_above_highest_level"][:] = most * 1e-3
            return check_of(results, about)

        assert set_to(0.04, 0.5, 0.06).word == GOOD
        risen = set_to(0.3, 0.94, 0.31)
        assert (risen.what, risen.word) == ("rate.extrapolated_bounded", GOOD)
        assert (risen.value, risen.more["side"], risen.upper) == (0.3, "above", pytest.approx(0.01))
        wide = set_to(0.3, 0.5, 0.5)
        assert (wide.word, wide.value, wide.more["side"]) == (CARE, 0.3, "above")
        assert (wide.lower, wide.upper) == pytest.approx((0.95, 1.20))
        assert wide.more["advice"].startswith("raise ida.levels.to")
        assert set_to(0.8, 0.1, 3.0).word == INVALID
        results["rate_above_highest_level"][0], results["probability_at_highest_level"][0] = 0.82e-3, 0.97
        assert self.word(results, about) == CARE  # (not of every block and law)

        assert set_to(0.0, 0.99, 0.0).word == GOOD
        results["rate_share_below_levels"][0, 0] = 0.2
        weak = check_of(results, about)
        assert (weak.word, weak.value, weak.more["side"]) == (CARE, 0.2, "below")
        assert weak.more["advice"].startswith("lower ida.levels.from")
        older = results.drop_vars(["rate_share_below_levels", "rate_share_above_levels"])
        assert self.word(older, about) == UNKNOWN

    @pytest.mark.slow
    def test_rates_say_where_they_stand_that_curves_are_extrapolated(self, results):
        results["rate_share_above_levels"][:], results["rate_share_below_levels"][:] = 0.3, 0.0
        results["probability_at_highest_level"][:] = 0.5
        results["rate_above_highest_level"][:] = 0.5 * results["rate"].values
        found = facts_of(curves.answer, results)["rate.part_extrapolated"]
        assert (found.value, found.names, found.more["side"]) == (0.3, ("“shelf”",), "above")
        said, table = say(found, "page"), lead_blocks(results)
        assert all("30\u00a0%" in text for text in (said, table.note))
        assert all(row["chance"].mark.endswith("‡") for row in table.lines)
        assert said in verdict(results, True)[0]
        results["probability_at_highest_level"][:] = 0.97
        results["rate_above_highest_level"][:] = 0.31 * results["rate"]
        assert said not in verdict(results, True)[0]
        assert "‡" not in lead_blocks(results).note

    def test_the_worst_word_wins(self):
        for words, worst in (((GOOD, GOOD), GOOD), ((UNKNOWN, GOOD), CARE), ((CARE, INVALID), INVALID)):
            assert worst_word([Fact("block.squat", word=word) for word in words]) == worst

    def test_the_badge_names_what_is_not_good_the_worst_first(self):
        checks = [
            Fact("sliding.share", word=CARE),
            Fact("rate.none", word=INVALID),
            Fact("block.squat", word=GOOD),
            Fact("support.castors", word=CARE),
            Fact("support.castors", word=CARE),
        ]
        found = badge(checks)
        assert (found.word, found.names, found.value) == (INVALID, ("hazard curve", "sliding", "castors"), 4)
        assert say(found, "checks").startswith(f"{INVALID}. 3 of 4 ")
        assert say(badge(checks[2:3]), "checks") == GOOD
        assert say(badge(checks[:1]), "checks").startswith(f"{CARE}. 1 of 1 check ")

    @pytest.mark.slow
    def test_every_kind_of_doubt_is_named(self, results):
        for kind in {*KINDS} - {"spectra"}:
            check = check_of(results.assign_attrs(doubts=json.dumps([[kind, "it is so", False]])), "inputs")
            assert (check.word, check.names, check.more["sentences"]) == (CARE, (kind,), ["It is so."])

    @pytest.mark.parametrize("kind", STUDIES)
    def test_a_page_says_what_is_not_good_and_what_to_do(self, folder, pages, kind):
        results = with_law_names(loaded(folder, kind))
        text = " ".join("".join(Page(pages[kind]).text).split())
        assert f"Validity: {say(badge(checks_of(results)), 'checks')}" in text
        for check in checks_of(results):
            if check.word != GOOD:
                assert " ".join(say(check, "checks").split()) in text
                assert " ".join(remedy(check, "checks").split()) in text
                assert check.remedy or check.more.get("sentence") == "missing"


def test_every_check_has_a_title_and_a_sentence():
    module = value_of("titles", "checks")
    for what in module:
        name = SHARED.get(what, what) if what not in ("curve.forced", "rate.extrapolated") else what
        assert value_of(name.replace(".", "_"), "checks").name == name.replace(".", "_")
