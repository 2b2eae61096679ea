"""Motions on the workers of a cluster: generated there from their seeds instead of sent, if no file is needed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...fragility.runs.cluster import Cluster, Remake
from ...motions.arrays import Record, records
from ..file.motions import motions_table
from ..file.schema import StudyFile
from ..text.words import scales
from .differences import makes_motions

if TYPE_CHECKING:
    from distributed import Client


def cluster(
    client: Client, configuration: dict[str, Any], digests: Iterable[str], stop: Callable[[], bool], both: bool = False
) -> Cluster:
    """Return the workers of a client, with the function that generates a study's motions (of these digests) there."""
    # (the workers may lack the files, and do not know what yields above the ground makes of each level)
    yields = "performance" in configuration and (
        "supports" in configuration or not scales(configuration.get("building") or {})
    )
    if yields or not makes_motions(configuration):
        return Cluster(client, None, stop)
    make = partial(motions_again, json.dumps(configuration), both)
    return Cluster(client, Remake(make, frozenset(digests)), stop)


def motions_again(configuration: str, both: bool = False) -> list[Record]:
    """Generate all motions of a study, of floors and of the ground below them, from its file's content (JSON)."""
    content = json.loads(configuration)
    others = content.pop("motion_sets", [])
    # (these do not affect the motions, and with defaults filled in a hazard is not valid for every study)
    for key in ("hazard", "hazards", "branches", "fit"):
        content.pop(key, None)
    study = StudyFile.model_validate(content)
    sets = study.shaking(Path(), both)
    for other in others:
        sets += study.other(motions_table(other["motions"])).shaking(Path(), both)
    arrays = [array for shaken in sets for array in (*shaken.motions, *shaken.ground)]
    return [record for array in arrays for record in records(array)]
