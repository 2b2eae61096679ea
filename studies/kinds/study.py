"""A study: the content of a study file, ready to be run into one result dataset."""

import hashlib
import json
import math
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, field, replace
from functools import cached_property
from importlib import import_module, metadata
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Progress
from ...core.doubts import Doubt, noted
from ...core.facts import Fact, doubted, stored
from ...core.units import SCHEMA
from ...core.wording import about_years, counted, with_article
from ...fragility.hazard.curve import HazardCurve
from ...fragility.hazard.plausibility import RETURN_PERIODS, hazard_doubts, level_at, point_off
from ...fragility.numerics import slabs
from ...fragility.runs.labels import ordered
from ...fragility.runs.plan import (
    MOST_CASES,
    SECONDS_PER_PLANE_SAMPLE,
    SECONDS_PER_SAMPLE,
    never,
    refuse_endless_runs,
    seconds_per_sample,
)
from ...fragility.runs.runners import ConfiguredScheduler, Runner, Workers, default_client, thread_count
from ...fragility.validity.notes import squat_facts
from ...fragility.validity.scenes import scene_facts
from ...fragility.validity.undecided import perturbed_runs
from ...models import Block, Law, Restraint
from ...models.friction import Friction
from ...models.oscillator import Oscillator
from ...models.outputs import OUTPUTS
from ...models.plausibility import block_doubts, stated_restitution_doubts, still_doubts
from ...models.runs import engine_identity, prepare
from ...motions import records
from ...motions.arrays import BOTH_AXES, LIFTS, REVERSE_OF, WEAK_AXIS, digest, shakes_of
from ..facts.notes import INPUT_NOTES
from ..facts.say import notes_said
from ..file.blocks import MOST_BLOCKS, read_blocks, stiffness_notes
from ..file.buildings import strength_notes
from ..file.include import text_of
from ..file.schema import StudyFile, read_study_file
from ..file.table import all_errors, key_doubts
from ..plan.designs import Cloud, Design, Incremental
from ..plan.estimates import UNDECIDED, Fit
from ..plan.reading import Reading, taken_facts
from ..plan.risk import Risk
from ..store.content import AS_WRITTEN, EDITED, content_state, sealed
from ..store.differences import identifying
from ..store.folder import RESULT_NAME, finished, folder_of_one, refuse_folder, save
from ..store.manifest import MOST_RUNS, kept_runs, read_manifest
from ..store.renames import with_present_names
from ..store.resources import Resources, refuse_shortage
from ..store.shards import Shards, belongs, open_shards, refuse_other, remove_leftover_shards, remove_shards
from ..store.watch import Interrupted, Stop, Watch, run_log
from ..store.worker_motions import cluster
from ..text.error import StudyError
from ..text.words import measure_name, value_in

OF_TABLES = ("table", "vertical", "PGA", "PGV/PGA", "building", "level", "scenario", "structure")
"""Kinds of input warnings from reading a study, not from its motions."""
MOST_VARIED = 2000
"""Most blocks of a study that runs many samples or values of each block."""
# Memory of a block and its curve, from the file to the results; and of each replicate of a curve.
CURVE_BYTES = 3e3
REPLICATE_BYTES = 50.0
MEASURING = 10
"""Number of arrays as long as a motion that its reading, its warnings and its measures need temporarily."""
SLAB_BYTES_A_RUN = 100.0
"""Most memory for each run of a slab, which the ranking of measures needs."""
__version__ = metadata.version("toppling")


class Expected(NamedTuple):
    """Approximate numbers of runs of adaptive levels (few, usual, many), motions in words, and usual runs of slides."""

    runs: tuple[int, int, int]
    words: str
    slides: int = 0


