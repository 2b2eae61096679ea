"""Runs of blocks whose friction is random: every motion with each of some equally probable coefficients."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Progress
from ...core.doubts import warn
from ...core.units import described
from ...models import Block
from ...models.friction import MOST_FRICTION, Contact, Friction
from ...models.outputs import BOTH as OF_BOTH, OUTPUTS, TRIP_VELOCITY
from ...models.runs import Specimen
from ...models.scenes.edge import FALLEN_OFF
from ...models.sliding.law import LEAST_FRICTION, PlaneSlider, Slider, check_free
from ...models.sliding.mode import Mode, demand, demand_in_plane, mode_in_plane, mode_of
from ...models.sliding.trip import OF_TRIPS, TRIP, TRIPS, trips
from ...motions.arrays import AS_GIVEN, DRAW, POLARITY, RECORD, Record, polarity_coordinate
from ...motions.polarity import AS_RECORDED, BOTH, POLARITIES, REVERSED
from ..runs.axes import along_depth, along_width, axes_of
from ..runs.plan import Work
from ..runs.provenance import blocks_of, carried_attributes, factors_of, records_of
from ..runs.request import ENDS, collect, runner_of
from ..runs.runners import Runner, Workers
from ..validity.friction_demand import contact_by_block
from ..validity.plausibility import cut_slides, end_doubts

DRAWS = 100
"""Coefficients of friction that each motion is run with."""
MIRRORED = {"slide_peak": "slide_peak", "slide_forward": "slide_backward", "slide_backward": "slide_forward"}
"""Slips, and the slip that each becomes if the floor moves the other way."""
SLIPS = tuple(MIRRORED)
AFTER = ENDS[1]
"""Way of blocks that slide on when a motion ends."""
TEXTS = {**{name: OUTPUTS[name].attributes for name in (*SLIPS, TRIP_VELOCITY, "mode", FALLEN_OFF)}, TRIPS: OF_TRIPS}
"""Attributes of the results."""
SLIDES_ON = "slides_on"
"""Setting: the numbers of the motions at whose end blocks still slide."""
OF_DRAWS = described("number of the coefficient of friction")
OF_FRICTION = "static coefficient of friction"


def slide_runs(
    runs: xr.Dataset,
    motions: Any,
    friction: float | Friction | Contact | Mapping[str, float | Friction | Contact],
    *,
    draws: int = DRAWS,
    client: Workers = None,
    progress: Progress | None = None,
    polarity: str = AS_RECORDED,
    trip: float | Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Let the blocks of runs slide if their friction is too small for rocking.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs of free blocks that are alike at front and back, as `toppling.ida`, `stripes` or `cloud` return them; of
        pairs of components, too.
    motions : xarray.DataArray or a sequence of them
        The motions of the runs, as for `screen`.
    friction : float, Friction, Contact or mapping
        Static coefficient of friction: a number, a distribution (`toppling.models.friction`), or either for each block
        by its label. A `Contact` also has the ratio of kinetic to static friction, which is 1 without it.
    draws : int
        Number of equally probable coefficients with which each motion is run, the quantiles of (k + 1/2)/draws; one if
        friction is a number.
    client, progress
        As for `toppling.ida`.
    polarity : {"as recorded", "both"}
        ``both`` adds every run the other way, as `ida` does; of sliding blocks it needs no run, since front and back
        change places.  Runs that are both ways already stay as they are.
    trip : float or mapping, optional
        Clear distance from the foot to an obstacle on either side (a joint, a cable, the edge of a carpet), m, > 0. One
        value for all blocks, or values for some by their labels.

    Returns
    -------
    xarray.Dataset
        Runs on (block, model, level, motion), or (block, model, motion), each motion repeated for each draw:

        - slide_peak, slide_forward, slide_backward: m, 0 if the block rests or rocks;
        - ``friction``;
        - ``mode``: 0 rests, 1 slides, 2 rocks; -1 if the vertical acceleration lifts the block, whose slips are then
          NaN;
        - ``fallen_off``, if a block is near an `Edge`: True if it slid over the edge or was lifted, False without an
          edge;
        - ``trip_velocity``, with `trip`: the velocity (m/s) with which a block first meets the obstacle, NaN if it does
          not reach it;
        - ``trips``, with `trip`: True if this velocity is enough to overturn the block, or if it was lifted. It is a
          criterion and no simulation (`toppling.models.sliding.trip`); the obstacle does not change the slips.

        The coordinate `record` is the label of the motion, which makes its runs one trial of every interval. Curves and
        probabilities of `Slip` states, of ``fallen_off`` and of ``trips`` are the total over friction. The attribute
        ``notes`` names the motions at whose end blocks still slide.

    Warns
    -----
    ImplausibleInput
        Motions at whose end blocks still slide.

    Notes
    -----
    From rest a block with a coefficient below b/h slides and never uplifts, since the pressure under a sliding block
    stays within its base. With a larger one it uplifts (`friction_at_uplift`) and is assumed to rock without sliding.
    Integrations of both show that this is valid for h/b >= 3 and coefficients above 1.3 b/h. Between b/h and 1.3 b/h
    outcomes change in up to 17 % of the runs. With less kinetic friction, which ends the rocking, they change in 28 %.
    For h/b <= 2 blocks slide and rock at every friction. Slips do not depend on the size of a block. A smaller
    coefficient may lead to a smaller slip: slips are run, never interpolated between coefficients.

    Under pairs of components the block slides in the plane of the floor, with friction against its velocity
    (`toppling.models.sliding.runs`). Its slide_peak is its maximum distance from its initial position. With a friction
    below b/h along the width it never rocks. With a friction between b/h along the width and b/h along the depth it
    rocks about its width as if it did not slide. If both components together exceed its resistance (`mode`), it slides
    as if it did not rock. The outputs slide_forward, slide_backward and the edge are of the width.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.models.friction import LognormalFriction
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(4)
    >>> runs = tp.ida(tp.catalogue["file-vertical-2-drawer"], tp.HousnerImpact(), shakes, [2.0, 9.8])
    >>> slides = slide_runs(runs, shakes, LognormalFriction(0.5, 0.3), draws=20)
    >>> (slides["mode"] == 1).mean("motion").values.round(2).tolist()  # at 0.2 g, and at 1 g
    [[[0.0, 0.75]]]
    """
    number = checks.count("draws", draws, at_least=1)
    checks.callback("progress", progress)
    mirrored = checks.choice("polarity", polarity, POLARITIES) == BOTH and POLARITY not in runs.coords
    records = records_of(runs, motions)
    plane, plain = bool(axes_of(records)), [along_width(record) for record in records]
    blocks = blocks_of(runs)
    for block in blocks:
        check_free(block)
    if friction is None:
        raise TypeError("friction must be a number or a Friction, got None")
    labels = [block.label for block in blocks]
    contacts, obstacles = contact_by_block(friction, labels), _obstacles(trip, labels)
    if plane and obstacles:
        raise ValueError("trip must be left out for motions of both components: trips are of one component")
    names = (*SLIPS, AFTER, TRIP_VELOCITY) if obstacles else (*SLIPS, AFTER)
    coefficients = np.stack([coefficients_of(contact.friction, number) for contact in contacts])
    if (coefficients == coefficients[:, :1]).all():
        coefficients = coefficients[:, :1]
    factors = factors_of(runs)
    runner = runner_of(client)
    shape = (len(blocks), coefficients.shape[1], factors.shape[1], len(plain))
    slips = {name: np.full(shape, np.nan if name == TRIP_VELOCITY else 0.0) for name in names}
    modes = np.empty(shape, np.int8)
    highest = [slides_below(block, plane) for block in blocks]
    total = sum(int((coefficient < level).sum()) for coefficient, level in zip(coefficients, highest, strict=True))
    done = 0
    for i, (block, coefficient) in enumerate(zip(blocks, coefficients, strict=True)):
        scale = factors[i if factors.shape[0] > 1 else 0]
        modes[i] = _modes(block, coefficient, plain, scale, plane)
        sliding = np.flatnonzero(coefficient < highest[i])
        if sliding.size:
            at = obstacles.get(block.label, math.inf)
            wanted = names if block.label in obstacles else (*SLIPS, AFTER)
            sliders = sliders_of(coefficient[sliding], contacts[i].kinetic_ratio, at, plane)
            slid = slips_of(sliders, plain, scale, runner, wanted)
            for name, values in slid.items():
                # (what rocks about its width does not slide along it alone)
                slips[name][i, sliding] = np.where(modes[i, sliding] == Mode.SLIDES, values, 0.0) if plane else values
        done += sliding.size
        if progress is not None:
            progress(done * scale.size, total * scale.size)
    for values in slips.values():
        values[modes == Mode.AIRBORNE] = np.nan
    on, labels = cut_slides(slips["slide_peak"], slips.pop(AFTER)), [record.label for record in plain]
    doubts = end_doubts(on, labels)
    warn(doubts)
    if mirrored:
        slips = {name: np.concatenate([slip, slips[MIRRORED.get(name, name)]], axis=1) for name, slip in slips.items()}
        modes, coefficients = np.tile(modes, (1, 2, 1, 1)), np.tile(coefficients, 2)
    every: dict[str, Any] = {**slips, "mode": modes}
    if any(block.edge is not None for block in blocks):
        every[FALLEN_OFF] = _fallen_off(blocks, slips)
    if obstacles:
        every[TRIPS] = np.stack(
            [trips(block, slip) for block, slip in zip(blocks, slips[TRIP_VELOCITY], strict=True)]
        ) | (modes == Mode.AIRBORNE)
        for i, block in enumerate(blocks):
            if block.label not in obstacles:
                every[TRIPS][i] = False
    ratios = [float(contact.kinetic_ratio) for contact in contacts]
    settings: dict[str, Any] = {"kinetic_ratio": ratios if len({*ratios}) > 1 else ratios[0], "draws": number}
    settings |= {"polarity": BOTH} if mirrored else {}
    settings |= {"trip": [obstacles.get(block.label) for block in blocks]} if obstacles else {}
    settings |= {SLIDES_ON: np.flatnonzero(on).tolist()} if doubts else {}
    labelled = _labelled(runs, contacts, coefficients, every, settings, mirrored)
    for name in SLIPS if plane else ():
        labelled[name].attrs["long_name"] += OF_BOTH[OUTPUTS[name].both]
    return labelled.assign_attrs(notes=doubts[0].sentence) if doubts else labelled


