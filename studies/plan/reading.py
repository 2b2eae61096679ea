"""Findings of making or reading the motions of a study: input warnings, processing, scenario, and variability."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import xarray as xr

from ...core.doubts import NAMED, Doubt
from ...core.facts import Fact
from ...motions import Generator, Scenario, over_model, records
from ...motions.arrays import TAKEN, Record, filter_doubts
from ...motions.intensity.variability import NATURAL, SPECTRA, Variability, pooled, variability
from ...motions.matching.adjustment import matching_doubts
from ...motions.plausibility import generator_doubts, record_doubts, vertical_doubts
from ...motions.simulated.ground_motion_models import MODEL

MOST_GROUPS = 8
"""Most groups of records of the same units, time steps and sources."""
_LINE = re.compile(r"\bline \d+")
_COLUMNS = re.compile(r"(?<=columns left out): .*(?=\)$)")
Taken = tuple[str, float, str, str, str]
FAR = 1.5
"""Ratio to a ground-motion model's median, or its inverse, from which the amplitude of a scenario is doubted."""


@dataclass
class Compared:
    """Motions of a scenario, compared with a ground-motion model when the outcome is first needed."""

    arrays: Sequence[xr.DataArray]
    at: Scenario

    @cached_property
    def outcome(self) -> tuple[str, Doubt | None]:
        """The ratios to the model, and the warning that they are far; nothing for a scenario beyond the model."""
        try:
            compared = over_model(list(self.arrays), self.at)
        except ValueError:
            return "", None
        ratios = compared["ratio"].values
        spectrum = f"Sa(0.1–4 s) {min(ratios[2:]):.2f}–{max(ratios[2:]):.2f}"
        line = f"{self.at.text}: PGA {ratios[0]:.2f}, PGV {ratios[1]:.2f}, {spectrum} times the median of {MODEL}"
        # A median of n motions varies by 1.25 times the dispersion over the root of n: few motions are far by chance.
        spread = np.maximum(compared["dispersion"].values, compared["model_dispersion"].values)[:2]
        chance = 2.58 * 1.2533 * spread / math.sqrt(sum(array.sizes["motion"] for array in self.arrays))
        if (np.abs(np.log(ratios[:2])) <= np.maximum(math.log(FAR), chance)).all():
            return line, None
        return line, Doubt.of("scenario_strength", line=line)


class Reading(NamedTuple):
    """Warnings on records, processing, spectra's spread, storeys, and comparisons of scenarios with a model.

    Motions that are scaled do not have their `own_strength`: it is not doubted. `taken` is as `taken_of` returns it.
    """

    doubts: tuple[Doubt, ...] = ()
    processing: tuple[str, ...] = ()
    variability: Variability | None = None
    storeys: tuple[str, ...] = ()
    compared: tuple[Compared, ...] = ()
    own_strength: bool = True
    taken: tuple[Taken, ...] = ()

    @property
    def scenario(self) -> tuple[str, ...]:
        """Lines on the strength of the motions of scenarios."""
        return tuple(dict.fromkeys(line for compared in self.compared if (line := compared.outcome[0])))

    @property
    def far(self) -> tuple[Doubt, ...]:
        """Warnings on the strength of motions that are not scaled."""
        every = [compared.outcome[1] for compared in self.compared] if self.own_strength else []
        return tuple(dict.fromkeys(doubt for doubt in every if doubt is not None))

    @classmethod
    def of(
        cls,
        arrays: Sequence[xr.DataArray],
        generator: Generator | None = None,
        own_level: bool = True,
        compare: bool = True,
    ) -> Self:
        """Return the reading of motions, and of the generator that made them, which may miss a target or a scenario.

        Motions that have the strength of a given level are not `own_level`. A scenario is compared with a model now,
        or when the comparison is first needed: until then the reading keeps the motions.
        """
        plain = [record for array in arrays for record in records(array)]
        if generator is not None:
            doubts = (*record_doubts(plain, own_level), *matching_doubts(arrays), *doubts_of_making(generator))
            at = generator.scenario
            compared = () if at is None or len(plain) < 2 else (Compared(arrays, at),)
            for comparison in compared if compare else ():
                comparison.outcome  # noqa: B018 - computes it
                comparison.arrays = ()
            return cls(doubts, compared=compared)._varied(plain)
        missed = tuple(matching_doubts(arrays))
        if not any(record.recorded for record in plain):
            return cls((*record_doubts(plain, own_level), *missed), taken=taken_of(arrays))
        done = [(str(array.attrs.get("processing", "")), records(array)) for array in arrays]
        notes = {note for note, _ in done}
        if len(notes) == 1:
            lines = tuple(notes - {""})
        else:
            lines = tuple(f"{record.label}: {note or 'none'}" for note, of_note in done for record in of_note)
        doubts = (*vertical_doubts(arrays), *record_doubts(plain, own_level), *filter_doubts(arrays), *missed)
        reading = cls(doubts, lines, taken=taken_of(arrays))
        return reading if any("floor" in array.dims for array in arrays) else reading._varied(plain)

    def _varied(self, plain: Sequence[Record]) -> Self:
        """Return the reading with the variability of its motions, and the input warning on it."""
        varied = variability(plain)
        return self._replace(variability=varied, doubts=(*self.doubts, *_alike(varied)))

    @classmethod
    def joined(cls, parts: "Iterable[Reading]") -> Self:
        """Return the reading of several sets of motions, with each warning and line once."""
        every = list(parts)
        varied = [reading.variability for reading in every if reading.variability is not None]
        joint = pooled(varied) if varied else None
        doubts = dict.fromkeys(doubt for part in every for doubt in part.doubts if doubt.kind != SPECTRA)
        lines = dict.fromkeys(line for part in every for line in part.processing)
        compared = tuple(comparison for part in every for comparison in part.compared)
        alike = () if joint is None else _alike(joint)
        storeys = dict.fromkeys(line for part in every for line in part.storeys)
        own_strength = all(part.own_strength for part in every)
        taken = dict.fromkeys(record for part in every for record in part.taken)
        return cls((*doubts, *alike), tuple(lines), joint, tuple(storeys), compared, own_strength, tuple(taken))


