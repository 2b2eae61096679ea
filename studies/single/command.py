"""The command `toppling simulate`: reads the command line, makes one run, and writes its files and its text."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from ...core.wording import system_reason, time_text
from ..command.choices import whole
from ..text.error import StudyError
from ..text.terminal import say, terminal

if TYPE_CHECKING:
    from rich.console import Console
    from xarray import Dataset


BLOCK = Group("Block", sort_key=11)
SURROUNDINGS = Group("Wall and kit", sort_key=12)
LAW = Group("Damping law", sort_key=13)
MOTION = Group("Motion", sort_key=14)
OUTPUT = Group("Output", sort_key=15)
"""Options by subject."""

Size = Annotated[str | None, Parameter(group=BLOCK)]
Signed = Annotated[str | None, Parameter(group=BLOCK, allow_leading_hyphen=True)]
Near = Annotated[str | None, Parameter(group=SURROUNDINGS)]
OfLaw = Annotated[float | None, Parameter(group=LAW)]
Word = Annotated[str | None, Parameter(group=LAW)]
OfMotion = Annotated[str | None, Parameter(group=MOTION)]
Flag = Annotated[bool, Parameter(group=OUTPUT, negative="")]


def simulate_one(
    block: str | None = None,
    motion: str | None = None,
    *,
    width: Size = None,
    height: Size = None,
    cm_height: Size = None,
    inertia_factor: Annotated[float | None, Parameter(group=BLOCK)] = None,
    mass: Size = None,
    cm_offset: Signed = None,
    lean: Signed = None,
    bed_settlement: Size = None,
    placed: Annotated[bool, Parameter(group=SURROUNDINGS, negative="")] = False,
    wall_gap: Near = None,
    wall_height: Near = None,
    wall_restitution: Annotated[float | None, Parameter(group=SURROUNDINGS)] = None,
    front_gap: Near = None,
    restraint: Near = None,
    law: Annotated[str, Parameter(group=LAW)] = "housner",
    e: OfLaw = None,
    restitution_factor: OfLaw = None,
    delta: OfLaw = None,
    zeta: OfLaw = None,
    coefficient: OfLaw = None,
    lever: Word = None,
    rest: Word = None,
    geometry: Word = None,
    scale: Annotated[float | None, Parameter(group=MOTION)] = None,
    pga: OfMotion = None,
    seed: Annotated[int | None, Parameter(group=MOTION, converter=whole)] = None,
    index: Annotated[int, Parameter(group=MOTION, converter=whole)] = 0,
    period: OfMotion = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", group=MOTION, negative_iterable="")] = (),
    out: Annotated[Path, Parameter(group=OUTPUT)] = Path("results/simulate"),
    animate: Flag = False,
    speed: Annotated[float, Parameter(group=OUTPUT)] = 1.0,
    json_: Annotated[bool, Parameter(name="--json", group=OUTPUT, negative="")] = False,
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
    width
        Width in the direction of shaking: 40cm, 0.4m or 0.4.
    height
        Height.
    cm_height
        Height of the centre of mass; default mid-height.
    inertia_factor
        I_O/(m R²), above 1, at most 2; default 4/3.
    mass
        Mass, 100kg; needed with a restraint.
    cm_offset
        Distance of the centre of mass in front of mid-width, 30mm; behind it: negative.
    lean
        Lean, or slope of the floor, to the front, 1deg; to the back: negative.
    bed_settlement
        Settlement of a soft bed (carpet, mat) under the block's weight, 2mm.
    placed
        Place a catalogue item as usual: back to a wall, or free.
    wall_gap
        Clear distance to a wall behind the block, 20mm; 0mm touches.
    wall_height
        Height of contact with the wall; default the block's upper edge.
    wall_restitution
        Velocity after an impact there over velocity before it; default from the geometry.
    front_gap
        Clear distance to a second wall in front.
    restraint
        Kind and properties: strap,height=1.75m,strength=267N,stiffness=20N/mm,slack=5mm.
    law
        Damping law.
    e
        Coefficient of restitution, above 0, at most 1; default e_R of the block's shape.
    restitution_factor
        Factor on e_R, instead of e.
    delta
        Half width of the elastic zone over α; default 0.05.
    zeta
        Damping ratio of the viscous law.
    coefficient
        Coefficient of the law of Vassiliou et al.; default 0.02.
    lever
        Lever arm of the inertia force: h or R.
    rest
        Kind of rest: elastic or rigid.
    geometry
        Geometry of Housner's law: exact, linear or bilinear.
    scale
        Scale factor of the motion.
    pga
        Peak acceleration to scale to, instead of scale: 0.4g or 3.9m/s2.
    seed
        Seed of a generator; default 0.
    index
        Number of the motion of the seed or file, from 0.
    period
        Period of a pulse, 0.5s.
    set_
        KEY=VALUE of [motions] in a study file: duration_s=20.
    out
        Folder for history and film; earlier files are replaced.
    animate
        Write a film: GIF, and MP4 if ffmpeg is installed.
    speed
        Speed of the film; 1 is real time.
    json_
        Print JSON.
    """
    from rich.console import Console  # noqa: PLC0415

    from .inputs import block_of, factor_of, law_of, motion_of, scene_of  # noqa: PLC0415
    from .run import Simulation, as_json  # noqa: PLC0415 - not for every command

    sizes = {"--width": width, "--height": height, "--cm-height": cm_height}
    if motion is None and any(sizes.values()):
        block, motion = None, block  # the only word given is the motion
    if motion is None:
        raise StudyError("which MOTION? A record file, or the name of a generator such as site-based-scenario")
    factors = {"e": e, "restitution_factor": restitution_factor, "delta": delta, "zeta": zeta}
    words = {"lever": lever, "rest": rest, "geometry": geometry}
    options = {**factors, "coefficient": coefficient, **words}
    lengths = {"--mass": mass, "--cm-offset": cm_offset, "--lean": lean, "--wall-gap": wall_gap}
    lengths |= {"--wall-height": wall_height, "--front-gap": front_gap, "--bed-settlement": bed_settlement}
    scene = scene_of(lengths, wall_restitution, restraint)
    stands, damped = block_of(block, sizes, inertia_factor, scene, placed), law_of(law, options)
    shaking = motion_of(motion, seed, index, set_, period)
    run = Simulation(stands, damped, shaking, factor_of(shaking, scale, pga))
    console = terminal()
    log = Console(stderr=True)
    written = run.write(out)
    if not json_:
        say(console, *run.lines(), *(f"note: {note}" for note in run.notes))
    if animate:
        written += _films(run.shown, out, speed, log)
    if json_:
        sys.stdout.write(as_json(run.content(written)) + "\n")
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
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted: {name} is not written, the history is") from None
    except OSError as error:
        raise StudyError(f"{folder / name}: cannot be written ({system_reason(error)})") from None
    except ValueError as error:
        raise StudyError(f"--speed {speed:g}: {error}") from None
    return films
