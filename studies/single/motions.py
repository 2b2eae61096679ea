"""Tables and figures of motions: their measures, histories, spectra and Husid plots."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from ... import motions as shaking
from ...core.doubts import Doubt, noted
from ...core.units import DAMPING, STANDARD_GRAVITY
from ...core.wording import counted
from ...core.writing import whole_file
from ...motions.arrays import Record, digest, records
from ...motions.intensity.cumulative import husid
from ...motions.intensity.peaks import velocity
from ...motions.intensity.spectra import damping_of
from ...motions.matching.target_spectra import TargetSpectrum
from ...motions.plausibility import record_doubts, vertical_doubts
from ...motions.readers.directions import BY_ITSELF, horizontal_motions
from ...motions.readers.patterns import expand
from ...motions.simulated.ground_motion_models import over_models
from ..facts.say import notes_said
from ..file.floor_index import read_floor_index
from ..file.motions import IndexedFloorMotions
from ..file.schema import read_study_file
from ..plan.reading import Reading, Taken, taken_facts, taken_of
from ..plots import axes
from ..tables.table import Cells, Column, Table
from ..text.encoding import json_text
from ..text.error import StudyError, writing
from ..text.words import floor_name

PERIODS = np.geomspace(0.02, 5.0, 90)
MOST_HISTORIES = 6
MOST_ROWS = 12
PERCENTILES = (16.0, 50.0, 84.0)
THIN: dict[str, Any] = {"lw": 0.4, "color": "0.65"}

MOTION = Column("motion", "motion")
COLUMNS = (
    (Column("pga", "PGA", "plain", "g"), STANDARD_GRAVITY),
    (Column("pgv", "PGV", "plain", "m/s"), 1.0),
    (Column("pgd", "PGD", "plain", "m"), 1.0),
    (Column("arias", "Arias", "plain", "m/s"), 1.0),
    (Column("cav", "CAV", "plain", "m/s"), 1.0),
    (Column("d5_75", "D5-75", "plain", "s"), 1.0),
    (Column("d5_95", "D5-95", "plain", "s"), 1.0),
    (Column("t_mean", "Tm", "plain", "s"), 1.0),
    (Column("Sa", "Sa(1 s)", "plain", "g"), STANDARD_GRAVITY),
)
"""Columns of measures, and the SI values of their units."""


class Shown(NamedTuple):
    """Motions to show; input warnings; ratios to models, or lines on stripes; what is `taken_of` files."""

    motions: list[xr.DataArray]
    doubts: list[Doubt]
    ratios: dict[str, xr.Dataset]
    lines: tuple[str, ...] = ()
    taken: tuple[Taken, ...] = ()

    @property
    def read(self) -> list[str]:
        """Sentences on the units and time steps of files."""
        return notes_said(taken_facts(self.taken))


def read_motions(inputs: Sequence[str]) -> Shown:
    """Return the motions of one study file (through its building) or of record files, paths or patterns."""
    studies = [given_input for given_input in inputs if given_input.lower().endswith(".toml")]
    if studies and len(inputs) > 1:
        raise StudyError(f"{studies[0]}: a study file must stand alone, got {len(inputs)} files")
    try:
        if not studies:
            arrays = horizontal_motions({path: shaking.read_all(path) for path in expand(list(inputs), Path())}, inputs)
            doubts = [*vertical_doubts(arrays, BY_ITSELF), *record_doubts(records(arrays))]
            return Shown(arrays, doubts, {}, taken=taken_of(arrays))
        path = Path(studies[0])
        with noted():  # a study names the warnings on its files
            content = read_study_file(path)
        table = content.motions
        if content.performance is not None and isinstance(table, IndexedFloorMotions):
            arrays = read_floor_index(path.parent / table.floors_index, table.dt_s, table.unit).arrays
            reading = Reading.of(arrays)
            doubts = [doubt for doubt in reading.doubts if doubt.kind not in (content.accept or [])]
            return Shown(arrays, doubts, {}, taken=reading.taken)
        sets = content.shaking(path.parent)
        arrays = _labelled_once([of_set.motions for of_set in sets])
        records(arrays)
        reading = Reading.joined([of_set.reading for of_set in sets])
        doubts = [doubt for doubt in (*reading.doubts, *reading.far) if doubt.kind not in (content.accept or [])]
        if content.stripes is not None:
            return Shown(arrays, doubts, {}, (*reading.scenario, *reading.storeys), reading.taken)
        made = content.motions.made_by(path.parent)
        at = None if made is None else made.scenario
        if at is None or content.motions.given("number") == 1 or reading.storeys:
            return Shown(arrays, doubts, {}, reading.storeys, reading.taken)
        on_floors = any("floor" in array.dims for array in arrays)
        ground = content.motions.build(path.parent) if on_floors else arrays
        try:
            return Shown(arrays, doubts, over_models(list(ground), at))
        except ValueError as error:
            return Shown(arrays, doubts, {}, (f"no ground-motion model is of {at.text}: {error}",))
    except StudyError:
        raise
    except (ValueError, ArithmeticError) as error:
        raise StudyError(f"{studies[0]}: {error}" if studies else str(error)) from None


def _labelled_once(sets: Sequence[Sequence[xr.DataArray]]) -> list[xr.DataArray]:
    """Return the motions of all stripes, each only once; different motions of the same label are renamed."""
    distinct: list[xr.DataArray] = []
    seen: dict[str, set[str]] = {}
    for number, arrays in enumerate(sets, start=1):
        for array in arrays:
            labels = [str(value) for value in array["motion"].values]
            recordings = (records(array.isel(motion=[i])) for i in range(len(labels)))
            samples = [" ".join(digest(part) for part in record) for record in recordings]
            new = [i for i, name in enumerate(labels) if samples[i] not in seen.get(name, set())]
            names = [f"{labels[i]} (stripe {number})" if labels[i] in seen else labels[i] for i in new]
            for i in new:
                seen.setdefault(labels[i], set()).add(samples[i])
            if new:
                distinct.append(array.isel(motion=new).assign_coords(motion=("motion", names, array["motion"].attrs)))
    return distinct


def measured(motions: Sequence[xr.DataArray], damping: float = DAMPING) -> xr.Dataset:
    """Return every measure without parameters, and Sa(1.0) at a damping ratio, on ``motion``."""
    return shaking.measures(list(motions), [*shaking.MEASURES, shaking.Sa(1.0, damping)])


def measures_table(values: xr.Dataset) -> Table:
    """Return the measures of the first motions, and the medians of all (of each floor)."""
    n = values.sizes["motion"]
    names = {str(key).partition("(")[0]: key for key in values.data_vars}  # (without parameters)
    columns = [(column, values[names[column.key]].values / scale) for column, scale in COLUMNS]
    lines: list[Cells | str] = [
        {MOTION: str(values["motion"].values[i]), **{column: float(of[i]) for column, of in columns}}
        for i in range(min(n, MOST_ROWS))
    ]
    for floor, motions in _by_floor(values).items() if n > 1 else ():
        name = "median" if floor is None else f"median, {floor_name(floor)}"
        lines.append({MOTION: name, **{column: float(np.median(of[motions])) for column, of in columns}})
    more = [f"{n - MOST_ROWS:,} more motions are not listed."] if n > MOST_ROWS else []
    return Table.of(counted(n, "motion"), lines, *more)


def scenario_table(ratios: Mapping[str, xr.Dataset]) -> Table:
    """Return the medians of a scenario's motions over ground-motion models' medians, with the dispersions."""
    first = next(iter(ratios.values()))
    of_all = Column("dispersion", "dispersion here", "hundredths")
    lines: list[Cells | str] = []
    for i, label in enumerate(first["measure"].values.astype(str).tolist()):
        row: Cells = {Column("measure", "measure"): {"pga": "PGA", "pgv": "PGV"}.get(label, label)}
        row |= {Column(model, f"over {model}", "hundredths"): float(of["ratio"][i]) for model, of in ratios.items()}
        row[of_all] = float(first["dispersion"][i])
        for model, of in ratios.items():
            row[Column(f"{model}_dispersion", f"dispersion {model}", "hundredths")] = float(of["model_dispersion"][i])
        lines.append(row)
    at = str(first.attrs["title"]).partition(": ")[2]
    return Table.of(f"Medians over those of ground-motion models ({at})", lines)


def measures_json(values: xr.Dataset, figures: Sequence[Path], shown: Shown) -> str:
    """Return every measure of every motion as JSON, SI; null if a measure is undefined (durations of zeros)."""
    measures = {
        str(name): {
            "units": array.attrs["units"],
            "long_name": array.attrs["long_name"],
            "values": [number if math.isfinite(number) else None for number in array.values.tolist()],
        }
        for name, array in values.data_vars.items()
    }
    content = {
        "motions": [str(value) for value in values["motion"].values],
        "dt": {"units": "s", "values": values["dt"].values.tolist()},
        "duration": {"units": "s", "values": values["duration"].values.tolist()},
        **({"floor": values["floor"].values.tolist()} if "floor" in values.coords else {}),
        "measures": measures,
        "notes": [*(doubt.sentence for doubt in shown.doubts), *shown.read],
        **({"over_models": {model: _over(ratio) for model, ratio in shown.ratios.items()}} if shown.ratios else {}),
        "figures": [str(path) for path in figures],
    }
    return json_text(content, indent=1)


def _over(ratios: xr.Dataset) -> dict[str, Any]:
    labels = [str(value) for value in ratios["measure"].values]
    return {
        name: dict(zip(labels, ratios[name].values.tolist(), strict=True))
        for name in ("ratio", "dispersion", "model_dispersion")
    }


@axes.defaults()
def write_figures(
    motions: Sequence[xr.DataArray], folder: Path, damping: float = DAMPING, target: TargetSpectrum | None = None
) -> list[Path]:
    """Write histories.png, spectra.png and husid.png; StudyError if the folder cannot be written."""
    plain = records(list(motions))
    figures = {
        "histories.png": histories_figure(plain),
        "spectra.png": spectra_figure(list(motions), damping, target),
        "husid.png": husid_figure(plain),
    }
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for name, figure in figures.items():
            with whole_file(folder / name) as temporary:
                figure.savefig(temporary, format="png", dpi=150)
    return [folder / name for name in figures]


def histories_figure(plain: Sequence[Record]) -> Figure:
    """Return the figure of acceleration and velocity of the first motions, one row each, to one scale."""
    shown = list(plain[:MOST_HISTORIES])
    figure = Figure(figsize=(9.0, 1.25 * len(shown) + 1.1), layout="constrained")
    panels = figure.subplots(len(shown), 2, squeeze=False, sharex=True, sharey="col")
    for (left, right), record, colour in zip(panels, shown, map(axes.colour, range(len(shown))), strict=True):
        time = np.arange(record.acceleration.size) * record.dt
        left.plot(time, record.acceleration / STANDARD_GRAVITY, lw=0.6, color=colour)
        right.plot(time, velocity(record.acceleration, record.dt), lw=0.8, color=colour)
        left.set_title(record.label, fontsize=9, loc="left")
        for ax in (left, right):
            axes.label(ax)
    for ax, name in zip(panels[0], ("acceleration (g)", "velocity (m/s)"), strict=True):
        ax.set_title(name, fontsize=10, loc="right")
    for ax in panels[-1]:
        ax.set_xlabel("time (s)")
    if len(plain) > len(shown):
        figure.suptitle(f"the first {len(shown)} of {len(plain):,} motions, one scale for all", fontsize=10)
    return figure


def spectra_figure(
    motions: Sequence[xr.DataArray], damping: float = DAMPING, target: TargetSpectrum | None = None
) -> Figure:
    """Return the figure of all motions' pseudo-acceleration spectra, with median and percentiles of each floor."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    draw_spectra(figure.subplots(), motions, damping, target)
    return figure


