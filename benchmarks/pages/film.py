"""The films docs/rocking.gif and docs/strap.gif: a bookcase that rocks and falls, and one whose strap breaks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import toppling as tp

from ...core.units import STANDARD_GRAVITY
from ...studies.file.schema import read_study_file
from .page import OUT, ROOT

STUDY = ROOT / "studies/examples/bookcase.toml"
MOTION, PGV = 65, 0.5
"""Motion of the study, by its place, and peak ground velocity (m/s): the strap breaks, and the bookcase falls early."""


def rocking(out: Path) -> Path:
    """Write the film of the README: small, so that a page loads quickly."""
    envelope = tp.motions.RiseStrongDecay(rise=1.0, strong_end=6.0, decay=0.5)
    motion = tp.motions.CloughPenzien(duration=9.0, envelope=envelope).sample(1, seed=19)
    motion = motion.sel(time=slice(0.0, 9.0))  # (what follows brings the ground to rest)
    shaking = tp.motions.scale_to(motion, 0.35 * STANDARD_GRAVITY)
    run = tp.simulate(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shaking)
    return tp.animate(run, out, fps=20, size=400)


def strap(out: Path) -> Path:
    """Write the film of the bookcase with a kit of examples/bookcase.toml, under one of the study's motions."""
    study = read_study_file(STUDY)
    assert study.blocks is not None  # (the study has them, and the restraint that the last one names)
    assert study.restraints is not None
    assert study.models is not None
    kits = {name: restraint.build() for name, restraint in study.restraints.items()}
    motions = study.motions.model_copy(update={"number": 1}).build(STUDY.parent, MOTION)
    shaking = tp.motions.scale_to(motions[0], PGV, im="pgv")
    block = replace(study.blocks[-1].build(kits), name="bookcase")
    run = tp.simulate(block, study.models[0].build(), shaking)
    return tp.animate(run, out, fps=20, size=400, speed=0.5)


def main() -> None:
    """Write both films."""
    rocking(OUT / "rocking.gif")
    strap(OUT / "strap.gif")
