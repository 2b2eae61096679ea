"""docs/directions.md: its controls, plain loops beside the engine, and numbers that are computed again."""

import re
from functools import partial

import numpy as np
import pytest
from check_facts import numbers_in
from page_tables import page, rows_beside, table_below
from scipy.stats import binomtest

import toppling as tp
from toppling import motions
from toppling.benchmarks.pages import directions as tables, directions_runs as directions, shares
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.friction import CONTACTS

TEXT = page("directions")
NUMBER = 60


@pytest.fixture(scope="module")
def shakes():
    """The first motions of the page."""
    return directions.shakes_of(NUMBER)


@pytest.fixture(scope="module")
def shelf():
    return next(one for one in directions.P58 if one.name == "bookcase-5-shelf")


rows = partial(rows_beside, "directions")
FALLS = rows("falls")


def falls_by_a_plain_loop(block, e, across, vertical, dt, parts=4):
    """Whether blocks fall, one for each motion (motion, time): Housner's equation in small steps, nothing else.

    No line of it is the engine's.  It steps with the velocity at the middle; an impact is where the rotation changes
    its sign within a step.
    """
    alpha, square = block.alpha, block.p**2
    number, samples = across.shape
    theta, omega, fallen = np.zeros(number), np.zeros(number), np.zeros(number, bool)
    h = dt / parts
    for i in range(samples - 1):
        for k in range(parts):
            part = (k + 0.5) / parts
            a = across[:, i] + part * (across[:, i + 1] - across[:, i])
            weight = G + vertical[:, i] + part * (vertical[:, i + 1] - vertical[:, i])
            side = np.where(theta != 0.0, np.sign(theta), np.where(omega != 0.0, np.sign(omega), -np.sign(a)))
            rests = (theta == 0.0) & (omega == 0.0) & (np.abs(a) <= weight * np.tan(alpha))
            middle = theta + 0.5 * h * omega
            lean = alpha * side - middle
            push = -square / G * (weight * np.sin(lean) + a * np.cos(lean))
            faster = omega + h * push
            moved = theta + 0.5 * h * (omega + faster)
            strikes = ~rests & (moved * side < 0.0)
            omega = np.where(rests, 0.0, np.where(strikes, e * faster, faster))
            # what would be pressed onto the floor on its new side, slowly, stays
            slow = strikes & (np.abs(omega) < 1e-5)
            omega = np.where(slow, 0.0, omega)
            theta = np.where(rests | strikes, 0.0, moved)
            fallen |= np.abs(theta) > 1.5
            theta, omega = np.where(fallen, 2.0, theta), np.where(fallen, 0.0, omega)
    return fallen


def slips_by_a_plain_loop(static, kinetic, across, dt, parts=10):
    """Greatest slips, m, of blocks with friction (draw,) on floors (motion, time), in small steps: (draw, motion)."""
    static, kinetic = static[:, None], kinetic[:, None]
    speed = np.zeros((static.size, across.shape[0]))
    slip, peak = np.zeros_like(speed), np.zeros_like(speed)
    h = dt / parts
    for i in range(across.shape[1] - 1):
        for k in range(parts):
            a = across[:, i] + (k + 0.5) / parts * (across[:, i + 1] - across[:, i])
            way = np.where(speed != 0.0, np.sign(speed), np.where(np.abs(a) > static * G, -np.sign(a), 0.0))
            faster = speed + h * (-a - way * kinetic * G) * (way != 0.0)
            stops = (faster * way < 0.0) & (speed != 0.0)
            part = np.where(stops, speed / np.where(stops, speed - faster, 1.0), 1.0)  # of the step, until it stops
            slip = slip + h * part * 0.5 * np.where(stops, speed, speed + faster)
            speed = np.where(stops, 0.0, faster)
            peak = np.maximum(peak, np.abs(slip))
    return peak


