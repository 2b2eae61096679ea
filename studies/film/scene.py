"""The drawing of a film's frames: the block on its floor, to scale, above its rotation over time."""

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
from matplotlib.patches import Polygon
from matplotlib.transforms import Affine2D

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ...models import Block
from ..plots import axes
from ..plots.response import HIGHEST
from ..text.histories import FLAT
from . import fittings
from .frames import Frames, corners, rotated
from .writers import Pixels

INK, STRONG, FALLING, HOLDS = "#000000", axes.COLOURS[0], axes.COLOURS[1], axes.COLOURS[2]
FACE, FALLING_FACE, FLOOR, PAPER = "#CCE3F0", "#F7DFCC", "#B5B5B5", "#FFFFFF"
INCHES = 4.8
"""Side of the figure, in: at 480 pixels letters of 11 points are 15 pixels high, and 12 on a telephone."""
FAR = 1.0
"""Range of floor displacements over the block's larger size, beyond which the view moves with the floor."""
LINE_LENGTH = 56  # letters of a line of the heading
BELOW, ABOVE = 0.20, 0.17  # shares of the view: floor and scale bar, texts
THICK, HIGH = 0.06, 1.08
"""Thickness and height of a wall over the block's height."""
SEEN = 0.16
"""Time that the mark of an impact at a wall is shown, s of the film."""


def _blend(first_colour: str, other: str, steps: int) -> list[str]:
    """Return colours between two colours, as they occur at the smoothed edges of shapes."""
    first, last = np.array(to_rgb(first_colour)), np.array(to_rgb(other))
    return [to_hex(first + (last - first) * i / (steps - 1)).upper() for i in range(steps)]


MIXED = (
    *((INK, PAPER, 24), (STRONG, PAPER, 10), (FALLING, PAPER, 10), (STRONG, FALLING, 6), (STRONG, INK, 5)),
    *((FALLING, INK, 5), (STRONG, FACE, 5), (FALLING, FALLING_FACE, 5), (INK, FACE, 5), (INK, FALLING_FACE, 5)),
    *((STRONG, FLOOR, 3), (FALLING, FLOOR, 3), (HOLDS, PAPER, 8), (HOLDS, FACE, 4), (HOLDS, FALLING_FACE, 4)),
    (HOLDS, FLOOR, 3),
)
"""Pairs of adjacent colours, and the number of colours from one to the other."""
PALETTE = tuple(dict.fromkeys([*(colour for pair in MIXED for colour in _blend(*pair)), FLOOR]))
"""All colours of a frame and those between two adjacent colours, for film formats with a small palette."""


