"""The table of a study file by which the motions of each stripe are selected to agree with the hazard."""

import warnings
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

import xarray as xr
from pydantic import Field, model_validator

from ... import motions as shaking
from ...core.doubts import Doubt, noted
from ...core.parameters import COUNT, POSITIVE, Seed
from ...fragility.hazard.curve import HazardCurve
from ...fragility.hazard.plausibility import disaggregation_doubts
from ...motions.selection.files import MEAN, correlations_in
from ...motions.selection.select import FACTORS, HIGH_RATIO, LOW_RATIO
from ...motions.simulated.ground_motion_models import MODEL, MODELS
from ...motions.simulated.scenario import FAULTINGS, STRIKE_SLIP, Velocity
from ..plan.reading import doubts_of_making
from ..plan.size import refuse_samples
from .motions import Motions, MotionsTable
from .table import SEVERAL, KeyInfo, RelativePath, Table, one_of

LEAVE_OUT, KEEP = "leave-out", "keep"
NEAR = 0.02
"""Relative difference between the level of a disaggregation and its stripe's level that needs no note."""
OF_RUPTURES = ("vs30_m_s", "faulting", "model", "measures")
"""Keys of targets that come from a disaggregation and a ground-motion model."""


class OwnTarget(Table):
    """Target of a stripe's motions, if it is not the same at all levels.

    target: Of a selection: the target of this level, instead of the target of all.
    disaggregation: Of a selection: the disaggregation of this level, instead of the one of all.
    """

    target: Annotated[str | None, KeyInfo("that of [stripes.select]"), RelativePath()] = None
    disaggregation: Annotated[str | None, KeyInfo("that of [stripes.select]"), RelativePath()] = None