def taken_of(arrays: Iterable[xr.DataArray]) -> tuple[Taken, ...]:
    """Return label, time step (s), and `TAKEN`, of motions from files: of each part if parts have different units."""
    rows: list[Taken] = []
    for array in (array for array in arrays if "unit_from" in array.coords):
        known = array if "dt" in array.coords else array.assign_coords(dt=records(array)[0].dt)
        part = next((dim for dim in ("floor", "component") if dim in array["unit_from"].dims), None)
        apart = part is not None and np.unique(array["unit_from"].values.astype(str)).size > 1
        names = ("motion", part or "motion", "dt", *TAKEN)
        columns = [known[name] if name in known.coords else xr.DataArray("") for name in names]
        cells = zip(*(column.values.ravel() for column in xr.broadcast(*columns)), strict=True)
        for label, of_part, dt, *sources in cells:
            unit, step, azimuth = map(str, sources)
            rows.append((f"{label} {part} {of_part}" if apart else str(label), float(dt), unit, step, azimuth))
    return tuple(dict.fromkeys(rows))


def taken_facts(every: Iterable[Taken]) -> list[Fact]:
    """Return the fact of the units and time steps of records, grouped by them and their sources; none without records.

    If there are too many groups, lines and names of columns are left out, then time steps.
    """
    rows = list(every)
    for all_lines, all_steps in ((True, True), (False, True), (False, False)):
        groups: dict[tuple[Any, ...], list[Taken]] = {}
        for row in rows:
            texts = row[2:] if all_lines else [_LINE.sub("", _COLUMNS.sub("", text)) for text in row[2:]]
            groups.setdefault((row[1] if all_steps else 0.0, *texts), []).append(row)
        if len(groups) <= MOST_GROUPS:
            break
    facts = []
    for group in groups.values():
        labels, steps, *columns = zip(*group, strict=True)
        names, sources = list(dict.fromkeys(labels)), dict(zip(("unit", "step", "azimuth"), columns, strict=True))
        shown = names if len(groups) > 1 and len(names) <= NAMED else []
        stated = {key: _common(texts) for key, texts in sources.items()}
        facts.append({"count": len(names), "names": shown, "steps": [min(steps), max(steps)], **stated})
    return [Fact("motion.taken", len({row[0] for row in rows}), more={"groups": facts})] if facts else []


def _common(texts: Sequence[str]) -> str:
    """Return the text of a group: without the names of columns if they differ, then without the lines."""
    for pattern, word in ((_COLUMNS, ""), (_LINE, "various lines")):
        if len({*texts}) > 1:
            texts = [pattern.sub(word, text) for text in texts]
    return texts[0]


def _alike(varied: Variability) -> tuple[Doubt, ...]:
    return (Doubt.of("spectra_alike", spread=varied.text, natural=NATURAL),) if varied.narrow else ()


def doubts_of_making(generator: Generator) -> list[Doubt]:
    """Return the input warnings on a generator: parameters of another unit, a scenario outside its equations' data."""
    outside = [Doubt.of("scenario_outside", outside=generator.outside)] if generator.outside else []
    return [*generator_doubts(generator), *outside]


UNREAD = Reading()
"""The reading of motions that are generated."""
