"""A study: what a study file describes, ready to run into one result dataset.

What the kinds of studies share stands here; each kind has a file of its own.
"""

from __future__ import annotations

import hashlib
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import xarray as xr

from ..models.oscillator import Oscillator
from ..motions import records
from .schema import StudyFile, read_study_file
from .store import RESULT_NAME, finished, save
from .tables import StudyError

if TYPE_CHECKING:
    from distributed import Client

Progress = Callable[[int, int], None]
__version__ = metadata.version("toppling")


@dataclass(frozen=True)
class Study(ABC):
    """A study, ready to run.

    Made by `Study.from_toml`, as the kind that the file asks for; `configuration` is the file's content as plain
    values.
    """

    title: str
    configuration: dict[str, Any]
    kind: ClassVar[str]
    _kinds: ClassVar[dict[str, type[Study]]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        Study._kinds[cls.kind] = cls

    @staticmethod
    def from_toml(path: str | os.PathLike[str]) -> Study:
        """The study in a TOML file; paths in it are relative to the file.

        Raises
        ------
        StudyError
            One sentence that names the file, the key, the value and what is allowed.
        """
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be a path, got {type(path).__name__}")
        file = Path(path)
        content = read_study_file(file)
        try:
            return Study._kinds[content.kind].of(content, file.parent)
        except StudyError:
            raise
        except (ValueError, ArithmeticError) as error:
            raise StudyError(f"{file}: {error}") from None

    @classmethod
    @abstractmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        """The study that a file in `folder` describes; ValueError for all that would only be found when it runs."""

    @property
    @abstractmethod
    def words(self) -> str:
        """Its size for people."""

    @property
    @abstractmethod
    def runs(self) -> int:
        """Number of runs."""

    @property
    def work(self) -> int:
        """Number of runs that it takes, those that only test others included: what progress counts."""
        return self.runs

    @property
    @abstractmethod
    def first(self) -> Oscillator:
        """One of its oscillators, with which the engine is made ready."""

    @property
    @abstractmethod
    def notes(self) -> list[str]:
        """What a user should know before anything runs: one sentence each."""

    @property
    @abstractmethod
    def _arrays(self) -> Iterable[xr.DataArray]:
        """All motions that decide the results."""

    @property
    def _read(self) -> list[Any]:
        """What else decides the results and stands in files beside the study's, as plain values."""
        return []

    @abstractmethod
    def _compute(self, client: Client | None, progress: Progress | None) -> xr.Dataset:
        """What the study finds."""

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
            What its kind of study finds (docs/study.md lists every variable), with the study's configuration and the
            package versions as attributes; no clock values.

        Raises
        ------
        StudyError
            `out` cannot be written, or holds another study's results and `resume` is set.
        """
        if out is None:
            return self._labelled(client, progress)
        folder = Path(out)
        before = finished(folder / RESULT_NAME, self.identity) if resume else None
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
            results = self._labelled(client, progress) if before is None else before.assign_attrs(title=self.title)
            save(results, folder / RESULT_NAME)
        except BaseException:
            if made:
                with suppress(OSError):  # not empty: another run's
                    folder.rmdir()
            raise
        return results

    def _labelled(self, client: Client | None, progress: Progress | None) -> xr.Dataset:
        try:
            found = self._compute(client, progress)
        except ValueError as error:
            raise StudyError(f"{self.title}: {error}") from None
        return found.assign_attrs(
            title=self.title,
            kind=self.kind,
            study=json.dumps(self.configuration, ensure_ascii=False, sort_keys=True),
            identity=self.identity,
        )

    @cached_property
    def identity(self) -> str:
        """What decides the results, as a hash: the study without its title, the motions' samples, our version."""
        content = {key: value for key, value in self.configuration.items() if key != "title"}
        digest = hashlib.sha256(json.dumps([__version__, content, self._read], sort_keys=True).encode())
        for record in (record for array in self._arrays for record in records(array)):
            digest.update(json.dumps([record.label, record.dt, record.source]).encode())
            digest.update(record.acceleration.tobytes())
        return digest.hexdigest()


def part_of(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Progress of a part that begins after so many runs of all."""
    return None if progress is None else lambda done, _: progress(before + done, total)


def plain(content: StudyFile) -> dict[str, Any]:
    """A study file as plain values."""
    found: dict[str, Any] = content.model_dump(mode="json", by_alias=True, exclude_none=True)
    return found


def each(name: str, tables: Iterable[Any]) -> tuple[Any, ...]:
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
    return tuple(built)
