"""Crash safety: every finished chunk is a file of its own (a shard), and a manifest names the study of the chunks.

`shards/manifest.json` identifies the study and the engine; `shards/CALL-CHUNK-CHECKSUM.nc` contains a chunk's results.
A file is written whole (temporary name, fsync, rename), and its name contains the checksum of its bytes. A damaged file
is therefore recognised before it is parsed, and its chunk is computed again.
"""

import hashlib
import json
import math
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from time import perf_counter
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from ...core.wording import system_errors, system_reason
from ...core.writing import refuse_pipe
from ...fragility.runs.factors import BlockFactors
from ...fragility.runs.plan import Chunk, ChunkResult, Work
from ...fragility.runs.runners import Runner
from ...models.outputs import OUTPUTS
from ...models.runs import TALLY, engine_identity
from ...motions.arrays import digest
from ..text.error import StudyError
from .differences import differences, same_inputs
from .folder import removed, write_whole
from .manifest import FOLDER, LAYOUT, MANIFEST, NAME, PART, REACHED, REACHED_AFTER, REFUSED, read_manifest, refuse_link
from .watch import Stop, Watch

IN_MEMORY = 2**25
"""Largest array of all runs, in bytes, that is held in memory; a larger one is a file without a name."""
DIMS = ("oscillator", "level", "motion")


