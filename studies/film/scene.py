"""The drawing of a film's frames: the block on its floor, to scale, above its rotation over time.

The parts that do not move are drawn once; each frame draws the moving parts over them.
"""

from __future__ import annotations

import json
import math
import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from ...aliases import Array
from ...models import Block
from ...units import STANDARD_GRAVITY
from ..plots import axes
from ..plots.response import HIGHEST
from ..text.histories import FLAT
from .frames import Frames, corners, rotated
from .writers import Pixels

INK, STRONG, FALLING = "#000000", axes.COLOURS[0], axes.COLOURS[1]
FACE, FALLING_FACE, FLOOR, PAPER = "#CCE3F0", "#F7DFCC", "#B5B5B5", "#FFFFFF"
INCHES = 4.8
"""Side of the figure, in: at 480 pixels letters of 11 points are 15 pixels high, and 12 on a telephone."""
FAR = 1.0
"""Range of floor displacements over the block's larger size, beyond which the view moves with the floor."""
LINE_LENGTH = 56  # letters of a line of the heading
BELOW, ABOVE = 0.20, 0.17  # shares of the view: floor and scale bar, texts


def _blend(one: str, other: str, steps: int) -> list[str]:
    """Return colours between two colours, as they occur at the smoothed edges of shapes."""
    first, last = np.array(to_rgb(one)), np.array(to_rgb(other))
    return [to_hex(first + (last - first) * i / (steps - 1)).upper() for i in range(steps)]


PALETTE = tuple(
    dict.fromkeys(
        [
            *_blend(INK, PAPER, 24),
            *_blend(STRONG, PAPER, 10),
            *_blend(FALLING, PAPER, 10),
            *_blend(STRONG, FALLING, 6),
            *_blend(STRONG, INK, 5),
            *_blend(FALLING, INK, 5),
            *_blend(STRONG, FACE, 5),
            *_blend(FALLING, FALLING_FACE, 5),
            *_blend(INK, FACE, 5),
            *_blend(INK, FALLING_FACE, 5),
            *_blend(STRONG, FLOOR, 3),
            *_blend(FALLING, FLOOR, 3),
            FLOOR,
        ]
    )
)
"""All colours of a frame and those between two adjacent colours, for film formats with a small palette."""