@dataclass(frozen=True)
class Study(ABC):
    """A study, ready to run.

    `Study.from_toml` makes the kind of study that the file requests. `configuration` is the file's content as plain
    values. `of_tables`: the input warnings on tables of other files, on buildings and supports, and on stripes that are
    not scaled.
    """

    title: str
    configuration: dict[str, Any]
    of_tables: tuple[Doubt, ...] = field(default=(), kw_only=True)
    kind: ClassVar[str]
    results_are_of: ClassVar[str] = ""
    """The kind of the results, if it differs: they contain the variables of that kind."""

    @staticmethod
    def from_toml(path: str | os.PathLike[str], target: float | None = None) -> "Study":
        """Read the study in a TOML file; paths in it are relative to the file.

        `target`: of all its restraints, instead of their own (`restraints.NAME.target`).

        Raises
        ------
        StudyError
            One sentence that names the file, the key, the value and the allowed values.
        """
        file = checks.path(path)
        study = study_of(lambda: read_study_file(file, target), file)
        # (comments may describe a curve that somebody changed)
        comments = (line for line in text_of(file).splitlines() if "#" in line)
        if study.site_hazard is None or not (off := point_off(study.site_hazard, comments)):
            return study
        return replace(study, of_tables=(*study.of_tables, Doubt.of("hazard_off", name=file.name, text=off)))

    def _check_vertical(self) -> None:
        """Raise ValueError for a vertical component under a law that is not in exact geometry."""
        if any(LIFTS in array.coords for array in self.arrays) and not all(
            oscillator.exact for oscillator in self.of_each_law
        ):
            raise ValueError(
                'motions.vertical needs the exact geometry of the impact law: take law = "housner" with geometry = '
                f'"exact" alone, got {", ".join(map(repr, dict.fromkeys(self._laws)))}'
            )

    @property
    def _laws(self) -> list[str]:
        """The laws by the names that the file gives."""
        given = self.configuration.get("models") or [self.configuration.get("model") or {}]
        return [str(law.get("law", "discrete")) for law in given if isinstance(law, dict)]

    @classmethod
    @abstractmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        """Make the study of a file in `folder`; ValueError for errors that would otherwise appear during the run."""

    @property
    @abstractmethod
    def words(self) -> str:
        """The size of the study in words."""

    @property
    @abstractmethod
    def runs(self) -> int:
        """Number of runs."""

    @property
    def size(self) -> str:
        """The number of runs in words."""
        most = "at most " if self.at_most else ""
        tests = f" ({self.perturbed_runs:,} for stability)" if self.perturbed_runs else ""
        return f"{most}{counted(self.work, 'run')}{tests}"

    @property
    def perturbed_runs(self) -> int:
        """Number of runs that only test other runs."""
        return 0

    @property
    def work(self) -> int:
        """Number of runs that progress counts, including runs that only test other runs."""
        return self.runs

    @property
    def expected(self) -> Expected | None:
        """Expected number of runs, if `work` is only an upper bound; None if it is known."""
        return None

    @property
    def at_most(self) -> bool:
        """True if `work` is an upper bound; the actual number of runs is known at the end."""
        return self.expected is not None

    @property
    def aside(self) -> int:
        """Approximate number of sliding runs, which the progress count excludes."""
        return self.slide_runs if self.expected is None else self.expected.slides

    @property
    def slide_runs(self) -> int:
        """Number of further runs, of sliding blocks, at most; they are not among those that `work` counts."""
        return 0

    @property
    def all_runs(self) -> int:
        """Maximum number of runs that are kept in the study's folder, including runs of sliding blocks."""
        return self.work + self.slide_runs

    @property
    def seconds_of_slides(self) -> float:
        """Approximate time of these runs on one core, by the generous planning figures of the engine."""
        if not self.slide_runs:
            return 0.0
        samples = [record.acceleration.size for array in self.arrays for record in records(array)]
        per_sample = SECONDS_PER_PLANE_SAMPLE if self.in_plane else SECONDS_PER_SAMPLE
        return self.slide_runs * float(np.mean(samples)) * per_sample

    @property
    def curves(self) -> int:
        """Number of curves that are fitted after the runs, if they are many."""
        return 0

    def seconds_of_fits(self, threads: int) -> float:
        """The approximate time of the fits on `threads` threads."""
        return 0.0

    @property
    def kept_outputs(self) -> tuple[str, ...]:
        """The outputs that are kept of every run."""
        return ("overturned",)

    @property
    def bytes_a_run(self) -> int:
        """Bytes of the kept outputs of a run."""
        return sum(np.dtype(OUTPUTS[name].kind).itemsize for name in self.kept_outputs)

    @property
    def stored_bytes(self) -> float:
        """Approximate bytes of the variables of every run in the results."""
        return float(self.bytes_a_run * self.runs)

    @property
    def together(self) -> float:
        """Approximate number of bytes in memory at once in addition to the chunks in flight."""
        return SLAB_BYTES_A_RUN * min(self.runs, slabs.RUNS)

    @property
    def arrays_aside(self) -> Sequence[float]:
        """Approximate bytes of each further array that may be large during the run; large arrays are on the disk."""
        # (one byte for each outcome that is tested, by two further runs at least)
        return [0.5 * (self.work - self.runs)]

    @cached_property
    def room(self) -> Resources:
        """The approximate memory and disk space that the study needs."""
        plain = [record for array in self.arrays for record in records(array)]
        sizes = [part.nbytes for record in plain for part in record if isinstance(part, np.ndarray)]
        dt = float(np.mean([record.dt for record in plain]))
        cases = islice(self.cases, MOST_CASES)
        per_sample = float(np.mean([seconds_per_sample(law.oscillator(block), dt) for _, block, law in cases]))
        samples = sum(record.acceleration.size for record in plain)
        return Resources.of(
            self.work * samples / len(plain) * per_sample,
            float(self.bytes_a_run * self.work),
            self.stored_bytes,
            # (a motion as read, its times, as run; and for the longest, measures and a copy for each thread)
            self.together + 3.0 * sum(sizes) + (MEASURING + thread_count()) * max(sizes),
            self.arrays_aside,
        )

    @property
    @abstractmethod
    def of_each_law(self) -> list[Oscillator]:
        """An oscillator of each law: the engine is prepared with them."""

    @property
    @abstractmethod
    def cases(self) -> Iterable[tuple[str, Block, Law]]:
        """The blocks that rock with their laws, which decide the cost of a run, and the keys that give the laws."""

    @property
    def may_slide(self) -> bool:
        """True if blocks of the study are also run as sliding blocks, by an engine of their own."""
        return False

    @property
    def in_plane(self) -> bool:
        """True if both horizontal components act on blocks."""
        return any(shakes_of(array) in (BOTH_AXES, WEAK_AXIS) for array in self.arrays)

    def prepare(self) -> None:
        """Load the engine's kernels that the runs need, or compile them: before the work, not in its threads."""
        prepare(self.of_each_law, self.may_slide, self.may_slide and self.in_plane)

    @property
    @abstractmethod
    def doubts(self) -> list[Doubt]:
        """The input warnings: values that look like a slip of units, an offset or a drift."""

    @property
    @abstractmethod
    def squat(self) -> list[Fact]:
        """Notes on blocks that slide or bounce rather than rock."""

    @property
    @abstractmethod
    def reading(self) -> Reading:
        """Processing of records, and scenario of the motions."""

    @property
    def accepted(self) -> list[str]:
        """The kinds of input warnings that the study file accepts."""
        return [str(kind) for kind in self.configuration.get("accept", [])]

    @property
    def facts(self) -> list[Fact]:
        """Notes for a user before any run."""
        doubts = doubted(doubt.sentence for doubt in self.doubts if doubt.kind not in self.accepted)
        readings = self.reading, *(branch.reading for branch in self.further.values())
        taken = taken_facts(dict.fromkeys(record for reading in readings for record in reading.taken))
        built = *stiffness_notes(self.configuration), *strength_notes(self.configuration)
        return [*self.squat, *built, *doubts, *taken, *self._hazard_facts()]

    def _hazard_facts(self) -> list[Fact]:
        """Return the fact of the hazard curve: what was read of its file, and its levels."""
        hazard = self.site_hazard
        if hazard is None:
            return []
        levels = {f"{years:.0f}": level_at(hazard, 1.0 / years) for years in RETURN_PERIODS}
        known = {years: value_in(level, hazard.units) for years, level in levels.items() if not math.isnan(level)}
        names, number = (measure_name(hazard.measure.label), hazard.source), len(self.configuration.get("hazards", []))
        more = {"levels": known}
        if len(known) < len(levels):  # (the ends of the curve show wrong levels or rates, too)
            ends = ((hazard.rates[k], hazard.levels[k]) for k in (0, -1))
            more["ends"] = {about_years(rate): value_in(level, hazard.units) for rate, level in ends}
        return [Fact("hazard.given", 1 + number, names=names, more=more)]

    @property
    def further(self) -> Mapping[str, Any]:
        """The motions of branches in addition to the study's own, by name."""
        return {}

    @property
    def notes(self) -> list[str]:
        """Notes for a user before any run, as sentences."""
        return notes_said(self.facts)

    @property
    @abstractmethod
    def arrays(self) -> Iterable[xr.DataArray]:
        """All motions that the results depend on."""

    @property
    def both_ways(self) -> bool:
        """True if every motion is run both ways."""
        return any(REVERSE_OF in array.coords for array in self.arrays)

    @property
    def _read(self) -> list[Any]:
        """Further data that determine the results, from other files than the study file, as plain values."""
        return []

    @property
    def site_hazard(self) -> HazardCurve | None:
        """The hazard curve of the site, None if the study has none."""
        return None

    @abstractmethod
    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Compute the results of the study."""

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        client: Workers = None,
        resume: bool = True,
        *,
        progress: Callable[[int, int], None] | None = None,
        watching: Callable[[Watch], None] | None = None,
    ) -> xr.Dataset:
        """Run the study.

        Every chunk (about a second of work) is kept in `out` as it is finished. After a kill, a crash or a full disk
        the same call computes the missing chunks and gives bit-identical results. One process at a time works in a
        folder.

        Parameters
        ----------
        out : path, optional
            Folder that gets ``results.nc`` and ``run.log`` (made if missing); nothing is written if not given.
        client : distributed.Client or Runner, optional
            Cluster or runner that computes the runs; by default threads of this process.
        resume : bool
            Keep the parts of this study in `out` instead of computing them again, and refuse a folder of another study.
            With False, compute everything and replace the content of the folder.
        progress : callable, optional
            Called with (runs done, runs in all).
        watching : callable, optional
            Called once, when the work begins, with its `Watch`: rate, share skipped, slowest chunk.

        Returns
        -------
        xarray.Dataset
            The results of this kind of study (the page of results lists the variables), with its configuration and the
            package versions as attributes; no clock values.

        Raises
        ------
        StudyError
            `out` cannot be written or has too little room, or another process runs a study there. Or it has another
            study's results or parts, or results that were edited, and `resume` is set.
        ClusterError
            The cluster cannot do the work, or no longer.
        TypeError
            `progress` or `watching` is no function.
        KeyboardInterrupt
            Interrupted (SIGINT, SIGTERM, SIGHUP): chunks in flight were finished and kept, if they take no more than
            about 2 s; a second signal leaves them.
        """
        checks.callback("progress", progress)
        checks.callback("watching", watching)
        if out is None:
            computed = self._labelled(self._runner(client, never), progress)
            return sealed(computed.assign_attrs(processor=engine_identity()["processor"]))
        folder = Path(out)
        stop = Stop()
        with folder_of_one(folder), stop.graceful():
            refuse_folder(folder / RESULT_NAME)
            # shards of this study are newer than results in its folder: begun with resume=False, or just finished
            whole = resume and not belongs(folder, self.identity)
            target = folder / RESULT_NAME
            before = finished(target, self.identity, self.configuration) if whole else None
            if before is not None:
                state = content_state(before)
                if state == EDITED:
                    raise StudyError(f"{target}: was {state}; move it away, or use --fresh to compute it again")
                # (with what keys decide now that are no part of the identity)
                named = self._named
                same = before.attrs.get("study") == named["study"]
                present = with_present_names(before)
                results = (present if same else ordered(self._decided(present))).assign_attrs(named, schema=SCHEMA)
                if results.attrs == before.attrs:
                    remove_leftover_shards(folder)
                    return before
                # (what was never sealed may have been edited)
                results = sealed(results) if state == AS_WRITTEN else results
            else:
                refuse_shortage(folder, self.room, resume)
                results = sealed(self._kept(folder, client, stop, not resume, progress, watching))
            try:
                save(results, folder / RESULT_NAME)
            except KeyboardInterrupt:
                raise Interrupted(
                    stop.number,
                    f"interrupted while the results were written, all runs are kept in {folder}; the same command"
                    f"{'' if resume else ' without --fresh'} goes on",
                ) from None
            try:
                remove_shards(folder)
            except StudyError as error:
                raise StudyError(f"{folder / RESULT_NAME}: is written, but {error}; remove it yourself") from None
        return results

    def refuse_occupied(self, folder: Path) -> None:
        """Raise a StudyError if a folder contains the results or parts of another study."""
        if not belongs(folder, self.identity):
            finished(folder / RESULT_NAME, self.identity, self.configuration)
        refuse_other(folder, self._pinned)

    @property
    def _pinned(self) -> dict[str, Any]:
        kept = {"identity": self.identity, "title": self.title, "study": self.configuration}
        return {**kept, "work": self.all_runs, MOST_RUNS: self.at_most}

    def _kept(
        self,
        folder: Path,
        client: Workers,
        stop: Stop,
        fresh: bool,
        progress: Progress | None,
        watching: Callable[[Watch], None] | None,
    ) -> xr.Dataset:
        """Compute the results of the study, and keep every chunk in the folder as it is finished."""
        shards, resumed = open_shards(folder, self._pinned, fresh)
        with run_log(folder) as log:
            watch = Watch(self.all_runs, log, self.at_most)
            log.info("%s %s: %s, %s", "resumed" if resumed else "begun", self.title, self.words, engine_identity())
            if watching is not None:
                watching(watch)
            try:
                results = self._labelled(Shards(shards, self._runner(client, stop), watch, stop), progress)
                results = results.assign_attrs(processor=engine_identity()["processor"])
            except KeyboardInterrupt:
                log.warning("interrupted: %s", watch.words)
                # of runs kept before, a study that runs wave by wave may not have reached all yet
                manifest = read_manifest(folder)
                runs = watch.runs if manifest is None else kept_runs(folder, manifest)[1]
                kept = f"{watch.count_of(runs)} kept in {folder}"
                how = " without --fresh" if fresh else ""
                raise Interrupted(stop.number, f"interrupted with {kept}; the same command{how} goes on") from None
            except BaseException as error:
                log.error("ended by %s (%s): %s", type(error).__name__, error, watch.words)
                raise
            log.info("finished: %s", f"{watch.runs:,} runs, {watch.pace}")
        return results

    def _runner(self, client: Workers, stop: Callable[[], bool]) -> Runner:
        """Return the runner of the chunks; workers generate the motions themselves if no file is needed."""
        if isinstance(client, Runner):
            return client
        client = default_client() if client is None else client
        if client is None:
            return ConfiguredScheduler(stop)
        return cluster(client, self.configuration, self._digests, stop, self.both_ways)

    def _labelled(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        try:
            with noted():  # warnings on motions are among the notes
                results = self._compute(client, progress)
        except ValueError as error:
            client.refused(str(error))
            raise StudyError(f"{self.title}: {error}") from None
        lines = {
            "processing": self.reading.processing,
            "scenario": self.reading.scenario,
            "storeys": self.reading.storeys,
        }
        read = {name: "\n".join(text) for name, text in lines.items() if text}
        varied = self.reading.variability
        if varied is not None and varied.freedom:
            read["spectral_variability"] = json.dumps(varied)
        if self.site_hazard is not None:
            # (where the curve came from does not change it)
            curve = json.dumps({**asdict(self.site_hazard), "source": ""}, sort_keys=True).encode()
            read["hazard_sha256"] = hashlib.sha256(curve).hexdigest()
        return ordered(results).assign_attrs(
            **self._named, **read, kind=self.results_are_of or self.kind, identity=self.identity
        )

    def _decided(self, results: xr.Dataset) -> xr.Dataset:
        """Return results with the values of `DECISIONS` computed from them, instead of earlier values."""
        return results

    @property
    def _named(self) -> dict[str, str]:
        """The attributes that title, accepted input warnings, cover and `DECISIONS` determine."""
        return {
            INPUT_NOTES: stored(self.facts),
            "doubts": json.dumps(
                [[*doubt[:2], doubt.kind in self.accepted] for doubt in self.doubts if not doubt.settled],
                ensure_ascii=False,
            ),
            "title": self.title,
            "study": json.dumps(self.configuration, ensure_ascii=False, sort_keys=True),
        }

    @cached_property
    def identity(self) -> str:
        """Hashes of all that decides the runs: of the tables and the version, and of the motions' samples."""
        content = identifying(self.configuration)
        inputs = hashlib.sha256(json.dumps([__version__, content, self._read], sort_keys=True).encode())
        digest_of_all = hashlib.sha256()
        plain = (record for array in self.arrays for record in records(array))
        for record, samples in zip(plain, self._digests, strict=True):
            digest_of_all.update(json.dumps([record.label, record.source, samples]).encode())
        return f"{inputs.hexdigest()[:32]}-{digest_of_all.hexdigest()[:32]}"

    @cached_property
    def _digests(self) -> list[str]:
        """The digest of the samples of each motion."""
        return [digest(record) for array in self.arrays for record in records(array)]