class TestPaired:
    def test_a_median_between_levels(self):
        levels = np.array([1.0, 2.0, 4.0])
        assert shares.medians(np.array([0.0, 0.25, 0.75]), levels) == pytest.approx(8.0**0.5)
        # a share that falls again counts as its highest before
        assert shares.medians(np.array([0.0, 0.6, 0.4]), levels) == pytest.approx(2.0 ** (0.5 / 0.6))
        assert np.isnan(shares.medians(np.array([[0.0, 0.1, 0.4], [0.5, 0.6, 0.7]]), levels)).all()

    def test_draws_are_paired(self):
        """The difference of two sets of draws is the draws of the difference, and equal values have none."""
        one, two = np.random.default_rng(1).random((2, 3, 50)) < 0.5
        np.testing.assert_allclose(shares.draws(one) - shares.draws(two), shares.draws(one * 1.0 - two), atol=1e-12)
        assert shares.interval((shares.draws(one) / shares.draws(one))[:, 0]) == (1.0, 1.0, 1.0)

    def test_the_sign_test(self):
        """McNemar's exact test is a binomial test."""
        before, after = np.zeros(40, bool), np.zeros(40, bool)
        after[:12] = True
        before[12:15] = True
        assert shares.flips(before, after) == (12, 3)
        assert shares.sign_test(before, after) == pytest.approx(binomtest(12, 15).pvalue)
        assert shares.sign_test(before, before) == 1.0

    def test_holm(self):
        assert shares.holm([0.02, 0.001, 0.04, 0.03]) == [False, True, False, False]
        assert shares.holm([0.012, 0.001, 0.02, 0.03]) == [True, True, True, True]


class TestControls:
    @pytest.mark.slow
    def test_the_same_motions_twice_change_nothing(self, shelf, shakes):
        part = shakes[0].isel(motion=slice(10))
        one, again = (directions.rocked(shelf.block, part, "h1")[0] for _ in range(2))
        np.testing.assert_array_equal(one, again)
        found = tables.Case(one[6], again[6])
        assert numbers_in(str(found)) == [0, 0, 0]
        assert found.p == 1.0

    def test_a_second_component_of_zero_changes_nothing(self, shelf, shakes):
        part = shakes[0].isel(motion=slice(10))
        still = part.copy(data=part.values * np.array([1.0, 0.0, 1.0])[None, :, None])
        found = tp.ida(
            shelf.block, directions.LAW, motions.both_axes(still), list(directions.LEVELS), im="scale",
            outputs=("overturned", "axis"), screen=False,
        )  # fmt: skip
        np.testing.assert_array_equal(found["overturned"].values[0, 0], directions.rocked(shelf.block, part, "h1")[0])
        assert not (found["axis"].values == 2).any()

    def test_a_vertical_component_of_zero_changes_nothing(self, shelf, shakes):
        part = directions.lifted(shakes[0].isel(motion=slice(10)), 0.0)
        fallen, airborne = directions.rocked(shelf.block, part, "h1", vertical=True)
        np.testing.assert_array_equal(fallen, directions.rocked(shelf.block, part, "h1")[0])
        assert not airborne.any()

    def test_the_union_is_the_engine_s(self, shelf, shakes):
        """Falls along the width or the depth, as the page joins them, and as the runs about both axes have them."""
        part = shakes[1].isel(motion=slice(10))
        square = tp.Block(shelf.block.width, shelf.block.height, depth=1.2 * shelf.block.width, name="square")
        one, two = (directions.rocked(own, part, h)[0] for own, h in ((square, "h1"), (square.across, "h2")))
        both = tp.ida(
            square, directions.LAW, motions.both_axes(part), list(directions.LEVELS), im="scale",
            outputs=("overturned",), screen=False,
        )  # fmt: skip
        np.testing.assert_array_equal(both["overturned"].values[0, 0], one | two)
        assert (two & ~one).any()


