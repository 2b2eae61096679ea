"""The numbers of the page docs/paper.md, from the package and from closed forms.

The paper is Liu, Huang and Qu (2024), A discretely damped SDOF model for the rocking response of freestanding blocks.
tests/benchmarks/pages/test_paper.py compares the main ones, and the page's sentences, with closed forms and independent
integrations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...models import Law
from ...models.runs import trace
from ...studies.plots.axes import COLOURS

E, DELTA, X0 = 0.925, 0.05, 0.5
"""Restitution of the concrete block, half width of the zone, and the rotation over α from which it is let go."""
CONCRETE = tp.Block.from_slenderness(math.atan(0.2), 0.38, name="concrete block")
"""e = 0.925 and e_R = 0.942 are Aslam's block's; its size is in the lost Table 1, and only stretches time."""
FIGURE_6 = tp.Block.from_slenderness(0.2, 0.38, name="block of figure 6")
PEAKS = 10
DELTAS = (0.01, 0.02, 0.05, 0.1)
SCALES = 0.1 * np.arange(1, 41)
"""Of the waveform, in the forced runs: the paper's runs are at 60, 80 and 100 %."""
SHAKEN = tuple(
    tp.Block.from_slenderness(math.atan(1.0 / ratio), R, name=f"h/b = {ratio}, R = {R} m")
    for ratio, R in ((5, 0.8), (4, 0.5), (3, 0.6))
)
LEVELS = (1.5, 2.0, 3.0, 4.0, 6.0)
"""PGA/(g tan α) of the many runs."""
LEAST_PGA = 0.1 * STANDARD_GRAVITY
"""Records weaker than this are left out of the many runs: scaled to six times g tan α they would be no records."""


class Rival(NamedTuple):
    """One law of the comparison: the panel it has in the paper's figures, its name, its colour, and how it is made."""

    panel: str
    name: str
    colour: str
    make: Callable[[float | None, float], Law]


def _lever(law: type[Law]) -> Callable[[float | None, float], Law]:
    return lambda e, delta: law(e=e, delta=delta, lever="R")  # type: ignore[call-arg]


RIVALS = (
    Rival("a", "discrete", COLOURS[0], _lever(tp.DiscreteDamping)),
    Rival("b", "Vassiliou", COLOURS[3], lambda e, delta: tp.Vassiliou(delta=delta, lever="R")),
    Rival("c", "Makris–Konstantinidis", COLOURS[2], _lever(tp.MakrisKonstantinidis)),
    Rival("d", "Giannini–Masiani", COLOURS[1], _lever(tp.GianniniMasiani)),
    Rival("e", "energy-consistent (ours)", COLOURS[5], _lever(tp.EnergyConsistent)),
)
"""In the order of the paper's panels; the fifth is not the paper's."""


# Free rocking --------------------------------------------------------------------------------------------------------


def turning_points(block: tp.Block, model: Law, number: int = PEAKS) -> NDArray[np.float64]:
    """Times over 1/p and |rotations| over alpha (2, number + 1) of free rocking from X0, inside the zone too."""
    quiet = np.zeros(6001)
    run = trace(model.oscillator(block), quiet, 0.01 / block.p, X0 * block.alpha, max_turning_points=8 * number)
    times, rotations = run.turning_points[:, :number]
    return np.stack([np.append(0.0, times) * block.p, np.append(X0 * block.alpha, np.abs(rotations)) / block.alpha])


def housner_peaks(e: float = E, x0: float = X0, number: int = PEAKS) -> NDArray[np.float64]:
    """Housner's closed form: times over 1/p and peaks over alpha (2, number + 1), linear geometry.

    x_n = 1 - sqrt(1 - e^2n [1 - (1 - x0)²]), and a quarter of a swing to x takes acosh(1/(1 - x))/p (Housner 1963).
    """
    n = np.arange(number + 1)
    x = 1.0 - np.sqrt(1.0 - e ** (2 * n) * (1.0 - (1.0 - x0) ** 2))
    quarter = np.arccosh(1.0 / (1.0 - x))
    return np.stack([np.append(0.0, np.cumsum(quarter[:-1] + quarter[1:])), x])


