"""Cases of scripts: one for each package, which calls its public functions and writes what they return."""

from case import HERE, Case

SCRIPTS = HERE / "scripts"
RENAMED = "e725edd8"
BEFORE = {
    "fragility": (
        ("tp.adaptive_ida(", "fragility.adaptive_ida("),
        ("fragility.adaptive_ida(SHELF, LAWS[0], NOISE, ", 'fragility.ida(SHELF, LAWS[0], NOISE, "adaptive", '),
        ('        "run_table": fragility.run_table(SHELF, LAWS, GROUND[:3], _table()),\n', ""),
    ),
    "studies": (
        ("_inventory(), studies.Assessment(", "_inventory(), "),
        ("FRAME, hazard, replicates=50))", "FRAME, hazard, replicates=50)"),
    ),
}
"""What the scripts called functions by until `RENAMED` (issue *Runs are a table*)."""
NAMES = ("models", "motions", "fragility", "studies")


def _before(name: str) -> dict[str, str]:
    """Return the script for a commit before the functions that it calls were renamed."""
    text = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    for new, old in BEFORE.get(name, ()):
        text = text.replace(new, old)
    return {f"{name}.py": text} if name in BEFORE else {}


def cases() -> list[Case]:
    """Return a case for each package, with the small files that its script reads."""
    inputs = {path.name: path for path in sorted((SCRIPTS / "inputs").iterdir())}
    collect = {"collect.py": SCRIPTS / "collect.py"}
    return [
        Case(
            f"scripts/{name}",
            {f"{name}.py": SCRIPTS / f"{name}.py", **collect, **(inputs if name != "models" else {})},
            [["python", "collect.py", name]],
            twins=_before(name),
        )
        for name in NAMES
    ]
