"""Films of a rocking block: the history of one run, drawn to scale and played in real time."""

import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import xarray as xr

from ...core import checks
from ..plots.axes import defaults
from ..text.histories import block_of
from .frames import frames_of
from .scene import PALETTE, Scene
from .writers import SUFFIXES, film

SMALLEST, LARGEST = 240, 2000


def animate(
    response: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    speed: float = 1.0,
    fps: int | None = None,
    size: int = 480,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a film of one run: the block on its moving floor, and its rotation over time.

    Parameters
    ----------
    response : xarray.Dataset
        Dataset that `toppling.simulate` returned; it also contains the block and the floor's acceleration.
    path : path
        File to write, .gif or .mp4 (which needs ffmpeg on the PATH); an existing file is replaced.
    speed : float
        1 plays in real time, 0.25 four times slower; 0.01 to 100.
    fps : int, optional
        Frames a second, 5, 10, 20, 25 or 50; by default 25, or fewer if there would be more than 1,500 frames.
    size : int
        Width and height, pixels, 240 to 2,000, even.
    progress : callable, optional
        Called with (frames written, frames in all).

    Returns
    -------
    Path
        The file, which is complete when this function returns; if it raises, no file is written.

    Raises
    ------
    TypeError, ValueError
        The response is not the history of one run, the path has another ending, or a value is out of range. Or the film
        would be longer than 20 minutes.
    OSError
        The file cannot be written; ffmpeg is missing or fails.

    Notes
    -----
    With θ > 0 the block turns about its right corner. The floor's displacement is the integral of its acceleration from
    rest, without correction. For an uncorrected record it may drift, and then the view moves with the floor.

    After overturning the block lies on its side. If the record ends before that, the rest is drawn as the fall of a
    rigid block on a quiet floor, θ'' = p² sin(|θ| − α) sgn θ. It is labelled so.

    Examples
    --------
    >>> import tempfile
    >>> import toppling as tp
    >>> shake = tp.motions.OneCycleSine(amplitude=4.0, omega=8.0, tail=0.2).sample(1)
    >>> run = tp.simulate(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shake)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tp.animate(run, f"{folder}/bookcase.gif", fps=5).suffix
    '.gif'
    """
    target = checks.path(path)
    if target.suffix not in SUFFIXES:
        raise ValueError(f"path must end in .gif or .mp4, got {target.name!r}")
    pixels = checks.count("size", size, at_least=SMALLEST)
    if pixels > LARGEST or pixels % 2:
        raise ValueError(f"size must be even and at most {LARGEST} pixels, got {pixels}")
    checks.callback("progress", progress)
    frames = frames_of(response, speed=speed, fps=fps)
    block = block_of(response)
    with (
        defaults(),
        closing(Scene(response, block, frames, pixels)) as scene,
        film(target, frames.fps, (pixels, pixels), PALETTE) as made,
    ):
        for i in range(frames.time.size):
            made.add(scene.frame(i))
            if progress is not None:
                progress(i + 1, frames.time.size)
    return target
