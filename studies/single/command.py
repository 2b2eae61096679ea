"""The command `toppling simulate`: reads the command line, makes one run, and writes its files and its text."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ..text.terminal import say, terminal

if TYPE_CHECKING:
    from rich.console import Console
    from xarray import Dataset


def simulate_one(
    block: str | None = None,
    motion: str | None = None,
    *,
    width: str | None = None,
    height: str | None = None,
    cm_height: str | None = None,
    inertia_factor: float | None = None,
    mass: str | None = None,
    cm_offset: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    lean: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    placed: Annotated[bool, Parameter(negative="")] = False,
    wall_gap: str | None = None,
    wall_height: str | None = None,
    wall_restitution: float | None = None,
    front_gap: str | None = None,
    bed_settlement: str | None = None,
    restraint: str | None = None,
    law: str = "housner",
    e: float | None = None,
    restitution_factor: float | None = None,
    delta: float | None = None,
    zeta: float | None = None,
    coefficient: float | None = None,
    lever: str | None = None,
    rest: str | None = None,
    geometry: str | None = None,
    scale: float | None = None,
    pga: str | None = None,
    seed: int | None = None,
    index: int = 0,
    period: str | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative_iterable="")] = (),
    out: Path = Path("results/simulate"),
    animate: Annotated[bool, Parameter(negative="")] = False,
    speed: float = 1.0,
    json_: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Simulate one block under one motion: what it does, history.csv, history.png and, with --animate, a film.

    toppling simulate bookcase-5-shelf site-based-scenario --seed 1 --pga 0.4g --animate
    toppling simulate bookcase-5-shelf ricker --period 1s --pga 0.4g --wall-gap 20mm

    Parameters
    ----------
    block
        A name of `toppling catalogue`; left out where --width and --height are given.
    motion
        A record file, a generator or a pulse by its name, or a study file for one of its motions.
    width
        Full width in the direction of shaking: 40cm, 0.4m or 0.4.
    height
        Full height.
    cm_height
        Height of the centre of mass; mid-height where not given.
    inertia_factor
        I_O/(m R²), above 1 to 2; 4/3 where not given.
    mass
        Mass, 100kg; only a restraint needs it.
    cm_offset
        Centre of mass in front of the middle, 30mm (behind it: negative).
    lean
        Lean, or slope of the floor, to the front, 1deg (to the back: negative).
    placed
        The item of the catalogue as it usually stands: back to a wall, or free.
    wall_gap
        Clear distance to a wall behind the block, 20mm; 0mm touches.
    wall_height
        Height at which it meets the wall; its upper edge where not given.
    wall_restitution
        Velocity after over before an impact there; from the geometry where not given.
    front_gap
        Clear distance to a second wall in front.
    bed_settlement
        Settlement of a soft bed (carpet, mat) under the block by its weight, 2mm.
    restraint
        Kind and parts: strap,height=1.75m,strength=267N,stiffness=20N/mm,slack=5mm.
    law
        Damping law.
    e
        Restitution, above 0 to 1; the block's own e_R where not given.
    restitution_factor
        Factor on e_R, instead of e.
    delta
        Half width of the elastic zone over α; 0.05.
    zeta
        Damping ratio of the viscous law.
    coefficient
        Coefficient of the law of Vassiliou et al.; 0.02.
    lever
        Lever arm of the shaking: h or R.
    rest
        Kind of rest: elastic or rigid.
    geometry
        Housner's geometry: exact, linear or bilinear.
    scale
        Factor on the motion.
    pga
        Or: its peak acceleration, 0.4g or 3.9m/s2.
    seed
        Seed of a generator; 0.
    index
        Which motion of the seed or the file, from 0.
    period
        Period of a pulse, 0.5s.
    set_
        KEY=VALUE of [motions] in a study file: duration_s=20.
    out
        Folder for history and film; those of an earlier call are replaced or removed.
    animate
        Write a film too: GIF, and MP4 where ffmpeg is there.
    speed
        Of the film: 1 is real time, 0.25 four times slower.
    json_
        Print it as JSON.
    """
    from rich.console import Console  # noqa: PLC0415

    from ..text.error import StudyError  # noqa: PLC0415 - it loads what a study needs, which no help needs
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
    from ...core.wording import system_reason, time_text  # noqa: PLC0415
    from ..film.animate import animate  # noqa: PLC0415 - matplotlib
    from ..film.frames import frames_of  # noqa: PLC0415
    from ..film.writers import ffmpeg  # noqa: PLC0415
    from ..store.progress import show_progress  # noqa: PLC0415
    from ..text.error import StudyError  # noqa: PLC0415
    from .run import FILMS  # noqa: PLC0415

    names = FILMS if ffmpeg() else FILMS[:1]
    if len(names) == 1:
        say(log, "no ffmpeg on the PATH: the film is a GIF alone")
    try:
        found = []
        number = frames_of(response, speed=speed).time.size
        takes = number * sum(FRAME_SECONDS[name[-3:]] for name in names)
        if takes >= LONG_SECONDS:
            each = " each" if len(names) > 1 else ""
            say(log, f"drawing {' and '.join(names)}: {number:,} frames{each}, some {time_text(takes)}")
        for name in names:
            # (an MP4 has twice the pixels: its file is small, and it can be watched on a full screen)
            size = 480 if name.endswith("gif") else 960
            with show_progress(log, f"frames of {name}", None) as shown:
                found.append(animate(response, folder / name, speed=speed, size=size, progress=shown.update))
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted: {name} is not written, the history is") from None
    except OSError as error:
        raise StudyError(f"{folder / name}: cannot be written ({system_reason(error)})") from None
    except ValueError as error:
        raise StudyError(f"--speed {speed:g}: {error}") from None
    return found
