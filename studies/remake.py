"""Motions on the workers of a cluster: made there from their seeds, not sent, wherever no file is needed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..fragility.cluster import Cluster, Remake
from ..motions.arrays import Record, records
from .schema import StudyFile

if TYPE_CHECKING:
    from distributed import Client

FILES = ("records", "floors_file", "target")
"""Keys of motions that name files, which workers may not have."""


def cluster(client: Client, configuration: dict[str, Any], digests: Iterable[str], stop: Callable[[], bool]) -> Cluster:
    """The workers of a client, told how to make a study's motions (of these digests) themselves where they can."""
    tables = [configuration["motions"]]
    tables += [one.get("motions", {}) for one in (configuration.get("stripes") or {}).get("at", [])]
    if any(name in table for table in tables for name in FILES):
        return Cluster(client, None, stop)
    make = partial(motions_again, json.dumps(configuration))
    return Cluster(client, Remake(make, frozenset(digests)), stop)


def motions_again(configuration: str) -> list[Record]:
    """All motions of a study, those of floors and those of the ground below them, from its file's content (JSON)."""
    content = json.loads(configuration)
    content.pop("hazard", None)  # (not of motions, and with its defaults filled in not every study's)
    sets = StudyFile.model_validate(content).shaking(Path())
    arrays = [array for one in sets for array in (*one.motions, *one.ground)]
    return [record for array in arrays for record in records(array)]
