"""A study: what a study file describes, and running it into one result dataset."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from ..fragility import block_notes, fit_fragility, notes, overturning_probability, screen
from ..fragility.perturbed import perturbed_runs
from ..models import Block, Law
from ..models.friction import Friction
from ..motions import records
from .designs import Design
from .schema import StudyFile, read_study_file
from .tables import StudyError

if TYPE_CHECKING:
    from distributed import Client

RESULT_NAME = "results.nc"
# Share of the motions whose flags are tested under perturbations: some 30 % more work.
UNDECIDED = 0.08
__version__ = metadata.version("toppling")


@dataclass(frozen=True)
class Study:
    """Blocks x damping laws x motions, ready to run.

    Made by `Study.from_toml`; `design` says what is done with which motions, `configuration` is the study file's
    content as plain values; `friction` and `undecided` (share of the motions) are for the validity screen.
    """

    title: str
    blocks: tuple[Block, ...]
    models: tuple[Law, ...]
    design: Design
    configuration: dict[str, Any]
    friction: Friction | None = None
    undecided: float = UNDECIDED

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Study:
        """The study in a TOML file; record paths in it are relative to the file.

        Raises
        ------
        StudyError
            One sentence that names the file, the key, the value and what is allowed.
        """
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be a path, got {type(path).__name__}")
        file = Path(path)
        content = read_study_file(file)
        screening = content.screen
        try:
            study = cls(
                content.title,
                tuple(_each("blocks", content.blocks)),
                tuple(_each("models", content.models)),
                content.design(file.parent),
                _plain(content),
                None if screening is None else screening.build(),
                UNDECIDED if screening is None or screening.undecided is None else screening.undecided,
            )
            # what only blocks, laws, motions and levels together can get wrong is said before the work, not during it
            for block in study.blocks:
                for model in study.models:
                    model.oscillator(block)
            study.design.check(study.blocks)
        except (ValueError, ArithmeticError) as error:
            raise StudyError(f"{file}: {error}") from None
        return study

    @property
    def runs(self) -> int:
        """Number of runs: blocks x laws x those of the design."""
        return len(self.blocks) * len(self.models) * self.design.runs

    @property
    def perturbed_runs(self) -> int:
        """Number of further runs that tell which flags are undecided."""
        if self.undecided == 0.0:
            return 0
        each = self.design.runs // self.design.shakes
        return perturbed_runs(len(self.blocks), self.models, each, self.design.shakes, self.undecided)

    @property
    def notes(self) -> list[str]:
        """What a user should know of the blocks before anything runs: one sentence each."""
        return block_notes(self.blocks)

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        client: Client | None = None,
        resume: bool = True,
        *,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """Run the study.

        Parameters
        ----------
        out : path, optional
            Folder that gets ``results.nc`` (made where missing); nothing is written where not given.
        client : distributed.Client, optional
            Where to run; threads of this process where not given.
        resume : bool
            Keep finished results of this study in `out` instead of computing them again, and refuse a folder with
            another study's.  With False, compute and replace whatever is there.
        progress : callable, optional
            Called with (runs done, runs in all).

        Returns
        -------
        xarray.Dataset
            overturned and peak_rotation of every run, its validity screen, probabilities with intervals and fitted
            fragility curves, with the study's configuration and the package versions as attributes; no clock values.

        Raises
        ------
        StudyError
            `out` cannot be written, or holds another study's results and `resume` is set.
        """
        if out is None:
            return self._compute(client, progress)
        folder = Path(out)
        before = self._finished(folder / RESULT_NAME) if resume else None
        if before is not None and before.attrs.get("title") == self.title:
            return before
        made = not folder.exists()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StudyError(f"{folder}: cannot be made a folder ({error.strerror})") from None
        if not os.access(folder, os.W_OK):
            raise StudyError(f"{folder}: no permission to write")
        try:
            results = self._compute(client, progress) if before is None else before.assign_attrs(title=self.title)
            save(results, folder / RESULT_NAME)
        except BaseException:
            if made:
                with suppress(OSError):  # not empty: another run's
                    folder.rmdir()
            raise
        return results

    def _compute(self, client: Client | None, progress: Callable[[int, int], None] | None) -> xr.Dataset:
        total = self.runs + self.perturbed_runs
        results = self.design.run(
            self.blocks,
            self.models,
            ("overturned", "peak_rotation"),
            client,
            None if progress is None else lambda done, _: progress(done, total),
        )
        screened = screen(
            results,
            self.design.motions,
            self.friction,
            undecided=self.undecided,
            client=client,
            progress=None if progress is None else lambda done, _: progress(self.runs + done, total),
        )
        probabilities = overturning_probability(results)
        curves = fit_fragility(probabilities)
        if "floor" in probabilities.dims:  # the dimension takes the name
            results = results.rename(floor="motion_floor")
        return results.assign({**probabilities.data_vars, **curves.data_vars, **screened.data_vars}).assign_attrs(
            title=self.title,
            study=json.dumps(self.configuration, ensure_ascii=False, sort_keys=True),
            identity=self.identity,
            fit_method=curves.attrs["method"],
            confidence=curves.attrs["confidence"],
            screen=screened.attrs["screen"],
            notes="\n".join(notes(screened)),
        )

    @cached_property
    def identity(self) -> str:
        """What decides the results, as a hash: the study without its title, the motions' samples, our version."""
        content = {key: value for key, value in self.configuration.items() if key != "title"}
        digest = hashlib.sha256(json.dumps([__version__, content], sort_keys=True).encode())
        for record in (record for array in (*self.design.arrays, *self.design.below) for record in records(array)):
            digest.update(json.dumps([record.label, record.dt, record.source]).encode())
            digest.update(record.acceleration.tobytes())
        return digest.hexdigest()

    def _finished(self, target: Path) -> xr.Dataset | None:
        """The finished results of this very study, if they are there; StudyError where another's are."""
        try:
            if not target.exists():
                return None
            with xr.open_dataset(target) as stored:
                if stored.attrs.get("identity") == self.identity:
                    return stored.load()
        except (OSError, ValueError) as error:
            if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
                raise StudyError(f"{target}: the name is too long") from None
            raise StudyError(f"{target}: exists and is no result file; move it away or use --fresh") from None
        raise StudyError(f"{target}: holds the results of another study; use another folder or --fresh")


def save(results: xr.Dataset, target: Path) -> None:
    """Write a dataset whole or not at all: temporary file beside the target, fsync, rename."""
    temporary = target.with_name(f"{target.name}.{os.getpid()}.part")
    try:
        results.to_netcdf(temporary, engine="netcdf4")
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(target)
    except (OSError, RuntimeError) as error:  # the HDF5 library speaks of a full disk as a RuntimeError
        reason = getattr(error, "strerror", None) or error
        raise StudyError(f"{target}: cannot be written ({reason}; is the disk full?)") from None
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _plain(content: StudyFile) -> dict[str, Any]:
    plain: dict[str, Any] = content.model_dump(mode="json", by_alias=True, exclude_none=True)
    return plain


def _each(name: str, tables: list[Any]) -> list[Any]:
    """Build each table; an error says which one."""
    built = []
    for i, table in enumerate(tables, start=1):
        try:
            built.append(table.build())
        except ValueError as error:
            raise ValueError(f"{name}[{i}]: {error}") from None
    labels = [value.label for value in built]
    for i, label in enumerate(labels, start=1):
        if labels.index(label) != i - 1:
            raise ValueError(f"{name}[{i}]: the label {label!r} is taken by {name}[{labels.index(label) + 1}]")
    return built
