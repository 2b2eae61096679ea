"""Edges of shelves and benches: the slips that take a block over them, and blocks that can have one."""

import math

import numpy as np
import pytest

import toppling as tp
from toppling.fragility.runs.provenance import blocks_of
from toppling.models.block import block_from, describe_block

SHAKES = tp.motions.CloughPenzien(duration=4.0, dt=0.01).sample(2)


def test_slips_are_to_the_centre_or_to_the_foot():
    assert tp.Edge(0.10, 0.02).slips(0.15) == pytest.approx((0.25, 0.17), rel=1e-15)
    assert tp.Edge(0.10, falls_when="foot").slips(0.15) == (0.10, math.inf)
    assert tp.Edge(back=0.0, falls_when="foot").slips(0.15) == (math.inf, 0.0)


def test_a_slip_to_either_edge():
    edge = tp.Edge(0.10, 0.05, "foot")
    forward, backward = np.array([0.09, 0.11, 0.0, 0.10]), np.array([0.05, 0.0, 0.06, 0.0])
    assert edge.fallen_off(forward, backward, 0.15).tolist() == [False, True, True, False]
    assert not tp.Edge(0.0).fallen_off(0.15, 99.0, 0.15)  # (the centre of mass over the edge still stands)


def test_blocks_of_results_have_their_edges():
    blocks = [tp.Block(0.3, 0.5, name="printer", edge=tp.Edge(0.1, 0.3)), tp.Block(0.2, 0.5, name="lamp")]
    assert [block_from(describe_block(one)) for one in blocks] == [
        tp.Block(0.3, 0.5, 0.25, 4.0 / 3.0, "printer", edge=tp.Edge(0.1, 0.3)),
        tp.Block(0.2, 0.5, 0.25, 4.0 / 3.0, "lamp"),
    ]
    runs = tp.ida(blocks, tp.HousnerImpact(), SHAKES, [4.0])
    assert [one.edge for one in blocks_of(runs)] == [tp.Edge(0.1, 0.3), None]
    plain = tp.ida(
        [tp.Block(one.width, one.height, name=one.name) for one in blocks], tp.HousnerImpact(), SHAKES, [4.0]
    )
    np.testing.assert_array_equal(runs["peak_rotation"], plain["peak_rotation"])


def test_the_edge_of_the_width_is_not_that_of_the_depth():
    assert tp.Block(0.3, 0.9, depth=0.5, edge=tp.Edge(0.1)).across.edge is None


def test_refused(refusal):
    refusal()
