"""Outcomes of sensitivity studies for the paper's claims and what its law gets wrong: verdict, number, interval.

Every sentence is made from the results.  Medians are compared with paired replicates of the bootstrap over motions,
averaged (as logarithms) over the blocks.  Free rocking has no scatter, so its interval is the range over the blocks
(and values).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.wording import confidence_text, whole_percent
from ...fragility.fitting.bootstrap import percentile_interval
from ...studies.file.uncertainty import RIGID
from ...studies.tables.sensitivity import LAW_NAMES

HOLDS, FAILS, OPEN = "holds", "does not hold", "open"
PAPER, OURS = "paper", "ours"
MARGIN = 0.15
"""Relative difference below which medians are alike."""
SAME = 1e-9
"""Difference below which errors of free rocking are equal."""
RECOMMENDED = 0.05
"""The delta that the paper recommends."""
CONTINUOUS = ("giannini-masiani", "makris-konstantinidis", "vassiliou")


LOSS = "discrete damping dissipates less than an impact does"
MODE = "discrete damping has an elastic mode that a rigid block has not"
"""What the discrete law gets wrong."""


class Claim(NamedTuple):
    """A claim and its outcome: verdict, number with its interval (`interval` names the kind), and a sentence."""

    claim: str
    of: str
    verdict: str
    number: float
    lower: float
    upper: float
    interval: str
    text: str


class Ratio(NamedTuple):
    """A mean ratio of medians with its interval, over `known` of all `pairs` of block and value.

    In the other pairs a law has no median, because nothing fell at any level (or everything).
    """

    middle: float
    lower: float
    upper: float
    known: int
    pairs: int

    @property
    def numbers(self) -> tuple[float, float, float]:
        """Number and interval."""
        return self.middle, self.lower, self.upper

    @property
    def words(self) -> str:
        """The phrase for a sentence: so many times."""
        left = f", where there are medians: {self.known} of {self.pairs} pairs" if self.known < self.pairs else ""
        return f"{_times(self.numbers)}{left}"


class Evidence(NamedTuple):
    """The results that claims are judged by: the values that count (block, value), and their range in words."""

    results: xr.Dataset
    inside: Flags
    where: str

    def model(self, law: str, rest: str = "elastic") -> int | None:
        """Return the position of a law among the models; None where it is not among them."""
        found = np.flatnonzero((self.results["law"].values == law) & (self.results["rest"].values == rest))
        return int(found[0]) if found.size else None

    def ratio(self, one: int, other: int | None) -> Ratio:
        """Return the geometric mean over blocks and values of a law's median over another's (None: the rigid one's)."""
        own = self.results["log_median_sample"].values
        base = self.results["log_rigid_sample"].values[:, one] if other is None else own[:, other]
        if other is None:
            here = np.log(self.results["median_ratio"].sel(comparison=RIGID).values[:, one])
        else:
            medians = np.log(self.results["median"].values)
            here = medians[:, one] - medians[:, other]
        known = self.inside & np.isfinite(here)
        if not known.any():
            return Ratio(np.nan, np.nan, np.nan, 0, int(self.inside.sum()))
        with np.errstate(invalid="ignore"):
            samples = (own[:, one] - base)[known].mean(axis=0)
        ends = percentile_interval(samples, float(self.results.attrs["confidence"]))
        with np.errstate(over="ignore"):
            middle, low, high = (float(np.exp(one)) for one in (here[known].mean(), ends.lower, ends.upper))
        return Ratio(middle, low, high, int(known.sum()), int(self.inside.sum()))

    def spread(self, values: Array) -> tuple[float, float, float]:
        """Return mean and range of the finite values (block, value) that count."""
        here = values[self.inside & np.isfinite(values)]
        return (float(here.mean()), float(here.min()), float(here.max())) if here.size else (np.nan, np.nan, np.nan)


def evidence_of(results: xr.Dataset) -> Evidence:
    """Return the evidence at the recommended delta where it is among the values; else at all usual values."""
    inside = results["in_use"].values
    where = f"over {results.attrs['usual']}"
    if results.attrs["parameter"] == "delta":
        far = np.abs(np.log(results["value"].values / RECOMMENDED))
        if far.min() < 1e-6:
            inside = np.zeros_like(inside)
            inside[:, int(far.argmin())] = True
            where = f"at δ = {RECOMMENDED:g}"
    return Evidence(results, inside, where)


def claims(results: xr.Dataset) -> list[Claim]:
    """Return each claim that a study's laws can decide, with its verdict; `evidence` gives the results."""
    evidence = evidence_of(results)
    if not evidence.inside.any():
        return []
    found = [
        _decay(evidence),
        _insensitive_decay(results) if results.attrs["parameter"] == "delta" else None,
        _insensitive_medians(results) if results.attrs["parameter"] == "delta" else None,
        _coefficient(results) if results.attrs["parameter"] == "delta" else None,
        _alike(evidence),
        _overturning(evidence, "makris-konstantinidis", "underestimates", above=True),
        _peaks(evidence, "makris-konstantinidis", "underestimates", smaller=True),
        _overturning(evidence, "vassiliou", "overestimates", above=False),
        _peaks(evidence, "vassiliou", "overestimates", smaller=False),
        _loss(evidence),
        _mode(evidence),
        _consistent(evidence),
    ]
    return [one for one in found if one is not None]


def _decay(evidence: Evidence) -> Claim | None:
    discrete = evidence.model("discrete")
    others = [(name, evidence.model(name)) for name in CONTINUOUS if evidence.model(name) is not None]
    if discrete is None or not others:
        return None
    error = evidence.results["decay_error"].values
    own = np.abs(error[:, discrete])
    beside = [np.abs(error[:, j]) for _, j in others]
    # (without loss all laws are exact, and none is better than the others)
    best = np.all([own <= one + SAME for one in beside], axis=0)[evidence.inside]
    mean = evidence.spread(own)
    verdict = HOLDS if best.all() else OPEN if best.any() else FAILS
    listed = ", ".join(
        f"{whole_percent(evidence.spread(error[:, j])[0], signed=True)} under {LAW_NAMES[name]}" for name, j in others
    )
    text = (
        f"peaks of free rocking lie {whole_percent(evidence.spread(error[:, discrete])[0], signed=True)} from the "
        f"rigid block's under discrete damping, {listed} ({evidence.where}); it is the nearest in {best.sum()} of "
        f"{best.size} cases"
    )
    return Claim("discrete damping outperforms in free decay", PAPER, verdict, *mean, _range(evidence), text)


def _insensitive_decay(results: xr.Dataset) -> Claim | None:
    evidence = Evidence(results, results["in_use"].values, f"over {results.attrs['usual']}")
    laws = _four(evidence)
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
    own = moves[:, laws["discrete"]]
    best = np.all([own < moves[:, j] for name, j in laws.items() if name != "discrete"], axis=0)
    verdict = HOLDS if best.all() else OPEN if best.any() else FAILS
    listed = ", ".join(f"{moves[:, j].mean():.2f} under {LAW_NAMES[name]}" for name, j in laws.items())
    text = (
        f"{evidence.where}, the largest peak {n} of free rocking is this many times the smallest: {listed} "
        f"(means over {own.size} blocks)"
    )
    numbers = float(own.mean()), float(own.min()), float(own.max())
    return Claim(
        "discrete damping is least sensitive to δ: free rocking", PAPER, verdict, *numbers, "range over blocks", text
    )


def _insensitive_medians(results: xr.Dataset) -> Claim | None:
    evidence = Evidence(results, results["in_use"].values, f"over {results.attrs['usual']}")
    laws = _four(evidence)
    if laws is None:
        return None
    confidence = float(results.attrs["confidence"])
    samples = results["log_trend_sample"].sel(span="usual").mean("block").transpose("model", "replicate").values
    middle = np.log(results["median_trend"].sel(span="usual").transpose("block", "model").values).mean(axis=0)
    if not np.isfinite(middle[list(laws.values())]).all():
        return None
    own = laws["discrete"]
    differences = [
        percentile_interval(np.abs(samples[own]) - np.abs(samples[j]), confidence)
        for name, j in laws.items()
        if name != "discrete"
    ]
    least = all(high < 0.0 for _, high, _ in differences)
    verdict = HOLDS if least else FAILS if any(low > 0.0 for low, _, _ in differences) else OPEN
    listed = []
    for name, j in laws.items():
        ends = np.exp(percentile_interval(samples[j], confidence)[:2])
        listed.append(f"{np.exp(middle[j]):.2f} ({ends[0]:.2f}–{ends[1]:.2f}) under {LAW_NAMES[name]}")
    low, high = np.exp(percentile_interval(samples[own], confidence)[:2])
    text = f"{evidence.where}, a tenfold δ multiplies the median by {', '.join(listed)}; 1 is no sensitivity"
    numbers = float(np.exp(middle[own])), float(low), float(high)
    claim = "discrete damping is least sensitive to δ: overturning"
    return Claim(claim, PAPER, verdict, *numbers, _bootstrap(results), text)


def _coefficient(results: xr.Dataset) -> Claim | None:
    evidence = Evidence(results, results["in_use"].values, "")
    law = evidence.model("vassiliou")
    if law is None:
        return None
    rate = results["viscous_rate"].values[:, law]
    moved = float(np.max(np.ptp(rate, axis=-1) / rate.max(axis=-1)))
    swing = [results[f"median_swing{end}"].sel(span="all").values[:, law].max() for end in ("", "_lower", "_upper")]
    text = (
        f"the coefficient differs by {moved:g} between {results.sizes['value']} values of δ; its medians still move, "
        f"by a factor of {swing[0]:.2f} at most ({swing[1]:.2f}–{swing[2]:.2f}), because the elastic zone itself does"
    )
    verdict = HOLDS if moved == 0.0 else FAILS
    return Claim(
        "the coefficient of Vassiliou et al. does not depend on δ", PAPER, verdict, moved, moved, moved, "exact", text
    )


def _alike(evidence: Evidence) -> Claim | None:
    one, other = evidence.model("giannini-masiani"), evidence.model("discrete")
    if one is None or other is None:
        return None
    found = evidence.ratio(one, other)
    least, most = 1.0 / (1.0 + MARGIN), 1.0 + MARGIN
    inside = found.lower >= least and found.upper <= most
    outside = found.lower > most or found.upper < least
    verdict = HOLDS if inside else FAILS if outside else OPEN
    rigid = [evidence.ratio(j, None) for j in (one, other)]
    text = (
        f"{evidence.where}, its median is {found.words} that of discrete damping (called alike within "
        f"{whole_percent(MARGIN)}); it is {rigid[0].words} the rigid block's, that of discrete damping {rigid[1].words}"
    )
    claim = "Giannini–Masiani performs like discrete damping under shaking"
    return Claim(claim, PAPER, verdict, *found.numbers, _bootstrap(evidence.results), text)


def _overturning(evidence: Evidence, law: str, what: str, *, above: bool) -> Claim | None:
    j = evidence.model(law)
    if j is None:
        return None
    found = evidence.ratio(j, None)
    holds = found.lower > 1.0 if above else found.upper < 1.0
    fails = found.upper < 1.0 if above else found.lower > 1.0
    text = f"{evidence.where}, its median is {found.words} the rigid block's"
    verdict = HOLDS if holds else FAILS if fails else OPEN
    return Claim(
        f"{LAW_NAMES[law]} {what} overturning", PAPER, verdict, *found.numbers, _bootstrap(evidence.results), text
    )


def _peaks(evidence: Evidence, law: str, what: str, *, smaller: bool) -> Claim | None:
    j = evidence.model(law)
    if j is None:
        return None
    # (the ends are averaged as the shares are, which is no narrower than the interval of the mean)
    middle, low, high = (
        evidence.spread(evidence.results[f"peak_smaller{end}"].values[:, j])[0] for end in ("", "_lower", "_upper")
    )
    found = (middle, low, high) if smaller else (1.0 - middle, 1.0 - high, 1.0 - low)
    text = (
        f"{evidence.where}, {whole_percent(found[0])} ({whole_percent(found[1])} to {whole_percent(found[2])}) of its "
        f"peaks are {'smaller' if smaller else 'larger'} than the rigid block's, among the runs in which the rigid "
        "block rocks and the two differ"
    )
    verdict = HOLDS if found[1] > 0.5 else FAILS if found[2] < 0.5 else OPEN
    return Claim(
        f"{LAW_NAMES[law]} {what} peaks under shaking", PAPER, verdict, *found, _bootstrap(evidence.results), text
    )


def _loss(evidence: Evidence) -> Claim | None:
    j = evidence.model("discrete")
    if j is None:
        return None
    results = evidence.results
    peak, rigid = (results[name].values[:, j] for name in ("decay_peak", "decay_rigid"))
    reached = ~np.isnan(peak[evidence.inside])
    n = int(np.flatnonzero(reached.all(axis=0))[-1])
    if n == 0:
        return None
    found = evidence.spread(peak[..., n] / rigid[..., n])
    text = f"{evidence.where}, peak {n} of free rocking is {_times(found)} that of an impact with the same e"
    alone = evidence.model("discrete", "rigid")
    if alone is not None:
        forced = evidence.ratio(alone, None)
        text += f"; under shaking, at rest until uplift, its median is {forced.words} the rigid block's"
    # (without loss nothing can be dissipated, and the ratio is 1)
    more, less = found[1] >= 1.0 - SAME, found[2] <= 1.0 + SAME
    verdict = OPEN if more == less else HOLDS if more else FAILS
    return Claim(LOSS, OURS, verdict, *found, _range(evidence), text)


def _mode(evidence: Evidence) -> Claim | None:
    j = evidence.model("discrete")
    if j is None:
        return None
    results = evidence.results
    alone = evidence.model("discrete", "rigid")
    found = evidence.ratio(j, alone)
    beside = "the same law at rest until uplift" if alone is not None else "the rigid block"
    lifted = results["uplift_alone"].values[:, j].max(axis=-1)
    hertz = results["elastic_frequency"].values[:, j][evidence.inside]
    excess = [
        results[f"excess{end}"].sel(comparison=RIGID).values[:, j].reshape(*evidence.inside.shape, -1)
        for end in ("", "_lower", "_upper")
    ]
    where = np.where(evidence.inside[..., None], excess[0], -np.inf)
    most = np.unravel_index(int(np.argmax(where)), where.shape)
    text = (
        f"{evidence.where}, its elastic mode at {hertz.min():.1f}–{hertz.max():.1f} Hz makes its median {found.words} "
        f"that of {beside}, and overturns up to {excess[0][most]:.2f} ({excess[1][most]:.2f}–{excess[2][most]:.2f}) "
        f"more of the motions than the rigid block; up to {whole_percent(evidence.spread(lifted)[2])} of the "
        "motions uplift it alone"
    )
    verdict = HOLDS if found.upper < 1.0 else FAILS if found.lower > 1.0 else OPEN
    return Claim(MODE, OURS, verdict, *found.numbers, _bootstrap(results), text)


def _consistent(evidence: Evidence) -> Claim | None:
    j = evidence.model("energy-consistent", "rigid")
    if j is None:
        return None
    results = evidence.results
    found = evidence.ratio(j, None)
    error = float(np.nanmax(np.abs(results["decay_error"].values[:, j])))
    least, most = 1.0 / (1.0 + MARGIN), 1.0 + MARGIN
    inside = least <= found.lower and found.upper <= most
    outside = found.lower > most or found.upper < least
    verdict = HOLDS if inside else FAILS if outside else OPEN
    text = (
        f"{evidence.where}, its median is {found.words} the rigid block's; its peaks of free rocking lie {error:.0e} "
        "off at most, over all values"
    )
    order = results["convergence_order"].values[:, j] if "convergence_order" in results else np.array([np.nan])
    if np.isfinite(order).all():
        text += f"; under pulses it converges to the rigid block with order {_between(order)} in δ"
    claim = "energy-consistent damping is the rigid block"
    return Claim(claim, OURS, verdict, *found.numbers, _bootstrap(results), text)


def _four(evidence: Evidence) -> dict[str, int] | None:
    """Return the positions of the paper's four laws; None where one is missing."""
    found = {name: evidence.model(name) for name in ("discrete", *CONTINUOUS)}
    return None if None in found.values() else {name: j for name, j in found.items() if j is not None}


def _bootstrap(results: xr.Dataset) -> str:
    return f"{confidence_text(results)}, bootstrap over motions, mean of blocks"


def _range(evidence: Evidence) -> str:
    several = evidence.inside.sum() > evidence.inside.shape[0]
    return "range over blocks and values" if several else "range over blocks"


def _times(found: Sequence[float]) -> str:
    return "{} ({}–{}) times".format(*("∞" if one == np.inf else f"{one:.2f}" for one in found))


def _between(values: Any) -> str:
    low, high = (f"{one:.2f}" for one in (np.nanmin(values), np.nanmax(values)))
    return low if low == high else f"{low}–{high}"
