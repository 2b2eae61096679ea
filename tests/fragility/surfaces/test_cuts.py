"""Cuts of a region: where a surface jumps, found from runs alone, none where it does not; blocks between."""

import math

import numpy as np
import pytest
import scipy

from toppling.fragility.surfaces.cuts import HELD, find_cut, log_likelihood, placed, settled
from toppling.fragility.surfaces.domain import check_points, cut_check_points, design_weights, domain_of, normals
from toppling.fragility.surfaces.evaluation import LawSurfaces, curves_at
from toppling.fragility.surfaces.surface import (
    Cut,
    Pool,
    added_terms,
    basis,
    cut_score,
    fit_surface,
    number_of_terms,
    terms_at,
)

PLACE = 0.3
PLANES = np.eye(2)


def smooth(points):
    return 0.3 + 0.5 * points[:, 0] - 0.2 * points[:, 0] * points[:, 1]


def jumping(points):
    return smooth(points) + (0.25 + 0.1 * points[:, 1]) * (points[:, 0] >= PLACE)


def pool(seed=0, motions=300, of=jumping):
    """Eight runs of each motion, each of another block; half of the variance of capacities is the motion's."""
    random = np.random.default_rng(seed)
    points = random.uniform(-1.0, 1.0, (motions * 8, 2))
    motion = np.repeat(np.arange(motions), 8)
    common, own = random.standard_normal(motions)[motion], random.standard_normal(motions * 8)
    x = of(points) + random.uniform(-0.4, 0.4, len(points))
    return Pool(points, x, of(points) + 0.3 * math.sqrt(0.5) * (common + own) < x, motion)


def found_in(runs):
    return find_cut(runs, PLANES, (2, 1), fit_surface(runs, (2, 1)))


def test_a_jump_is_found_where_it_is():
    found = found_in(pool())
    assert found.cut.normal.tolist() == [1.0, 0.0]
    assert found.cut.low <= PLACE <= found.cut.high
    assert found.cut.low <= found.cut.place <= found.cut.high < found.cut.low + 0.1
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (60, 2))
    points = points[~found.cut.open_at(points)]
    middle, error = found.log_medians(points), found.median_errors(points)
    assert np.abs((middle - jumping(points)) / error).max() < 4.0
    # (the surface without a cut is far from it next to the plane)
    other = fit_surface(pool(), (2, 1)).log_medians(points)
    assert np.abs(other - jumping(points)).max() > 0.1


def test_no_jump_is_found_where_there_is_none():
    assert [found_in(pool(seed, of=smooth)) for seed in range(10)] == [None] * 10


def test_the_score_of_a_cut_is_twice_the_likelihood_that_it_gains():
    for of, places in ((smooth, (-0.5, 0.0, 0.5)), (jumping, (PLACE,))):
        runs = pool(of=of)
        without = fit_surface(runs, (2, 1))
        for place in places:
            cut = Cut(PLANES[0], place, place, place)
            gain = log_likelihood(fit_surface(runs, (2, 1), without, cut), runs) - log_likelihood(without, runs)
            assert cut_score(runs, without, cut) == pytest.approx(2.0 * gain, rel=0.15)
    assert cut_score(runs, without, Cut(PLANES[0], 2.0, 2.0, 2.0)) == 0.0


@pytest.mark.slow
def test_places_that_runs_allow_hold_the_true_one():
    held = 0
    for seed in range(60):
        cut = found_in(pool(seed, motions=600)).cut
        held += cut.low <= PLACE <= cut.high
    assert held >= 57  # (of 60 at 99 %: 56 or fewer come about by chance once in 300)


def test_the_place_is_the_likeliest_of_all():
    """Against the likelihood of every place in turn, with the coefficients as they are."""
    runs = pool(motions=80)
    found = fit_surface(runs, (2, 1), cut=Cut(PLANES[0], 0.2, 0.2, 0.2))
    values = np.unique(runs.points[:, 0])
    places = 0.5 * (values[1:] + values[:-1])
    each = [log_likelihood(found._replace(cut=found.cut._replace(place=place)), runs) for place in places.tolist()]
    fewest = 24 * 9  # (runs on either side)
    enough = np.arange(fewest - 1, runs.x.size - fewest)
    heights = np.array(each)[enough]
    cut = placed(found, runs)
    assert cut.place == places[enough[heights.argmax()]]
    allowed = enough[heights >= heights.max() + HELD * math.log1p(-math.sqrt(0.99))]
    assert (cut.low, cut.high) == (values[allowed[0]], values[allowed[-1] + 1])
    assert settled(found, runs).cut.place == placed(settled(found, runs), runs).place


def test_few_runs_on_one_side_have_no_cut():
    runs = pool(motions=30)
    assert placed(fit_surface(runs, (2, 1), cut=Cut(PLANES[0], 0.2, 0.2, 0.2)), runs) is None


