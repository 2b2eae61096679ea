"""A study: what a study file describes, and running it into one result dataset."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility import fit_fragility, ida, overturning_probability
from ..fragility.scaling import scaling
from ..models import Block, Law
from ..motions import records
from .schema import StudyError, StudyFile, read_study_file

if TYPE_CHECKING:
    from distributed import Client

RESULT_NAME = "results.nc"


@dataclass(frozen=True)
class Study:
    """Blocks x damping laws x motions x levels, ready to run.

    Made by `Study.from_toml`; `configuration` is the study file's content as plain values.
    """

    title: str
    blocks: tuple[Block, ...]
    models: tuple[Law, ...]
    motions: tuple[xr.DataArray, ...]
    levels: NDArray[np.float64]
    im: str
    configuration: dict[str, Any]

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Study:
        """The study in a TOML file; record paths in it are relative to the file.

        Raises
        ------
        StudyError
            One sentence that names the file, the key, the value and what is allowed.
        """
        file = Path(path)
        content = read_study_file(file)
        try:
            study = cls(
                content.title,
                tuple(_each("blocks", content.blocks)),
                tuple(_each("models", content.models)),
                tuple(content.motions.build(file.parent)),
                content.ida.levels.build(content.ida.im),
                content.ida.im,
                _plain(content),
            )
            # what only blocks, laws, motions and levels together can get wrong is said before the work, not during it
            for block in study.blocks:
                for model in study.models:
                    model.oscillator(block)
            scaling(study.levels, records(study.motions), study.im)
        except ValueError as error:
            raise StudyError(f"{file}: {error}") from None
        return study

    @property
    def runs(self) -> int:
        """Number of runs: blocks x laws x motions x levels."""
        motions = sum(array.sizes["motion"] for array in self.motions)
        return len(self.blocks) * len(self.models) * motions * self.levels.size

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        client: Client | None = None,
        *,
        fresh: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> xr.Dataset:
        """Run the study.

        Parameters
        ----------
        out : path, optional
            Folder that gets ``results.nc`` (made where missing); nothing is written where not given.
        client : distributed.Client, optional
            Where to run; threads of this process where not given.
        fresh : bool
            Replace the results of another study in `out`.
        progress : callable, optional
            Called with (runs done, runs in all).

        Returns
        -------
        xarray.Dataset
            overturned and peak_rotation of every run, probabilities with intervals and fitted fragility curves, with
            the study's configuration and the package versions as attributes; no clock values.

        Raises
        ------
        StudyError
            `out` cannot be written, or holds another study's results and `fresh` is not set.
        """
        target = None if out is None else self._target(Path(out), fresh)
        results = ida(self.blocks, self.models, self.motions, self.levels, self.im, client=client, progress=progress)
        probabilities = overturning_probability(results)
        curves = fit_fragility(probabilities)
        merged = results.assign({**probabilities.data_vars, **curves.data_vars})
        merged = merged.assign_attrs(
            title=self.title,
            study=self._identity(),
            fit_method=curves.attrs["method"],
            confidence=curves.attrs["confidence"],
        )
        if target is not None:
            save(merged, target)
        return merged

    def _identity(self) -> str:
        return json.dumps(self.configuration, ensure_ascii=False, sort_keys=True)

    def _target(self, out: Path, fresh: bool) -> Path:
        """The result file to write, checked before the work rather than after it."""
        target = out / RESULT_NAME
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StudyError(f"{out}: cannot be made a folder ({error.strerror})") from None
        if not os.access(out, os.W_OK):
            raise StudyError(f"{out}: no permission to write")
        if target.exists() and not fresh:
            try:
                with xr.open_dataset(target) as before:
                    same = before.attrs.get("study") == self._identity()
            except (OSError, ValueError):
                raise StudyError(f"{target}: exists and is no result file; move it away or use --fresh") from None
            if not same:
                raise StudyError(f"{target}: holds the results of another study; use another folder or --fresh")
        return target


def save(results: xr.Dataset, target: Path) -> None:
    """Write a dataset whole or not at all: temporary file beside the target, fsync, rename."""
    temporary = target.with_name(target.name + ".part")
    try:
        results.to_netcdf(temporary, engine="netcdf4")
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(target)
    except OSError as error:
        raise StudyError(f"{target}: cannot be written ({error.strerror or error})") from None
    finally:
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