def _fallen_off(blocks: list[Block], slips: Mapping[str, Array]) -> Any:
    """Return flags of blocks that slid over their edges (block, draw, level, motion)."""
    fallen = np.zeros(slips["slide_forward"].shape, np.bool_)
    for flags, block, forward, backward in zip(
        fallen, blocks, slips["slide_forward"], slips["slide_backward"], strict=True
    ):
        if block.edge is not None:
            flags[...] = block.edge.fallen_off(forward, backward, block.b)
    return fallen


def slides_below(block: Block, plane: bool) -> float:
    """Return the coefficient below which a block slides: its b/h, in the plane that along its depth."""
    return (0.5 * block.depth if plane and block.depth is not None else block.b) / block.h


def number_of_slides(block: Block, friction: Friction, plane: bool, draws: int = DRAWS) -> int:
    """Return the number of slides of one block under each motion at each level in `slide_runs`."""
    coefficients = coefficients_of(friction, draws)
    if (coefficients == coefficients[0]).all():
        coefficients = coefficients[:1]
    return int((coefficients < slides_below(block, plane)).sum())


def coefficients_of(friction: Friction, number: int) -> Array:
    """Return equally probable coefficients in increasing order, the quantiles of (k + 1/2)/number."""
    coefficients = friction.quantile((np.arange(number) + 0.5) / number)
    return np.clip(coefficients, LEAST_FRICTION, MOST_FRICTION)


