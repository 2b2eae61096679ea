"""Where the results of a side lie: its folder, its result file, or those of a study file."""

from __future__ import annotations

import shlex
from pathlib import Path

from ..kinds.study import Study
from ..store.differences import makes_motions, same_inputs
from ..store.folder import RESULT_NAME, UNREADABLE, is_locked
from ..store.manifest import read_manifest
from ..store.netcdf import opened
from ..text.error import StudyError

STUDY_FILE = ".toml"


def result_of(path: Path) -> Path:
    """Return the result file of a finished, unchanged study, given its folder, its result file or its study file."""
    if path.suffix == STUDY_FILE and path.is_file():
        return _of_study_file(path)
    if not path.is_dir():
        return path
    _refuse_unfinished(path, path)
    if not (path / RESULT_NAME).exists():
        raise StudyError(f"{path}: holds no results of a study ({RESULT_NAME})")
    return path / RESULT_NAME


def _of_study_file(file: Path) -> Path:
    """Return the results that `toppling run` writes for a study file where no other folder is named."""
    folder = Path("results") / file.stem
    run = f"toppling run {shlex.quote(str(file))}"
    named = "or name the folder of its results"
    if folder.is_dir():
        _refuse_unfinished(file, folder)
    target = folder / RESULT_NAME
    study = Study.from_toml(file)
    if not target.exists():
        raise StudyError(f"{file}: has no results in {folder}: {run} computes them, {named}")
    try:
        with opened(target) as stored:
            theirs = str(stored.attrs.get("identity"))
    except (*UNREADABLE, RuntimeError):
        return target  # (its reader says what is wrong with it)
    same = theirs == study.identity or (same_inputs(theirs, study.identity) and makes_motions(study.configuration))
    if not same:
        raise StudyError(
            f"{file}: is not the study of the results in {folder}, or was changed since: {run} --fresh computes them "
            f"again, {named}"
        )
    return target


def _refuse_unfinished(said: Path, folder: Path) -> None:
    if is_locked(folder):
        raise StudyError(f"{said}: its study is running: compare it when it is finished")
    if read_manifest(folder) is not None:
        raise StudyError(f"{said}: its study is not finished: the same toppling run goes on where it stopped")