class SelectTable(Table):
    """Selection of each stripe's motions, so that their measures are distributed as the hazard asks.

    number: Motions of each stripe; twice as many candidates must be within the factors.
    target: CSV `measure,unit,median,sigma` (of the logarithm) of the earthquake, not of the level, with
        `rupture,weight` in front for several earthquakes. Or OpenQuake's conditional spectra, which are
        of their own levels. Relative to the study file.
    statistic: Curve of OpenQuake's file, or column of its disaggregation.
    correlations: CSV of correlations: a square table with the measures as heading and first column (a number is
        a period of Sa).
    disaggregation: Instead of a target: OpenQuake's `Mag_Dist` CSV or the USGS' JSON, whose magnitudes and
        distances weigh the medians of a ground-motion model.
    vs30_m_s: With a disaggregation: V_S30 of the site.
    faulting: With it: faulting.
    model: Its ground-motion model.
    measures: With it: the measures that are to agree.
    factor: Smallest and largest factor of a motion.
    weights: Weights of measures in the choice.
    seed: Seed of the choice.
    outside: True: leave out stripes whose median differs by more than 10 % from the target, or whose scatter is outside
        0.8 to 1.25 times the target's, in any measure.
    also: Further candidates, each table as [motions]: one simulated earthquake alone is too uniform.
    """

    number: Annotated[int, COUNT]
    target: Annotated[str | None, KeyInfo("from `disaggregation`"), RelativePath()] = None
    statistic: Annotated[str | None, KeyInfo(MEAN)] = None
    correlations: Annotated[str | None, KeyInfo("Baker & Jayaram (2008), Bradley (2011, 2012)"), RelativePath()] = None
    disaggregation: Annotated[str | None, KeyInfo("from `target`"), RelativePath()] = None
    vs30_m_s: Velocity | None = None
    faulting: Annotated[str | None, one_of(FAULTINGS), KeyInfo(STRIKE_SLIP)] = None
    model: Annotated[str | None, one_of(MODELS), KeyInfo(MODEL)] = None
    measures: Annotated[
        list[str] | None, KeyInfo("Sa from 0.1 to 4 s, pgv, d5_95"), Field(min_length=1, max_length=200)
    ] = None
    factor: Annotated[
        list[Annotated[float, POSITIVE]] | None,
        KeyInfo(f"[{FACTORS[0]:g}, {FACTORS[1]:g}]", unit="1"),
        Field(min_length=2, max_length=2),
    ] = None
    weights: Annotated[dict[str, float] | None, KeyInfo("1 each", unit="1")] = None
    seed: Seed = 0
    outside: Annotated[str | None, one_of((LEAVE_OUT, KEEP)), KeyInfo(LEAVE_OUT)] = None
    also: Annotated[list[Motions] | None, KeyInfo("none"), SEVERAL] = None

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if self.target is not None and self.disaggregation is not None:
            raise ValueError("stripes.select has a target or a disaggregation, not both")
        if self.disaggregation is not None:
            if self.vs30_m_s is None:
                raise ValueError("stripes.select.disaggregation needs vs30_m_s, the site's V_S30")
        elif self.target is not None:
            for name in OF_RUPTURES:
                if getattr(self, name) is not None:
                    raise ValueError(f"stripes.select.{name} is of a disaggregation, a target has its own")
        return self

    def refuse_without_target(self, stripes: Sequence[OwnTarget]) -> None:
        """Raise a ValueError if a stripe has no target, or keys of stripes do not go with a selection."""
        for i, stripe in enumerate(stripes, start=1):
            if stripe.target is not None and stripe.disaggregation is not None:
                raise ValueError(f"stripes.at[{i}] has a target or a disaggregation, not both")
            if (stripe.target or stripe.disaggregation or self.target or self.disaggregation) is None:
                raise ValueError(
                    f"stripes.select needs a target or a disaggregation, or stripes.at[{i}] one of its own"
                )
            if stripe.disaggregation is not None and self.vs30_m_s is None:
                raise ValueError(f"stripes.at[{i}].disaggregation needs stripes.select.vs30_m_s, the site's V_S30")

    def pool(self, table: MotionsTable, folder: Path) -> shaking.Candidates:
        """Return the candidates: the motions of a table and of further tables; ValueError as of the tables."""
        arrays = table.build(folder)
        for k, further in enumerate(self.also or [], start=1):
            try:
                built = further.build(folder)
            except ValueError as error:
                raise ValueError(f"stripes.select.also[{k}]: {error}") from None
            arrays += [
                array.assign_coords(motion=("motion", [f"{name} ({k})" for name in array["motion"].values]))
                for array in built
            ]
            refuse_samples(sum(array.size for array in arrays), "the candidates of a selection")
        for array in arrays:
            if "component" in array.dims or "floor" in array.dims:
                raise ValueError(
                    "stripes.select chooses ground motions of one component: no pairs and no floor motions"
                )
        return shaking.Candidates(arrays)

    def doubts_of_making(self, table: MotionsTable, folder: Path) -> list[Doubt]:
        """Return the input warnings on the generators of the candidates."""
        made = (generator.made_by(folder) for generator in (table, *(self.also or [])))
        return [doubt for generator in made if generator is not None for doubt in doubts_of_making(generator)]

    def chosen(
        self, candidates: shaking.Candidates, stripe: OwnTarget, levels: "Levels", level: float, folder: Path
    ) -> tuple[shaking.Selection, list[Doubt]]:
        """Return the selection for a stripe at a level (SI), and notes on it; ValueError as `select`."""
        target, doubts = self._target(stripe, levels, level, folder)
        low, high = self.factor or FACTORS
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", shaking.InconsistentSelection)  # (said among the notes)
            selection = shaking.select(
                candidates, target, self.number, level=level, factor=(low, high), weights=self.weights, seed=self.seed
            )
        return selection, doubts

    def _target(self, stripe: OwnTarget, levels: "Levels", level: float, folder: Path) -> tuple[Any, list[Doubt]]:
        im = levels.im
        own_table = None if self.correlations is None else correlations_in(folder / self.correlations)
        correlations: Any = {} if own_table is None else {"correlations": own_table}
        of_stripe = stripe.target is not None or stripe.disaggregation is not None
        path = stripe.target if of_stripe else self.target
        if path is not None:
            with noted() as doubts:
                return shaking.read_target(folder / path, im, statistic=self.statistic or MEAN, **correlations), doubts
        file = folder / str(stripe.disaggregation if of_stripe else self.disaggregation)
        column = self.statistic or MEAN
        with noted() as doubts:
            try:
                parts = shaking.read_disaggregation(file, im=im, level=level, column=column)
            except shaking.TargetError as error:
                try:  # (of one level, for all stripes)
                    parts = shaking.read_disaggregation(file, im=im, column=column)
                except shaking.TargetError:
                    raise error from None
        if levels.hazard is not None:
            doubts += disaggregation_doubts(levels.hazard, parts.level, parts.rate, Path(file).name)
        if abs(parts.level / level - 1.0) > NEAR:
            texts = {"name": Path(file).name, "level": levels.text(parts.level), "stripe": levels.text(level)}
            doubts.append(Doubt.of("other_level", **texts))
        assert self.vs30_m_s is not None
        target = shaking.expected_target(
            parts.scenarios(self.vs30_m_s, self.faulting or STRIKE_SLIP),
            im,
            self.measures,
            weights=parts.share,
            model=self.model or MODEL,
            **correlations,
        )
        return target, doubts


