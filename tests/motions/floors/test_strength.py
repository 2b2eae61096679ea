"""Default strengths of a code: the formula by hand, and what is refused."""

import numpy as np
import pytest

from toppling.core.doubts import noted
from toppling.motions import Building, Yielding
from toppling.motions.floors.strength import code_strength


@pytest.mark.parametrize(
    ("system", "period", "expected"),
    [
        ("special-moment-frame", 0.3, 3.0 * 1.1 / 8.0),  # the plateau: S_DS governs up to T = 0.6/1.1 s
        ("special-moment-frame", 1.0, 3.0 * 0.6 / 8.0),
        ("special-moment-frame", 3.0, 3.0 * 0.2 / 8.0),
        ("ordinary-steel-moment-frame", 1.0, 3.0 * 0.6 / 3.5),
        ("special-concrete-wall", 1.0, 2.5 * 0.6 / 6.0),
        ("special-braced-frame", 1.0, 2.0 * 0.6 / 6.0),
        ("buckling-restrained-braced-frame", 1.0, 2.5 * 0.6 / 8.0),
        ("light-frame-wall", 1.0, 3.0 * 0.6 / 6.5),
        ("ordinary-masonry-wall", 1.0, 2.5 * 0.6 / 2.0),
    ],
)
def test_overstrength_times_the_design_strength(system, period, expected):
    assert code_strength(system, period, 1.1, 0.6).coefficient == pytest.approx(expected, rel=1e-14)
    assert code_strength(system, period, 1.1, 0.6, 1.25).coefficient == pytest.approx(1.25 * expected, rel=1e-14)


@pytest.mark.parametrize(("period", "exponent"), [(0.4, 1.0), (1.5, 1.5), (3.0, 2.0)])
def test_storeys_follow_the_lateral_forces_of_the_code(period, exponent):
    """Exponent 1 up to 0.5 s, 2 from 2.5 s on, linear between: shears by hand, from the roof down."""
    masses = np.array([3e5, 2e5, 1e5])
    plain = Building.from_storeys(masses, [4e8, 3e8, 2e8])
    stiffnesses = np.array([4e8, 3e8, 2e8]) * (float(plain.periods[0]) / period) ** 2
    coefficient = code_strength("special-moment-frame", period, 1.0, 0.6).coefficient
    building = Building.from_storeys(masses, stiffnesses, yielding=Yielding(coefficient), storey_height=4.0)
    forces = masses * np.array([4.0, 8.0, 12.0]) ** exponent
    shears = np.array([forces[i:].sum() for i in range(3)]) / forces.sum()
    np.testing.assert_allclose(building.strengths, coefficient * 9.80665 * 6e5 * shears, rtol=1e-9)


@pytest.mark.parametrize(("coefficient", "doubted"), [(15.0, 1), ([15.0, 12.0], 2), (0.15, 0), ([0.15, 0.1], 0)])
def test_coefficients_in_per_cent_are_doubted(coefficient, doubted):
    with noted() as doubts:
        Building.from_storeys([1e5, 1e5], [4e7, 4e7], yielding=Yielding(coefficient))
    assert ["yield coefficient" in doubt.sentence for doubt in doubts] == [True] * doubted


def test_refused(refusal):
    refusal()
