"""Safe reading of OpenQuake's XML from unknown sources: elements, attributes and text alone.

A document type, and with it entities of any kind, is refused where it begins, so that nothing can be expanded or
fetched; the number of elements and their depth are bounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from ..files import ExchangeError

NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
MAX_ELEMENTS = 500_000
MAX_DEPTH = 12


@dataclass
class Element:
    """One element: its tag without the namespace, attributes, children, text, the comment before it, and its line."""

    file: Path
    tag: str
    namespace: str
    attributes: Mapping[str, str]
    line: int
    comment: str = ""
    children: list[Element] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Text directly inside the element."""
        return "".join(self.parts)

    def attribute(self, name: str) -> str:
        """Return an attribute; ExchangeError where it is missing."""
        if name not in self.attributes:
            raise self.error(f"has no attribute {name}")
        return self.attributes[name]

    def only(self, tag: str) -> Element:
        """Return the only child of a tag; ExchangeError where there is none or more than one."""
        found = [child for child in self.children if child.tag == tag]
        if len(found) != 1:
            raise self.error(f"must hold one {tag}, got {len(found)}")
        return found[0]

    def error(self, message: str) -> ExchangeError:
        """Return an error that names this element and its line."""
        return ExchangeError(f"{self.file}: line {self.line}: {self.tag} {message}")


def parse(file: Path, content: bytes) -> Element:
    """Return the fragility model of NRML 0.5 in a document without a document type, of limited size and depth."""
    root = _Reader(file).read(content)
    if root.tag != "nrml" or root.namespace != NAMESPACE:
        raise ExchangeError(
            f"{file}: must be nrml of {NAMESPACE}, got {root.tag!r:.40} of {root.namespace or 'no namespace':.80}"
        )
    return root.only("fragilityModel")


class _Reader:
    """Builder of the tree of elements while expat reads."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._open: list[Element] = []
        self._root: Element | None = None
        self._count = 0
        self._comment = ""
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.CommentHandler = self._remember
        parser.StartDoctypeDeclHandler = self._doctype
        parser.EntityDeclHandler = self._entity
        parser.ExternalEntityRefHandler = self._entity
        self._parser = parser

    def read(self, content: bytes) -> Element:
        try:
            self._parser.Parse(content, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise ExchangeError(f"{self._file}: line {error.lineno}: no XML ({reason})") from None
        except (LookupError, UnicodeError, ValueError) as error:
            if isinstance(error, ExchangeError):
                raise
            raise ExchangeError(f"{self._file}: its encoding cannot be read") from None
        assert self._root is not None  # expat refuses a document without an element
        return self._root

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > MAX_ELEMENTS or len(self._open) >= MAX_DEPTH:
            raise ExchangeError(f"{self._file}: more than {MAX_ELEMENTS:,} elements, or deeper than {MAX_DEPTH}")
        namespace, _, tag = name.rpartition(" ")
        line = self._parser.CurrentLineNumber
        element = Element(self._file, tag, namespace, attributes, line, self._comment)
        self._comment = ""
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _name: str) -> None:
        self._open.pop()
        self._comment = ""

    def _text(self, text: str) -> None:
        self._open[-1].parts.append(text)

    def _remember(self, text: str) -> None:
        self._comment = text

    def _doctype(self, *_: object) -> NoReturn:
        raise ExchangeError(f"{self._file}: has a document type, which may hide entities: remove it")

    def _entity(self, *_: object) -> NoReturn:
        raise ExchangeError(f"{self._file}: declares or refers to entities, which are not read")