class Levels(NamedTuple):
    """Levels of the stripes: measure, unit as written, its SI value, levels in SI, and the study's hazard, if any."""

    im: str
    unit: str
    factor: float
    values: Sequence[float]
    hazard: HazardCurve | None = None

    def text(self, level: float) -> str:
        """A level (SI) as people write it."""
        return f"{self.im} = {level / self.factor:.3g}{'' if self.unit == '1' else f' {self.unit}'}"


def selected(
    select: SelectTable,
    stripes: Sequence[OwnTarget],
    tables: Sequence[MotionsTable],
    levels: Levels,
    folder: Path,
    named: Callable[[int], AbstractContextManager[None]],
) -> tuple[list[tuple[list[xr.DataArray], xr.Dataset]], list[Doubt]]:
    """Return the chosen ground motions of stripes with their agreement, and warnings; ValueError if none agrees."""
    pools: dict[str, shaking.Candidates] = {}
    chosen_stripes: list[tuple[list[xr.DataArray], xr.Dataset]] = []
    doubts: list[Doubt] = []
    for i, (stripe, table, level) in enumerate(zip(stripes, tables, levels.values, strict=True), start=1):
        key = table.model_dump_json()
        if key not in pools:
            with named(i):
                pools[key] = select.pool(table, folder)
                for candidates in (table, *(select.also or [])):
                    candidates.refuse_moving(folder, levels.im)
            doubts += select.doubts_of_making(table, folder)
        try:
            chosen, of_choice = select.chosen(pools[key], stripe, levels, level, folder)
        except ValueError as error:
            raise ValueError(f"stripes.at[{i}]: {error}") from None
        doubts += of_choice
        if not chosen.consistent:
            kept = select.outside == KEEP
            what = "stripe_kept" if kept else "stripe_left_out"
            doubts.append(Doubt.of(what, level=levels.text(level), why=chosen.why))
            if not kept:
                continue
        ground = chosen.motions if isinstance(chosen.motions, list) else [chosen.motions]
        bare = [array.drop_vars(["factor", "candidate", "event"]) for array in ground]
        chosen_stripes.append((bare, chosen.report))
    if not chosen_stripes:
        raise ValueError(
            "stripes.select: no stripe agrees with the hazard (a median off by more than 10 %, or a scatter outside "
            f"{LOW_RATIO:g} to {HIGH_RATIO:g} times the target's): {doubts[-1].sentence}"
        )
    return chosen_stripes, list(dict.fromkeys(doubts))
