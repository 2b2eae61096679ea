"""Crash safety: every finished chunk is a file of its own, and a manifest says whose chunks they are.

`shards/manifest.json` pins the study and the engine; `shards/CALL-CHUNK-CHECKSUM.nc` holds a chunk's results.  A file
appears whole (temporary name, fsync, rename), and its name carries the checksum of its bytes, so that a damaged one is
recognised before anything parses it, and computed again.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
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

from ..fragility.block_factors import BlockFactors
from ..fragility.plan import OUTPUT_TYPES, Chunk, Done, Work
from ..fragility.runners import Runner
from ..models.runs import TALLY, engine_identity
from ..motions.arrays import digest
from .differences import differences
from .store import write_whole
from .tables import StudyError
from .watch import Stop, Watch

FOLDER = "shards"
MANIFEST = "manifest.json"
LAYOUT = 2
"""Number of the layout of manifest and shards."""
MOST = 10**18
"""Runs that a manifest can speak of."""
IN_MEMORY = 2**25
"""Bytes of an array of all runs up to which it is held in memory; a larger one is a file without a name."""
DIMS = ("oscillator", "level", "motion")
_NAME = re.compile(r"([0-9]{3,})-([0-9]{6,})-([0-9a-f]{16})\.nc")
_PART = re.compile(rf"({_NAME.pattern}|{re.escape(MANIFEST)})\.part")


class Shards(Runner):
    """Runs chunks by another runner, keeps each one, and gives back those that were kept before."""

    def __init__(self, folder: Path, inner: Runner, watch: Watch, stop: Stop) -> None:
        self._folder = folder
        self._inner = inner
        self._watch = watch
        self._stop = stop
        self._calls = 0
        self._known: dict[tuple[int, int], list[Path]] = {}
        for path in sorted(folder.iterdir()):
            name = _NAME.fullmatch(path.name)
            if name is not None:
                self._known.setdefault((int(name[1]), int(name[2])), []).append(path)
            elif _PART.fullmatch(path.name):
                with suppress(OSError):
                    _remove(path)

    def run(self, work: Work, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Done]]:
        """Every chunk with its results; StudyError where one cannot be kept."""
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
        """A place for what is kept of all runs: of the disk, where it is large; StudyError where that is full.

        The file has no name, so that nothing is left of it however this process ends, and all of its space from the
        beginning: a disk that fills up later cannot end the process by a signal.
        """
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if size <= IN_MEMORY:
            return super().array(shape, dtype)
        try:
            with tempfile.TemporaryFile(dir=self._folder) as file:
                if hasattr(os, "posix_fallocate"):
                    os.posix_fallocate(file.fileno(), 0, size)
                else:
                    file.truncate(size)
                return np.asarray(np.memmap(file, dtype, "r+", shape=shape))
        except OSError as error:
            raise StudyError(
                f"{self._folder}: has no room for {size:,} bytes of results ({error.strerror or error}); what is "
                "finished is kept: make room and run the same command again"
            ) from None

    def tell(self, what: str, done: int, total: int) -> None:
        """Say how far the work is that is not done in chunks."""
        self._watch.tell(what, done, total)

    def _kept(self, call: int, number: int, key: str, work: Work, chunk: Chunk) -> Done | None:
        """The results of a chunk, if a sound shard of it is there; others are removed."""
        for path in self._known.get((call, number), []):
            try:
                return _read(path, key, work, chunk)
            except (OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError) as error:  # (netCDF4's)
                self._watch.log.warning("%s is damaged (%s): its chunk is computed again", path.name, error)
                with suppress(OSError):
                    _remove(path)
        return None

    def _keep(self, call: int, number: int, key: str, work: Work, done: Done) -> None:
        started = perf_counter()
        content = _packed(work, done, key)
        checksum = hashlib.sha256(content).hexdigest()[:16]
        write_whole(self._folder / f"{call:03d}-{number:06d}-{checksum}.nc", content)
        self._watch.storing += perf_counter() - started


def open_shards(folder: Path, pinned: Mapping[str, Any], fresh: bool) -> tuple[Path, bool]:
    """The folder for the shards of a study, and whether it holds some of it already.

    `pinned`: identity, study (its file's content) and work (its runs), as the manifest keeps them.

    Raises
    ------
    StudyError
        It holds parts of another study, or made by another engine: one sentence that says what differs.
    """
    shards = folder / FOLDER
    _refuse_link(shards)
    if shards.exists() and not fresh:
        if refuse_other(folder, pinned):
            return shards, True
        if any(_NAME.fullmatch(path.name) for path in shards.iterdir()):
            raise StudyError(f"{shards}: holds parts of a study without a manifest; use --fresh to start over")
    remove_shards(folder)
    try:
        shards.mkdir(exist_ok=True)
    except OSError as error:
        raise StudyError(f"{shards}: cannot be made a folder ({error.strerror})") from None
    write_whole(shards / MANIFEST, _json(_manifest(pinned)))
    return shards, False


def refuse_other(folder: Path, pinned: Mapping[str, Any]) -> bool:
    """Whether a folder holds parts of the study that `pinned` is of; StudyError where they are of another one."""
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


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """The manifest in a study's folder, None where there is none; StudyError where it is none of ours."""
    path = folder / FOLDER / MANIFEST
    _refuse_link(folder / FOLDER)
    try:
        found = json.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError) as error:
        raise StudyError(f"{path}: cannot be read ({type(error).__name__}); use --fresh to start over") from None
    kinds = {"layout": int, "engine": dict, "identity": str, "study": dict, "work": int, "calls": list}
    if not isinstance(found, dict) or not all(isinstance(found.get(name), kind) for name, kind in kinds.items()):
        raise StudyError(f"{path}: is no manifest of a study; use --fresh to start over")
    if found["layout"] != LAYOUT:
        raise StudyError(
            f"{path}: has layout {found['layout']}, this version reads {LAYOUT}; use --fresh to start over"
        )
    counts = [found["work"], *(value for one in found["calls"] for value in _counts_of(one))]
    if any(type(value) is not int or not 0 <= value <= MOST for value in counts):
        raise StudyError(f"{path}: is no manifest of a study; use --fresh to start over")
    return found