def edge_peaks(delta: float = DELTA, e: float = E, x0: float = X0, number: int = PEAKS) -> NDArray[np.float64]:
    """Peaks over alpha where each crossing shrinks the speed at the zone's edge by e: the paper's Eqs. 16 and 17.

    (1 - x_n)² = (1 - delta)² - e^2n [(1 - delta)² - (1 - x0)²] (derived): the energy below the edge is never lost.
    """
    top = (1.0 - delta) ** 2
    n = np.arange(number + 1)
    return np.asarray(1.0 - np.sqrt(top - e ** (2 * n) * (top - (1.0 - x0) ** 2)))


class FreeErrors(NamedTuple):
    """A law's peaks (n + 1,) over alpha, and mean relative errors of peaks and half periods, of n swings."""

    peaks: NDArray[np.float64]
    peak_errors: NDArray[np.float64]
    peak: float
    period: float


def free_errors(model: Law, block: tp.Block = CONCRETE) -> FreeErrors:
    """The paper's Table 2, with Housner's closed form in the place of the measurement."""
    reference = housner_peaks()
    found = turning_points(block, model)
    relative = found[1, 1:] / reference[1, 1:] - 1.0
    periods = np.diff(found[0]) / np.diff(reference[0]) - 1.0
    return FreeErrors(found[1], relative, float(relative.mean()), float(periods.mean()))


def equivalent_restitution(number: int = PEAKS) -> float:
    """The e at which Housner's block has the discrete law's last peak: (E_n/E_0)^(1/2n), E = 1 - (1 - x)² (derived)."""
    last = turning_points(CONCRETE, RIVALS[0].make(E, DELTA), number)[1, number]
    return float(((1.0 - (1.0 - last) ** 2) / (1.0 - (1.0 - X0) ** 2)) ** (0.5 / number))


def fifth_peaks() -> NDArray[np.float64]:
    """The fifth peak of the concrete block (law, delta, 2), its time over 1/p and its rotation over alpha."""
    return np.array([[turning_points(CONCRETE, rival.make(E, delta), 5)[:, 5] for delta in DELTAS] for rival in RIVALS])


# Damping ratios, thresholds, the elastic mode ------------------------------------------------------------------------


def elastic_frequency(block: tp.Block, delta: float = DELTA) -> float:
    """Hz: sqrt(k0/I_O)/2π, the block's own frequency inside the zone, which a rigid block does not have."""
    ratio = 1.0 / delta - 1.0
    return block.p * math.sqrt(ratio * math.sin(block.alpha) / block.alpha) / (2.0 * math.pi)


def moment_difference(block: tp.Block) -> float:
    """Largest difference of sin(alpha - theta)/sin(alpha) and 1 - theta/alpha, in units of M0."""
    theta = np.linspace(0.0, block.alpha, 2001)
    return float(np.abs(np.sin(block.alpha - theta) / math.sin(block.alpha) - 1.0 + theta / block.alpha).max())


class Mode(NamedTuple):
    """Overturnings of the rigid block, and of the discrete law at several deltas, elastic and rigid at rest."""

    number: int
    rigid: int
    deltas: tuple[float, ...]
    elastic: tuple[int, ...]
    at_rest: tuple[int, ...]
    consistent: tuple[int, ...]