class Scene:
    """The drawing of one film's frames, each `pixels` wide and high."""

    def __init__(self, response: xr.Dataset, block: Block, frames: Frames, pixels: int) -> None:
        self._block, self._frames = block, frames
        self._alpha = block.alpha
        self._balance = block.balances
        # (a lean is drawn as the slope of the floor, with walls square to it)
        self._slope = Affine2D().rotate(-block.lean)
        self._walls = fittings.faces(response, block)
        self._straps = fittings.straps(block, self._walls)
        self._strikes = fittings.strikes(response, self._walls)
        self._breaks = float(response["rupture_time"]) if self._straps else math.inf
        options = json.loads(response.attrs["configuration"])["model"]
        # a block counts as standing inside its elastic zone; without a zone only in the upright position
        self._zone = float(options.get("delta") or 1e-9) * block.alpha
        if block.bed is not None:
            self._zone = block.bed.settlement / block.b
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
        sloped = self._slope + ax.transData
        span = 2.0 * half
        power = 10.0 ** math.floor(math.log10(span / 6.0))
        step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= span / 6.0)
        self._step, self._depth = step, 0.045 * high
        # (a sloping floor is drawn beyond the view, which cuts it)
        low, wide = (self._depth, half) if not self._block.lean else (2.0 * high, 2.0 * half)
        floor = [[middle - wide, 0.0], [middle + wide, 0.0], [middle + wide, -low], [middle - wide, -low]]
        ax.add_patch(Polygon(floor, facecolor=FLOOR, lw=0.0, transform=sloped))
        ax.plot([middle - wide, middle + wide], [0.0, 0.0], color=INK, lw=1.0, transform=sloped)

        # marks on the floor move with it; marks below the floor stay with the ground
        self._marks = self._add_moving(ax, ax.plot([], [], color=INK, lw=1.0, transform=sloped)[0])
        self._earth = self._add_moving(ax, ax.plot([], [], color="#6F6F6F", lw=1.0)[0])
        # a scale bar, one step long
        bar, at = -0.105 * high, middle + half * 0.94
        ax.plot([at - step, at], [bar, bar], color=INK, lw=2.0, solid_capstyle="butt")
        length = f"{step:g} m" if step >= 1.0 else f"{100.0 * step:g} cm"
        ax.text(at - 0.5 * step, bar - 0.02 * high, length, ha="center", va="top", fontsize=9.0)
        self._moved = self._add_moving(ax, ax.text(middle - half * 0.96, -0.09 * high, "", va="top", fontsize=9.0))

        self._slabs = [
            self._add_moving(ax, Polygon([[0.0, 0.0]] * 4, facecolor=FLOOR, edgecolor=INK, lw=0.8, transform=sloped))
            for _ in self._slab_shapes()
        ]
        ghost = Polygon([[0.0, 0.0]] * 4, fill=False, edgecolor="#9A9A9A", lw=1.0, ls="dotted", transform=sloped)
        self._ghost = self._add_moving(ax, ghost)
        body = Polygon([[0.0, 0.0]] * 4, facecolor=FACE, edgecolor=STRONG, lw=1.8, transform=sloped)
        self._body = self._add_moving(ax, body)
        for patch in (*self._slabs, self._ghost, self._body):
            ax.add_patch(patch)
        moving: dict[str, Any] = {"transform": sloped, "clip_on": False}
        self._plumb = self._add_moving(ax, ax.plot([], [], color=INK, lw=0.8, ls="dotted")[0])
        self._centre = self._add_moving(ax, ax.plot([], [], "o", color=INK, ms=4.0, **moving)[0])
        self._corner = self._add_moving(ax, ax.plot([], [], "o", color=FALLING, ms=6.0, mew=0.0, **moving)[0])
        self._lines = []
        for strap in self._straps:
            thick = {"strap": 2.2, "cable": 1.6, "tendon": 1.6}.get(strap.restraint.kind, 4.0)
            ends: dict[str, Any] = {"marker": "s" if strap.restraint.kind == "adhesive" else "o", "ms": 5.0, "mew": 0.0}
            self._lines.append(self._add_moving(ax, ax.plot([], [], color=HOLDS, lw=thick, **ends, **moving)[0]))
        self._hit = self._add_moving(ax, ax.plot([], [], "o", color=FALLING, ms=7.0, mew=0.0, **moving)[0])
        words: dict[str, Any] = {"transform": ax.transAxes, "va": "top", "fontsize": 11.0}
        self._clock = self._add_moving(ax, ax.text(0.02, 0.985, "", **words))
        self._state = self._add_moving(ax, ax.text(0.98, 0.985, "", ha="right", **words))
        self._hold = self._add_moving(ax, ax.text(0.98, 0.90, "", ha="right", **{**words, "fontsize": 9.0}))

    def _slab_shapes(self) -> list[Array]:
        """Return the corners (4, 2) of walls, rails and the ceiling, m, in the frame of the floor."""
        block, shapes = self._block, []
        thick, high = THICK * block.height, HIGH * block.height
        for face in self._walls:
            near = face.x
            if face.rail:
                # the wall is clear of the block's upper edge, which goes beyond the rail
                edge = np.array([[face.side * block.b, block.height]])
                near = float(rotated(block, face.side * face.rotation, 0.0, edge)[0, 0]) + face.side * 0.5 * thick
                top, bottom = face.height, face.height - 0.3 * thick
                shapes.append(np.array([[face.x, bottom], [near, bottom], [near, top], [face.x, top]]))
            far = near + face.side * thick
            shapes.append(np.array([[near, 0.0], [far, 0.0], [far, high], [near, high]]))
        for strap in self._straps:
            x, y = strap.fixed
            if strap.restraint.kind == "pole":
                ends = x - block.width, x + block.width
                shapes.append(np.array([[ends[0], y], [ends[1], y], [ends[1], y + thick], [ends[0], y + thick]]))
            elif strap.restraint.kind in ("strap", "cable", "bracket") and not any(
                wall.side < 0 for wall in self._walls
            ):
                half = 0.5 * thick
                shapes.append(np.array([[x, y - half], [x - half, y - half], [x - half, y + half], [x, y + half]]))
        return shapes

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
        front, back = (angle / self._alpha for angle in self._balance)
        words: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 9.0}
        if self._limit > min(front, back):
            for side in (-back, front):
                ax.axhline(side, color=INK, lw=0.8, ls=(0, (4, 3)))
            ax.text(0.995, front + 0.03, "balance", transform=ax.get_yaxis_transform(), **words)
        for face in self._walls:
            at = face.side * face.rotation / self._alpha
            if abs(at) < self._limit:
                ax.axhline(at, color=INK, lw=0.8, ls="dotted")
                ax.text(0.995, at, "wall", transform=ax.get_yaxis_transform(), **words)
        if first <= self._breaks <= last:
            ax.axvline(self._breaks, color=HOLDS, lw=1.2, ls=(0, (4, 3)))
            late = self._breaks > 0.6 * first + 0.4 * last
            style = {**words, "ha": "right" if late else "left", "color": HOLDS}
            text = f" {self._straps[0].restraint.kind} breaks "
            ax.text(self._breaks, 0.02, text, transform=ax.get_xaxis_transform(), **style)
        ax.set_xlabel("time (s)", fontsize=10.0, labelpad=1.0)
        ax.set_ylabel("rotation θ/α", fontsize=10.0, labelpad=1.0)
        ax.tick_params(labelsize=9.0)
        ax.locator_params(axis="y", nbins=5)
        axes.label(ax)

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
        upright = [corners(self._block, 0.0), *self._slab_shapes()]
        still = np.concatenate([shape + np.array([u, 0.0]) for shape in upright for u in (floor.min(), floor.max())])
        seen = self._slope.transform(np.concatenate([every, still]))
        room = 0.06 * max(self._block.width, self._block.height)
        return float(seen[:, 0].min()) - room, float(seen[:, 0].max()) + room, float(seen[:, 1].max())

    def _move_to_frame(self, i: int) -> None:
        """Move the moving parts to their positions in frame `i`."""
        frames, block = self._frames, self._block
        theta, time, moved = float(frames.rotation[i]), float(frames.time[i]), float(frames.displacement[i])
        floor = 0.0 if self._follows else moved
        earth = -moved if self._follows else 0.0
        self._ghost.set_xy(corners(block, 0.0, floor))
        self._body.set_xy(corners(block, theta, floor))
        past = self._past_balance(i)
        self._body.set_facecolor(FALLING_FACE if past else FACE)
        self._body.set_edgecolor(FALLING if past else STRONG)
        centre = rotated(block, theta, floor, np.array([[block.cm_offset, block.h]]))
        self._centre.set_data(*centre.T)
        if not block.symmetric:  # (its weight acts vertically, on a sloping floor too)
            x, y = self._slope.transform(centre)[0]
            self._plumb.set_data([x, x], [y, -x * math.tan(block.lean)])
        moved_by = np.array([floor, 0.0])
        for slab, shape in zip(self._slabs, self._slab_shapes(), strict=True):
            slab.set_xy(shape + moved_by)
        self._move_straps(i, floor)
        struck = self._struck(i)
        self._hit.set_data(*([], []) if struck is None else (struck.contact(block, theta) + moved_by)[:, None])
        turns = abs(theta) > self._zone
        self._corner.set_data([floor + math.copysign(block.b, theta)] if turns else [], [0.0] if turns else [])
        self._marks.set_data(*self._ticks(floor, -0.15 * self._depth, -0.85 * self._depth))
        self._earth.set_data(*self._ticks(earth, -self._depth, -1.6 * self._depth))
        speed = "" if frames.speed == 1.0 else f"  (speed {frames.speed:g})"
        self._clock.set_text(f"{time:.2f} s{speed}")
        self._state.set_text(self._state_text(i))
        distance = (f"{moved:+.2f} m" if abs(moved) >= 1.0 else f"{100.0 * moved:+.1f} cm").replace("-", "−")
        self._moved.set_text(f"floor {distance}{', view moves with it' if self._follows else ''}")
        curve, share = self._curve
        seen = curve <= time
        self._past.set_data(curve[seen], share[seen])
        self._point.set_data([time], [min(max(float(self._x[i]), -self._limit), self._limit)])

    def _move_straps(self, i: int, floor: float) -> None:
        """Move the lines of the restraint to frame `i`, and write its state."""
        theta, broken = float(self._frames.rotation[i]), self._broken(i)
        for drawn, strap in zip(self._lines, self._straps, strict=True):
            shape = fittings.ends if broken else fittings.line
            points = shape(self._block, strap, theta) + np.array([floor, 0.0])
            drawn.set_data(*points.T)
            drawn.set_color(FALLING if broken else HOLDS)
            drawn.set_linewidth(1.6 if broken else drawn.get_linewidth())
            drawn.set_markevery([0, len(points) - 1] if not broken else [0, 3])
        self._hold.set_text(self._hold_text(i))

    def _broken(self, i: int) -> bool:
        """Return True if the restraint is broken in frame `i`."""
        return bool(self._frames.time[i] >= self._breaks)

    def _past_balance(self, i: int) -> bool:
        """Return True if the block is beyond its balance in frame `i`."""
        theta = float(self._frames.rotation[i])
        return theta > self._balance[0] or theta < -self._balance[1]

    def _struck(self, i: int) -> fittings.Face | None:
        """Return the wall that the block struck just before frame `i`."""
        time = float(self._frames.time[i])
        dt = 1.0 / self._frames.fps
        late = time - self._strikes
        if not ((late >= -0.5 * dt * self._frames.speed) & (late <= SEEN * self._frames.speed)).any():
            return None
        theta = float(self._frames.rotation[i])
        return next((wall for wall in self._walls if wall.side * theta > 0.5 * wall.rotation), None)

    def _hold_text(self, i: int) -> str:
        """Return the state of the restraint in frame `i`; '' without a restraint."""
        if not self._straps:
            return ""
        restraint = self._straps[0].restraint
        if self._broken(i):
            return f"{restraint.kind} broken at {self._breaks:.2f} s"
        pull = fittings.force(restraint, float(self._frames.rotation[i]))
        if pull is None:
            return f"{restraint.kind} holds"
        slack = restraint.slack > 0.0 and pull == 0.0
        return f"{restraint.kind} slack" if slack else f"{restraint.kind}: {pull:.0f} N"

    def _state_text(self, i: int) -> str:
        """Return the state of the block in frame `i` as text."""
        theta = float(self._frames.rotation[i])
        if abs(theta) >= FLAT:
            return "overturned: the model ends here"
        if self._frames.drawn[i]:
            return "record over: a drawn fall"
        if self._past_balance(i):
            leans = any(wall.side * theta > wall.rotation - fittings.LEAST for wall in self._walls)
            return "leans on the wall" if leans else "past its balance"
        if self._struck(i) is not None:
            return "strikes the wall"
        return "rocks" if abs(theta) > self._zone else "stands"

    def _ticks(self, origin: float, upper: float, lower: float) -> tuple[Array, Array]:
        """Return short vertical lines at every step from an origin, across the whole view."""
        left, right = self._middle - self._half, self._middle + self._half
        at = np.arange(math.ceil((left - origin) / self._step), math.floor((right - origin) / self._step) + 1)
        x = origin + self._step * at
        return np.repeat(x, 3), np.tile([upper, lower, np.nan], x.size)


