"""Soft supports: delta against the equilibrium of two springs, and frequencies of the zone."""

import math

import pytest

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.models import delta_from_frequency, delta_from_settlement
from toppling.models.sides import zone_of

BLOCK = tp.Block(0.4, 1.8)


@pytest.mark.parametrize(("settlement", "delta", "frequency", "springs"), [
    (0.2e-3, 0.004573123065, 6.6057375886, 6.6059802096),
    (0.5e-3, 0.011432807663, 4.1634152483, 4.1638001838),
    (2.0e-3, 0.045731230651, 2.0452763262, 2.0460597965),
])  # fmt: skip
def test_settlement(settlement, delta, frequency, springs):
    """The zone's frequency, and that of a rigid block on two springs, k = m g/(2 d0) at b."""
    found = delta_from_settlement(BLOCK, settlement)
    assert found == pytest.approx(delta, abs=5e-13)
    zone = zone_of(BLOCK, found, "h", rigid_rest=False)
    assert math.sqrt(zone.stiffness) / (2.0 * math.pi) == pytest.approx(frequency, abs=5e-11)
    b, h = BLOCK.b, BLOCK.h
    stiffness = STANDARD_GRAVITY / settlement * b**2 - STANDARD_GRAVITY * h
    assert math.sqrt(stiffness / (BLOCK.inertia * BLOCK.R**2)) / (2.0 * math.pi) == pytest.approx(springs, abs=5e-11)
    assert zone.front == pytest.approx(settlement / b, rel=1e-12)


@pytest.mark.parametrize(("frequency", "delta"), [(3.0, 0.021788945753), (6.0, 0.005537732452), (10.0, 0.002000674370)])
def test_frequency(frequency, delta):
    found = delta_from_frequency(BLOCK, frequency)
    assert found == pytest.approx(delta, abs=5e-13)
    zone = zone_of(BLOCK, found, "h", rigid_rest=False)
    assert math.sqrt(zone.stiffness) / (2.0 * math.pi) == pytest.approx(frequency, rel=1e-12)


def test_body_in_series():
    assert delta_from_frequency(BLOCK, 6.0, 8.0) == pytest.approx(delta_from_frequency(BLOCK, 4.8), rel=1e-12)


def test_refused(refusal):
    refusal()
