"""The sentences that pages and terminals of the corpus show, without their numbers, and the rows of `facts.csv`.

`facts.csv` has a row for every sentence that was printed when `sentences.txt` was written: the fact that it tells, the
numbers in it, the condition under which it appears, where it stood in the code, and where it will stand ("dropped":
because). In a row's sentence `{}` is any text and `{a|b}` either word. `facts_unseen.csv` has what the code could print
and no study of the corpus shows (where no place is given, that of its fact).
`python tests/golden/sentences.py .golden/new` prints the sentences of another run.
"""

import csv
import functools
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

HERE = Path(__file__).parent
INLINE = {"strong", "em", "code", "span", "b", "i", "sub", "sup", "a", "abbr"}
NO_TEXT = {"script", "style", "head", "svg", "th", "pre", "h1"}  # (of h1: the study's own title)
VOID = {"br", "meta", "link", "img", "input", "hr"}
LEAST_WORDS, LEAST_WORDS_OF_A_CELL = 3, 6
HASH = re.compile(r"\b[0-9a-f]{8,}(?:-[0-9a-f]+)*\b")
NUMBER = re.compile(r"(?<![A-Za-z_\[])[−-]?\d[\d.,]*(?:[eE][−-]?\d+)?(?:[ -]?[–/][ -]?\d[\d.,]*)?|∞")
NAME = re.compile(r"“[^”]*”")
END = re.compile(r"(?<=[.!?;:])\s+(?=[A-Z“\"(])")
OF_A_TABLE = re.compile(r"\S {3,}\S|[─━│╭╰╷]|\s$|^$|^ *[\"{}\[\]]")


class Page(HTMLParser):
    """The texts of a page, each with whether it is a cell of a table."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.pieces: list[str] = []
        self.texts: list[tuple[bool, str]] = []

    def end(self) -> None:
        """End a text at the border of a paragraph, a cell or the like."""
        if self.pieces and not NO_TEXT & set(self.open):
            self.texts.append(("td" in self.open, " ".join("".join(self.pieces).split())))
        self.pieces = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        """Open an element."""
        if tag not in INLINE:
            self.end()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close an element."""
        if tag not in INLINE:
            self.end()
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        """Take a piece of text."""
        self.pieces.append(data)


def of_text(text: str, least: int = LEAST_WORDS) -> Iterator[str]:
    """Yield the sentences of a text, without their numbers and names."""
    for sentence in END.split(text):
        plain = " ".join(NUMBER.sub("#", NAME.sub("“…”", HASH.sub("#", sentence))).split())
        if len(re.findall(r"[A-Za-z]{2,}", plain)) >= least:
            yield plain


def of_file(path: Path) -> Iterator[str]:
    """Yield the sentences of a page, or of what a terminal showed."""
    text = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix == ".html":
        page = Page()
        page.feed(text)
        page.end()
        for is_cell, whole in page.texts:
            yield from of_text(whole, LEAST_WORDS_OF_A_CELL if is_cell else LEAST_WORDS)
    else:
        for line in text.splitlines():
            if not OF_A_TABLE.search(line):
                yield from of_text(line)


def of_corpus(root: Path) -> set[str]:
    """Return all different sentences that a run of the corpus left, refusals and schemas aside."""
    files = [path for path in root.rglob("*") if path.suffix in {".html", ".out", ".err"} and path.is_file()]
    shown = [path for path in files if not {"refused", "schema"} & set(path.relative_to(root).parts)]
    return {sentence for path in shown for sentence in of_file(path)}


def facts() -> list[dict[str, str]]:
    """Return the rows of `facts.csv`."""
    with (HERE / "facts.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@functools.cache
def pattern(sentence: str) -> re.Pattern[str]:
    """Return the pattern of a row's sentence."""
    parts = re.split(r"(\{[^{}]*\})", sentence)
    texts = [re.escape(part) for part in parts]
    for place in range(1, len(parts), 2):
        words = parts[place][1:-1].split("|")
        texts[place] = f"(?:{'|'.join(map(re.escape, words))})" if len(words) > 1 else ".+?"
    return re.compile("".join(texts))


if __name__ == "__main__":
    print(*sorted(of_corpus(Path(sys.argv[1]))), sep="\n")