def _obstacles(trip: float | Mapping[str, float] | None, labels: Sequence[str]) -> dict[str, float]:
    """Return the distances to obstacles (m) by the labels of blocks; ValueError for others and values out of range."""
    if trip is None:
        return {}
    given = dict(trip) if isinstance(trip, Mapping) else dict.fromkeys(labels, trip)
    unknown = [name for name in given if name not in labels]
    if unknown:
        raise ValueError(f"trip must name blocks of the runs, got {unknown[0]!r}")
    return {name: checks.number("trip", distance, at_least=TRIP.at_least, unit="m") for name, distance in given.items()}


def demands(motions: Sequence[Record], factors: Array) -> Array:
    """Return the friction (level, motion) that keeps blocks in place under motions times factors (level, motion)."""
    columns = [demand(motion.acceleration, motion.vertical, factors[:, k].copy()) for k, motion in enumerate(motions)]
    return np.stack(columns, axis=1)


def demands_in_plane(motions: Sequence[Record], factors: Array, level: float) -> Array:
    """Return the same under both components of motions, of a block with this b/h along its width."""
    columns = [
        demand_in_plane(motion.acceleration, along_depth(motion).acceleration, motion.vertical, factors[:, k], level)
        for k, motion in enumerate(motions)
    ]
    return np.stack(columns, axis=1)