class Shards(Runner):
    """A runner that runs chunks by another runner, keeps each of them, and returns the chunks kept before."""

    def __init__(self, folder: Path, inner: Runner, watch: Watch, stop: Stop) -> None:
        self._folder = folder
        self._inner = inner
        self._watch = watch
        self._stop = stop
        self._calls = 0
        self._known: dict[tuple[int, int], list[Path]] = {}
        for path in sorted(folder.iterdir()):
            name = NAME.fullmatch(path.name)
            if name is not None:
                self._known.setdefault((int(name[1]), int(name[2])), []).append(path)
            elif PART.fullmatch(path.name):
                with suppress(OSError):
                    _remove(path)

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, ChunkResult]]:
        """Yield every chunk with its results; StudyError if a chunk cannot be kept."""
        call = self._calls
        self._calls += 1
        whole = _digest_of(work)
        numbers = {chunk: i for i, chunk in enumerate(chunks)}
        _add_call(self._folder, call, [work.runs_of(chunk) for chunk in chunks])
        self._stop.waiting = True
        try:
            missing = []
            for chunk, number in numbers.items():
                if self._stop():
                    raise KeyboardInterrupt
                done = self._kept(call, number, _key(whole, chunk), work, chunk)
                if done is None:
                    missing.append(chunk)
                else:
                    self._watch.done(done, kept=True)
                    yield chunk, done
            for chunk, done in self._inner.run(work, missing):
                self._keep(call, numbers[chunk], _key(whole, chunk), work, done)
                self._watch.done(done, kept=False)
                yield chunk, done
        finally:
            self._stop.waiting = False

    def array(self, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """Make an array for all runs, in a nameless file if large; StudyError if the disk is full."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if size <= IN_MEMORY:
            return super().array(shape, dtype)
        try:
            with tempfile.TemporaryFile(dir=self._folder) as file:
                if hasattr(os, "posix_fallocate"):  # (a disk that fills up later would end the process by a signal)
                    os.posix_fallocate(file.fileno(), 0, size)
                else:
                    file.truncate(size)
                return np.asarray(np.memmap(file, dtype, "r+", shape=shape))
        except OSError as error:
            raise StudyError(
                f"{self._folder}: has no room for {size:,} bytes of results ({system_reason(error)}); what is "
                "finished is kept: make room and run the same command again"
            ) from None

    def tell(self, what: str, done: int, total: int) -> None:
        """Report the progress of work that is not done in chunks."""
        self._watch.tell(what, done, total)

    def reached(self, what: str) -> None:
        """Keep the reached precision of an analysis in the manifest for its status, unless a repeated call has less."""
        manifest = _present(self._folder)
        before = manifest.get(REACHED_AFTER)
        if not isinstance(before, int) or self._calls > before:
            write_whole(self._folder / MANIFEST, _json({**manifest, REACHED: what, REACHED_AFTER: self._calls}))

    def refused(self, why: str) -> None:
        """Keep in the manifest, for the status, the reason why no result can be made of the runs."""
        with suppress(StudyError):  # (that sentence counts, and not where it cannot be kept)
            write_whole(self._folder / MANIFEST, _json({**_present(self._folder), REFUSED: why}))

    def _kept(self, call: int, number: int, key: str, work: Work, chunk: Chunk) -> ChunkResult | None:
        """Return the results of a chunk if there is an intact shard of it; damaged shards are removed."""
        for path in self._known.get((call, number), []):
            try:
                return _read(path, key, work, chunk)
            except (OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError) as error:  # (netCDF4's)
                self._watch.log.warning("%s is damaged (%s): its chunk is computed again", path.name, error)
                with suppress(OSError):
                    _remove(path)
        return None

    def _keep(self, call: int, number: int, key: str, work: Work, done: ChunkResult) -> None:
        started = perf_counter()
        content = _packed(work, done, key)
        checksum = hashlib.sha256(content).hexdigest()[:16]
        write_whole(self._folder / f"{call:03d}-{number:06d}-{checksum}.nc", content)
        self._watch.storing += perf_counter() - started


def open_shards(folder: Path, pinned: Mapping[str, Any], fresh: bool) -> tuple[Path, bool]:
    """Return the folder for the shards of a study, and True if it contains shards of this study already."""
    shards = folder / FOLDER
    refuse_link(shards)
    if shards.exists() and not fresh:
        if refuse_other(folder, pinned):
            return shards, True
        if any(NAME.fullmatch(path.name) for path in shards.iterdir()):
            raise StudyError(f"{shards}: holds parts of a study without a manifest; use --fresh to start over")
    remove_shards(folder, finished=False)
    with system_errors(StudyError, f"{shards}: cannot be made a folder"):
        shards.mkdir(exist_ok=True)
    write_whole(shards / MANIFEST, _json(_manifest(pinned)))
    return shards, False


def refuse_other(folder: Path, pinned: Mapping[str, Any]) -> bool:
    """Return True if a folder contains parts of the study `pinned`; StudyError if they are of another study."""
    before = read_manifest(folder)
    if before is None:
        return False
    differs = _difference(before, _manifest(pinned))
    if differs:
        raise StudyError(
            f"{folder / FOLDER}: holds parts of another study ({differs}); use another folder, or --fresh to start over"
        )
    return True


def _manifest(pinned: Mapping[str, Any]) -> dict[str, Any]:
    return {"layout": LAYOUT, "engine": engine_identity(), **pinned, "calls": []}


def belongs(folder: Path, identity: str) -> bool:
    """Return True if the folder contains parts of the study of this identity, made by this engine."""
    try:
        manifest = read_manifest(folder)
    except StudyError:
        return False
    return manifest is not None and manifest["identity"] == identity and manifest["engine"] == engine_identity()


def remove_shards(folder: Path, finished: bool = True) -> None:
    """Remove our files from the folder of shards; StudyError if this fails.

    The manifest is removed first if the study is `finished`, so that after a kill its results count; otherwise last.
    """
    shards = folder / FOLDER
    refuse_link(shards)
    if not shards.exists():
        return
    with system_errors(StudyError, f"{shards}: cannot be removed"):
        ours = [path for path in shards.iterdir() if NAME.fullmatch(path.name) or PART.fullmatch(path.name)]
        for path in sorted([*ours, shards / MANIFEST], key=lambda path: (path.name == MANIFEST) != finished):
            _remove(path)
        if not any(shards.iterdir()):  # other files are not toppling's
            shards.rmdir()


def remove_leftover_shards(folder: Path) -> None:
    """Remove shards of finished results: their process was killed after it had removed the manifest."""
    with suppress(StudyError, OSError):  # (the results count)
        if not (folder / FOLDER / MANIFEST).exists():
            remove_shards(folder)


def _remove(path: Path) -> None:
    """Remove a file, or an empty folder of the same name."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    else:
        path.unlink(missing_ok=True)


def _add_call(folder: Path, call: int, runs: Sequence[int]) -> None:
    """Add the chunks of a call to the manifest, as pairs: the number of consecutive chunks, and the runs of each."""
    manifest = _present(folder)
    refused_before = manifest.pop(REFUSED, None) is not None
    new = len(manifest["calls"]) <= call
    if new:
        manifest["calls"].append(
            {"chunks": [[len(list(equal)), runs_of_chunk] for runs_of_chunk, equal in groupby(runs)]}
        )
    if new or refused_before:
        write_whole(folder / MANIFEST, _json(manifest))


def _present(shards: Path) -> dict[str, Any]:
    """Return the manifest of a study that runs; StudyError if it was broken or removed meanwhile."""
    manifest = read_manifest(shards.parent)
    if manifest is None:
        raise removed(shards / MANIFEST)
    return manifest


def _json(manifest: Mapping[str, Any]) -> bytes:
    return (json.dumps(manifest, ensure_ascii=False, indent=1) + "\n").encode()


def _difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return the differences of a study or of its engine from before; empty if there are none."""
    if before["engine"] != now["engine"]:
        names = sorted({*before["engine"], *now["engine"]})
        changes = [(name, before["engine"].get(name), now["engine"].get(name)) for name in names]
        return ", ".join(f"{name} was {old}, is {new}" for name, old, new in changes if old != new)
    if before["identity"] == now["identity"]:
        return ""
    return differences(before["study"], now["study"], same_inputs(before["identity"], now["identity"]))


def _digest_of(work: Work) -> str:
    """Return a hash of the work without the bounds of its chunks."""
    digest_of_work = hashlib.sha256(repr((work.skip, work.outputs, work.factors.shape)).encode())
    for oscillator in work.oscillators:
        digest_of_work.update(repr(oscillator).encode())
    factors = work.factors
    arrays = [factors.levels, factors.measured, factors.times] if isinstance(factors, BlockFactors) else [factors]
    if isinstance(factors, BlockFactors):
        digest_of_work.update(factors.measure.label.encode())
    for array in arrays:
        digest_of_work.update(np.ascontiguousarray(array).tobytes())
    for motion in work.motions:
        digest_of_work.update(digest(motion).encode())
    return digest_of_work.hexdigest()


def _key(whole: str, chunk: Chunk) -> str:
    return f"{whole} {chunk.row}:{chunk.row_stop} {chunk.first}:{chunk.stop}"


def _packed(work: Work, done: ChunkResult, key: str) -> memoryview:
    """Return a chunk's results as the bytes of a classic netCDF file, which takes a third of the time of HDF5."""
    file = netCDF4.Dataset("shard", "w", format="NETCDF3_64BIT_DATA", memory=1)  # (grows as it is written)
    for name, size in zip(DIMS, done.results[0].shape, strict=True):
        file.createDimension(name, size)
    file.createDimension("count", len(TALLY))
    for name, values in zip(work.outputs, done.results, strict=True):
        stored = values.astype(np.int8) if values.dtype == np.bool_ else values
        file.createVariable(name, stored.dtype, DIMS)[:] = stored
    file.createVariable("tally", np.int64, ("count",))[:] = done.tally
    file.setncatts({"layout": LAYOUT, "key": key})
    content: memoryview = file.close()
    return content


def _read(path: Path, key: str, work: Work, chunk: Chunk) -> ChunkResult:
    """Read a chunk from its shard, ValueError if damaged."""
    refuse_pipe(path)
    content = path.read_bytes()
    name = NAME.fullmatch(path.name)
    if name is None or hashlib.sha256(content).hexdigest()[:16] != name[3]:
        raise ValueError("its bytes have changed")
    with netCDF4.Dataset(path.name, memory=content) as file:
        if str(file.getncattr("key")) != key:
            raise ValueError("it is of another chunk")
        file.set_auto_mask(False)
        shape = (chunk.row_stop - chunk.row, work.levels, chunk.stop - chunk.first)
        if any(file[name].shape != shape for name in work.outputs) or file["tally"].shape != (len(TALLY),):
            raise ValueError("its arrays have another shape")
        results = tuple(file[name][:].astype(OUTPUTS[name].kind) for name in work.outputs)
        tally = np.asarray(file["tally"][:], np.int64)
    return ChunkResult(results, tally)
