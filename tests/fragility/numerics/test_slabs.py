"""Slabs of runs."""

from toppling.fragility.numerics.slabs import slabs


def test_the_first_dimension_is_cut_first():
    found = slabs({"block": 3, "motion": 2**20}, ["block"])
    assert [part["block"] for part in found] == [slice(0, 2, None), slice(2, 3, None)]