def elastic_mode(number: int = 400) -> Mode:
    """Overturnings under filtered noise of mean PGA 0.3 g: h/b = 4, R = 0.5 m, e_R, lever R."""
    generator = tp.motions.KanaiTajimi(omega_g=5.0 * math.pi, xi_g=0.6, duration=30.0, dt=0.005, baseline="parabolic")
    motions = tp.motions.scale_to_mean(generator.sample(number, seed=1980), 0.3 * STANDARD_GRAVITY)
    deltas = (0.1, 0.05, 0.01, 0.001)
    models: list[Law] = [tp.HousnerImpact(geometry="bilinear", lever="R")]
    models += [tp.DiscreteDamping(delta=delta, lever="R") for delta in deltas]
    models += [tp.DiscreteDamping(delta=delta, lever="R", rest="rigid") for delta in deltas]
    models += [tp.EnergyConsistent(delta=delta, lever="R") for delta in deltas]
    block = tp.Block.from_slenderness(math.atan(0.25), 0.5)
    runs = tp.ida(block, models, motions, [1.0], im="scale", outputs=("overturned",))
    counts = [int(count) for count in runs["overturned"].sum("motion").values.ravel()]
    n = len(deltas)
    return Mode(number, counts[0], deltas, *(tuple(counts[1 + i * n : 1 + (i + 1) * n]) for i in range(3)))


# Forced rocking ------------------------------------------------------------------------------------------------------


class Shaking(NamedTuple):
    """One waveform for the figures, many motions for the shares, and both in words."""

    waveform: xr.DataArray
    many: list[xr.DataArray]
    waveform_words: str
    many_words: str
    titles: tuple[str, ...]


def shaking(folder: str | Path | None = None, number: int = 40) -> Shaking:
    """The AT2 records of a folder (and its sub-folders), or where none is given the simulated stand-ins.

    The waveform is elCentro.AT2 where it is among them, else the record of the largest peak velocity.
    """
    if folder is None:
        waveform = tp.motions.read(tp.motions.example_path())
        many = [tp.motions.CloughPenzien(duration=20.0, dt=0.01).sample(number, seed=1940)]
        words = "the simulated record that ships with the package (motions/example.AT2), no earthquake's"
        return Shaking(waveform, many, words, f"{number} simulated motions (Clough–Penzien, seed 1940)", ())
    files = sorted(Path(folder).rglob("*.AT2"), key=lambda path: path.name)
    if not files:
        raise ValueError(f"the folder of records must hold AT2 files, got {folder}")
    arrays = [tp.motions.read(path) for path in files]
    values = tp.motions.measures(arrays)
    names = [path.name for path in files]
    chosen = names.index("elCentro.AT2") if "elCentro.AT2" in names else int(values["pgv"].values.argmax())
    strong = np.flatnonzero(values["pga"].values >= LEAST_PGA)
    if strong.size == 0:
        raise ValueError(f"a record must reach a PGA of at least {LEAST_PGA:.3g} m/s², got none in {folder}")
    return Shaking(
        arrays[chosen],
        [arrays[i] for i in strong],
        f"`{names[chosen]}`: {_title(files[chosen])}",
        f"the {strong.size} of {len(files)} records that reach 0.1 g",
        tuple(f"`{names[i]}`: {_title(files[i])}" for i in strong),
    )


def _title(path: Path) -> str:
    """Event, station and component as the file's head says them: its first line where that names no database."""
    head = path.read_text(encoding="latin-1").splitlines()[:2]
    if "PEER" not in head[0].upper():
        return " ".join(head[0].split())
    return f"{' '.join(head[1].split())}; PEER strong motion database"


class Forced(NamedTuple):
    """One block under the waveform at one scale: the reference's history and each law's, and what is undecided.

    `causes` says of each of `CAUSES` whether it overturned.
    """

    block: tp.Block
    scale: float
    reference: xr.Dataset
    runs: tuple[xr.Dataset, ...]
    undecided: tuple[bool, ...]
    causes: tuple[bool, ...]

    @property
    def name(self) -> str:
        """Slenderness and scale, as the paper names its runs."""
        return f"{self.block.label.split(',')[0]}, {100.0 * self.scale:.0f} %"


REFERENCE = tp.HousnerImpact()
"""Exact geometry and e_R: what stands where the paper has measurements."""
CAUSES = {f"Housner, bilinear, lever {one}": tp.HousnerImpact(geometry="bilinear", lever=one) for one in ("R", "h")}
"""The reference with the paper's straight line, and with its lever: what is not the damping's doing."""


