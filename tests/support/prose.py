"""Words, sentences and words to avoid of a page of documentation; `python tests/support/prose.py PAGE…` shows them."""

import re
import sys
from pathlib import Path

MOST_WORDS_OF_A_SENTENCE = 28

FENCE = re.compile(r"^(?P<fence>`{3,}|:{3,})[^\n]*$")
CODE = re.compile(r"^`{3,}")

AVOIDED = {
    r"(?:that|those) of": "repeat the noun",
    r"(?<!\w-)ones": "repeat the noun",
    r"nobody|somebody|whoever": "name the actor",
    r"(?:is|are|was|were) (?:said|told|asked for)": "name the actor",
    r"what shakes": "ground motion, motion",
    r"strength of shaking": "intensity level",
    r"verdicts?": "outcome",
    r"come down|comes down": "overturn",
    r"t(?:ell|old|ells) apart": "distinguish",
    r"held to": "verified against",
    r"beside": "compared with, in addition to, next to",
    r"in place of": "instead of",
    r"goes on|go on": "continue",
    r"anew|nonetheless|as a rule|but for|so many|so much": "plain modern English",
    r"the same (?:bytes|bits)": "bit-identical",
    r"doubts?|oddit(?:y|ies)": "input warning",
    r"judgements?": "assumption",
    r"(?<!at )least(?![ -]squares)": "minimum, smallest",
    r"greatest": "maximum, largest",
    r"knows? no|says? nothing|stands? (?:for|above|below|again)": "is, has, uses",
    r"refused": "must be, not supported, an error",
    r"that there (?:is|are)|that (?:was|were) run|that is studied": "cut the relative clause",
}
"""Regular expressions of what `english.md`-like rules avoid (whole words, any case), and what to write."""


def prose_of(text: str) -> str:
    """Return a page without front matter, code blocks, examples, directives' fences, comments and labels."""
    lines, fence = [], None
    for line in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL).splitlines():
        found = FENCE.match(line.strip())
        if fence is None and found and CODE.match(line.strip()):
            fence = found["fence"]
        elif fence is not None:
            if line.strip() == fence:
                fence = None
        elif not found and not re.match(r"^\s*:[\w-]+:|^\([\w-]+\)=$|^\s*>>>", line):
            lines.append(line)
    return "\n".join(lines)


def prose_of_docstring(text: str) -> str:
    """Return a docstring whose sections and entries (numpydoc) and keys are paragraphs, without their headings."""
    lines = text.splitlines()
    result = []
    for before, line, following in zip(["", *lines], lines, [*lines, ""][1:], strict=False):
        underlined = re.fullmatch(r"\s*-{3,}\s*", line) or re.fullmatch(r"\s*-{3,}\s*", following)
        deeper = len(following) - len(following.lstrip()) > len(line) - len(line.lstrip())
        entry = following.strip() and deeper and re.match(r"\s*[\w*(\"]", line) and not re.match(r"\s*\d+\.\s", line)
        key = re.search(r"(?:^|[.?!])\s*$", before) and re.match(r"\s*[a-z]\w*: (?=[A-Z“\[`])", line)
        result.append("" if underlined else "\n" + line[key.end() :] if key else "" if entry else line)
    return "\n".join(result)


def words(text: str) -> int:
    """Return the number of words of a page: prose and tables, without code blocks."""
    return sum(bool(re.search(r"\w", word)) for word in re.sub(r"\]\([^)]*\)", "]", prose_of(text)).split())


def sentences(text: str) -> list[str]:
    """Return the sentences of paragraphs and lists of a page; code in lines and formulas are one word each."""
    text = re.sub(r"\$\$.*?\$\$", "", prose_of(text), flags=re.DOTALL)
    kept = [line for line in text.splitlines() if not re.match(r"^\s*(\||#|!\[|\[.*\]:)", line)]
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)", "\n".join(kept))
    result = []
    for paragraph in paragraphs:
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(paragraph.split()))
        plain = re.sub(r"\{[\w:-]+\}`[^`]*`|`+[^`]*`+|\$[^$]*\$", "CODE", plain)
        plain = re.sub(r"^(?:[-*]|\d+\.)\s|\*\*|__|(?<!\w)\*|\*(?!\w)", "", plain)
        plain = re.sub(r"\b(e\.g|i\.e|al|vs|approx|Fig|Eq|No|Sec|Ch)\.", lambda found: found[1].replace(".", ""), plain)
        parts = re.split(r"(?<=[.!?])[)\"”]?\s+(?=[A-ZCODE“\"(0-9])", plain)
        result += [part for part in parts if re.search(r"\w", part)]
    return result


def length(sentence: str) -> int:
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def avoided(text: str) -> list[tuple[str, str, str]]:
    """Return (words, what to write, surroundings) of each avoided expression outside code."""
    plain = re.sub(r"`+[^`]*`+|\]\([^)]*\)|\$[^$]*\$", " ", prose_of(text))
    plain = " ".join(plain.split())
    return [
        (found[0], advice, plain[max(found.start() - 40, 0) : found.end() + 40])
        for pattern, advice in AVOIDED.items()
        for found in re.finditer(rf"\b(?:{pattern})\b", plain, re.IGNORECASE)
    ]


if __name__ == "__main__":
    total = 0
    for path in map(Path, sys.argv[1:]):
        page = path.read_text("utf-8")
        lengths = [length(sentence) for sentence in sentences(page)]
        total += words(page)
        mean = sum(lengths) / max(len(lengths), 1)
        print(f"{path}: {words(page)} words, {len(lengths)} sentences, {mean:.1f} words each")
        for sentence in sentences(page):
            if length(sentence) > MOST_WORDS_OF_A_SENTENCE:
                print(f"  {length(sentence)} words: {sentence[:160]}")
        for found, advice, around in avoided(page):
            print(f"  {found!r} ({advice}): …{around}…")
    print(f"total: {total} words")
