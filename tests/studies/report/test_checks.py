"""Checks of reports: what each says of results, and that what is not good is named."""

import json

import pytest
from report_pages import STUDIES, Page, loaded

from toppling.core.doubts import KINDS
from toppling.studies.command.verdict import verdict
from toppling.studies.report.answers import answer
from toppling.studies.report.law_choice import law_choice
from toppling.studies.report.summary import plain_answer
from toppling.studies.report.validity import CARE, GOOD, INVALID, ODD, UNKNOWN, Check, badge, checks_of, worst_word
from toppling.studies.tables.client import client_rows


class TestChecks:
    @staticmethod
    def word(results, about):
        return next(one.word for one in checks_of(results) if about in one.question)

    @pytest.mark.slow
    def test_words_follow_the_screen(self, folder):
        results = loaded(folder).copy(deep=True)
        assert self.word(results, "bounce") == GOOD
        assert self.word(results, "enough motions") == CARE  # 12 of them
        assert self.word(results, "slide") == UNKNOWN  # no friction is given
        results["friction_uplift"][:] = 0.6
        assert self.word(results, "bounce") == INVALID
        results["friction_uplift"][:1] = 0.2
        assert self.word(results, "bounce") == CARE
        results["outside"].loc[{"reason": "slides_at_uplift"}] = 0.3
        assert self.word(results, "slide") == CARE
        results["outside"].loc[{"reason": "slides_at_uplift"}] = 0.6
        assert self.word(results, "slide") == INVALID
        results["interval_half_width"][()] = 0.4
        assert self.word(results, "enough motions") == INVALID
        results["interval_half_width"][()] = 0.1
        assert self.word(results, "enough motions") == GOOD

    def test_of_the_zone(self, folder):
        results = loaded(folder).copy(deep=True)
        assert self.word(results.isel(model=[1]), "δ") == GOOD
        rigid = results.assign_coords(rest=("model", ["rigid"] * results.sizes["model"]))
        assert self.word(rigid.assign_coords(delta=results["delta"] * 4.0), "δ") == GOOD  # (nothing that resonates)
        results = results.isel(model=[0]).assign_coords(rest=("model", ["elastic"]))
        results["outside"].loc[{"reason": "elastic_mode"}] = 0.0
        assert self.word(results, "δ") == GOOD
        assert self.word(results.assign_coords(delta=results["delta"] * 4.0), "δ") == CARE
        results["outside"].loc[{"reason": "elastic_mode"}] = 0.9
        assert self.word(results, "δ") == INVALID

    def test_of_the_laws_that_the_answer_is_given_for(self, folder):
        """The elastic mode of a law beside the reference law is named in the appendix, and not in the badge."""
        results = loaded(folder).copy(deep=True)
        results["outside"][:] = 0.0
        both = results.assign_coords(rest=("model", ["elastic", "rigid"]))
        both["outside"].loc[{"reason": "elastic_mode", "model": both["model"][0]}] = 0.85
        found = next(one for one in checks_of(both) if "δ" in one.question)
        assert found.word == GOOD
        assert "Other laws of this study (energy-consistent e=e_R δ=0.05), for which the answer is not" in found.reason
        assert "85 % of the runs" in found.reason
        assert "elastic" not in badge(checks_of(both))
        only = both.isel(model=[0])
        assert "the law’s elastic mode resonates in up to 85 % of the runs" in badge(checks_of(only))
        # a sensitivity study is about all of its laws, and branches weigh all of theirs
        assert self.word(both.assign_attrs(kind="sensitivity"), "δ") == CARE
        weighted = both.assign_coords(branch_model=("branch", both["model"].values))
        assert self.word(weighted, "δ") == CARE
        both["risk_probability"][0] = [0.03, 0.02]
        said = plain_answer(both)[-1]
        assert said.startswith("The answer depends on the damping law that is assumed: under the other law of this")
        assert "That law lets a standing piece vibrate elastically, so that it begins to rock in weaker shaking" in said
        assert said.endswith(law_choice(both))

    def test_of_intervals_and_curves(self, folder):
        results = loaded(folder).copy(deep=True)
        results["half_level_lower"][:], results["half_level_upper"][:], results["half_level"][:] = 1.0, 1.2, 1.1
        assert self.word(results, "narrow") == GOOD
        results["half_level_upper"][0, 0] = 9.0
        assert self.word(results, "narrow") == CARE
        results["half_level_upper"][:] = 9.0
        assert self.word(results, "narrow") == INVALID
        results["converged"][0, 0] = False
        assert self.word(results, "every curve") == CARE
        results["converged"][:] = False
        assert self.word(results, "every curve") == INVALID

    def test_of_rates(self, folder):
        results = loaded(folder).copy(deep=True)
        results["rate_share_above"][:] = 0.0
        results["rate_lower"][:], results["rate"][:], results["rate_upper"][:] = 1e-4, 2e-4, 3e-4
        assert self.word(results, "annual rates") == GOOD
        results["rate_share_above"][0, 0] = 0.9
        assert self.word(results, "annual rates") == CARE
        results["rate_share_above"][:] = 0.9
        assert self.word(results, "annual rates") == INVALID

    def test_of_rates_from_shaking_that_was_not_run(self, folder):
        """The word follows how far the rate can be off, whatever a curve that rises on does above the highest level."""
        results = loaded(folder).copy(deep=True)
        results["rate"][:], results["rate_share_below_levels"][:] = 1e-3, 0.0
        about = "shaking that was run"

        def set_to(share, reached, most):
            # of such shaking every run reaches the state at `most` times the rate of the results
            results["rate_share_above_levels"][:] = share
            results["probability_at_highest_level"][:] = reached
            results["rate_above_highest_level"][:] = most * 1e-3
            return next(one for one in checks_of(results) if about in one.question)

        assert set_to(0.04, 0.5, 0.06).word == GOOD
        risen = set_to(0.3, 0.94, 0.31)
        assert risen.word == GOOD
        assert "Up to 30 % of any annual rate comes from shaking stronger than any that was run" in risen.reason
        assert "no rate is off by more than 1 %" in risen.reason
        wide = set_to(0.3, 0.5, 0.5)
        assert wide.word == CARE
        assert "30 % of an annual rate" in wide.clause
        assert "the rate is 0.95 to 1.20 times the one given" in wide.reason
        assert wide.cure.startswith("Raise ida.levels.to")
        assert badge([wide]).startswith("use with care: up to 30 % of an annual rate comes from shaking stronger")
        assert set_to(0.8, 0.1, 3.0).word == INVALID
        results["rate_above_highest_level"][0], results["probability_at_highest_level"][0] = 0.82e-3, 0.97
        assert self.word(results, about) == CARE  # (not of every block and law)

        weak = set_to(0.0, 0.99, 0.0)
        assert weak.word == GOOD
        results["rate_share_below_levels"][0, 0] = 0.2
        weak = next(one for one in checks_of(results) if about in one.question)
        assert weak.word == CARE
        assert "20 % of an annual rate comes from shaking weaker than any that was run" in weak.clause
        assert weak.cure.startswith("Lower ida.levels.from")
        older = results.drop_vars(["rate_share_below_levels", "rate_share_above_levels"])
        assert self.word(older, about) == UNKNOWN

    @pytest.mark.slow
    def test_rates_say_where_they_stand_that_curves_are_extrapolated(self, folder):
        results = loaded(folder).copy(deep=True)
        said = "comes from shaking stronger than any that was run, where the fitted curve is extrapolated."
        for name, values in (("above_levels", 0.3), ("below_levels", 0.0)):
            results[f"rate_share_{name}"][:] = values
        results["probability_at_highest_level"][:] = 0.5
        results["rate_above_highest_level"][:] = 0.5 * results["rate"].values
        assert f"About 30\u00a0% of this chance {said}" in " ".join(plain_answer(results))
        assert f"About 30\u00a0% of the rate under {results['model'].values[1]} {said}" in answer(results).sentences[0]
        table = client_rows(results)
        assert "‡: 30\u00a0% of the rate comes from shaking at which nothing was run" in table.title
        assert all(row[2].endswith(" ‡") for row in table.rows)
        plain = verdict(loaded(folder), True)
        lines = verdict(results, True)
        assert lines[0] == f"30\u00a0% of the annual rates of “shelf”, “rack” {said} {plain[0]}"
        assert lines[0].endswith("which the other laws approximate.")
        results["probability_at_highest_level"][:], results["rate_above_highest_level"][:] = (
            0.97,
            0.31 * results["rate"],
        )
        text = " ".join([*plain_answer(results), *answer(results).sentences, *verdict(results, True)])
        assert said not in text
        assert "‡" not in client_rows(results).title

    def test_the_worst_word_wins(self, folder):
        found = checks_of(loaded(folder))
        assert worst_word([one._replace(word=GOOD) for one in found]) == GOOD
        assert worst_word([found[0]._replace(word=UNKNOWN), found[0]._replace(word=GOOD)]) == CARE
        assert worst_word([found[0]._replace(word=INVALID), found[0]._replace(word=GOOD)]) == INVALID

    def test_the_badge_names_the_worst_in_one_clause(self, folder):
        """What is not valid before what needs care, before what was not checked; of the same word the first."""
        named = {word: Check("q", word, "r", "", f"{word}, this") for word in (GOOD, CARE, UNKNOWN, INVALID)}
        assert badge([named[GOOD]._replace(clause="")]) == "good"
        several = [named[UNKNOWN], named[CARE], named[GOOD]]
        assert badge(several) == "use with care: use with care, this; 1 other check needs attention"
        worst = badge([named[CARE], named[INVALID], named[INVALID]._replace(clause="that")])
        assert worst == "not valid: not valid, this; 2 other checks need attention"
        assert badge([named[UNKNOWN], named[GOOD]]) == "use with care: not checked, this"
        results = loaded(folder).copy(deep=True)
        results["outside"].loc[{"reason": "slides_while_rocking"}] = 0.73
        assert badge(checks_of(results)).startswith(
            "not valid: in up to 73 % of the runs a piece would slide instead of rocking unless its coefficient of "
            "friction were above 1; "
        )

    @pytest.mark.slow
    def test_what_is_odd_is_said_in_words(self, folder):
        """A clause for every kind of doubt but the spectra, which have a check of their own."""
        assert {*ODD} == {*KINDS} - {"spectra"}
        results = loaded(folder)
        for kind, clause in ODD.items():
            (check,) = (
                one
                for one in checks_of(results.assign_attrs(doubts=json.dumps([[kind, "it is so", False]])))
                if "records plausible" in one.question
            )
            assert (check.word, check.clause, check.reason) == (CARE, clause, "It is so.")

    @pytest.mark.parametrize("kind", STUDIES)
    def test_every_check_that_is_not_good_has_a_clause(self, folder, pages, kind):
        found = checks_of(loaded(folder, kind))
        for one in found:
            assert bool(one.clause) == (one.word != GOOD), one
            assert not one.clause.endswith(".")
        text = " ".join("".join(Page(pages[kind]).text).split())
        assert f"Validity of this study: {badge(found)}" in text
