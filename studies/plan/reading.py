"""Findings of making or reading the motions of a study: input warnings, processing, scenario, and variability."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

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
        arrays, self.arrays = list(self.arrays), ()
        try:
            compared = over_model(arrays, self.at)
        except ValueError:
            return "", None
        ratios = compared["ratio"].values
        spectrum = f"Sa(0.1–4 s) {min(ratios[2:]):.2f}–{max(ratios[2:]):.2f}"
        line = f"{self.at.text}: PGA {ratios[0]:.2f}, PGV {ratios[1]:.2f}, {spectrum} times the median of {MODEL}"
        # A median of n motions varies by 1.25 times the dispersion over the root of n: few motions are far by chance.
        spread = np.maximum(compared["dispersion"].values, compared["model_dispersion"].values)[:2]
        chance = 2.58 * 1.2533 * spread / math.sqrt(sum(array.sizes["motion"] for array in arrays))
        if (np.abs(np.log(ratios[:2])) <= np.maximum(math.log(FAR), chance)).all():
            return line, None
        return line, Doubt.of("scenario_strength", line=line)


class Reading(NamedTuple):
    """Warnings on records, processing, spectra's spread, storeys, and comparisons of scenarios with a model.

    Motions that are scaled have `own_strength` no longer: it is not doubted. `taken` is as `taken_of` returns it.
    """

    doubts: tuple[Doubt, ...] = ()
    processing: tuple[str, ...] = ()
    variability: Variability | None = None
    storeys: tuple[str, ...] = ()
    compared: tuple[Compared, ...] = ()
    own_strength: bool = True
    taken: tuple[tuple[str, float, str, str, str], ...] = ()

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
            reading = cls(doubts, compared=() if at is None or len(plain) < 2 else (Compared(arrays, at),))
            if compare:
                reading.scenario  # noqa: B018 - computes it
            return reading._varied(plain)
        missed = tuple(matching_doubts(arrays))
        if not any(record.recorded for record in plain):
            return cls((*record_doubts(plain, own_level), *missed))
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


def taken_of(arrays: Iterable[xr.DataArray]) -> tuple[tuple[str, float, str, str, str], ...]:
    """Return label, time step (s), and `TAKEN`, of each component and floor of motions from files."""
    records: list[tuple[str, float, str, str, str]] = []
    for array in (array for array in arrays if "unit_from" in array.coords):
        columns = [array[name] if name in array.coords else xr.DataArray("") for name in ("motion", "dt", *TAKEN)]
        rows = zip(*(column.values.ravel() for column in xr.broadcast(*columns)), strict=True)
        records += [(str(label), float(dt), str(unit), str(step), str(at)) for label, dt, unit, step, at in rows]
    return tuple(dict.fromkeys(records))


def taken_facts(records: Iterable[tuple[str, float, str, str, str]]) -> list[Fact]:
    """Return the fact of the units and time steps of records, grouped by their sources; none without records."""
    groups: dict[tuple[str, ...], list[tuple[str, float, str, str, str]]] = {}
    for record in records:
        groups.setdefault(tuple(re.sub(r"\bline \d+", "", text) for text in record[2:]), []).append(record)
    rows = []
    for group in groups.values():
        labels, steps, units, step_sources, azimuth_sources = zip(*group, strict=True)
        names = list(dict.fromkeys(labels)) if len(groups) > 1 else []
        row = {"count": len(group), "names": names if len(names) <= NAMED else [], "steps": [min(steps), max(steps)]}
        texts = zip(("unit", "step", "azimuth"), (units, step_sources, azimuth_sources), strict=True)
        rows.append({**row, **{name: _with_all_lines(sources) for name, sources in texts}})
    return [Fact("motion.taken", sum(map(len, groups.values())), more={"groups": rows})] if rows else []


def _with_all_lines(texts: Sequence[str]) -> str:
    """Return the first of texts that differ in the number of a line, with the first and the last number."""
    numbers = sorted({int(number) for text in texts for number in re.findall(r"\bline (\d+)", text)})
    return re.sub(r"\bline \d+", f"lines {numbers[0]} to {numbers[-1]}", texts[0]) if len(numbers) > 1 else texts[0]


def _alike(varied: Variability) -> tuple[Doubt, ...]:
    return (Doubt.of("spectra_alike", spread=varied.text, natural=NATURAL),) if varied.narrow else ()


def doubts_of_making(generator: Generator) -> list[Doubt]:
    """Return the input warnings on a generator: parameters of another unit, a scenario outside its equations' data."""
    outside = [Doubt.of("scenario_outside", outside=generator.outside)] if generator.outside else []
    return [*generator_doubts(generator), *outside]


UNREAD = Reading()
"""The reading of motions that are generated."""
