"""docs/runs.md: verdicts as those of analyses, an exponent that is known, and cells that are computed again."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import toppling as tp
from toppling.benchmarks.pages import runs

DOCS = Path(tp.__file__).parent / "docs"
TEXT = (DOCS / "runs.md").read_text(encoding="utf-8")


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
    """Changes by 1 % of the factor and of e, with their intervals, as the page has them.

    Motions differ in their last digits between processors, and with them some hundred of the 24,000 verdicts.
    """
    factors = runs.about_the_median(found)
    before = runs.falls(found.motions, factors)
    changed = (runs.falls(found.motions, factors * 1.01) != before).mean(axis=1)
    e = tp.EnergyConsistent().restitution(runs.BLOCK)
    other = (runs.falls(found.motions, factors, law=tp.EnergyConsistent(e=1.01 * e)) != before).mean(axis=1)
    for name, shares in (("1", changed), ("e larger by 1 %", other)):
        stated, computed = (
            [float(value) for value in re.findall(r"\d+\.\d", text)]
            for text in (re.search(rf"\| {name} \| (.*) \|", TEXT)[1], runs.per_cent(shares))
        )
        assert len(stated) == 3
        np.testing.assert_allclose(computed, stated, atol=0.25)


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


@pytest.mark.parametrize("name", ["databases", "single", "synthetic"])
def test_numbers_of_the_commands_stand_on_the_page(name):
    """What the commands printed is there, and sequential analyses kept 93 % of their promises or more."""
    kept = runs.printed(name)
    assert kept in TEXT
    shares = []
    title, column = "", 0
    for before, line in pairwise(["", *kept.splitlines()]):
        if " kept " in line:
            title, column = before, line.index(" kept ")
        share = line[column : column + 6].strip()
        if "common levels" not in title + line and share.startswith(("0.", "1.")):
            shares.append(float(share))
    assert len(shares) >= 8
    assert min(shares) >= 0.93


def test_pooled_surfaces_beside_grids():
    """What the command printed is on the page; what is said of equal time and equal error follows from it."""
    kept = runs.printed("sizes")
    assert kept in TEXT
    ways = runs.ways_to_sizes(kept)
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
