"""The manifest of a study's shards, and its accompanying files: their study, and the kept chunks."""

import json
import re
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...core.wording import system_reason
from ...core.writing import refuse_pipe
from ..text.error import StudyError

FOLDER = "shards"
MANIFEST = "manifest.json"
LAYOUT = 3
"""Number of the layout of manifest and shards."""
MOST_RUNS = "most"
"""Key that is true if the number of runs is an upper bound; the actual number is known at the end."""
REACHED = "reached"
"""Key of the sentence on the reached precision of an analysis at adaptive levels; only such a study has it."""
REACHED_AFTER = "reached_after"
"""Key of the number of calls after which it was true."""
REFUSED = "refused"
"""Key of the sentence with the reason why no result can be made of the kept runs, until they are continued."""
MOST = 10**18
"""Most runs that a manifest can count."""
NAME = re.compile(r"([0-9]{3,})-([0-9]{6,})-([0-9a-f]{16})\.nc")
PART = re.compile(rf"({NAME.pattern}|{re.escape(MANIFEST)})\.toppling-[0-9]+-[0-9]+\.part")


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """Return the manifest in a study's folder, None if there is none; StudyError if it is not valid."""
    path = folder / FOLDER / MANIFEST
    refuse_link(folder / FOLDER)
    try:
        refuse_pipe(path)
        manifest = json.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({system_reason(error)})") from None
    except (ValueError, RecursionError):
        manifest = None
    kinds = {"layout": int, "engine": dict, "identity": str, "study": dict, "work": int, "calls": list}
    if not isinstance(manifest, dict) or not all(isinstance(manifest.get(name), kind) for name, kind in kinds.items()):
        raise StudyError(f"{path}: is no manifest of a study; use --fresh to start over")
    if manifest["layout"] != LAYOUT:
        raise StudyError(
            f"{path}: has layout {manifest['layout']}, this version reads {LAYOUT}; use --fresh to start over"
        )
    counts = [manifest["work"], *(value for call in manifest["calls"] for value in _counts_of(call))]
    if any(type(value) is not int or not 0 <= value <= MOST for value in counts):
        raise StudyError(f"{path}: is no manifest of a study; use --fresh to start over")
    return manifest


def _counts_of(call: Any) -> list[Any]:
    """Return the counts in a manifest's entry of a call; [None] if it is no such entry."""
    pairs = call.get("chunks") if isinstance(call, dict) else None
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        return [None]
    return [value for pair in pairs for value in pair]


def kept_runs(folder: Path, manifest: dict[str, Any]) -> tuple[int, int]:
    """Return the number of chunks that are kept in a folder, and the number of their runs."""
    kept_chunks: dict[int, set[int]] = defaultdict(set)
    with suppress(FileNotFoundError):  # (the study has just been finished)
        for path in (folder / FOLDER).iterdir():
            if name := NAME.fullmatch(path.name):
                kept_chunks[int(name[1])].add(int(name[2]))
    chunks = runs = 0
    for i, call in enumerate(manifest["calls"]):
        first = 0
        for number, runs_of_chunk in call["chunks"]:
            kept = sum(first <= chunk < first + number for chunk in kept_chunks[i])
            chunks += kept
            runs += kept * runs_of_chunk
            first += number
    return chunks, runs


def refuse_link(shards: Path) -> None:
    """Raise a StudyError if the folder of shards is a link, because the files behind it must not be removed."""
    if shards.is_symlink():
        raise StudyError(f"{shards}: is a link to another folder; remove the link, or use another folder")