def _counts_of(one: Any) -> list[Any]:
    """The counts in a manifest's entry of a call, with a None where it is no such entry."""
    pairs = one.get("chunks") if isinstance(one, dict) else None
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        return [None]
    return [value for pair in pairs for value in pair]


def belongs(folder: Path, identity: str) -> bool:
    """Whether the folder holds parts of the study of this identity, made by this engine."""
    try:
        found = read_manifest(folder)
    except StudyError:
        return False
    return found is not None and found["identity"] == identity and found["engine"] == engine_identity()


def kept_chunks(folder: Path) -> dict[int, set[int]]:
    """Numbers of the chunks that are kept, by call."""
    try:
        chunks = {_NAME.fullmatch(path.name) for path in (folder / FOLDER).iterdir()}
    except FileNotFoundError:  # the study has just been finished
        return {}
    found: dict[int, set[int]] = {}
    for name in chunks:
        if name is not None:
            found.setdefault(int(name[1]), set()).add(int(name[2]))
    return found


def remove_shards(folder: Path) -> None:
    """Remove what is ours of the folder of shards, the manifest last; StudyError where that cannot be."""
    shards = folder / FOLDER
    _refuse_link(shards)
    if not shards.exists():
        return
    try:
        ours = [path for path in shards.iterdir() if _NAME.fullmatch(path.name) or _PART.fullmatch(path.name)]
        for path in (*ours, shards / MANIFEST):
            _remove(path)
        if not any(shards.iterdir()):  # (what is left was put there by somebody else)
            shards.rmdir()
    except OSError as error:
        raise StudyError(f"{shards}: cannot be removed ({error.strerror})") from None


def _remove(path: Path) -> None:
    """Remove a file, or an empty folder that has its name."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    else:
        path.unlink(missing_ok=True)


def _refuse_link(shards: Path) -> None:
    """StudyError where the folder of shards is another one's: what is in it is not ours to remove."""
    if shards.is_symlink():
        raise StudyError(f"{shards}: is a link to another folder; remove the link, or use another folder")


def _add_call(folder: Path, call: int, runs: Sequence[int]) -> None:
    """Say in the manifest what chunks a part of the study has: so many after each other, of so many runs each."""
    path = folder / MANIFEST
    manifest = json.loads(path.read_text("utf-8"))
    if len(manifest["calls"]) <= call:
        manifest["calls"].append({"chunks": [[len(list(equal)), each] for each, equal in groupby(runs)]})
        write_whole(path, _json(manifest))


def _json(manifest: Mapping[str, Any]) -> bytes:
    return (json.dumps(manifest, ensure_ascii=False, indent=1) + "\n").encode()


def _difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """What of a study, or of what runs it, is other than before; empty where nothing is."""
    if before["engine"] != now["engine"]:
        names = sorted({*before["engine"], *now["engine"]})
        found = [(name, before["engine"].get(name), now["engine"].get(name)) for name in names]
        return ", ".join(f"{name} was {old}, is {new}" for name, old, new in found if old != new)
    return "" if before["identity"] == now["identity"] else differences(before["study"], now["study"])


def _digest_of(work: Work) -> str:
    """All of the work as a hash, but for the chunks' bounds."""
    found = hashlib.sha256(repr((work.skip, work.outputs, work.factors.shape)).encode())
    for oscillator in work.oscillators:
        found.update(repr(oscillator).encode())
    factors = work.factors
    arrays = [factors.levels, factors.measured, factors.times] if isinstance(factors, BlockFactors) else [factors]
    if isinstance(factors, BlockFactors):
        found.update(factors.measure.label.encode())
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    for motion in work.motions:
        found.update(digest(motion).encode())
    return found.hexdigest()


def _key(whole: str, chunk: Chunk) -> str:
    return f"{whole} {chunk.row}:{chunk.row_stop} {chunk.first}:{chunk.stop}"


def _packed(work: Work, done: Done, key: str) -> memoryview:
    """A chunk's results as the bytes of a netCDF file, of the classic kind: a third of the time of one over HDF5."""
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


def _read(path: Path, key: str, work: Work, chunk: Chunk) -> Done:
    """A chunk's results from its shard; ValueError (or another of the libraries' errors) where it is not sound."""
    content = path.read_bytes()
    name = _NAME.fullmatch(path.name)
    if name is None or hashlib.sha256(content).hexdigest()[:16] != name[3]:
        raise ValueError("its bytes have changed")
    with netCDF4.Dataset(path.name, memory=content) as file:
        if file.getncattr("key") != key:
            raise ValueError("it is of another chunk")
        file.set_auto_mask(False)
        shape = (chunk.row_stop - chunk.row, work.levels, chunk.stop - chunk.first)
        if any(file[name].shape != shape for name in work.outputs) or file["tally"].shape != (len(TALLY),):
            raise ValueError("its arrays have another shape")
        results = tuple(file[name][:].astype(OUTPUT_TYPES[name]) for name in work.outputs)
        tally = np.asarray(file["tally"][:], np.int64)
    return Done(results, tally)