def draw_spectra(
    ax: Axes, motions: Sequence[xr.DataArray], damping: float = DAMPING, target: TargetSpectrum | None = None
) -> Axes:
    """Draw spectra into axes: every motion thin, median and 16 and 84 % of each floor, and a target dotted."""
    spectrum = shaking.response_spectrum(list(motions), PERIODS, damping_of(damping))
    sa = spectrum["sa"].values / STANDARD_GRAVITY
    floors = _by_floor(spectrum)
    single = sa.shape[0] == 1
    for i, (floor, places) in enumerate(floors.items()):
        colour = axes.colour(i)
        thin: dict[str, Any] = THIN if len(floors) == 1 else {"lw": 0.4, "color": colour, "alpha": 0.25}
        name = "" if floor is None else f"{floor_name(floor)}: "
        if single:
            ax.plot(PERIODS, sa[0], lw=1.8, color=colour, label=str(spectrum["motion"].values[0]))
            continue
        ax.plot(PERIODS, sa[places].T, **thin)
        low, middle, high = np.percentile(sa[places], PERCENTILES, axis=0)
        ax.plot(PERIODS, middle, lw=2.0, color=colour, label=f"{name}median", zorder=3)
        label = "16 and 84 %" if floor is None else None
        ax.plot(PERIODS, low, lw=1.2, ls="dashed", color=colour, label=label, zorder=3)
        ax.plot(PERIODS, high, lw=1.2, ls="dashed", color=colour, zorder=3)
        if floor is None:
            ax.plot([], [], **THIN, label=f"{sa.shape[0]:,} motions")
    if len(floors) > 1:
        ax.plot([], [], lw=1.2, ls="dashed", color="0.3", label="16 and 84 %")
    if target is not None:
        values = np.array(target.sa) / STANDARD_GRAVITY
        ax.plot(target.periods, values, lw=1.8, ls="dotted", color="#000000", label="target", zorder=4)
    ax.set_xscale("log")
    top = float(sa.max())
    if top > 0.0:
        ax.set_yscale("log")
        low = max(float(sa[sa > 0.0].min()), 1e-3 * top)
        ax.set_ylim(0.8 * low, 1.5 * top)
        if top < 100.0 * low:  # within one decade the axis would otherwise have one number or none
            ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.set_xlim(PERIODS[0], PERIODS[-1])
    ax.xaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("period (s)")
    ax.set_ylabel(f"Sa (g), {100.0 * damping:g} % damping")
    ax.legend(fontsize=8, frameon=False)
    axes.label(ax)
    return ax