def _heading(response: xr.Dataset, block: Block) -> str:
    """Return the heading: block, law and motion in three lines."""
    pga = float(np.abs(response["floor_acceleration"].values).max()) / STANDARD_GRAVITY
    sizes = f"{block.width:.3g} m × {block.height:.3g} m"
    around = ", ".join(_around(block)) or f"α = {block.alpha:.3g} rad"
    # (without a name a block is called by its sizes)
    called = f"{sizes}, {around}" if block.name is None else f"{block.name}: {sizes}, {around}"
    if block.name is not None and len(called) > LINE_LENGTH:
        called = f"{block.name}: {around}"
    lines = (
        called,
        axes.model_name(str(response.attrs["model"])),
        f"{response.attrs.get('motion', 'no shaking')}, PGA {pga:.2f} g",
    )
    return "\n".join(textwrap.shorten(line, LINE_LENGTH, placeholder=" …") for line in lines)


def _around(block: Block) -> list[str]:
    """Return the features that make a block asymmetric or not freestanding, in short words."""
    features = []
    if block.cm_offset:
        features.append(f"mass {1000.0 * block.cm_offset:+.3g} mm")
    if block.lean:
        features.append(f"lean {math.degrees(block.lean):+.2g}°")
    features = [word.replace("-", "−") for word in features]
    return [*features, *(part.label for part in (block.wall, block.restraint, block.bed) if part is not None)]
