"""Cases of scripts: one for each package, which calls its public functions and writes what they return."""

from __future__ import annotations

from case import HERE, Case

SCRIPTS = HERE / "scripts"
NAMES = ("models", "motions", "fragility", "studies")


def cases() -> list[Case]:
    """Return a case for each package, with the small files that its script reads."""
    inputs = {path.name: path for path in sorted((SCRIPTS / "inputs").iterdir())}
    collect = {"collect.py": SCRIPTS / "collect.py"}
    return [
        Case(
            f"scripts/{name}",
            {f"{name}.py": SCRIPTS / f"{name}.py", **collect, **(inputs if name != "models" else {})},
            [["python", "collect.py", name]],
        )
        for name in NAMES
    ]
