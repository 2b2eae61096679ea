"""The page docs/validation.md: published and derived numbers, compared with the numbers that the package computes.

docs/validation/numbers.csv has the numbers as their sources print them.  A number agrees if it rounds to the printed
one; `remark` gives the reason if it does not.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.stats import binom

import toppling as tp

from ...core.units import STANDARD_GRAVITY as G
from ...fragility import binomial_interval, fit_fragility
from ...fragility.curves import published
from ...models.friction import friction_at_impact, friction_at_uplift
from ...models.laws import Law
from ...models.oscillator import Oscillator
from ...models.runs import run_many, trace
from ...motions import HalfSine, KanaiTajimi, OneCycleCosine, OneCycleSine, RectangularPulse, scale_to_mean
from .page import ROOT, some, template, write, write_csv
from .tables import body

SECTIONS = {
    "block": "Block",
    "free": "Free rocking under Housner's impact",
    "decay": "Free decay under the other laws",
    "laws": "Damping and elastic frequency",
    "pulses": "Overturning under pulses",
    "validity": "Friction needed for rocking",
    "fragility": "Fragility curves and intervals",
    "risk": "Annual rate",
    "floors": "Modes of buildings",
    "criteria": "Published criteria",
}
SAMPLES = 20_000
"""Samples in a pulse: the chords of a sine then err by 1e-8."""


class Number(NamedTuple):
    """A row of the table; our number has one digit more than the printed one."""

    key: str
    section: str
    what: str
    published: str
    unit: str
    kind: str
    source: str
    ours: str
    remark: str

    def agrees(self, ours: float) -> bool:
        """Return True if a number rounds to the printed digits."""
        return abs(ours - float(self.published)) <= 0.5 * 10.0**-self.decimals * (1.0 + 1e-9)

    @property
    def decimals(self) -> int:
        """Number of printed digits after the point."""
        return len(self.published.partition(".")[2])

    def of(self, ours: float) -> Number:
        """Return the row with our number."""
        return self._replace(ours=f"{ours:.{self.decimals + 1}f}")


def numbers() -> list[Number]:
    """Return every row of docs/validation/numbers.csv."""
    with (ROOT / "docs/validation/numbers.csv").open(encoding="utf-8", newline="") as stream:
        return [Number(**row) for row in csv.DictReader(stream)]


def fine(pulse: type, amplitude: float, omega: float) -> xr.DataArray:
    """A pulse sampled finely."""
    duration = pulse(amplitude, omega).duration
    motion: xr.DataArray = pulse(amplitude, omega, dt=duration / SAMPLES, tail=duration / SAMPLES).sample(1)
    return motion


def boundary(oscillator: Oscillator, pulse: xr.DataArray, low: float, high: float) -> float:
    """The factor between `low` and `high` at which the verdict changes."""
    values, dt = np.ascontiguousarray(pulse.values[0]), float(pulse["dt"][0])

    def falls(factors: np.ndarray) -> np.ndarray:
        return np.asarray(run_many([oscillator], np.atleast_2d(factors), values, dt)[0, :, 0] == 1.0)

    before = falls(np.array([low]))[0]
    for _ in range(12):
        grid = np.linspace(low, high, 17)
        at = int(np.argmax(falls(grid) != before))
        low, high = grid[at - 1], grid[at]
    return 0.5 * (low + high)


def side(oscillator: Oscillator, pulse: xr.DataArray, factor: float) -> int:
    """To which side it falls, 0 where it stands."""
    values = np.concatenate([pulse.values[0] * factor, np.zeros(40 * SAMPLES)])
    run = trace(oscillator, values, float(pulse["dt"][0]))
    return int(np.sign(run.history[0, -1])) if run.results[0] else 0


def side_boundary(oscillator: Oscillator, pulse: xr.DataArray, low: float, high: float) -> float:
    """The factor above which it falls at once, to the side to which it is pushed first."""
    last = side(oscillator, pulse, high)
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if side(oscillator, pulse, middle) == last else (middle, high)
    return high


def peaks(law: Law, alpha: float = math.atan(0.2)) -> np.ndarray:
    """|Peaks| of free rocking over alpha from x = 0.5, inside the zone too."""
    block = tp.Block.from_slenderness(alpha, 0.5)
    run = trace(law.oscillator(block), np.zeros(4001), 0.005, 0.5 * alpha, max_turning_points=50)
    return np.append(0.5, np.abs(run.turning_points[1]) / alpha)


def _blocks() -> dict[str, float]:
    values = {"eR_aslam": tp.Block.from_slenderness(math.atan(0.2), 1.0).restitution}
    for key, slenderness in (("lever_16", 1.6), ("lever_6", 6.0)):
        block = tp.Block.from_slenderness(math.atan(1.0 / slenderness), 1.0)
        h, R = (tp.DiscreteDamping(lever=lever).oscillator(block).gain for lever in ("h", "R"))
        values[key] = 100.0 * (1.0 - h / R)
    return values


def _free() -> dict[str, float]:
    block = tp.Block.from_slenderness(0.2, 0.38)
    values = {}
    for geometry in ("linear", "exact"):
        run = tp.free_rocking(block, tp.HousnerImpact(e=1.0, geometry=geometry), 0.5 * block.alpha, 5.0)
        values[f"quarter_{geometry}"] = 0.5 * float(run.peak_times[1]) * block.p
    housner = peaks(tp.HousnerImpact(e=0.925, geometry="linear"))
    values |= {f"peak_{n}": housner[n] for n in (1, 2, 5, 10)}
    laws = {
        "discrete": tp.DiscreteDamping(e=0.925, lever="R"),
        "vassiliou": tp.Vassiliou(lever="R"),
        "mk": tp.MakrisKonstantinidis(e=0.925, lever="R"),
        "gm": tp.GianniniMasiani(e=0.925, lever="R"),
        "ec": tp.EnergyConsistent(e=0.925, lever="R"),
    }
    return values | {f"{key}_{n}": peaks(law)[n] for key, law in laws.items() for n in (1, 2, 5, 10)}


def zone_frequency(block: tp.Block) -> float:
    """Frequency of the elastic zone, Hz, from the oscillator that the law makes."""
    zone = min(tp.DiscreteDamping(delta=0.05).oscillator(block).regions, key=lambda part: abs(part.lower + part.upper))
    return math.sqrt(zone.stiffness) / (2.0 * math.pi)


def _laws() -> dict[str, float]:
    values = {
        f"ratio_{angle}": 100.0
        * tp.MakrisKonstantinidis.damping_ratio(tp.Block.from_slenderness(math.radians(angle), 1.0).restitution)
        for angle in (10, 15, 20)
    }
    values["gm_zero"] = tp.GianniniMasiani.damping_ratio(1e-12)
    values["mode"] = zone_frequency(tp.Block.from_slenderness(0.2, 0.38))
    modes = [zone_frequency(tp.catalogue[name]) for name in published.fema_p58()["block"].values]
    values |= {"mode_low": min(modes), "mode_high": max(modes)}
    return values


def _pulses() -> dict[str, float]:
    block, rigid = tp.Block.from_slenderness(0.25, 1.6), tp.HousnerImpact(e=0.9, geometry="linear")
    oscillator, at_rest = rigid.oscillator(block), G * block.alpha
    values = {
        "rectangular": boundary(oscillator, fine(RectangularPulse, at_rest, math.pi * block.p), 1.2, 2.0),
        "half_1": boundary(oscillator, fine(HalfSine, at_rest, block.p), 1.05, 4.0),
        "half_3": boundary(oscillator, fine(HalfSine, at_rest, 3.0 * block.p), 1.05, 4.0),
        "sine_1": side_boundary(oscillator, fine(OneCycleSine, at_rest, block.p), 1.3, 1.6),
        "sine_3": side_boundary(oscillator, fine(OneCycleSine, at_rest, 3.0 * block.p), 3.5, 3.8),
    }
    slab = tp.HousnerImpact(e=0.9, geometry="linear").oscillator(tp.Block(0.4, 1.2))
    values["half_mr"] = boundary(slab, fine(HalfSine, 1.0, 2.0 * math.pi), 5.3, 5.6)
    zhang = tp.Block.from_slenderness(0.25, 3.0 * G / (4.0 * 2.14**2))
    near = {"linear": (3.02, 6.32, 7.17), "exact": (3.03, 6.74, 7.49)}
    for geometry, windows in near.items():
        oscillator = tp.HousnerImpact(e=0.9, geometry=geometry).oscillator(zhang)
        pulse = fine(OneCycleSine, G * 0.25, 5.0 * zhang.p)
        for i, middle in enumerate(windows, 1):
            values[f"window_{geometry}_{i}"] = boundary(oscillator, pulse, middle - 0.05, middle + 0.05)
        middle = {"linear": 3.23, "exact": 2.22}[geometry]
        values[f"high_{geometry}"] = boundary(oscillator, fine(OneCycleSine, G, 15.7), middle - 0.1, middle + 0.1)
    cosine = fine(OneCycleCosine, G, 2.0 * math.pi)
    values["cosine"] = boundary(tp.HousnerImpact().oscillator(tp.Block(1.0, 3.0)), cosine, 0.60, 0.65)
    return values


def _validity() -> dict[str, float]:
    e = tp.Block.from_slenderness(math.atan(0.2), 1.0).restitution
    return {
        "mu_uplift": float(friction_at_uplift(1.6, G)),
        "mu_impact": float(friction_at_impact(5.0, e)),
        "mu_impact_half": float(friction_at_impact(5.0, 0.5)),
    }


def _fragility() -> dict[str, float]:
    levels = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
    falls = np.array([0, 0, 0, 4, 6, 13, 12, 16])
    counts = xr.Dataset(
        {"overturnings": ("level", falls), "runs": ("level", np.full(8, 40))},
        coords={"level": ("level", levels, {"units": "g"})},
    )
    curve = fit_fragility(counts, intervals="profile")
    values = {
        "baker_median": curve["median"].item(),
        "baker_beta": curve["dispersion"].item(),
        "baker_se_median": curve["median_se"].item() / curve["median"].item(),
        "baker_se_beta": curve["dispersion_se"].item(),
    }
    ends = ("median_lower", "median_upper", "dispersion_lower", "dispersion_upper")
    values |= {f"profile_{i}": curve[name].item() for i, name in enumerate(ends, 1)}
    for key, method in (("wilson", "wilson"), ("cp", "clopper-pearson"), ("jeffreys", "jeffreys")):
        lower, upper = binomial_interval(np.array([4]), np.array([40]), method=method)
        values |= {f"{key}_l": float(lower[0]), f"{key}_u": float(upper[0])}
    return values | {"all_wilson": float(binomial_interval(np.array([20]), np.array([20]))[0][0])}


def _risk() -> dict[str, float]:
    curve = xr.Dataset(
        {"median": ((), 0.6, {"units": "m s-2"}), "dispersion": ((), 0.4, {"units": "1"})},
        attrs={"im": "pga", "form": "lognormal"},
    )
    law = tp.HazardCurve.power_law(1e-4, 2.5, "pga")
    return {"rate": 1e4 * tp.annual_rate(curve, law)["rate"].item()}


def _floors() -> dict[str, float]:
    beams = {a: tp.motions.Building.flexural_shear(1.0, alpha0=a, storeys=8, modes=3) for a in (0.0, 5.0, 30.0)}
    values = {"beam_1": beams[5.0].periods[1], "beam_2": beams[5.0].periods[2]}
    return values | {f"beam_{i}": beams[a].participation[0] for i, a in ((3, 0.0), (4, 5.0), (5, 30.0))}


def _criteria() -> dict[str, float]:
    curves = published.fema_p58()
    B, H, median = (curves[name].values for name in ("width", "height", "median"))
    design = np.column_stack([np.ones(9), np.log(B), np.log(H)])
    coefficients = np.linalg.lstsq(design, np.log(median), rcond=None)[0]
    japanese = published.japanese(tp.Block(1.74 / G, 1.0))["median"].item()
    return {f"p58_{i}": float(coefficient) for i, coefficient in enumerate(coefficients)} | {"japan": 100.0 * japanese}


OURS: dict[str, Callable[[], dict[str, float]]] = {
    "block": _blocks,
    "free": _free,
    "laws": _laws,
    "pulses": _pulses,
    "validity": _validity,
    "fragility": _fragility,
    "risk": _risk,
    "floors": _floors,
    "criteria": _criteria,
}
"""Functions that compute the numbers of each section."""

YIM = {5: (0.0, 0.10, 0.15, 0.40, 0.55, 0.75, 0.80), 6: (0.10, 0.40, 0.50, 0.65, 0.75, 0.80, 1.0)}
"""Yim, Chopra and Penzien (1980): share of 20 motions that overturn at mean PGA 0.30, 0.35, … 0.60 g, by h/b."""
YIM_MOTIONS = some(500)


def yim_motions(n: int, dt: float, seed: int) -> xr.DataArray:
    """Motions as theirs, scaled to a mean peak of 1 m/s²; the peak depends on the step, theirs is 0.02 s."""
    generator = KanaiTajimi(omega_g=5.0 * math.pi, xi_g=0.6, duration=30.0, dt=dt, baseline="parabolic")
    return scale_to_mean(generator.sample(n, seed=seed), 1.0)


def yim() -> Iterator[tuple[str, ...]]:
    """Yield their counts, with the 99 % binomial interval of counts under our probability."""
    levels = np.arange(0.30, 0.601, 0.05)
    blocks = [tp.Block.from_slenderness(math.atan(1.0 / ratio), 3.048, name=f"h/b={ratio}") for ratio in YIM]
    runs = tp.ida(blocks, tp.HousnerImpact(), yim_motions(YIM_MOTIONS, 0.02, 1980), levels * G, im="scale")
    ours = tp.overturning_probability(runs)["probability"].values[:, 0]
    for (ratio, shares), of_block in zip(YIM.items(), ours, strict=True):
        for level, share, p in zip(levels, shares, of_block, strict=True):
            low, high = (binom.ppf(end, 20, p) for end in (0.005, 0.995))
            inside = "yes" if low <= round(20 * share) <= high else "no"
            yield f"{level:.2f}", str(ratio), f"{20 * share:.0f}", f"{p:.3f}", f"{low:.0f}", f"{high:.0f}", inside


def compute(chosen: tuple[str, ...] = tuple(OURS)) -> dict[str, float]:
    """Return our numbers by key."""
    return {key: float(value) for section in chosen for key, value in OURS[section]().items()}


def sections(printed: list[Number], different: list[Number]) -> Iterator[tuple[object, ...]]:
    """Yield the name of each section, its numbers, those that agree, and their sources."""
    for section, title in SECTIONS.items():
        rows = [row for row in printed if row.section == section]
        agreed = len(rows) - sum(row.section == section for row in different)
        yield title, len(rows), agreed, "; ".join(sorted({row.source for row in rows}))


def main() -> None:
    """Write the page and its tables."""
    ours, printed, counts = compute(), numbers(), list(yim())
    different = [row for row in printed if not row.agrees(ours[row.key])]
    write_csv("validation", "numbers", Number._fields, (row.of(ours[row.key]) for row in printed))
    heads = ("mean PGA, g", "h/b", "published, of 20", "our probability", "99 % lowest", "99 % highest", "inside")
    write_csv("validation", "overturnings", heads, counts)
    text = template("validation").format(
        number=len(printed),
        agreed=len(printed) - len(different),
        different=len(different),
        sections=body(sections(printed, different)),
        remarks="\n".join(f"- {row.what}: {row.remark}" for row in different),
        inside=sum(row[-1] == "yes" for row in counts),
        counts=len(counts),
        yim_motions=YIM_MOTIONS,
    )
    write("validation", text)