class TestMotions:
    def test_the_components(self, shakes):
        found = shakes[0]
        names = ["RotD50(pga)", "RotD50(pgv)"]
        measured = motions.measures(motions.as_recorded(found), names)
        np.testing.assert_allclose(measured["RotD50(pgv)"], 1.0, rtol=1e-12)
        up = found.sel(component="v").values
        np.testing.assert_allclose(np.abs(up).max(1), measured["RotD50(pga)"], rtol=1e-12)
        np.testing.assert_allclose(shakes[1].sel(component="v").values, up * directions.RATIOS[0], rtol=1e-14, atol=0.0)
        h1, h2 = (found.sel(component=name).values for name in ("h1", "h2"))
        for one, two in ((h1, h2), (h1, up), (h2, up)):
            correlations = (one * two).sum(1) / np.sqrt((one**2).sum(1) * (two**2).sum(1))
            assert abs(correlations.mean()) < 4.0 * correlations.std() / NUMBER**0.5

    def test_the_vertical_one_is_about_twice_as_fast(self, shakes):
        """Crossings of zero in the middle 90 % of each component's energy."""

        def frequency(values):
            energy = np.cumsum(values**2)
            first, last = np.searchsorted(energy, [0.05 * energy[-1], 0.95 * energy[-1]])
            part = values[first:last]
            return (np.diff(np.sign(part)) != 0).sum() / part.size

        ratios = [frequency(up) / frequency(h1) for h1, _, up in shakes[0].values]
        assert 1.6 < np.median(ratios) < 2.2

    def test_any_part_of_the_motions_is_the_same(self, shakes):
        np.testing.assert_array_equal(directions.triples(2).values, shakes[0].values[:2])


@pytest.mark.slow
class TestPlainLoops:
    """Numbers of the page by loops that have nothing in common with the engine."""

    @pytest.mark.parametrize("vertical", [False, True])
    def test_falls(self, shelf, shakes, vertical):
        """Single outcomes are chaotic, shares are not: those that differ do so either way.

        Processors compute the shaking with other last digits: on one of them 16 outcomes of 60 differ, on another fewer
        than 15.  Independent outcomes of the same shares would differ in half of the runs.
        """
        level = directions.LEVELS.index(0.4)
        h1, up = (shakes[1].sel(component=name).values * 0.4 for name in ("h1", "v"))
        ours = directions.rocked(shelf.block, shakes[1], "h1", vertical=vertical)[0][level]
        plain = falls_by_a_plain_loop(shelf.block, shelf.block.restitution, h1, up if vertical else 0.0 * up, 0.01)
        assert 0.25 < ours.mean() < 0.75
        assert (ours != plain).mean() < 0.35
        assert abs(ours.mean() - plain.mean()) < 0.1

    def test_slips(self, shakes):
        """Each slip on vinyl, which is not chaotic (steps of 1 ms are off by millimetres), and the chance of 10 cm."""
        part = shakes[0].isel(motion=slice(30))
        level = directions.LEVELS.index(1.0)
        coefficients = directions.coefficients("vinyl")
        ours = directions.slid("vinyl", motions.as_recorded(part, "h1", vertical=False), "slide_peak")["slide_peak"][
            :, level
        ]
        ratio = CONTACTS["vinyl"].kinetic_ratio
        plain = slips_by_a_plain_loop(coefficients, ratio * coefficients, part.sel(component="h1").values, 0.01)
        errors = np.abs(plain - ours)
        assert np.median(errors) < 5e-4
        assert errors.max() < 0.01
        assert 0.1 < (ours > 0.10).mean() < 0.5
        assert (ours > 0.10).mean() == pytest.approx((plain > 0.10).mean(), abs=4e-3)