class Scene:
    """The drawing of one film's frames, each `pixels` wide and high."""

    def __init__(self, response: xr.Dataset, block: Block, frames: Frames, pixels: int) -> None:
        self._block, self._frames = block, frames
        self._alpha = block.alpha
        options = json.loads(response.attrs["configuration"])["model"]
        # a block counts as standing inside its elastic zone; without a zone only in the upright position
        self._zone = float(options.get("delta") or 1e-9) * block.alpha
        moved = frames.displacement
        self._follows = float(np.ptp(moved)) > FAR * max(block.width, block.height)
        self._figure = Figure(figsize=(INCHES, INCHES), dpi=pixels / INCHES, facecolor=PAPER)
        self._canvas = FigureCanvasAgg(self._figure)
        self._figure.text(0.5, 0.985, _heading(response, block), ha="center", va="top", fontsize=9.5, linespacing=1.25)
        self._moving: list[tuple[Any, Artist]] = []
        self._stage()
        self._history(response)
        self._canvas.draw()  # type: ignore[no-untyped-call]
        self._still = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Clear the figure, so that its memory is freed."""
        self._figure.clear()

    def frame(self, i: int) -> Pixels:
        """Return frame `i` as RGB, shape (pixels, pixels, 3)."""
        self._move_to_frame(i)
        self._canvas.restore_region(self._still)  # type: ignore[no-untyped-call]
        for ax, artist in self._moving:
            ax.draw_artist(artist)
        pixels = self._canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        return np.asarray(pixels)[..., :3].copy()

    def _stage(self) -> None:
        """Draw the upper part: the floor, the block and the texts."""
        ax = self._figure.add_axes((0.02, 0.385, 0.96, 0.495))
        left, right, top = self._view()
        # the scale is the largest at which the widest and the highest frame fit
        box = ax.get_window_extent()
        scale = min(box.width / (right - left), box.height * (1.0 - BELOW - ABOVE) / top)
        half, high = 0.5 * box.width / scale, box.height / scale
        middle = 0.5 * (left + right)
        ax.set_xlim(middle - half, middle + half)
        ax.set_ylim(-BELOW * high, (1.0 - BELOW) * high)
        ax.set_axis_off()
        self._stage_ax, self._middle, self._half = ax, middle, half
        step = _round_step(2.0 * half)
        self._step, self._depth = step, 0.045 * high
        ax.add_patch(Rectangle((middle - half, -self._depth), 2.0 * half, self._depth, facecolor=FLOOR, lw=0.0))
        ax.plot([middle - half, middle + half], [0.0, 0.0], color=INK, lw=1.0)

        # marks on the floor move with it; marks below the floor stay with the ground
        self._marks = self._add_moving(ax, ax.plot([], [], color=INK, lw=1.0)[0])
        self._earth = self._add_moving(ax, ax.plot([], [], color="#6F6F6F", lw=1.0)[0])
        # a scale bar, one step long
        bar, at = -0.105 * high, middle + half * 0.94
        ax.plot([at - step, at], [bar, bar], color=INK, lw=2.0, solid_capstyle="butt")
        ax.text(at - 0.5 * step, bar - 0.02 * high, _length(step), ha="center", va="top", fontsize=9.0)
        self._moved = self._add_moving(ax, ax.text(middle - half * 0.96, -0.09 * high, "", va="top", fontsize=9.0))

        ghost = Polygon([[0.0, 0.0]] * 4, fill=False, edgecolor="#9A9A9A", lw=1.0, ls="dotted")
        self._ghost = self._add_moving(ax, ghost)
        self._body = self._add_moving(ax, Polygon([[0.0, 0.0]] * 4, facecolor=FACE, edgecolor=STRONG, lw=1.8))
        for patch in (self._ghost, self._body):
            ax.add_patch(patch)
        self._centre = self._add_moving(ax, ax.plot([], [], "o", color=INK, ms=4.0)[0])
        self._corner = self._add_moving(ax, ax.plot([], [], "o", color=FALLING, ms=6.0, mew=0.0)[0])
        words: dict[str, Any] = {"transform": ax.transAxes, "va": "top", "fontsize": 11.0}
        self._clock = self._add_moving(ax, ax.text(0.02, 0.985, "", **words))
        self._state = self._add_moving(ax, ax.text(0.98, 0.985, "", ha="right", **words))

    def _history(self, response: xr.Dataset) -> None:
        """Draw the lower part: rotation over slenderness against time, with a moving marker."""
        ax = self._figure.add_axes((0.145, 0.105, 0.825, 0.255))
        self._x = self._frames.rotation / self._alpha
        time = response["time"].values
        shown = np.abs(response["rotation"].values) < FLAT
        share = response["rotation"].values / self._alpha
        most = float(np.abs(np.concatenate([share[shown], self._x])).max(initial=0.0))
        self._limit = min(max(1.15 * most, 0.02), HIGHEST)
        first, last = float(self._frames.time[0]), float(self._frames.time[-1])
        ax.set_xlim(first, max(last, first + 1e-3))
        ax.set_ylim(-self._limit, self._limit)
        ax.plot(time[shown], share[shown], color="#9A9A9A", lw=0.8)
        self._past = self._add_moving(ax, ax.plot([], [], color=STRONG, lw=1.4)[0])
        self._point = self._add_moving(ax, ax.plot([], [], "o", color=FALLING, ms=7.0, mew=0.0, clip_on=False)[0])
        self._curve = (time[shown], share[shown])
        if self._limit > 1.0:
            for side in (-1.0, 1.0):
                ax.axhline(side, color=INK, lw=0.8, ls=(0, (4, 3)))
            ax.text(0.995, 1.03, "balance", transform=ax.get_yaxis_transform(), ha="right", va="bottom", fontsize=9.0)
        ax.set_xlabel("time (s)", fontsize=10.0, labelpad=1.0)
        ax.set_ylabel("rotation θ/α", fontsize=10.0, labelpad=1.0)
        ax.tick_params(labelsize=9.0)
        ax.locator_params(axis="y", nbins=5)
        axes.grid(ax)

    def _add_moving(self, ax: Any, artist: Any) -> Any:
        artist.set_animated(True)
        self._moving.append((ax, artist))
        return artist

    def _view(self) -> tuple[float, float, float]:
        """Return left, right and top of the area that the block covers in the film, m, in the view's frame."""
        floor = np.zeros_like(self._frames.displacement) if self._follows else self._frames.displacement
        moments = np.unique(np.column_stack([self._frames.rotation, floor]), axis=0)
        every = np.concatenate([corners(self._block, theta, u) for theta, u in moments.tolist()])
        # (the upright block at both ends of the floor's movement is included, since its dotted outline is drawn)
        ends = np.array([floor.min() - self._block.b, floor.max() + self._block.b])
        x = np.concatenate([every[:, 0], ends])
        room = 0.06 * max(self._block.width, self._block.height)
        return float(x.min()) - room, float(x.max()) + room, max(float(every[:, 1].max()), self._block.height)

    def _move_to_frame(self, i: int) -> None:
        """Move the moving parts to their positions in frame `i`."""
        frames, block = self._frames, self._block
        theta, time, moved = float(frames.rotation[i]), float(frames.time[i]), float(frames.displacement[i])
        floor = 0.0 if self._follows else moved
        earth = -moved if self._follows else 0.0
        self._ghost.set_xy(corners(block, 0.0, floor))
        self._body.set_xy(corners(block, theta, floor))
        past = abs(theta) > self._alpha
        self._body.set_facecolor(FALLING_FACE if past else FACE)
        self._body.set_edgecolor(FALLING if past else STRONG)
        self._centre.set_data(*rotated(block, theta, floor, np.array([[0.0, block.h]])).T)
        turns = abs(theta) > self._zone
        self._corner.set_data([floor + math.copysign(block.b, theta)] if turns else [], [0.0] if turns else [])
        self._marks.set_data(*self._ticks(floor, -0.15 * self._depth, -0.85 * self._depth))
        self._earth.set_data(*self._ticks(earth, -self._depth, -1.6 * self._depth))
        speed = "" if frames.speed == 1.0 else f"  (speed {frames.speed:g})"
        self._clock.set_text(f"{time:.2f} s{speed}")
        self._state.set_text(self._state_text(i))
        self._moved.set_text(f"floor {_signed(moved)}{', view moves with it' if self._follows else ''}")
        curve, share = self._curve
        seen = curve <= time
        self._past.set_data(curve[seen], share[seen])
        self._point.set_data([time], [min(max(float(self._x[i]), -self._limit), self._limit)])

    def _state_text(self, i: int) -> str:
        """Return the state of the block in frame `i` as text."""
        theta = abs(float(self._frames.rotation[i]))
        if theta >= FLAT:
            return "overturned: the model ends here"
        if self._frames.drawn[i]:
            return "record over: a drawn fall"
        if theta > self._alpha:
            return "past its balance"
        return "rocks" if theta > self._zone else "stands"

    def _ticks(self, origin: float, upper: float, lower: float) -> tuple[Array, Array]:
        """Return short vertical lines at every step from an origin, across the whole view."""
        left, right = self._middle - self._half, self._middle + self._half
        at = np.arange(math.ceil((left - origin) / self._step), math.floor((right - origin) / self._step) + 1)
        x = origin + self._step * at
        return np.repeat(x, 3), np.tile([upper, lower, np.nan], x.size)