def _flips(block: tp.Block, model: Law, motion: xr.DataArray) -> bool:
    """Return whether the verdict changes if the motion is a millionth stronger or weaker."""
    verdicts = tp.ida(block, model, motion, [1.0 - 1e-6, 1.0, 1.0 + 1e-6], im="scale", outputs=("overturned",))
    return bool(np.ptp(verdicts["overturned"].values.astype(int)))


def verdicts(waveform: xr.DataArray) -> xr.DataArray:
    """Overturned or not (block, model, level): every block and law, the reference first, at every scale."""
    models = [REFERENCE, *(rival.make(None, DELTA) for rival in RIVALS)]
    return tp.ida(SHAKEN, models, waveform, SCALES, im="scale", outputs=("overturned",))["overturned"].isel(motion=0)


def forced(waveform: xr.DataArray, fell: xr.DataArray) -> tuple[list[Forced], list[Forced]]:
    """Runs of the three blocks: at the least scale (of `verdicts`) at which the reference falls, and one step below.

    A rule, not a choice of good cases: first those that stand, then those that fall.
    """
    models = [rival.make(None, DELTA) for rival in RIVALS]
    standing: list[Forced] = []
    fallen: list[Forced] = []
    for i, block in enumerate(SHAKEN):
        falls = np.flatnonzero(fell.isel(block=i, model=0).values)
        if falls.size == 0 or falls[0] == 0:
            low, high = (f"{100.0 * one:.0f} %" for one in SCALES[[0, -1]])
            raise ValueError(f"{block.label} must stand at {low} and fall by {high} of the waveform, got another one")
        for index, runs in ((falls[0] - 1, standing), (falls[0], fallen)):
            scale = float(SCALES[index])
            motion = (waveform * scale).assign_attrs(waveform.attrs)
            runs.append(
                Forced(
                    block,
                    scale,
                    tp.simulate(block, REFERENCE, motion),
                    tuple(tp.simulate(block, model, motion) for model in models),
                    tuple(_flips(block, model, motion) for model in [REFERENCE, *models]),
                    tuple(bool(tp.simulate(block, model, motion)["overturned"]) for model in CAUSES.values()),
                )
            )
    return standing, fallen


class Shares(NamedTuple):
    """One law against the reference over many runs: counts of verdicts, and errors where both blocks rock and stand."""

    name: str
    standing: int
    falsely_fallen: int
    fallen: int
    detected: int
    compared: int
    error: tuple[float, float, float]


def many_runs(motions: Sequence[xr.DataArray]) -> list[Shares]:
    """Tables 4 and 5 over all blocks, motions and levels: shares in the place of six verdicts."""
    models = [REFERENCE, *(rival.make(None, DELTA) for rival in RIVALS), *CAUSES.values()]
    outputs = ("overturned", "peak_rotation", "uplifted")
    runs = tp.ida(SHAKEN, models, list(motions), LEVELS, im="pga_normalised", outputs=outputs)
    fell, peak, rocked = (runs[name].transpose("model", ...).values for name in outputs)
    names = [*(rival.name for rival in RIVALS), *CAUSES]
    found = []
    for i, name in enumerate(names, 1):
        both = rocked[0].astype(bool) & ~fell[0] & ~fell[i]
        error = peak[i][both] / peak[0][both] - 1.0
        quantiles = tuple(float(one) for one in np.quantile(error, (0.5, 0.16, 0.84)))
        stood = rocked[0].astype(bool) & ~fell[0]
        found.append(
            Shares(
                name,
                int(stood.sum()),
                int((stood & fell[i]).sum()),
                int(fell[0].sum()),
                int((fell[0] & fell[i]).sum()),
                int(both.sum()),
                (quantiles[0], quantiles[1], quantiles[2]),
            )
        )
    return found
