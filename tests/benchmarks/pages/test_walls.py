"""docs/walls.md: its intervals, and numbers that are computed again."""

import math
from functools import partial

import numpy as np
import pytest
from page_tables import rows_beside

import toppling as tp
from toppling.benchmarks.pages import shares, walls
from toppling.motions.polarity import both_polarities

rows = partial(rows_beside, "walls")
FALLS = rows("falls")


class TestIntervals:
    def test_it_is_the_interval_of_the_package(self):
        """Wilson's of 30.5 of 100 motions; and never narrower with the same share of twice as many runs."""
        clusters = np.repeat([0.0, 0.5, 1.0], [69, 1, 30])
        found = tuple(shares.share(clusters))
        assert found == pytest.approx((0.305, *map(float, tp.fragility.binomial_interval(30.5, 100))))
        for hits in range(201):
            one = shares.share(np.repeat([0.0, 0.5, 1.0], [100 - (hits + 1) // 2, hits % 2, hits // 2]))
            lower, upper = tp.fragility.binomial_interval(hits, 200)
            assert one.lower <= lower
            assert one.upper >= upper

    def test_its_ends_rise_with_the_falls(self):
        found = [shares.share(np.repeat([0.0, 0.5], [100 - k, k])) for k in range(101)]
        assert (np.diff([one.lower for one in found]) >= 0.0).all()
        assert (np.diff([one.upper for one in found]) > 0.0).all()

    def test_a_free_piece_has_half_the_interval_of_its_falls(self):
        one = shares.share_of_free(np.repeat([0.0, 0.5], [40, 60]))
        assert tuple(one) == pytest.approx(
            (0.3, *(0.5 * float(end) for end in tp.fragility.binomial_interval(60, 100)))
        )
        with pytest.raises(ValueError, match="free symmetric piece"):
            shares.share_of_free(np.array([0.0, 1.0]))

    def test_a_decision_is_an_exact_permutation_test(self):
        """Against all signs of nine differences, enumerated; eight of one sign decide at 1 %, seven do not."""
        differences = np.array([0.5, 0.5, 1.0, 0.5, 1.0, -0.5, 0.5, 1.0, 0.5, 0.0])
        signs = np.array(np.meshgrid(*[[-1, 1]] * 9)).reshape(9, -1)
        chance = np.mean(np.abs(differences[:9] @ signs) >= abs(differences.sum()) - 1e-12)
        assert shares.two_sided(6, 3, 10) == pytest.approx(chance)
        assert shares.decided(differences, chance * 1.001) == 1
        assert shares.decided(differences, chance * 0.999) == 0
        few = np.array([np.repeat([-0.5, 0.0], [n, 100 - n]) for n in (7, 8)])
        assert shares.decided(few).tolist() == [0, -1]
        assert shares.decidable(few).tolist() == [False, True]
        with pytest.raises(ValueError, match="multiples of 1/2"):
            shares.decided(np.array([0.25]))

    def test_a_crossing(self):
        levels = np.array([1.0, 2.0, 4.0])
        excess = np.array([[-0.5, -0.5], [-0.25, -0.25], [0.25, 0.25]])
        assert shares.crossing(excess, levels) == pytest.approx((math.sqrt(8.0),) * 3)

    def test_both_polarities(self):
        shakes = tp.motions.CloughPenzien(duration=4.0, dt=0.01).sample(2)
        found = both_polarities(shakes)
        assert found.sizes["motion"] == 4
        np.testing.assert_array_equal(found.values[1::2], -shakes.values)
        np.testing.assert_array_equal(shares.clustered(np.array([1, 1, 0, 1])), [1.0, 0.5])


class TestPage:
    def test_its_table_of_pieces_is_of_today(self):
        assert rows("pieces") == [list(row) for row in walls.piece_rows()]

    def test_a_row_is_computed_again(self):
        """Free and at every gap, one piece under all motions of a kind: shares within one run of the page's."""
        kind, piece = "broadband", "museum-pedestal-slender"
        stated = next(row for row in FALLS if row[:3] == [kind, piece, "nine in ten"])
        n = int(np.argmin([abs(level * walls.velocity(piece) - float(stated[3])) for level in walls.LEVELS]))
        shakes = {kind: both_polarities(walls.KINDS[kind].sample(walls.NUMBER, seed=walls.SEED))}
        found = walls.over_gaps(shakes, (walls.LEVELS[n],), (piece,))
        ours = walls.gap_row(found, 0, 0, 0)
        numbers = [[int(str(cell).split()[0]) for cell in row] for row in (stated[4:], ours)]
        np.testing.assert_allclose(numbers[1], numbers[0], atol=1)

    def test_what_the_page_concludes(self):
        """Its sentences follow from its tables."""
        half, often = ([row for row in FALLS if row[2] == part] for part in walls.OFTEN)
        assert len(half) == len(often) == 18

        def value(cell):
            return float(cell.split()[0])

        for row in (*half, *often):
            # a wider gap: as many falls or more
            assert sorted(map(value, row[6:])) == list(map(value, row[6:]))
        # where the free piece falls in half of the runs, a touching wall reduces falls; a close one does everywhere
        assert all(value(row[6]) < value(row[5]) and value(row[7]) < value(row[5]) for row in half)
        # under near-fault motions the wall at 50 mm does not reduce them by much even there
        near = [row for row in half if row[0] == "near-fault"]
        assert all(value(row[9]) > value(row[5]) - 3.0 for row in near)
        # beyond, the kind of motions decides
        assert all(value(row[6]) < value(row[5]) for row in often if row[0] != "near-fault")
        assert sum(value(row[6]) > value(row[5]) for row in often if row[0] == "near-fault") >= 4
        assert all(row[3].startswith("above") for row in rows("rebounds") if row[1] == "half")
