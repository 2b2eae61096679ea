"""docs/coming/questions.md: its studies run as shown, and give the numbers of its answers."""

import re
from pathlib import Path

import pytest
from study_texts import study_in

import toppling as tp

PAGE = (Path(__file__).resolve().parents[2] / "docs/coming/questions.md").read_text(encoding="utf-8")
STUDIES = {
    re.search('title = "(.*)"', text)[1]: text
    for text in re.findall(r"^```toml\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
}
FAR = (('"near-fault"', '"site-based-scenario"'), ("distance_m = 5000", "distance_m = 15000"))
IN_PGV = (('"pga"', '"pgv"'), ('unit = "g"', 'unit = "m/s"'))
NO_DRILL, CASTORS, RACK, FAULT = (
    "A bookcase without drilled holes",
    "A bookcase on castors",
    "A server rack under the test motions of AC156",
    "Shelves near a fault",
)
SHELF, PER_CENT, IN_G = "bookcase-5-shelf", 100.0, 1.0 / 9.80665
ANSWERS = [
    (NO_DRILL, (), "risk_probability", {"block": "20 mm from the wall"}, PER_CENT, "1.0 % (0.87–1.2)"),
    (NO_DRILL, (), "risk_probability", {"block": "touching the wall"}, PER_CENT, "0.50 % (0.43–0.59)"),
    (NO_DRILL, (), "risk_probability", {"block": "batten, 20 mm from the wall"}, PER_CENT, "0.43 % (0.38–0.48)"),
    (NO_DRILL, (), "risk_probability", {"block": "batten, touching the wall"}, PER_CENT, "0.29 % (0.24–0.34)"),
    (NO_DRILL, (), "risk_probability", {"block": "adhesive strap"}, PER_CENT, "0.94 % (0.81–1.1)"),
    (NO_DRILL, (), "broken_probability", {"block": "adhesive strap", "level": 0.2}, PER_CENT, "74 % (62–84)"),
    (CASTORS, (), "probability", {"block": "brakes on", "level": 0.4}, PER_CENT, "62 % (49–73)"),
    (CASTORS, (), "slip_probability", {"block": "free to roll", "level": 0.4, "slip": 0.1}, PER_CENT, "42 % (31–55)"),
    (RACK, (), "probability", {"block": "free", "level": 1.0}, PER_CENT, "a free rack falls in 32 % (20–48)"),
    (RACK, (), "probability", {"block": "bolted to the floor", "level": 1.0}, PER_CENT, "0 % (0–8.8)"),
    (RACK, (), "broken_probability", {"block": "bolted to the floor", "level": 1.0}, PER_CENT, "break in 32 % (20–48)"),
    (FAULT, (), "half_level", {"block": SHELF}, IN_G, "0.32 g (0.29–0.35)"),
    (FAULT, FAR, "half_level", {"block": SHELF}, IN_G, "0.48 g (0.43–0.54)"),
    (FAULT, IN_PGV, "half_level", {"block": SHELF}, 1.0, "0.51 m/s (0.47–0.57)"),
    (FAULT, FAR + IN_PGV, "half_level", {"block": SHELF}, 1.0, "0.38 m/s (0.35–0.40)"),
]
"""Study by its title, changes to its text, variable of the results, where, factor, and what the page says."""


def test_every_study_is_the_ground_of_an_answer():
    assert set(STUDIES) == {title for title, *_ in ANSWERS}
    for *_, shown in ANSWERS:
        assert shown in PAGE, shown


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A function that runs a study of the page with changes, each once."""
    made = {}

    def run(title, changes):
        if (title, changes) not in made:
            text = STUDIES[title]
            for old, new in changes:
                assert old in text, old
                text = text.replace(old, new)
            made[title, changes] = study_in(tmp_path_factory.mktemp("study"), text).run()
        return made[title, changes]

    return run


@pytest.mark.slow
@pytest.mark.parametrize(("title", "changes", "variable", "where", "factor", "shown"), ANSWERS)
def test_the_answers_are_of_the_studies(title, changes, variable, where, factor, shown, results):
    found = results(title, changes)
    names = [variable, variable + "_lower", variable + "_upper"]
    if variable == "probability":
        found, names = tp.overturning_probability(found), [variable, "lower", "upper"]
    text = {name: value for name, value in where.items() if name == "block"}
    numbers = {name: value for name, value in where.items() if name != "block"}
    stated = map(float, re.findall(r"\d+(?:\.\d+)?", shown.replace("m/s", "").replace("%", "")))
    for name, value in zip(names, stated, strict=True):
        at = found[name].sel(text)
        at = at.sel(numbers, method="nearest") if numbers else at
        assert at.item() * factor == pytest.approx(value, rel=0.1, abs=1e-9), name
