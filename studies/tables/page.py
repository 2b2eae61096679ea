"""Tables on a page: unbroken intervals in HTML, and text escaped for Markdown."""

from __future__ import annotations

import re

from markupsafe import Markup

from ..text.names import clean

_BRACKETS = re.compile(r"(\([^()]{1,24}\))")
_MARKDOWN = re.compile(r"([\\`*_{}\[\]|~$<>&]|(?<=.)#+$)")
_LINE_START = re.compile(r"^(#|\+(?= |$)|-(?= |-|$)|=+$|\d+(?=[.)](?: |$)))")
"""Characters with a meaning in Markdown: anywhere (round brackets have none without square ones) or at the end of a
heading, which they close; at the start of a line."""


def longest_word(text: str) -> int:
    """Return the length of the longest word, which a narrow column must break."""
    return max(map(len, text.split()), default=0)


def whole_intervals(text: str) -> Markup:
    """Return a cell as one HTML element in which no line break divides an interval in brackets."""
    whole = Markup('<span class="whole">{}</span>')
    parts = [whole.format(one) if i % 2 else one for i, one in enumerate(_BRACKETS.split(clean(text)))]
    return Markup("<span>{}</span>").format(Markup("").join(parts))


def markdown(text: object) -> str:
    """Return text escaped for Markdown in one line, so that nothing in it is markup or HTML."""
    entities = {"<": "&lt;", ">": "&gt;", "&": "&amp;"}
    plain = " ".join(clean(str(text)).split())
    marked = _LINE_START.search(plain)
    text = _MARKDOWN.sub(lambda found: entities.get(found[1], f"\\{found[1]}"), plain)
    if marked is None:
        return text
    # (a number is kept from being a list by its stop or bracket: a digit cannot be escaped)
    at = marked.end() if marked[1].isdigit() else 0
    return f"{text[:at]}\\{text[at:]}"
