"""Blocks and the catalogue: Housner's parameters, validation, real sizes with sources."""

import csv
import math

import pytest
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models import catalogue
from toppling.models.items import QUALITIES

INCH = 0.0254


def test_parameters():
    block = tp.Block(width=0.40, height=1.80)
    assert (block.b, block.h) == (0.2, 0.9)
    assert pytest.approx(math.hypot(0.2, 0.9), rel=1e-15) == block.R
    assert block.alpha == pytest.approx(math.atan(0.2 / 0.9), rel=1e-15)
    assert block.p == pytest.approx(math.sqrt(3.0 * G / (4.0 * block.R)), rel=1e-15)
    assert block.restitution == pytest.approx(1.0 - 1.5 * math.sin(block.alpha) ** 2, rel=1e-15)


def test_from_slenderness_and_back():
    for alpha, R in ((0.01, 0.01), (0.2, 0.38), (1.2, 100.0)):
        block = tp.Block.from_slenderness(alpha, R)
        assert block.alpha == pytest.approx(alpha, rel=1e-13)
        assert pytest.approx(R, rel=1e-14) == block.R


def test_tilt_angle_is_alpha():
    block = tp.Block.from_tilt_test(0.25, width=0.4, height=1.8, inertia_factor=1.3)
    assert block.alpha == pytest.approx(0.25, rel=1e-15)
    assert block.h == pytest.approx(0.2 / math.tan(0.25), rel=1e-15)
    middle = tp.Block.from_tilt_test(math.atan(0.4 / 1.8), width=0.4, height=1.8)
    assert middle.h == pytest.approx(0.9, rel=1e-14)


def test_centre_of_mass_off_the_middle():
    low = tp.Block(0.4, 1.8, cm_height=0.7, inertia_factor=1.25)
    assert low.alpha == pytest.approx(math.atan(0.2 / 0.7))
    assert low.p == pytest.approx(math.sqrt(G / (1.25 * low.R)))
    assert low.restitution == pytest.approx(1.0 - 2.0 / 1.25 * math.sin(low.alpha) ** 2)
    assert tp.Block(0.4, 1.8, cm_height=0.9) == tp.Block(0.4, 1.8)


def test_squat_blocks_take_an_explicit_restitution():
    squat = tp.Block(width=1.5, height=1.0)
    tp.HousnerImpact(e=0.5).oscillator(squat)
    assert tp.Block(width=math.sqrt(2.0) * 0.999, height=1.0).restitution > 0.0


class TestCatalogue:
    P58 = {
        "E.20.22.102a": (12.625, 29.0),
        "E.20.22.103a": (12.625, 41.0),
        "E.20.22.104a": (12.625, 56.0),
        "E.20.22.105a": (12.625, 71.0),
        "E.20.22.106a": (12.625, 81.25),
        "E.20.22.112a": (15.0, 24.0),
        "E.20.22.114a": (15.0, 52.0),
        "E.20.22.124a": (18.6, 52.5),
        "E.20.22.125a": (18.6, 67.75),
    }

    def test_the_nine_fema_p58_items(self):
        items = {catalogue.item(n).fema_p58: catalogue[n] for n in catalogue if catalogue.item(n).fema_p58}
        assert set(items) == set(self.P58)
        for fema, (depth, height) in self.P58.items():
            assert items[fema].width == pytest.approx(depth * INCH, rel=1e-9)
            assert items[fema].height == pytest.approx(height * INCH, rel=1e-9)

    @needs_shared
    def test_ids_are_fema_p58s(self):
        with (SHARED / "data/fema_p58_contents.csv").open() as file:
            published = {row["ID"] for row in csv.DictReader(file)}
        assert set(self.P58) <= published

    def test_every_item_is_usable_and_has_a_source(self):
        assert len(catalogue) == 49
        assert {"server", "hospital", "laboratory", "vending", "museum", "bench-top"} <= {
            catalogue.item(name).category for name in catalogue
        }
        for name in catalogue:
            item = catalogue.item(name)
            assert item.block.name == name
            assert item.quality in QUALITIES
            assert len(item.source) > 20
            # (what stands on benches is squat, and slides rather than rocks)
            assert 0.05 < item.block.alpha < (1.0 if item.category == "bench-top" else 0.6)
            assert item.breadth is None or item.breadth >= item.block.width
            assert 0.0 < item.block.restitution < 1.0

    def test_known_and_unknown_names(self):
        assert "bookcase-5-shelf" in catalogue
        assert "nothing" not in catalogue


def test_refused(refusal):
    refusal()
