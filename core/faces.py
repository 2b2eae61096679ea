"""The public names of a package, each loaded from its module when it is first used."""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any


def face(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package, whose names its own `if TYPE_CHECKING:` imports.

    Libraries are loaded only when needed: a command that prints a list loads no labelled arrays, and a single
    simulation no statistics.
    """
    source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
    block = next(node for node in ast.parse(source).body if isinstance(node, ast.If))
    home_of = {name.name: node.module for node in block.body if isinstance(node, ast.ImportFrom) for name in node.names}

    def load(name: str) -> Any:
        home = home_of.get(name)
        if home is not None:
            value = getattr(import_module(f"{package}.{home}"), name)
        elif name.startswith("_") or find_spec(f"{package}.{name}") is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        else:
            value = import_module(f"{package}.{name}")
        setattr(sys.modules[package], name, value)  # (the next use finds it without this function)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home_of})

    return load, names, sorted(home_of)
