"""The command `toppling simulate`: reads the command line, makes one run, and writes its files and its text."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from ...core.wording import system_reason, time_text
from ..command.choices import whole
from ..text.encoding import json_text
from ..text.error import StudyError
from ..text.terminal import say, terminal

if TYPE_CHECKING:
    from rich.console import Console
    from xarray import Dataset

Toward = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
"""Length or angle with a side: negative to the back."""


def _options(title: str, key: int) -> Parameter:
    """Return the mark of a class whose fields are options with a common title; a field's sentence is its help."""
    return Parameter(name="*", group=Group(title, sort_key=key), negative="")


@_options("Block", 11)
@dataclass(frozen=True)
class BlockOptions:
    width: str | None = None
    """Width in the direction of shaking: 40cm, 0.4m or 0.4."""
    height: str | None = None
    """Height."""
    cm_height: str | None = None
    """Height of the centre of mass; default mid-height."""
    inertia_factor: float | None = None
    """I_O/(m R²); default for a uniform block."""
    mass: str | None = None
    """Mass, 100kg; needed with a restraint."""
    cm_offset: Toward = None
    """Distance of the centre of mass in front of mid-width, 30mm; behind it: negative."""
    lean: Toward = None
    """Lean, or slope of the floor, to the front, 1deg; to the back: negative."""
    bed_settlement: str | None = None
    """Settlement of a soft bed (carpet, mat) under the block's weight, 2mm."""


@_options("Wall and kit", 12)
@dataclass(frozen=True)
class SceneOptions:
    placed: bool = False
    """Place a catalogue item as usual: back to a wall, or free."""
    wall_gap: str | None = None
    """Clear distance to a wall behind the block, 20mm; 0mm touches."""
    wall_height: str | None = None
    """Height of contact with the wall; default the block's upper edge."""
    wall_restitution: float | None = None
    """Velocity after an impact there over velocity before it; default from the geometry."""
    front_gap: str | None = None
    """Clear distance to a second wall in front."""
    restraint: str | None = None
    """Kind and properties: strap,height=1.75m,strength=267N,stiffness=20N/mm,slack=5mm."""


@_options("Damping law", 13)
@dataclass(frozen=True)
class LawOptions:
    law: str = "housner"
    """Damping law."""
    e: float | None = None
    """Coefficient of restitution; default e_R of the block's shape."""
    restitution_factor: float | None = None
    """Factor on e_R, instead of e."""
    delta: float | None = None
    """Half width of the elastic zone over α."""
    zeta: float | None = None
    """Damping ratio of the viscous law."""
    coefficient: float | None = None
    """Coefficient of the law of Vassiliou et al."""
    lever: str | None = None
    """Lever arm of the inertia force: h or R."""
    rest: str | None = None
    """Kind of rest: elastic or rigid."""
    geometry: str | None = None
    """Geometry of Housner's law: exact, linear or bilinear."""


@_options("Motion", 14)
@dataclass(frozen=True)
class MotionOptions:
    scale: float | None = None
    """Scale factor of the motion."""
    pga: str | None = None
    """Peak acceleration to scale to, instead of scale: 0.4g or 3.9m/s2."""
    seed: Annotated[int | None, Parameter(converter=whole)] = None
    """Seed of a generator."""
    index: Annotated[int, Parameter(converter=whole)] = 0
    """Number of the motion of the seed or file, from 0."""
    period: str | None = None
    """Period of a pulse, 0.5s."""
    settings: Annotated[tuple[str, ...], Parameter(name="set", negative_iterable="")] = ()
    """KEY=VALUE of [motions] in a study file: duration_s=20."""


@_options("Output", 15)
@dataclass(frozen=True)
class OutputOptions:
    out: Path = Path("results/simulate")
    """Folder for history and film; earlier files are replaced."""
    animate: bool = False
    """Write a film: GIF, and MP4 if ffmpeg is installed."""
    speed: float = 1.0
    """Speed of the film; 1 is real time."""
    json: bool = False
    """Print JSON."""