def husid_figure(plain: Sequence[Record]) -> Figure:
    """Return the Husid plot: the share of the Arias intensity over time, which shows the duration of strong motion."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    ax = figure.subplots()
    many = len(plain) > MOST_HISTORIES
    for i, record in enumerate(plain):
        time = np.arange(record.acceleration.size) * record.dt
        share = 100.0 * husid(record.acceleration, record.dt)
        if many:
            ax.plot(time, share, **THIN)
        else:
            ax.plot(time, share, lw=1.5, color=axes.colour(i), label=record.label)
    if many:
        ends = max(record.duration for record in plain)
        time = np.linspace(0.0, ends, 600)
        # after its end a motion keeps its whole intensity
        for i, floor in enumerate(dict.fromkeys(record.floor for record in plain)):
            curves = [
                np.interp(
                    time, np.arange(record.acceleration.size) * record.dt, 100.0 * husid(record.acceleration, record.dt)
                )
                for record in plain
                if record.floor == floor and record.acceleration.any()
            ]
            if curves:
                label = f"median, {floor_name(floor)}" if floor else "median"
                ax.plot(time, np.median(curves, axis=0), lw=2.0, color=axes.colour(i), label=label)
        ax.plot([], [], **THIN, label=f"{len(plain):,} motions")
    for level in (5.0, 75.0, 95.0):
        ax.axhline(level, lw=0.8, ls="dotted", color="0.3", zorder=0)
    ax.set_yticks([0, 5, 25, 50, 75, 95])
    ax.set_ylim(0.0, 101.0)
    ax.set_xlim(left=0.0)
    ax.set_xlabel("time (s)")
    ax.set_ylabel("share of the Arias intensity (%)")
    ax.legend(fontsize=8, frameon=False, loc="center right")
    axes.label(ax)
    return figure


def _by_floor(values: xr.Dataset) -> dict[str | None, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return a mask of the motions of each floor; without floors one mask of all motions under None."""
    everything = np.ones(values.sizes["motion"], dtype=bool)
    if "floor" not in values.coords:
        return {None: everything}
    floors = values["floor"].values
    return {str(floor): np.asarray(floors == floor) for floor in dict.fromkeys(floors.tolist())}
