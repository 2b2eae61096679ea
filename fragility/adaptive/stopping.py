"""When a sequential analysis stops: two looks in a row with room to spare, and a wave of fresh motions to confirm them.

Looking at a result until it is precise enough favours looks at which the estimated error is too small by chance. The
three parts of the rule compensate for it. Looks require intervals a sixth narrower than promised, one good look is not
enough, and the last motions are run after the decision.
"""

import math

from .until import DISPERSION, MEDIAN, PROBABILITY, RATE, Until

WAVE = 32
"""Number of motions between two looks at the result, of the first looks."""
WAVE_SHARE = 8
MARGIN = 1.2
LOOKS = 2
CONFIRMING = 32
CONFIRMING_SHARE = 0.2

REACHED, MOST_MOTIONS, NO_MORE = "precision reached", "most motions", "no more motions"
NONE_FELL, ALL_FELL, MISFIT = "nothing overturned", "everything overturned", "misfit"
"""Reasons to stop."""


def reason_text(reason: str, state: str | None = None) -> str:
    """Return a reason to stop in words; state: the name of a damage state other than overturning."""
    if state is None or reason not in (NONE_FELL, ALL_FELL):
        return reason
    return f"{'no' if reason == NONE_FELL else 'every'} run reached {state}"


def next_wave(motions: int) -> int:
    """Return the number of motions of the next wave: 32; from 512 on an eighth of those so far, in whole 32s."""
    return WAVE * max(1, motions // (WAVE * WAVE_SHARE))


_USUAL = {MEDIAN: 1.35, DISPERSION: 7.5, RATE: 42.0, PROBABILITY: 1.25}
"""Motions times the square of the half width that is allowed, counted on lognormal curves of dispersion 0.4 (a rate:
under a hazard of slope 2.5) by `benchmarks.sequential`."""
_OF_FEWER = {1: 1.4, 2: 1.1}
"""Times as many motions if each has fewer runs than three, counted by `benchmarks.sequential.databases`."""
_SPREAD = 2.5
"""Factor on the number of motions of other curves, up and down: dispersions of 0.25 and 0.63 cause it for a median."""


def usual_motions(until: Until, runs: int = 3) -> tuple[int, int, int]:
    """Return the approximate number of motions for a precision with `runs` of each: few, usual, many."""
    usual = _USUAL[until.target] / until.room**2 * _OF_FEWER.get(runs, 1.0)

    def bounded(number: float) -> int:
        waves = WAVE * math.ceil(number / WAVE)
        # the minimum is two looks and a confirming wave
        return min(until.most, max(until.least + (LOOKS - 1) * WAVE + CONFIRMING, waves))

    return bounded(usual / _SPREAD), bounded(usual), bounded(usual * _SPREAD)


def margin(motions: int, firm: float) -> float:
    """Return the number of times that an interval must be narrower than asked at a look, 1.2 up to `firm` motions.

    The room is for intervals that happen to be estimated too narrow. Their relative error falls with the root of the
    number of motions, and so does the room beyond `firm` motions.
    """
    return 1.0 + (MARGIN - 1.0) * math.sqrt(min(1.0, firm / max(motions, 1)))


class StoppingRule:
    """State of the rule for one curve: number of good looks in a row, and progress of the confirmation.

    firm: as of `margin`; without it all looks have the same room to spare.
    """

    def __init__(self, until: Until, firm: float = math.inf) -> None:
        self._until, self._firm = until, firm
        self._good = 0
        self._confirmed_at: int | None = None

    @property
    def confirmed_at(self) -> int:
        """Number of motions after which the confirming look is, 0 before any."""
        return self._confirmed_at or 0

    def step(self, motions: int, ratio: float, last: bool) -> str:
        """Return the reason to stop after a wave, empty if the analysis continues.

        `ratio` is the half width of the interval over its allowed value; `last` is True if there are no further
        motions.
        """
        most = motions >= self._until.most
        if self._confirmed_at is not None:
            if motions < self._confirmed_at and not (most or last):
                return ""
            if ratio <= 1.0:
                return REACHED
            self._confirmed_at, self._good = None, 0
        elif motions >= self._until.least:
            self._good = self._good + 1 if margin(motions, self._firm) * ratio <= 1.0 else 0
            if self._good >= LOOKS:
                self._confirmed_at = motions + max(CONFIRMING, math.ceil(CONFIRMING_SHARE * motions))
        if most or last:
            # (what a confirming wave was to show is not known, whatever the last look says)
            return MOST_MOTIONS if most else NO_MORE
        return ""


def motions_needed(motions: int, ratio: float, firm: float = math.inf) -> int:
    """Return the approximate total number of motions for the precision, from `motions` and their `ratio`.

    The `ratio` is the half width with `motions` over its allowed value.

    Errors fall with the root of the number of motions; the margin (after `motions`) and the confirming wave are
    included.
    """
    if not math.isfinite(ratio):
        return 0
    enough = motions * max(1.0, margin(motions, firm) * ratio) ** 2
    return math.ceil(enough + max(CONFIRMING, CONFIRMING_SHARE * enough))