def simulate_one(
    block: str | None = None,
    motion: str | None = None,
    *,
    sizes: BlockOptions = BlockOptions(),
    around: SceneOptions = SceneOptions(),
    law: LawOptions = LawOptions(),
    shaking: MotionOptions = MotionOptions(),
    output: OutputOptions = OutputOptions(),
) -> None:
    """Simulate one block under one motion: response, history.csv, history.png and a film.

    toppling simulate bookcase-5-shelf site-based-scenario --seed 1 --pga 0.4g --animate
    toppling simulate bookcase-5-shelf ricker --period 1s --pga 0.4g --wall-gap 20mm

    Parameters
    ----------
    block
        Name in `toppling catalogue`; not needed with --width and --height.
    motion
        Record file, generator, pulse, or study file.
    """
    from rich.console import Console  # noqa: PLC0415

    from .inputs import block_of, factor_of, law_of, motion_of  # noqa: PLC0415
    from .run import Simulation  # noqa: PLC0415 - not for every command

    if motion is None and (sizes.width or sizes.height or sizes.cm_height):
        block, motion = None, block  # the only word given is the motion
    if motion is None:
        raise StudyError("which MOTION? A record file, or the name of a generator such as site-based-scenario")
    stands, damped = block_of(block, {**vars(sizes), **vars(around)}), law_of(**vars(law))
    record = motion_of(motion, shaking.seed, shaking.index, shaking.settings, shaking.period)
    run = Simulation(stands, damped, record, factor_of(record, shaking.scale, shaking.pga))
    console = terminal()
    log = Console(stderr=True)
    written = run.write(output.out)
    if not output.json:
        say(console, *run.lines(), *(f"note: {note}" for note in run.notes))
    if output.animate:
        written += _films(run.shown, output.out, output.speed, log)
    if output.json:
        sys.stdout.write(json_text(run.content(written), indent=1, allow_nan=False) + "\n")
    else:
        say(console, *(f"written: {path}" for path in written))


FRAME_SECONDS = {"gif": 0.006, "mp4": 0.03}
"""Time that a frame of a film takes on a usual machine, s."""
LONG_SECONDS = 10.0
"""Time from which it is said beforehand how long the films take, s."""


def _films(response: Dataset, folder: Path, speed: float, log: Console) -> list[Path]:
    """Write the films of a run: a GIF, and an MP4 where ffmpeg is installed."""
    from ..film.animate import animate  # noqa: PLC0415 - matplotlib
    from ..film.frames import frames_of  # noqa: PLC0415
    from ..film.writers import ffmpeg  # noqa: PLC0415
    from ..store.progress import show_progress  # noqa: PLC0415
    from .run import FILMS  # noqa: PLC0415

    names = FILMS if ffmpeg() else FILMS[:1]
    if len(names) == 1:
        say(log, "no ffmpeg on the PATH: the film is a GIF alone")
    try:
        films = []
        number = frames_of(response, speed=speed).time.size
        takes = number * sum(FRAME_SECONDS[name[-3:]] for name in names)
        if takes >= LONG_SECONDS:
            of_each = " each" if len(names) > 1 else ""
            say(log, f"drawing {' and '.join(names)}: {number:,} frames{of_each}, some {time_text(takes)}")
        for name in names:
            # (an MP4 has twice the pixels: its file is small, and it can be watched on a full screen)
            size = 480 if name.endswith("gif") else 960
            with show_progress(log, f"frames of {name}", None) as shown:
                films.append(animate(response, folder / name, speed=speed, size=size, progress=shown.update))
    except KeyboardInterrupt as error:
        error.args = (f"interrupted: {name} is not written, the history is",)
        raise
    except OSError as error:
        raise StudyError(f"{folder / name}: cannot be written ({system_reason(error)})") from None
    except ValueError as error:
        raise StudyError(f"--speed {speed:g}: {error}") from None
    return films
