"""docs/runs.md: verdicts as those of analyses, an exponent that is known, and cells that are computed again."""

import re
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from page_tables import DOCS, page, rows_beside

import toppling as tp
from toppling.benchmarks.pages import runs

TEXT = page("runs")


rows = partial(rows_beside, "runs")


@pytest.fixture(scope="module")
def found():
    return runs.shaken()


def test_verdicts_are_those_of_an_analysis(found):
    array = runs.GENERATOR.sample(3, seed=runs.SEED)
    factors = np.array([0.5, 1.0, 2.0, 4.0])
    own = runs.falls(found.motions[:3], np.broadcast_to(factors, (3, 4)))
    other = tp.ida(runs.BLOCK, runs.LAW, array, factors, "scale", ("overturned",), screen=False)
    np.testing.assert_array_equal(own.T, other["overturned"].values[0, 0])


def test_half_of_the_runs_fall_at_the_median(found):
    fell = runs.falls(found.motions, found.middle[:, None] * np.exp(np.linspace(-0.02, 0.02, 21)))
    assert fell.mean() == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("slope", [0.1, 0.5])
def test_a_known_exponent_is_found(slope):
    random = np.random.default_rng(1)
    shares = {change: 0.3 * change**slope * random.uniform(0.9, 1.1, 60) for change in runs.CHANGES}
    value, low, high = runs.exponent(shares)
    assert value == pytest.approx(slope, abs=0.02)
    assert low <= value <= high
    assert high - low < 0.05


def test_cells_are_computed_again(found):
    """Changes by 1 % of the factor and of e, with their intervals, as the table has them.

    Motions differ in their last digits between processors, and with them some hundred of the 24,000 verdicts.
    """
    factors = runs.about_the_median(found)
    before = runs.falls(found.motions, factors)
    changed = (runs.falls(found.motions, factors * 1.01) != before).mean(axis=1)
    e = tp.EnergyConsistent().restitution(runs.BLOCK)
    other = (runs.falls(found.motions, factors, law=tp.EnergyConsistent(e=1.01 * e)) != before).mean(axis=1)
    table = {row[0]: [*map(float, row[1:])] for row in rows("changes")}
    for name, shares in (("factor larger by 1 %", changed), ("e larger by 1 %", other)):
        np.testing.assert_allclose(runs.interval(shares).times(100), table[name], atol=0.25)


def test_intervals_and_first_falls_of_a_known_set(found, monkeypatch):
    """Verdicts that are set: stripes of width 0.05 in ln, every 0.1 from 0.02 on, are counted at every spacing."""

    def striped(motions, factors, *_):
        x = np.log(factors / found.middle[0])
        return (x >= 0.02) & (((x - 0.02) % 0.1) < 0.05)

    monkeypatch.setattr(runs, "falls", striped)
    one = runs.Shaken(found.motions[:1], found.middle[:1])
    intervals, first = runs.first_falls(one)
    assert intervals[-1] == 8  # (0.02, 0.12 … 0.72 up to 0.8)
    assert first[-1] == pytest.approx(0.02, abs=2e-4)
    assert (np.diff(first[1:]) <= 1e-12).all()


def test_the_page_is_that_of_its_tables():
    assert not re.search(r"\{\w+", TEXT)
    assert set(re.findall(r"\]\(runs/([\w.]+)\)", TEXT)) == {path.name for path in (DOCS / "runs").iterdir()}
    changed = next(row for row in rows("changes") if row[0] == "factor larger by 1 %")
    assert "{} ({}–{}) % of the outcomes".format(*changed[1:]) in TEXT
    coarse, *_, fine = rows("spacings")
    assert f"{coarse[1]} intervals" in TEXT
    assert f"it has {float(fine[1]):.0f}." in TEXT
    assert runs.body(runs.covered()) in TEXT
    assert f"at least {runs.half_levels():.1f} % of studies" in TEXT
    assert runs.half_levels() > 94.0


def promises(kept):
    """Return the shares of kept promises of sequential analyses that a command printed."""
    shares = []
    title, column = "", 0
    for before, line in pairwise(["", *kept.splitlines()]):
        if " kept " in line:
            title, column = before, line.index(" kept ")
        share = line[column : column + 6].strip()
        if "common levels" not in title + line and share.startswith(("0.", "1.")):
            shares.append(float(share))
    return shares


def test_promises_are_kept():
    """Sequential analyses kept 93 % of their promises or more, and as many as the page has."""
    shares = [promises(runs.printed(name)) for name in ("databases", "single", "synthetic")]
    assert all(len(each) >= 8 for each in shares)
    low, high = map(int, re.search(r"in (\d+) to (\d+) % of 500 replicates", TEXT).groups())
    assert (round(100 * min(map(min, shares))), round(100 * max(map(max, shares)))) == (low, high)
    assert low >= 93


def test_pooled_surfaces_beside_grids():
    """Errors in equal time, and time for equal errors, follow from the output of the command."""
    ways = runs.ways_to_sizes(runs.printed("sizes"))
    assert {len(one) for one in ways.values()} == {3}
    surface = ways["one surface"]
    assert [one.runs for one in surface] == [4000, 8000, 16_000]
    assert surface[0].rms <= 0.011
    local = ways["20 common levels, local fit"]
    assert surface[1].rms <= local[-1].rms < surface[0].rms
    assert surface[0].rms < 0.6 * local[1].rms
    assert surface[0].seconds < 1.1 * local[1].seconds
    # (in the same time about a third of the error)
    assert surface[2].rms < 0.35 * local[1].rms
    assert surface[2].seconds < 1.1 * local[1].seconds
    (through_all,) = (errors for name, errors in ways.items() if name.endswith("curve through all"))
    assert through_all[-1].rms > 2.0 * surface[0].rms