def _modes(block: Block, coefficients: Array, motions: Sequence[Record], factors: Array, plane: bool) -> Any:
    """Return the first mode of a block (draw, level, motion); `plane`: under both components."""
    friction, along = coefficients[:, None, None], demands(motions, factors)[None]
    if not plane:
        return mode_of(block, friction, along)
    across = demands([along_depth(motion) for motion in motions], factors)[None]
    both = demands_in_plane(motions, factors, block.b / block.h)[None]
    return mode_in_plane(block, friction, along, across, both)


def sliders_of(coefficients: Array, ratio: float, obstacle: float, plane: bool) -> list[Specimen]:
    """Return sliding blocks with static coefficients (slider,); `plane`: under both horizontal components."""
    if plane:
        return [PlaneSlider(mu, ratio * mu) for mu in coefficients.tolist()]
    return [Slider(mu, mu, ratio * mu, ratio * mu, obstacle) for mu in coefficients.tolist()]


def slips_of(
    sliders: Sequence[Specimen],
    motions: Sequence[Record],
    factors: Array,
    runner: Runner,
    names: tuple[str, ...] = SLIPS,
) -> dict[str, Array]:
    """Return outputs (`SLIPS`, m) of sliders (slider, level, motion) under motions times factors (level, motion).

    Motions are along the width, and have the motions along the depth as companions if blocks slide in the plane.
    Outputs are NaN in runs in which the vertical acceleration takes the weight.
    """
    return collect(Work(sliders, tuple(motions), factors[None], True, names), runner, None).results


def _labelled(
    runs: xr.Dataset,
    contacts: list[Contact],
    coefficients: Array,
    results: Mapping[str, Any],
    settings: dict[str, Any],
    mirrored: bool,
) -> xr.Dataset:
    """Return the results (block, draw, level, motion) as labelled runs, in which the draws of a motion follow it.

    `mirrored`: the second half of the draws are the first with the floor moving the other way.
    """
    per_motion, motions = coefficients.shape[1], runs.sizes["motion"]
    draws = per_motion // 2 if mirrored else per_motion
    dims = ("block", "model", "level", "motion") if "level" in runs.dims else ("block", "model", "motion")

    def on_runs(values: Any) -> Any:
        sequence = np.moveaxis(values, 1, -1).reshape(values.shape[0], 1, values.shape[2], motions * per_motion)
        return sequence if "level" in runs.dims else sequence[:, :, 0]

    every = np.repeat(np.arange(motions), per_motion)
    shared = {"block", "level", "motion"}
    coordinates = {
        name: coordinate.isel(motion=every) if "motion" in coordinate.dims else coordinate
        for name, coordinate in runs.coords.items()
    }
    kept = {
        name: coordinate.variable
        for name, coordinate in coordinates.items()
        if coordinate.dims and {*coordinate.dims} <= shared
    }
    if per_motion > 1:
        labels = [str(value) for value in runs["motion"].values[every]]
        reverse = np.tile(np.arange(per_motion) >= draws, motions)
        names = [label + REVERSED if back else label for label, back in zip(labels, reverse.tolist(), strict=True)]
        if draws > 1:
            names = [f"{name}, friction {k % draws + 1}" for k, name in enumerate(names)]
            kept[DRAW] = xr.Variable("motion", np.tile(np.arange(per_motion) % draws + 1, motions), OF_DRAWS)
        if mirrored:
            kept[POLARITY] = polarity_coordinate(reverse)
        kept[RECORD] = xr.Variable("motion", kept.get(RECORD, kept["motion"]).values, AS_GIVEN)
        kept["motion"] = xr.Variable("motion", np.array(names, dtype=object), runs["motion"].attrs)
    variables = {
        **{name: (dims, on_runs(values), TEXTS[name]) for name, values in results.items()},
        "friction": (("block", "motion"), np.tile(coefficients, (1, motions)), described(OF_FRICTION)),
    }
    sliding = {"friction": [contact.friction.description for contact in contacts], **settings}
    return xr.Dataset(
        variables,
        coords={**kept, "model": xr.Variable("model", np.array(["sliding"], dtype=object), described("law"))},
        attrs={
            **carried_attributes(runs.attrs),
            "title": "Runs of sliding blocks",
            "sliding": json.dumps(sliding, ensure_ascii=False),
        },
    )
