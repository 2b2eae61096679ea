"""docs/consistency.md: its hazard is of one piece, and its answer says what its tables hold."""

import re
from functools import partial

import numpy as np
import pytest
from page_tables import page, rows_beside

import toppling as tp
from toppling.benchmarks.pages import consistency

TEXT = page("consistency")


rows = partial(rows_beside, "consistency", heading=True)


def test_levels_are_exceeded_once_in_their_return_periods():
    """The curve against draws: 200,000 values of Sa(1 s) of each earthquake of a site."""
    random = np.random.default_rng(1)
    for site in consistency.SITES:
        hazard = consistency.hazard_of(site)
        np.testing.assert_allclose(hazard.curve.rate_at(hazard.levels), 1.0 / np.array(consistency.PERIODS), rtol=5e-3)
        rate = np.zeros(hazard.levels.size)
        for scenario, own in zip(site.scenarios, site.rates, strict=True):
            one = tp.motions.expected_target(scenario, consistency.GIVEN, [consistency.GIVEN])
            drawn = one.medians[0] * np.exp(one.sigmas[0] * random.standard_normal(200_000))
            rate += own * np.array([np.mean(drawn > level) for level in hazard.levels])
        np.testing.assert_allclose(rate[:4], 1.0 / np.array(consistency.PERIODS[:4]), rtol=0.05)
        for level, target in zip(hazard.levels, hazard.wide, strict=True):
            given = target.at(level)
            at = [one.label for one in given.measures].index(given.given.label)
            assert given.medians[at] == pytest.approx(level, rel=1e-12)
            assert given.sigmas[at] == pytest.approx(0.0, abs=1e-12)


def test_the_answer_says_what_the_tables_hold():
    choices = rows("choices")
    for name in consistency.CHOICES:
        cells = [row[choices[0].index(name)] for row in choices[1:]]
        # (too few falls for a ratio are counted)
        assert all(re.fullmatch(r"\d falls?", cell) for cell in cells if "fall" in cell)
        ratios = [float(cell.split()[0]) for cell in cells if "fall" not in cell]
        assert len(ratios) >= 15
        assert f"{min(ratios):.2f} to {max(ratios):.2f}" in TEXT


def test_intervals_hold_their_ratios():
    cells = [cell for name in ("choices", "roof", "supports") for row in rows(name) for cell in row]
    found = [match.groups() for match in map(re.compile(r"([\d.]+) \(([\d.]+)–([\d.]+)\)").fullmatch, cells) if match]
    assert len(found) > 80
    for value, low, high in found:
        assert float(low) <= float(value) <= float(high)
