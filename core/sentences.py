"""Sentences of facts: a template file is a register of macros, and a macro, named after a fact, is its sentence."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import wording
from .doubts import NAMED, first_names, first_of
from .facts import Fact

if TYPE_CHECKING:
    from jinja2 import Environment


def _listed(names: Sequence[str]) -> str:
    """Return the first names, with “and” before the last of few."""
    few = 1 < len(names) <= NAMED
    return f"{', '.join(names[:-1])} and {names[-1]}" if few else first_of(names)


Filters = Mapping[str, Callable[..., str | float]]
FILTERS: Filters = {
    "counted": lambda number, noun: wording.counted(int(number), noun),
    "percent": wording.two_digit_percent,
    "whole": wording.given_percent,
    "two_digits": wording.two_digits,
    "given": wording.given_number,
    "listed": _listed,
    "named": first_names,
    "quoted": lambda names: _listed([f"“{name}”" for name in names]),
    "article": wording.with_article,
}
"""Filters of numbers, plurals and lists."""
_SPACES, _GAPS = re.compile(r"[ \n]+"), re.compile(r" ([,.;:])(?=\s|$)")
_PER_CENT = re.compile(r"(?<=\d) (?=%)")


def environment(
    folders: Sequence[Path],
    filters: Filters = FILTERS,
    *,
    escaping: bool = False,
    safe: Callable[[Any], Any] | None = None,
) -> Environment:
    """Return the templates of folders; `safe` cleans every value, and with `escaping` they are of HTML."""
    # (not for every import)
    from jinja2 import Environment, FileSystemBytecodeCache, FileSystemLoader, StrictUndefined  # noqa: PLC0415

    class Kept(FileSystemBytecodeCache):
        """Compiled templates next to the first folder; without them where nothing can be read or written."""

        def load_bytecode(self, bucket: Any) -> None:
            with suppress(Exception):  # (a damaged file may raise any)
                super().load_bytecode(bucket)

        def dump_bytecode(self, bucket: Any) -> None:
            if not sys.dont_write_bytecode:
                with suppress(OSError):
                    Path(self.directory).mkdir(exist_ok=True)
                    super().dump_bytecode(bucket)

    kind = f"{'html' if escaping else 'text'}-{'plain' if safe is None else 'safe'}"
    made = Environment(
        bytecode_cache=Kept(str(folders[0] / "__pycache__"), f"{kind}-%s.j2c"),
        optimized=False,  # (which would keep what filters make of constants)
        loader=FileSystemLoader(folders),
        autoescape=escaping,
        finalize=safe,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= filters
    return made


def sentence(what: str, fact: Fact, modules: Iterable[Any], shared: Mapping[str, str] = {}) -> str:
    """Return the sentence of a name for a fact: its macro, `a_b` for `a.b`, in the first register that has it.

    `shared`: names of the sentences of facts that have none of their own.
    """
    modules = [*modules]
    macros = (name.replace(".", "_") for name in (what, shared.get(what, what)))
    macro, module = next((macro, module) for macro in macros for module in modules if hasattr(module, macro))
    text = _GAPS.sub(r"\1", _SPACES.sub(" ", str(getattr(module, macro)(fact)))).strip()
    return _PER_CENT.sub("\u00a0", text)


@cache
def register_of(folder: Path, name: str) -> Any:
    """Return a register of one folder, with the plain filters."""
    return environment([folder]).get_template(f"{name}.j2").module
