"""Long motions are worked on in pieces, between which an interrupt is heard, to the same bits; or they are refused."""

import numpy as np
import pytest

from toppling import motions as mo
from toppling.core import elementary
from toppling.motions import corrections
from toppling.motions.kernels import matching as engine, pieces
from toppling.motions.matching import adjustment, match
from toppling.motions.simulated import filters, site_based

SHAKES = 4.0 * mo.CloughPenzien(duration=6.0, dt=0.01).sample(2, seed=5)
TARGET = mo.TargetSpectrum((0.1, 0.5, 2.0), (8.0, 8.0, 2.0))
FRAME = mo.Building.from_storeys([1e5] * 2, [4e7] * 2, yielding=mo.Yielding(0.1))
WEAK = mo.Building.from_storeys([1e5] * 2, [4e7] * 2, yielding=mo.Yielding(0.02, p_delta=True))
WORK = {
    "spectrum": lambda: mo.response_spectrum(SHAKES, [0.004, 0.3, 1.0]),
    "floors": lambda: mo.Building.flexural_shear(0.8).floor_motions(SHAKES, parts=3),
    "peaks of floors": lambda: mo.Building.flexural_shear(0.8).peaks(SHAKES),
    "storeys that yield": lambda: FRAME.response(SHAKES),
    "storeys that collapse": lambda: WEAK.response(SHAKES, 3.0),
    "spring": lambda: mo.Isolator.bilinear(2.0, 0.05).motions(SHAKES),
    "stops": lambda: mo.Isolator.bilinear(2.0, 0.05, clearance=0.02, stop_frequency=10.0).motions(SHAKES),
    "pendulum": lambda: mo.Isolator.pendulum(1.0, 0.05).motions(SHAKES),
    "drifting ground": lambda: mo.EvolutionaryKanaiTajimi(duration=6.0, dt=0.01).sample(2),
    "site-based": lambda: mo.SiteBasedScenario().sample(20),
    "match": lambda: mo.match(SHAKES, TARGET),
    "baseline": lambda: mo.baseline(SHAKES, 4),
    "finer": lambda: mo.resample(SHAKES, 0.002),
    "coarser": lambda: mo.resample(SHAKES, 0.025),
    "other": lambda: mo.resample(SHAKES, 0.01 * 7 / 6),
}


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("work", WORK.values(), ids=WORK)
def test_pieces_give_the_same_bits(work, monkeypatch):
    whole = work()
    monkeypatch.setattr(pieces, "PIECE", 1e5)
    monkeypatch.setattr(match, "PIECE", 1e4)
    monkeypatch.setattr(filters, "PIECE", 100)
    monkeypatch.setattr(site_based, "PART_WORK", 1.0)
    monkeypatch.setattr(elementary, "PIECE", 100)
    monkeypatch.setattr(corrections, "_PIECE", 100)
    assert len([*pieces.pieces(600, 1e3)]) == 6
    assert work().identical(whole)


def test_a_step_of_a_match_can_be_left(monkeypatch):
    """The whole adjustment of a long record takes minutes; what Ctrl-C raises comes out between two steps."""
    improve, steps = engine._improve, []

    def interrupted(*arguments):
        steps.append(arguments)
        if len(steps) == 3:
            raise KeyboardInterrupt
        return improve(*arguments)

    monkeypatch.setattr(engine, "_improve", interrupted)
    with pytest.raises(KeyboardInterrupt):
        mo.match(SHAKES, TARGET)


@pytest.mark.parametrize(
    "make",
    [
        lambda: mo.match(mo.from_array(np.ones(3001), 0.01), TARGET),
        lambda: mo.SpectrumCompatible(TARGET, duration=30.0, dt=0.01),
    ],
)
def test_motions_too_long_to_be_matched_are_refused(make, monkeypatch):
    monkeypatch.setattr(adjustment, "MOST_NUMBERS", 100_000)
    with pytest.raises(ValueError, match=r"36 periods can be matched by motions of at most 1,754 samples, got 3,001: "):
        make()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: mo.HalfSine(1.0, 1e-9).sample(),
            r"a pulse may have 10,000,000 samples, got 3\.14e\+12: ",
        ),
        (lambda: mo.Ricker(1.0, 1e-320).sample(), "a pulse may have 10,000,000 samples, got inf"),
        (lambda: mo.Isolator.pendulum(1.0, 0.05, clearance=None), "clearance must be a number"),
        (lambda: mo.Building.flexural_shear(1.0, damping=None), "damping must be real numbers"),
        (lambda: mo.Building.from_storeys([1e5], [5e7], damping=10**400), "damping must be real numbers"),
    ],
)
def test_what_would_fill_the_memory_or_is_no_number(make, words):
    with pytest.raises((TypeError, ValueError), match=words):
        make()


def test_refused(refusal):
    refusal()


def test_no_vector_of_motions_waits_for_many_others(monkeypatch):
    """The work between two moments at which an interrupt is heard is bounded; no part has the memory of all motions."""
    made, parts = site_based.drifting_noise, []

    def noted(*arguments):
        parts.append(arguments[-1].size)
        assert len(arguments[0]) == parts[-1]
        return made(*arguments)

    monkeypatch.setattr(site_based, "drifting_noise", noted)
    monkeypatch.setattr(site_based, "PART_WORK", 1.0)
    mo.SiteBasedScenario().sample(20)
    assert parts == [8, 8, 4]
