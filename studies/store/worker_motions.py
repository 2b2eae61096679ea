"""Motions on the workers of a cluster: generated there from their seeds instead of sent, where no file is needed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...fragility.runs.cluster import Cluster, Remake
from ...motions.arrays import Record, records
from ..file.schema import StudyFile
from .differences import makes_motions

if TYPE_CHECKING:
    from distributed import Client


def cluster(client: Client, configuration: dict[str, Any], digests: Iterable[str], stop: Callable[[], bool]) -> Cluster:
    """Return the workers of a client, with the function that generates a study's motions (of these digests) there."""
    if not makes_motions(configuration):  # (the workers may lack the files)
        return Cluster(client, None, stop)
    make = partial(motions_again, json.dumps(configuration))
    return Cluster(client, Remake(make, frozenset(digests)), stop)


def motions_again(configuration: str) -> list[Record]:
    """Generate all motions of a study, of floors and of the ground below them, from its file's content (JSON)."""
    content = json.loads(configuration)
    # (the hazard does not affect the motions, and with its defaults filled in it is not valid for every study)
    content.pop("hazard", None)
    sets = StudyFile.model_validate(content).shaking(Path())
    arrays = [array for one in sets for array in (*one.motions, *one.ground)]
    return [record for array in arrays for record in records(array)]
