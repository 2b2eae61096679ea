"""Validity checks of results, by their titles."""

from toppling.studies.facts.checks import checks_of
from toppling.studies.facts.say import value_of


def check(results, title):
    """Return the check of a title; a remark on other laws comes before it and is passed over."""
    titles = value_of("titles", "checks")
    return [fact for fact in checks_of(results) if titles[fact.what] == title][-1]