def study_of(read: Callable[[], StudyFile], file: Path) -> Study:
    """Return the study of the content that `read` returns; paths in it are relative to `file`, named in errors."""
    try:
        with noted() as doubts_read:
            content = read()
            module = import_module(f".{content.kind}", __package__)
            study: Study = getattr(module, f"{content.kind.title()}Study").of(content, file.parent)
        # (those of motions are among the study's own)
        of_files = (doubt for doubt in doubts_read if doubt.kind in OF_TABLES)
        tables = tuple(dict.fromkeys([*of_files, *key_doubts(content)]))
        study = replace(study, of_tables=tables) if tables else study
        study._check_vertical()
        # (of a motion of each array: the analysis looks at all of them)
        firsts = (record for array in study.arrays for record in records(array.isel(motion=slice(1))))
        refuse_endless_runs(study.cases, firsts)
        for doubt in study.doubts:
            if doubt.grave and doubt.kind not in study.accepted:
                raise ValueError(
                    f'{doubt.sentence} (accept = ["{doubt.kind}"] at the top of the study file takes it as it is)'
                )
    except StudyError:
        raise
    except (ValueError, ArithmeticError) as error:
        raise StudyError(f"{file}: {error}") from None
    return study


LOGNORMAL = Fit()


@dataclass(frozen=True)
class BlockStudy(Study):
    """A study of known or uncertain blocks under the motions of a design.

    `friction` and `undecided` (share of the motions) are for the validity screen.
    """

    blocks: tuple[Block, ...]
    models: tuple[Law, ...]
    design: Design
    risk: Risk | None = None
    fit: Fit = LOGNORMAL
    friction: Friction | Mapping[str, Friction] | None = None
    undecided: float = UNDECIDED

    def _check(self, content: StudyFile, laws: Sequence[Law] | None = None) -> None:
        """Raise a ValueError if blocks, laws, motions, levels and hazard do not go together."""
        check_laws(content, self.blocks, self.models if laws is None else laws)
        self.design.check(self.blocks)
        if self.risk is not None:
            self.risk.check(self.design, content.motions.given("floors_file") is not None)

    @property
    def pairs_words(self) -> str:
        """The numbers of blocks and laws in words."""
        return f"{counted(len(self.blocks), 'block')} × {counted(len(self.models), 'law')}"

    @property
    def perturbed_runs(self) -> int:
        return self.design.tested(self.undecided) * self._tests

    @property
    def _tests(self) -> int:
        """Number of runs that test an outcome under every law of every block."""
        return perturbed_runs(len(self.blocks), self.models, 1, 1, 1.0, axes=self.design.about)

    @property
    def work(self) -> int:
        return self.runs * self.design.about + self.perturbed_runs

    @property
    def of_each_law(self) -> list[Oscillator]:
        return [model.oscillator(self.blocks[0]) for model in self.models]

    @property
    def cases(self) -> Iterable[tuple[str, Block, Law]]:
        return ((f"models[{i}]", block, law) for block in self.blocks for i, law in enumerate(self.models, start=1))

    @property
    def site_hazard(self) -> HazardCurve | None:
        return None if self.risk is None else self.risk.hazard

    @property
    def squat(self) -> list[Fact]:
        return [*squat_facts(self.blocks), *scene_facts(self.blocks)]

    @property
    def doubts(self) -> list[Doubt]:
        of_risk = [] if self.risk is None else hazard_doubts(self.risk.hazard)
        of_laws = stated_restitution_doubts(self.models)
        if isinstance(self.design, Cloud):
            of_laws += still_doubts(self.blocks, (float(np.abs(array.values).max()) for array in self.arrays))
        return [*self.of_tables, *self.of_blocks, *of_laws, *self.design.doubts, *of_risk]

    @property
    def of_blocks(self) -> list[Doubt]:
        """The input warnings on the sizes of blocks and on their restraints."""
        return block_doubts(self.blocks)

    @property
    def reading(self) -> Reading:
        return self.design.reading

    @property
    def arrays(self) -> Iterable[xr.DataArray]:
        return (*self.design.arrays, *self.design.below)

    @property
    def _read(self) -> list[Any]:
        hazard = [] if self.risk is None else [asdict(self.risk.hazard)]
        from_file = "blocks_file" in self.configuration
        return [*hazard, *([list(astuple(block)) for block in self.blocks] if from_file else [])]