def test_terms_beyond_a_cut():
    points = np.array([[-0.5, 0.4], [0.7, 0.4]])
    cut = Cut(PLANES[0], 0.0, 0.0, 0.0)
    rows = terms_at(points, 3, cut)
    assert rows.shape == (2, 10 + 6)
    np.testing.assert_array_equal(rows[:, :10], basis(points, 3))
    assert not rows[0, 10:].any()
    np.testing.assert_array_equal(rows[1, 10:], basis(points[1:], 2)[0])
    np.testing.assert_array_equal(terms_at(points, 3), basis(points, 3))
    assert number_of_terms(2, (3, 1), cut) == 10 + 6 + 3 + 3


def test_likelihood_with_a_cut_is_greatest():
    """Two surfaces of their own on the two sides, where the jump has all terms of the surface."""
    runs = pool()
    cut = Cut(PLANES[0], PLACE, PLACE, PLACE)
    found = fit_surface(runs, (2, 1), cut=cut)
    far = runs.points[:, 0] >= PLACE
    each = [fit_surface(runs.some(side), (2, 1)) for side in (~far, far)]
    for one, side in zip(each, (~far, far), strict=True):
        np.testing.assert_allclose(found.log_medians(runs.points[side]), one.log_medians(runs.points[side]), atol=2e-4)
    assert added_terms(fit_surface(runs, (2, 1)), found) < 1e-4


def test_blocks_between_the_sides_have_intervals_of_both():
    runs = pool()
    found = found_in(runs)
    cut = found.cut._replace(low=0.25, high=0.35)
    law = LawSurfaces(found._replace(cut=cut), found._replace(cut=cut), 2.5, 0.0)
    points = np.array([[0.2, 0.0], [0.29, 0.0], [0.31, 0.0], [0.4, 0.0]])
    curves = curves_at(law, points, np.zeros(4), None)
    reach = curves.log_upper - curves.log_lower
    assert (reach[1:3] > 0.3).all()
    assert (reach[[0, 3]] < 0.2).all()
    for far in (False, True):
        one = law._replace(near=law.near.on_side(far), curve=law.curve.on_side(far))
        side = curves_at(one, points, np.zeros(4), None)
        assert (curves.log_lower[1:3] <= side.log_median[1:3]).all()
        assert (curves.log_upper[1:3] >= side.log_median[1:3]).all()


def test_checks_of_a_cut_have_other_blocks_on_its_two_sides():
    random = np.random.default_rng(0)
    table = np.stack([random.uniform(1.0, 1.8, 500), random.uniform(-2.0, -1.0, 500), np.full(500, 4 / 3)], axis=1)
    domain = domain_of(table)
    given = domain.points(table)
    planes = normals(domain)
    assert planes.shape == (2, 2)
    along = given @ planes[0]
    cut = Cut(planes[0], 0.1, 0.08, 0.12)
    found = [cut_check_points(domain, given, 24, 1, cut, check) for check in (1, 2)]
    np.testing.assert_array_equal(found[0], cut_check_points(domain, given, 24, 1, cut, 1))
    for one in found:
        assert one.shape == (24, 2)
        assert domain.holds(one).all()
        assert not cut.open_at(one).any()
        near = np.abs(one @ planes[0] - 0.1) < 0.1 * (along.max() - along.min())
        assert (near & (one @ planes[0] < 0.1)).sum() >= 6
        assert (near & (one @ planes[0] > 0.1)).sum() >= 6
    first = {tuple(one) for one in check_points(domain, given, 24, 1)}
    assert len(first & {tuple(one) for one in found[0]}) <= 6
    assert len({tuple(one) for one in found[1]} & {tuple(one) for one in found[0]}) <= 6


def test_the_design_has_blocks_on_both_sides_of_a_cut():
    points = np.linspace(-1.0, 1.0, 401)[:, None]
    cut = Cut(np.ones(1), 0.2, 0.2, 0.2)
    with_cut = design_weights(points, 2, np.ones(401), cut)
    without = design_weights(points, 2, np.ones(401))
    next_to = np.abs(points[:, 0] - 0.2) < 0.05
    assert with_cut[next_to].sum() > 0.2
    assert without[next_to].sum() < 0.1


def test_the_best_likelihood_is_not_beaten_by_another_search():
    runs = pool(motions=120)
    cut = Cut(PLANES[0], PLACE, PLACE, PLACE)
    found = fit_surface(runs, (2, 1), cut=cut)
    middle, width = terms_at(runs.points, 2, cut), terms_at(runs.points, 1, cut)
    n = middle.shape[1]

    def loss(c):
        z = (runs.x - middle @ c[:n]) / np.exp(width @ c[n:])
        return -scipy.special.log_ndtr(np.where(runs.fell, z, -z)).sum()

    other = scipy.optimize.minimize(loss, found.coefficients + 0.02, method="BFGS", options={"maxiter": 2000})
    assert loss(found.coefficients) <= other.fun + 1e-6
    assert loss(found.coefficients) == pytest.approx(-log_likelihood(found, runs))
