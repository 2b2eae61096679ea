"""Facts of results by their names, and validity checks by their titles."""

import json
import re

from toppling.studies.facts.checks import checks_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import value_of
from toppling.studies.text.reached import within_levels


def check(results, title):
    """Return the check of a title; a remark on other laws comes before it and is passed over."""
    titles = value_of("titles", "checks")
    return [fact for fact in checks_of(results) if titles[fact.what] == title][-1]


def facts_of(subject, results):
    """Return the facts that a function yields of results within their levels, by their names."""
    return {fact.what: fact for fact in subject(within_levels(results))}


def notes_named(results, what):
    """Return the notes of results of one name."""
    return [fact for fact in notes_of(results) if fact.what == what]


def doubts_in(results):
    """Return the doubts of results, one in each line."""
    return "\n".join(fact.names[0] for fact in notes_named(results, "input.doubt"))


def numbers_in(text):
    """Return the numbers of a text, in its order."""
    return [float(number.replace(",", "")) for number in re.findall(r"(?<![\w.,])\d[\d,]*(?:\.\d+)?", text)]


def doubts_of(results, kind):
    """Return the doubts of results of one kind."""
    return [sentence for name, sentence, _ in json.loads(results.attrs["doubts"]) if name == kind]