class TestPage:
    def test_its_table_of_pieces_is_of_today(self):
        assert rows("pieces") == [list(row) for row in tables.item_rows()]

    @pytest.mark.slow
    def test_falls_are_computed_again(self, shelf, shakes):
        """A piece at all levels and in all cases under the first motions (other processors flip some outcomes)."""
        assert rows("falls", heading=True)[0][-1] == f"falls_of_first_{NUMBER}"
        found = directions.of_item(shelf, *shakes)
        stated = {(case, float(level)): int(first) for name, case, level, _, _, first in FALLS if name == shelf.name}
        ours = {
            (case, level): int(row.sum())
            for case, flags in found.items()
            for level, row in zip(directions.LEVELS, flags, strict=True)
        }
        assert ours.keys() == stated.keys()
        differences = np.array([abs(ours[key] - stated[key]) for key in ours])
        assert differences.max() <= 3
        assert differences.sum() <= 0.02 * NUMBER * differences.size

    def test_its_tables_are_of_these_falls(self):
        """Shares with one component in the table, from the file of falls."""
        shares = {(name, case, float(level)): int(n) / int(of) for name, case, level, of, n, _ in FALLS}
        for item in directions.ROCKING:
            stated = next(row for row in rows("second_direction") if row[0] == item.name)
            assert float(stated[2]) == pytest.approx(100 * shares[item.name, "one", float(stated[1])], abs=0.5)
            every = [shares[item.name, "one", level] for level in directions.LEVELS]
            assert directions.LEVELS[int(np.argmin(np.abs(np.array(every) - 0.5)))] == float(stated[1])

    def test_what_the_page_concludes(self):
        """Its sentences follow from its tables."""

        def ends(cell):
            return [float(one.replace("−", "-")) for one in re.findall(r"[+−][\d.]+", cell)[1:3]]

        def per_cent(cell):
            return [float(one) for one in re.search(r"(\d+) \((\d+)–(\d+)\)", cell).groups()]

        summary = {row[0]: row[1:] for row in table_below(TEXT, "# Second direction")}
        square, _, third, full, *controls = summary.values()
        assert ends(square[0])[0] > 20.0
        assert ends(third[0])[0] < 0.0 < ends(third[0])[1]
        assert ends(third[2])[0] < 0.0 < ends(third[2])[1]
        assert ends(full[0])[0] > 0.0
        assert ends(full[2])[0] > 0.0
        assert len(controls) == 2
        for row in controls:
            assert [numbers_in(cell)[:2] for cell in row[1:4:2]] == [[0, 0], [0, 0]]
            assert ends(row[0])[0] <= 0.1
            assert ends(row[2])[0] <= 0.1
        for row in rows("second_direction"):
            if float(row[5]) >= 1.6:
                assert ends(row[6])[1] < 1.0
            assert 1.1 < float(row[4].split()[0]) < 1.3
        slips = [float(row[4].split()[0].replace("−", "-")) for row in rows("slips")]
        assert 1.5 < max(slips) < 2.5
        assert min(slips) >= 0.0
        bench = {(row[0], row[1]): row for row in rows("bench")}
        for name in ("microscope", "analyser", "laptop"):
            row = bench[name, "2"]
            assert row[4] == "–" or per_cent(row[5])[1] > per_cent(row[4])[2]
        for name in ("vase", "monitor"):
            for level in ("0.5", "1"):
                assert per_cent(bench[name, level][4])[1] > per_cent(bench[name, level][5])[2]
        assert all(per_cent(bench[name, "1"][8])[2] <= 1 for name, _ in bench)
        for name in ("vase", "monitor", "microscope"):
            assert per_cent(bench[name, "1"][7])[0] >= per_cent(bench[name, "1"][2])[0] - 1

    def test_what_other_pages_say(self):
        """Numbers of the page that are on others."""
        chance = tables.slides(next(one for one in directions.P58 if one.name == directions.TWO_DRAWER), "vinyl")
        assert f"{chance:.2f}" == "0.97"
        assert "probability of 0.97" in page("p58")
        ratios = [1.0 / float(row[4].split()[0]) for row in rows("second_direction")]
        assert np.median(ratios) == pytest.approx(0.83, abs=0.01)
        assert "0.83 times" in page("limits")

    @pytest.mark.slow
    def test_a_row_is_computed_again(self, shelf):
        """Of all motions: the change in both directions of a square plan, by counting.

        Motions differ in their last digits between processors, and with them a few of a thousand verdicts.
        """
        stated = next(row for row in rows("second_direction") if row[0] == shelf.name)
        level, full = float(stated[1]), directions.triples()
        one, other = (
            tp.ida(shelf.block, directions.LAW, motions.as_recorded(full, name), [level], "scale", screen=False)[
                "overturned"
            ].values.ravel()
            for name in ("h1", "h2")
        )
        assert float(stated[3].split()[0]) == pytest.approx(100 * (other & ~one).sum() / directions.NUMBER, abs=0.5)
        assert float(stated[2]) == pytest.approx(100 * one.sum() / directions.NUMBER, abs=0.7)
