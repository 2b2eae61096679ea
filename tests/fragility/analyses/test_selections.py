"""Stripes of selected motions: run as such, and refused where they do not agree with the hazard."""

import warnings

import numpy as np
import pytest

import toppling as tp
from toppling.motions.selection.select import InconsistentSelection

BLOCK = tp.Block(width=0.2, height=1.0)
LAW = tp.HousnerImpact()


@pytest.fixture(scope="module")
def pool():
    return tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(60, seed=4)


@pytest.fixture(scope="module")
def target(pool):
    names = ["pga", "pgv"]
    logs = np.log(tp.motions.measures(pool, names).to_array().values)
    rho = np.corrcoef(logs)
    return tp.motions.Target(names, np.exp(logs.mean(axis=1)), logs.std(axis=1), correlations=rho, given="pga")


def selected(pool, target, level, number=12):
    with warnings.catch_warnings(action="ignore", category=InconsistentSelection):
        return tp.motions.select(pool, target, number, level=level, factor=(0.05, 20.0))


@pytest.fixture(scope="module")
def near(pool, target):
    return selected(pool, target, target.medians[0])


def test_as_the_same_motions_by_hand(near):
    level = near.report.attrs["level"]
    runs = tp.stripes(BLOCK, LAW, [near], [level], outputs=["overturned", "peak_rotation"])
    plain = tp.stripes(BLOCK, LAW, [near.motions], [level], outputs=["overturned", "peak_rotation"])
    np.testing.assert_array_equal(runs["peak_rotation"], plain["peak_rotation"])


def test_refused(pool, target, near):
    level = near.report.attrs["level"]
    far = selected(pool, target, 8.0 * level)
    assert not far.consistent
    for motions, levels, change, words in (
        ([near, far], [level, 8.0 * level], {}, r"motions\[2\] is not hazard-consistent \(pgv: median"),
        ([near], [2.0 * level], {}, "is selected for pga = "),
        ([near], [level], {"im": "pgv"}, "levels of pga, im must be that"),
        ([near, pool], [level, 9.0 * level], {}, "all be selections"),
    ):
        with pytest.raises((TypeError, ValueError), match=words):
            tp.stripes(BLOCK, LAW, motions, levels, **change)
    runs = tp.stripes(BLOCK, LAW, [near.motions, far.motions], [level, 8.0 * level])
    assert runs.sizes["motion"] == 24
