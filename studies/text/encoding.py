"""Output of the command: characters that it cannot write get readable replacements, a closed pipe ends no study."""

import codecs
import io
import json
import os
import sys
import unicodedata
from typing import Any

READABLE: dict[str, str] = {
    "α": "alpha", "β": "beta", "δ": "delta", "Δ": "delta", "θ": "theta", "ζ": "zeta", "σ": "sigma", "τ": "tau",
    "φ": "phi", "ε": "eps", "ω": "omega", "ξ": "xi", "μ": "mu", "π": "pi", "Φ": "Phi", "η": "eta", "κ": "kappa",
    "λ": "lambda", "ρ": "rho",
    "≥": ">=", "≤": "<=", "≈": "~", "≠": "!=", "×": "x", "·": "*", "±": "+/-", "−": "-", "∞": "inf", "√": "sqrt",
    "→": "->", "←": "<-", "–": "-", "—": "-", "…": "...", "‘": "'", "’": "'", "“": '"', "”": '"', "„": '"',
    "€": "EUR", "£": "GBP", "°": " deg", "§": "par. ", "•": "*", "✓": "ok", "✔": "ok", "✗": "x",
}  # fmt: skip
"""Replacements of single characters."""
ERRORS = "toppling.readable"
"""The name of the error handler of streams."""


def readable(text: str) -> str:
    """Return a readable text in ASCII instead of it; a question mark if nothing better is known."""
    return "".join(_ascii(character) for character in text)


def _ascii(character: str) -> str:
    if character in READABLE:
        return READABLE[character]
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode("ascii")
    if plain:
        return plain
    name = unicodedata.name(character, "")
    if name.startswith("BRAILLE"):  # (a spinner)
        return "*"
    if name.startswith("BOX DRAWINGS"):
        shape = name.removeprefix("BOX DRAWINGS ").split()
        along, across = "HORIZONTAL" in shape or shape[-1] in ("LEFT", "RIGHT"), "VERTICAL" in shape
        return "+" if (along and across) or "AND" in shape else "|" if across else "-"
    return "?"


def _replaced(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return readable(error.object[error.start : error.end]), error.end


codecs.register_error(ERRORS, _replaced)


class _Kept(io.RawIOBase):
    """A stream that takes text after some errors, and discards it."""

    def __init__(self, raw: io.RawIOBase, ignored: type[OSError]) -> None:
        self._raw, self._ignored = raw, ignored

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self._raw.isatty()

    def fileno(self) -> int:
        return self._raw.fileno()

    def write(self, content: Any) -> int | None:
        try:
            return self._raw.write(content)
        except OSError as error:
            if not isinstance(error, self._ignored):
                self._ignored = OSError  # (said once: what is left is tried again as the process ends)
                raise
            return len(content)


def write_anything() -> None:
    """Let standard output and error take every text, closed pipe or full log; a full disk is an error as before."""
    for name, ignored in (("stdout", BrokenPipeError), ("stderr", OSError)):
        stream = getattr(sys, name)
        if stream is None:  # (closed by the shell)
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ERRORS)
        if isinstance(stream, io.TextIOWrapper) and stream is getattr(sys, f"__{name}__"):
            raw: Any = getattr(stream.buffer, "raw", stream.buffer)
            kept: Any = _Kept(raw, ignored)
            options: Any = {"line_buffering": stream.line_buffering, "write_through": stream.write_through}
            # (Python may be told to have no buffer)
            held = kept if stream.write_through else io.BufferedWriter(kept)
            setattr(sys, name, io.TextIOWrapper(held, stream.encoding, ERRORS, **options))


def printable(text: str) -> str:
    """Return a text without the control characters that a terminal would obey; line breaks stay."""
    return "".join(letter if letter.isprintable() or letter == "\n" else " " for letter in text)


def json_text(content: Any, **options: Any) -> str:
    """Return JSON for standard output: with escapes if its encoding has not every character."""
    encoding = str(getattr(sys.stdout, "encoding", None) or "ascii").lower().replace("-", "")
    return json.dumps(content, ensure_ascii=encoding not in ("utf8", "utf16"), **options)
