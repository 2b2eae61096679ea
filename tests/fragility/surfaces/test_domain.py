"""Region of blocks: what lies in it, designs that determine polynomials, and the blocks of checks."""

import numpy as np
import pytest

from toppling.fragility.surfaces import domain as designs
from toppling.fragility.surfaces.domain import (
    EVEN,
    ROUNDS,
    candidates,
    check_points,
    design_weights,
    designed,
    domain_of,
    some_points,
)
from toppling.fragility.surfaces.surface import basis


def variables(number=500, seed=0, inertia=0.0):
    random = np.random.default_rng(seed)
    p, tan = random.uniform(1.0, 1.8, number), random.uniform(-2.0, -1.0, number)
    return np.stack([p, tan + 0.5 * p, 4 / 3 + inertia * random.uniform(-1.0, 1.0, number)], axis=1)


@pytest.mark.parametrize(("table", "size"), [(variables(), 2), (variables(inertia=0.1), 3), (variables()[:1], 0)])
def test_points_and_variables_go_both_ways(table, size):
    domain = domain_of(table)
    assert domain.size == size
    points = domain.points(table)
    assert points.shape == (len(table), size)
    assert not size or np.abs(points).max() <= 1.0 + 1e-12
    np.testing.assert_allclose(domain.variables(points), table, atol=1e-12)
    assert domain.holds(points).all()


def test_what_lies_outside_is_known():
    domain = domain_of(variables())
    far = domain.variables(np.array([[0.0, 0.0], [1.2, 0.0], [0.0, -1.5]]))
    assert domain.holds(domain.points(far)).tolist() == [True, False, False]


def test_axes_along_which_blocks_hardly_differ_are_left_out():
    table = variables()
    table[:, 2] += 1e-5 * np.arange(len(table)) / len(table)
    assert domain_of(table).size == 2
    line = np.stack([np.linspace(1.0, 2.0, 9), np.full(9, -1.5), np.full(9, 4 / 3)], axis=1)
    domain = domain_of(line)
    assert domain.size == 1
    np.testing.assert_allclose(np.sort(domain.points(line)[:, 0]), np.linspace(-1.0, 1.0, 9), atol=1e-12)


def test_few_blocks_have_the_box_around_them():
    table = variables(3)
    table[2] = 0.5 * (table[0] + table[1])
    table[2, 1] += 0.02
    domain = domain_of(table)
    assert domain.holds(domain.points(table)).all()
    two = domain_of(variables(2))
    assert two.size == 1


def test_candidates_lie_in_the_region_and_depend_on_the_seed_alone():
    domain = domain_of(variables())
    found = candidates(domain, 1)
    assert domain.holds(found).all()
    assert np.array_equal(found, candidates(domain, 1))
    assert not np.array_equal(found, candidates(domain, 2))


def test_the_best_design_of_a_cubic_with_equal_dispersions(monkeypatch):
    """D-optimal is ±1, ±1/√5 with a quarter each; the greatest variance is then 4, and no design has less (Kiefer)."""
    points = np.linspace(-1.0, 1.0, 401)[:, None]
    even = np.full(401, 1.0 / 401)
    rows = basis(points, 3)

    def best(rounds):
        monkeypatch.setattr(designs, "ROUNDS", rounds)
        weights = (design_weights(points, 3, np.ones(401)) - EVEN * even) / (1.0 - EVEN)
        assert weights.min() > -1e-12
        variance = np.einsum("ij,jk,ik->i", rows, np.linalg.inv(rows.T @ (weights[:, None] * rows)), rows)
        return weights, variance.max()

    weights, variance = best(300)
    assert 4.0 <= variance < 5.0
    # (the criterion is the mean of a high power, for which the ends count a little less than for the greatest)
    near = sum(weights[np.abs(np.abs(points[:, 0]) - at) < 0.06].sum() for at in (1.0, 5**-0.5))
    assert near > 0.85
    # the rounds that are taken come near
    assert best(ROUNDS)[1] < 1.02 * variance


def test_runs_go_where_dispersions_are_great():
    points = np.linspace(-1.0, 1.0, 401)[:, None]
    weights = design_weights(points, 2, np.exp(points[:, 0]))
    assert weights[points[:, 0] > 0.5].sum() > 2.0 * weights[points[:, 0] < -0.5].sum()


def test_designs_follow_their_shares():
    points = np.linspace(-1.0, 1.0, 11)[:, None]
    weights = np.arange(11.0) / 55.0
    for parts, atol in ((1, 1 / 16), (8, 0.01), (500, 2e-4)):
        found = np.concatenate([designed(points, weights, 16, 3, part) for part in range(parts)])
        shares = np.array([(found[:, 0] == one).mean() for one in points[:, 0]])
        np.testing.assert_allclose(shares, weights, atol=atol)
    assert np.array_equal(designed(points, weights, 16, 3, 7), designed(points, weights, 16, 3, 7))
    assert not np.array_equal(designed(points, weights, 16, 3, 7), designed(points, weights, 16, 4, 7))


@pytest.mark.parametrize("inertia", [0.0, 0.1])
def test_every_part_of_a_design_is_all_over_the_region(inertia):
    domain = domain_of(variables(inertia=inertia))
    points = candidates(domain, 1)
    even = np.full(len(points), 1.0 / len(points))
    sides = points > np.median(points, axis=0)
    for part in range(20):
        own = designed(points, even, 16, 1, part) > np.median(points, axis=0)
        # (of 16 blocks at random 3 or fewer, or 13 or more, would lie on one side in one part of fifty, a side)
        assert (np.abs(own.mean(axis=0) - sides.mean(axis=0)) <= 0.2).all()


def test_checks_are_at_the_corners_and_elsewhere():
    domain = domain_of(variables())
    given = domain.points(variables())
    found = check_points(domain, given, 24, 1)
    assert domain.holds(found).all()
    assert len(np.unique(found, axis=0)) == len(found) >= 20
    apart = np.linalg.norm(found[:, None] - domain.vertices[None], axis=-1).min(axis=0)
    assert apart.max() < 1.0  # (every corner has a check within half the region)
    assert len(some_points(domain, given, 100)) == 100 + len(domain.vertices)