def _heading(response: xr.Dataset, block: Block) -> str:
    """Return the heading: block, law and motion in three lines."""
    pga = float(np.abs(response["floor_acceleration"].values).max()) / STANDARD_GRAVITY
    name = str(response.attrs["block"])
    sizes = f"{block.width:.3g} m × {block.height:.3g} m, α = {block.alpha:.3g} rad"
    lines = (
        sizes if name.startswith("alpha=") else f"{name}: {sizes}",  # (without a name a block is called by its sizes)
        axes.model_name(str(response.attrs["model"])),
        f"{response.attrs.get('motion', 'no shaking')}, PGA {pga:.2f} g",
    )
    return "\n".join(textwrap.shorten(line, LINE_LENGTH, placeholder=" …") for line in lines)


def _round_step(span: float) -> float:
    """Return a length of 1, 2 or 5 times a power of ten, about a sixth of the view."""
    power = 10.0 ** math.floor(math.log10(span / 6.0))
    return next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= span / 6.0)


def _length(metres: float) -> str:
    return f"{metres:g} m" if metres >= 1.0 else f"{100.0 * metres:g} cm"


def _signed(metres: float) -> str:
    text = f"{metres:+.2f} m" if abs(metres) >= 1.0 else f"{100.0 * metres:+.1f} cm"
    return text.replace("-", "−")
