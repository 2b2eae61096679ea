"""Cases of scripts: one for each package, which calls its public functions and writes what they return."""

from case import HERE, Case

SCRIPTS = HERE / "scripts"
BEFORE = {
    "fragility": (
        "e725edd8",
        ("tp.adaptive_ida(", "fragility.adaptive_ida("),
        ("fragility.adaptive_ida(SHELF, LAWS[0], NOISE, ", 'fragility.ida(SHELF, LAWS[0], NOISE, "adaptive", '),
        ('        "run_table": fragility.run_table(SHELF, LAWS, GROUND[:3], _table()),\n', ""),
    ),
    "models": ("c3699e45", ("friction.contact_of(0.5).friction", "friction.friction_of(0.5)")),
    "motions": (
        "c3699e45",
        ("yielding=motions.Yielding(0.1, strength", "yield_coefficient=0.1, strength"),
        ("0.3))", "0.3)"),
    ),
    "studies": (
        "e725edd8",
        ("_inventory(), studies.Assessment(", "_inventory(), "),
        ("FRAME, hazard, replicates=50))", "FRAME, hazard, replicates=50)"),
    ),
}
"""The last commit under which each script calls functions by other names, and these (issue *Runs are a table*)."""
NAMES = ("models", "motions", "fragility", "studies")


def _before(name: str) -> dict[str, str]:
    """Return the script for a commit before the functions that it calls were renamed."""
    text = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    for new, old in BEFORE[name][1:]:
        text = text.replace(new, old)
    return {f"{name}.py": text}


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
            renamed=BEFORE[name][0],
        )
        for name in NAMES
    ]