def screening_of(content: StudyFile) -> tuple[Friction | None, float]:
    """Return the friction and the share of the motions to be tested that a study file asks for."""
    friction = None if content.friction is None else content.friction.build().friction
    tested = None if content.screen is None else content.screen.undecided
    return friction, UNDECIDED if tested is None else tested


def perturbed_words(runs: int) -> str:
    """Return the end of the words on a study's size: the further runs under perturbations, if there are any."""
    return f", plus {runs:,} with a change of one millionth, to test whether outcomes are stable" if runs else ""


def plain(content: StudyFile) -> dict[str, Any]:
    """Return a study file as plain values."""
    values: dict[str, Any] = content.model_dump(mode="json", by_alias=True, exclude_none=True)
    return values


def blocks_of(content: StudyFile, folder: Path, most: int = MOST_BLOCKS) -> tuple[Block, ...]:
    """Make the blocks of a study, from its file or its blocks_file; ValueError for wrong blocks or more than `most`."""
    if content.blocks_file is None:
        blocks = each("blocks", content.blocks or [], restraints_of(content))
    else:
        blocks = read_blocks(folder / content.blocks_file, restraints_of(content))
        if len(blocks) > most:
            raise ValueError(f"blocks_file: a study of this kind holds at most {most:,} blocks, got {len(blocks):,}")
    near = next((block.label for block in blocks if block.edge is not None), None)
    if near is not None and content.kind not in ("fragility", "sequential"):
        raise ValueError(
            f"edge_distance_mm is for fragility studies: {with_article(content.kind)} study does not let {near!r} slide"
        )
    return blocks


