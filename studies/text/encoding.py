"""Encodings of the output: characters that a terminal or a redirected output cannot write get readable replacements."""

from __future__ import annotations

import codecs
import json
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
    """Return a text in ASCII that can be read in place of it; a question mark where nothing better is known."""
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


def write_anything() -> None:
    """Let standard output and standard error take every text: no character ends a command."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=ERRORS)


def json_text(content: Any, **options: Any) -> str:
    """Return JSON for standard output: with escapes where its encoding has not every character."""
    encoding = str(getattr(sys.stdout, "encoding", None) or "ascii").lower().replace("-", "")
    return json.dumps(content, ensure_ascii=encoding not in ("utf8", "utf16"), **options)
