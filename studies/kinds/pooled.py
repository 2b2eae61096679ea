"""Fragility studies of a region: curves and rates of many free-standing blocks from one surface for each law."""

import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.doubts import Doubt
from ...core.elementary import expm1
from ...core.facts import Fact, doubted, stored
from ...core.parameters import USUAL_CONFIDENCE
from ...core.units import ENDS, described, of_end
from ...core.wording import counted, years_text
from ...fragility.analyses.pooled import checked_plan
from ...fragility.fitting.states import OK, OVERTURNED, state_name
from ...fragility.risk.modelling import USUAL_DISPERSION, range_of_half_levels
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Runner
from ...fragility.validity.notes import squat_facts
from ...models.block_array import BlockArray
from ...models.plausibility import block_doubts
from ..file.schema import StudyFile
from ..plan.designs import Pooled
from ..region.reading import read_region
from ..region.rows import pooled_notes
from .fragility import median_doubts
from .study import BlockStudy, Expected, blocks_of, parts_of

STORED_BYTES = 8.0 * 14
"""Bytes of a curve in the results."""
HELD_BYTES = 3.0
"""Times as many are held while curves are evaluated."""
COLUMN_BYTES = 200.0
"""Bytes of a block: its name and its properties."""
FORM = (
    "P(x) = Phi(ln(x/median)/dispersion) of all blocks from one surface a law; medians from runs near them, "
    "dispersions from all runs; intervals by a covariance with motions as clusters, for all blocks at once"
)


@dataclass(frozen=True)
class PooledStudy(BlockStudy):
    """A region of free-standing blocks x damping laws; of `blocks`, one of them, the engine is prepared."""

    design: Pooled
    region: BlockArray = field(kw_only=True)
    kind: ClassVar[str] = "pooled"
    results_are_of: ClassVar[str] = "fragility"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        region = (
            BlockArray.of(blocks_of(content, folder))
            if content.blocks_file is None
            else read_region(folder / content.blocks_file)
        )
        parts = parts_of(content, folder, tuple(region.some(np.array([0]))))
        study = cls(**parts, undecided=0.0, region=region)
        study._check(content)
        design = study.design
        if study.risk is not None:
            design = replace(design, hazard=study.risk.hazard)
        checked_plan(
            region, study.models, design.source, design.im, design.until, design.runs_per_motion, design.hazard
        )
        if design.events is not None and len(region) < 2:
            raise ValueError("events are of blocks that fall together: leave them out for one block")
        if region.own and design.events is not None:
            raise ValueError(f"events take {' and '.join(region.own)} from the laws: leave the columns out, or events")
        return replace(study, design=design)

    @property
    def words(self) -> str:
        assert self.expected is not None
        of = f"{counted(len(self.region), 'block')} × {counted(len(self.models), 'law')} × {self.design.words}"
        return f"{of}: about {self.expected.runs[1]:,} runs"

    @property
    def runs(self) -> int:
        return len(self.models) * self.design.runs + self.event_runs

    @property
    def event_runs(self) -> int:
        """Number of runs of the sample of which falls in one event are counted."""
        return 0 if self.design.events is None else len(self.models) * self.design.events.runs_of(len(self.region))

    @property
    def expected(self) -> Expected:
        motions = self.design.expected
        few, usual, many = (len(self.models) * self.design.runs_of(n) + self.event_runs for n in motions)
        return Expected((few, usual, many), "of some {1:,} motions ({0:,} to {2:,})".format(*motions))

    @property
    def stored_bytes(self) -> float:
        of_curves = STORED_BYTES * len(self.region) * len(self.models)
        return COLUMN_BYTES * len(self.region) + of_curves + 8.0 * 7 * self.design.until.most

    @property
    def together(self) -> float:
        return HELD_BYTES * self.stored_bytes

    @property
    def squat(self) -> list[Fact]:
        return squat_facts(self.region)

    @property
    def of_blocks(self) -> list[Doubt]:
        return block_doubts(self.region)

    @property
    def _read(self) -> list[Any]:
        columns = self.region.width, self.region.height, self.region.cm_height, self.region.inertia
        columns_of_file = list(self.region.own.values())
        digest = hashlib.sha256("\n".join([*self.region.own, *self.region.names.tolist()]).encode())
        for column in (*columns, *columns_of_file):
            digest.update(np.ascontiguousarray(column).tobytes())
        return [*super()._read, digest.hexdigest()]

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        surfaces = 0

        def tell(done: int, total: int) -> None:
            nonlocal surfaces
            surfaces = done
            if progress is not None:
                progress(done, total + self.event_runs)

        curves = self.design.run(self.region, self.models, (), client, tell)
        dims, shape = ("block", "model"), (curves.sizes["block"], curves.sizes["model"])
        run = curves["run_level"].variable
        named = {"im": self.design.im, "units": run.attrs["units"], "long_name": curves.attrs["level_name"]}
        curves = curves.assign_coords(intensity=(run.dims, run.values, named)).assign(
            status=(dims, np.full(shape, OK), described("status of the curve")),
            converged=(dims, np.ones(shape, np.bool_), described("whether the fit ended")),
        )
        if self.risk is not None:
            curves = curves.assign(self._chances(curves, self.risk.years)).assign_attrs(years=self.risk.years)
            curves = curves.assign(self.risk.modelling_range(curves, 0.0, curves["rate"].values))
        if self.design.events is not None:
            events = self._events(client, part_of(progress, surfaces, surfaces + self.event_runs))
            curves = curves.merge(events, combine_attrs="no_conflicts")
        return curves.assign(range_of_half_levels(curves, 0.0)).assign_attrs(
            fit_method=FORM,
            form="lognormal",
            modelling_dispersion=0.0,
            modelling_range=USUAL_DISPERSION,
            modelling="mean",
            confidence=USUAL_CONFIDENCE,
            state=state_name(OVERTURNED),
            notes=stored(
                [*pooled_notes(curves), *doubted(median_doubts(curves["half_level"].values, run.attrs["units"]))]
            ),
        )

    def _events(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Return the share of the region that falls in one event, on its own axes."""
        falls = self.design.falls(self.region, self.models, client, progress)
        kept = falls.drop_vars([name for name in falls.coords if name not in {*falls.dims} - {"model"}])
        renamed = kept.rename({name: f"event_{name}" for name in ("level", "motion", "quantile")})
        return xr.Dataset(renamed.variables, attrs={"event_sample": falls.attrs["sample"]})

    @staticmethod
    def _chances(curves: xr.Dataset, years: float) -> dict[str, Any]:
        """Return the probabilities of an earthquake within the years that overturns each block."""
        text = f"probability that {years_text(years)} hold an earthquake that overturns the block, 1 - exp(-rate years)"
        return {
            f"risk_probability{end}": (
                ("block", "model"),
                -expm1(-years * curves[f"rate{end}"].values),
                described(of_end(end, text)),
            )
            for end in ENDS
        }
