"""Outcomes of sensitivity studies for the paper's claims and what its law gets wrong: verdict, number, interval.

Medians are compared with paired replicates of the bootstrap over motions, averaged (as logarithms) over the blocks.
Free rocking has no scatter, so its interval is the range over the blocks (and values).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...fragility.fitting.bootstrap import percentile_interval
from ...studies.file.uncertainty import RIGID
from ...studies.text.words import LAW_NAMES

HOLDS, FAILS, OPEN = "holds", "does not hold", "open"
PAPER, OURS = "paper", "ours"
ALIKE = 1.0 / 1.15, 1.15
"""Ratios of medians between which they are alike."""
SAME = 1e-9
"""Difference below which errors of free rocking are equal."""
RECOMMENDED = 0.05
"""The delta that the paper recommends."""
CONTINUOUS = ("giannini-masiani", "makris-konstantinidis", "vassiliou")

Numbers = tuple[float, float, float]
"""A number and the ends of its interval."""


class Claim(NamedTuple):
    """A claim of the paper, or ours of its law, and its outcome: verdict, and number with its interval."""

    claim: str
    of: str
    verdict: str
    number: float
    lower: float
    upper: float


class Evidence(NamedTuple):
    """The results that claims are judged by, and the values that count (block, value)."""

    results: xr.Dataset
    inside: Flags

    def model(self, law: str, rest: str = "elastic") -> int | None:
        """Return the position of a law among the models; None where it is not among them."""
        places = np.flatnonzero((self.results["law"].values == law) & (self.results["rest"].values == rest))
        return int(places[0]) if places.size else None

    def ratio(self, law: int, base_law: int | None) -> Numbers:
        """Return the geometric mean over blocks and values of a law's median over another's (None: the rigid one's).

        Pairs in which a law has no median, because nothing fell at any level (or everything), are left out.
        """
        log_samples = self.results["log_median_sample"].values
        base = self.results["log_rigid_sample"].values[:, law] if base_law is None else log_samples[:, base_law]
        if base_law is None:
            logs = np.log(self.results["median_ratio"].sel(comparison=RIGID).values[:, law])
        else:
            medians = np.log(self.results["median"].values)
            logs = medians[:, law] - medians[:, base_law]
        known = self.inside & np.isfinite(logs)
        if not known.any():
            return np.nan, np.nan, np.nan
        with np.errstate(invalid="ignore"):
            samples = (log_samples[:, law] - base)[known].mean(axis=0)
        ends = percentile_interval(samples, float(self.results.attrs["confidence"]))
        with np.errstate(over="ignore"):
            middle, low, high = (float(np.exp(end)) for end in (logs[known].mean(), ends.lower, ends.upper))
        return middle, low, high

    def spread(self, values: Array) -> Numbers:
        """Return mean and range of the finite values (block, value) that count."""
        used = values[self.inside & np.isfinite(values)]
        return (float(used.mean()), float(used.min()), float(used.max())) if used.size else (np.nan, np.nan, np.nan)


def evidence_of(results: xr.Dataset) -> Evidence:
    """Return the evidence at the recommended delta where it is among the values; else at all usual values."""
    inside = results["in_use"].values
    if results.attrs["parameter"] == "delta":
        far = np.abs(np.log(results["value"].values / RECOMMENDED))
        if far.min() < 1e-6:
            inside = np.zeros_like(inside)
            inside[:, int(far.argmin())] = True
    return Evidence(results, inside)


def claims(results: xr.Dataset) -> list[Claim]:
    """Return each claim that a study's laws can decide, with its verdict; `evidence` gives the results."""
    evidence = evidence_of(results)
    if not evidence.inside.any():
        return []
    usual = Evidence(results, results["in_use"].values) if results.attrs["parameter"] == "delta" else None
    decided = [
        _decay(evidence),
        *(judge(usual) if usual else None for judge in (_insensitive_decay, _insensitive_medians, _coefficient)),
        _like_discrete(evidence),
        _overturning(evidence, "makris-konstantinidis", "underestimates", above=True),
        _peaks(evidence, "makris-konstantinidis", "underestimates", smaller=True),
        _overturning(evidence, "vassiliou", "overestimates", above=False),
        _peaks(evidence, "vassiliou", "overestimates", smaller=False),
        _loss(evidence),
        _mode(evidence),
        _rigid(evidence),
    ]
    return [claim for claim in decided if claim is not None]


def verdict(holds: bool, fails: bool) -> str:
    """Return the verdict, open where a claim is neither held nor refuted."""
    return HOLDS if holds else FAILS if fails else OPEN


def _decay(evidence: Evidence) -> Claim | None:
    discrete = evidence.model("discrete")
    rivals = [model for model in map(evidence.model, CONTINUOUS) if model is not None]
    if discrete is None or not rivals:
        return None
    error = np.abs(evidence.results["decay_error"].values)
    # (without loss all laws are exact, and none is better than the others)
    best = np.all([error[:, discrete] <= error[:, j] + SAME for j in rivals], axis=0)[evidence.inside]
    numbers = evidence.spread(error[:, discrete])
    return Claim("discrete damping outperforms in free decay", PAPER, verdict(best.all(), not best.any()), *numbers)


def _insensitive_decay(evidence: Evidence) -> Claim | None:
    results, laws = evidence.results, _four(evidence)
    if laws is None:
        return None
    span = np.flatnonzero(evidence.inside[0])
    edge = float(results["value"].values[span].max())
    rigid = results["decay_rigid"].values[:, laws["discrete"]].min(axis=(0, 1))
    n = int(np.flatnonzero(rigid >= edge)[-1])
    if n == 0 or span.size < 2:
        return None
    peak = np.fmax(results["decay_peak"].values[..., n], results["value"].values[None, None, :])[:, :, span]
    moves = peak.max(axis=-1) / peak.min(axis=-1)
    least = moves[:, laws["discrete"]]
    best = np.all([least < moves[:, j] for name, j in laws.items() if name != "discrete"], axis=0)
    numbers = float(least.mean()), float(least.min()), float(least.max())
    claim = "discrete damping has the lowest sensitivity to δ: free rocking"
    return Claim(claim, PAPER, verdict(best.all(), not best.any()), *numbers)


def _insensitive_medians(evidence: Evidence) -> Claim | None:
    results, laws = evidence.results, _four(evidence)
    if laws is None:
        return None
    confidence = float(results.attrs["confidence"])
    samples = results["log_trend_sample"].sel(span="usual").mean("block").transpose("model", "replicate").values
    middle = np.log(results["median_trend"].sel(span="usual").transpose("block", "model").values).mean(axis=0)
    if not np.isfinite(middle[list(laws.values())]).all():
        return None
    base = laws["discrete"]
    differences = [
        percentile_interval(np.abs(samples[base]) - np.abs(samples[j]), confidence)
        for name, j in laws.items()
        if name != "discrete"
    ]
    least, more = all(high < 0.0 for _, high, _ in differences), any(low > 0.0 for low, _, _ in differences)
    low, high = np.exp(percentile_interval(samples[base], confidence)[:2])
    numbers = float(np.exp(middle[base])), float(low), float(high)
    return Claim("discrete damping has the lowest sensitivity to δ: overturning", PAPER, verdict(least, more), *numbers)


def _coefficient(evidence: Evidence) -> Claim | None:
    law = evidence.model("vassiliou")
    if law is None:
        return None
    rate = evidence.results["viscous_rate"].values[:, law]
    moved = float(np.max(np.ptp(rate, axis=-1) / rate.max(axis=-1)))
    claim = "the coefficient of Vassiliou et al. does not depend on δ"
    return Claim(claim, PAPER, verdict(moved == 0.0, True), moved, moved, moved)


def _like_discrete(evidence: Evidence) -> Claim | None:
    law, discrete = evidence.model("giannini-masiani"), evidence.model("discrete")
    if law is None or discrete is None:
        return None
    ratio = evidence.ratio(law, discrete)
    return Claim("Giannini–Masiani performs like discrete damping under shaking", PAPER, _alike(ratio), *ratio)


def _rigid(evidence: Evidence) -> Claim | None:
    law = evidence.model("energy-consistent", "rigid")
    if law is None:
        return None
    ratio = evidence.ratio(law, None)
    return Claim("energy-consistent damping is the rigid block", OURS, _alike(ratio), *ratio)


def _alike(ratio: Numbers) -> str:
    least, most = ALIKE
    _, low, high = ratio
    return verdict(low >= least and high <= most, low > most or high < least)


def _overturning(evidence: Evidence, law: str, what: str, *, above: bool) -> Claim | None:
    j = evidence.model(law)
    if j is None:
        return None
    ratio = evidence.ratio(j, None)
    larger, smaller = ratio[1] > 1.0, ratio[2] < 1.0
    outcome = verdict(larger, smaller) if above else verdict(smaller, larger)
    return Claim(f"{LAW_NAMES[law]} {what} overturning", PAPER, outcome, *ratio)


def _peaks(evidence: Evidence, law: str, what: str, *, smaller: bool) -> Claim | None:
    j = evidence.model(law)
    if j is None:
        return None
    # (the ends are averaged as the shares are, which is no narrower than the interval of the mean)
    middle, low, high = (
        evidence.spread(evidence.results[f"peak_smaller{end}"].values[:, j])[0] for end in ("", "_lower", "_upper")
    )
    share = (middle, low, high) if smaller else (1.0 - middle, 1.0 - high, 1.0 - low)
    outcome = verdict(share[1] > 0.5, share[2] < 0.5)
    return Claim(f"{LAW_NAMES[law]} {what} peaks under shaking", PAPER, outcome, *share)


def _loss(evidence: Evidence) -> Claim | None:
    j = evidence.model("discrete")
    if j is None:
        return None
    peak, rigid = (evidence.results[name].values[:, j] for name in ("decay_peak", "decay_rigid"))
    reached = ~np.isnan(peak[evidence.inside])
    n = int(np.flatnonzero(reached.all(axis=0))[-1])
    if n == 0:
        return None
    ratio = evidence.spread(peak[..., n] / rigid[..., n])
    # (without loss nothing can be dissipated, and the ratio is 1)
    more, less = ratio[1] >= 1.0 - SAME, ratio[2] <= 1.0 + SAME
    outcome = OPEN if more == less else HOLDS if more else FAILS
    return Claim("discrete damping dissipates less than an impact does", OURS, outcome, *ratio)


def _mode(evidence: Evidence) -> Claim | None:
    j = evidence.model("discrete")
    if j is None:
        return None
    ratio = evidence.ratio(j, evidence.model("discrete", "rigid"))
    claim = "discrete damping has an elastic mode that a rigid block has not"
    return Claim(claim, OURS, verdict(ratio[2] < 1.0, ratio[1] > 1.0), *ratio)


def _four(evidence: Evidence) -> dict[str, int] | None:
    """Return the positions of the paper's four laws; None where one is missing."""
    places = {name: evidence.model(name) for name in ("discrete", *CONTINUOUS)}
    return None if None in places.values() else {name: j for name, j in places.items() if j is not None}