def restraints_of(content: StudyFile) -> dict[str, Restraint]:
    """Make the restraints of a study by name; an error names the table."""
    restraints = {}
    for name, table in (content.restraints or {}).items():
        try:
            restraints[name] = table.build()
        except ValueError as error:
            raise ValueError(f"restraints.{name}: {error}") from None
    return restraints


def parts_of(content: StudyFile, folder: Path, blocks: tuple[Block, ...], key: str = "", each_of: str = "") -> Any:
    """Return the parts that all studies of blocks have.

    key: a table that needs the motions of one floor at the same levels, for each of its values or samples.
    """
    models = each("models", content.models, *([] if key else [blocks]))
    design = content.design(folder, content.both_ways(blocks))
    if key and not isinstance(design, Incremental):
        raise ValueError(f"{key} needs ida: the same motions at the same levels for every {each_of}")
    if key:
        check_one_floor(design, key)
    risk = None if content.hazard is None else content.hazard.risk(design.im, folder)
    return {
        "title": content.title,
        "configuration": plain(content),
        "blocks": blocks,
        "models": models,
        "design": design,
        "risk": risk,
    }


def check_one_floor(design: Design, key: str) -> None:
    """Raise a ValueError if a study with the table `key` has the motions of several floors."""
    if any(array.sizes.get("floor", 1) > 1 for array in design.arrays) or len(design.floors) > 1:
        raise ValueError(f"{key} needs the motions of one floor, got several")


def check_laws(content: StudyFile, blocks: Iterable[Block], laws: Sequence[Law]) -> None:
    """Raise a ValueError that names the block and the law if a law does not apply to a block."""
    where = "blocks" if content.blocks_file is None else "blocks_file"
    sentences = []
    for block in blocks:
        for law in laws:
            try:
                law.oscillator(block)
            except ValueError as error:
                sentences.append(f"{where}: {block.label!r} under {law.label}: {error}")
    if sentences:
        raise ValueError(all_errors(sentences))


def each(name: str, tables: Iterable[Any], *needed: Any) -> tuple[Any, ...]:
    """Build each table, from the other objects that it needs; an error names the table."""
    built, wrong = [], []
    for i, table in enumerate(tables, start=1):
        try:
            built.append(table.build(*needed))
        except ValueError as error:
            wrong.append(f"{name}[{i}]: {error}")
    if wrong:
        raise ValueError(all_errors(wrong))
    taken: dict[str, int] = {}
    for i, value in enumerate(built, start=1):
        if value.label in taken:
            raise ValueError(f"{name}[{i}]: the label {value.label!r} is taken by {name}[{taken[value.label]}]")
        taken[value.label] = i
    return tuple(built)
