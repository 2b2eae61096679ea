"""Names and levels of measures as texts."""

import pytest

from toppling import motions as mo
from toppling.motions.intensity.naming import FLOOR, GROUND, long_name_at, written_level


@pytest.mark.parametrize(
    ("name", "place", "text"),
    [
        ("peak floor velocity", GROUND, "peak ground velocity"),
        ("Arias intensity", FLOOR, "Arias intensity, floor motion"),
    ],
)
def test_long_names_at_a_place(name, place, text):
    assert long_name_at(name, place) == text


def test_levels_in_units_of_other_programs():
    assert written_level(mo.measure_named("pgv"), 0.5) == "50 cm/s"
