"""Effect of sliding on the blocks of a study: their mode, sliding or rocking, and their slips."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact, doubted
from ...core.units import DIMENSIONLESS, ENDS, METRE, PER_YEAR, described, of_end
from ...core.wording import years_text
from ...fragility import Slip, fit_fragility, overturning_probability, probability_in, reached, slide_runs
from ...fragility.analyses.sliding import SLIDES_ON
from ...fragility.curves.curve import LEAST
from ...fragility.fitting.bootstrap import percentile_interval
from ...fragility.fitting.states import OVERTURNED, State
from ...fragility.runs.provenance import AXES, configuration_of
from ...fragility.runs.runners import Runner
from ...fragility.validity.plausibility import end_doubts
from ...fragility.validity.slab_screen import SQUAT_RATIO
from ...models import Block
from ...models.friction import Contact, FixedFriction, Friction
from ...models.scenes.edge import FALLEN_OFF
from ...models.sliding.law import check_free
from ...models.sliding.mode import Mode
from ...models.sliding.trip import TRIPS
from ...motions.polarity import AS_RECORDED, BOTH
from .estimates import Fit
from .risk import Risk, without_replicates

INSTEAD, NEAR = "slides_instead", "friction_near_uplift"
"""Variables: the chance that friction is below b/h, and that it is between b/h and 1.3 b/h."""
SHARE, SLIP, SLIP_RATE = "slide_probability", "slip_probability", "slip_rate"
GATED, GATED_RATE = "gated_probability", "gated_rate"
TRIP, TRIP_RATE, TRIP_DISTANCE = "trip_probability", "trip_rate", "trip_distance"
FALL_OFF, FALLS = "fall_off", "falls"
"""Beginnings of variables: of falls over an edge, and of falls of either kind."""
MORE_RATE = "more_rate"
OFF = "falling over an edge"
EITHER = "falling over an edge or overturning"
BAND = 1.3
"""Coefficient of friction over b/h up to which outcomes changed in tests if rocking blocks may slide."""
DAMAGE = {0.05: "touches a neighbour", 0.10: "tears its service line", 0.30: "blocks an aisle"}
"""Effects of slips beyond these distances, m (assumed)."""
DISTANCES = tuple(DAMAGE)
LARGE = 0.1
"""Chance of a friction just above b/h from which on a block is named."""


@dataclass(frozen=True)
class Slides:
    """Friction of blocks, also by label, ratios, distances to obstacles and slips, m, and polarity of uneven edges."""

    friction: Friction
    kinetic_ratio: float = 1.0
    distances: tuple[float, ...] = DISTANCES
    polarity: str = BOTH
    frictions: Mapping[str, tuple[Friction, float | None]] = field(default_factory=dict)
    trip: float | None = None
    trips: Mapping[str, float] = field(default_factory=dict)

    def friction_of(self, block: Block) -> Friction:
        """Return the friction of a block."""
        return self.frictions[block.label][0] if block.label in self.frictions else self.friction

    def ratio_of(self, block: Block) -> float:
        """Return kinetic over static friction of a block."""
        ratio = self.frictions[block.label][1] if block.label in self.frictions else None
        return self.kinetic_ratio if ratio is None else ratio

    def exact(self, blocks: Sequence[Block]) -> list[str]:
        """Return the labels of the blocks that may slide and whose coefficient is assumed to be known exactly."""
        return [blocks[i].label for i in free_of(blocks) if isinstance(self.friction_of(blocks[i]), FixedFriction)]

    def trip_of(self, block: Block) -> float | None:
        """Return the distance from the foot of a block to an obstacle, m; None if there is none."""
        return self.trips.get(block.label, self.trip)

    def of(
        self,
        runs: xr.Dataset,
        motions: Any,
        blocks: Sequence[Block],
        fit: Fit,
        risk: Risk | None,
        falls: Mapping[str, xr.DataArray],
        client: Runner,
    ) -> xr.Dataset:
        """Return the probabilities of sliding and of slips, and of overturning if blocks rock.

        `runs` are of blocks that cannot slide. `falls` are the results on their falls, ``probability`` at levels,
        ``rate`` and its interval with a hazard. `client` receives the further runs block by block. ``slides_instead``
        is the probability of a friction below b/h, with which the block slides and never rocks.
        ``friction_near_uplift`` is the probability of a friction between b/h and 1.3 b/h; NaN for restrained or
        asymmetric blocks.
        """
        free = free_of(blocks)
        parts: list[xr.Dataset] = []
        near: list[xr.Dataset] = []
        tripped: list[xr.Dataset] = []
        cut: set[int] = set()
        for k, i in enumerate(free if has_levels(runs) else []):
            by_edge = blocks[i].edge is not None and fit.state == OVERTURNED
            # what else is known of the rocking runs stays in its file: peaks take more memory than flags
            rocking = runs.drop_vars({*runs.data_vars} - ({"overturned"} if by_edge else set())).isel(block=[i])
            slid = self._run(rocking, motions, blocks[i], client)
            most = self._most(slid, blocks[i])
            parts.append(self._of_block(slid, fit, risk, most))
            cut |= set(json.loads(slid.attrs["sliding"]).get(SLIDES_ON, ()))
            if self.trip_of(blocks[i]) is not None:
                tripped.append(self._trips(slid, fit, risk, most))
            if by_edge:
                near.append(self._falls(slid, rocking, fit, risk, most))
            del rocking, slid  # before the runs of the next block exist
            client.tell("slips", k + 1, len(free))
        results = self.chances(blocks, in_plane(runs))
        if tripped:
            near_by = [self.trip_of(block) if is_free(block) else None for block in blocks]
            distances = [math.nan if at is None else at for at in near_by]
            results[TRIP_DISTANCE] = ("block", distances, described("distance to an obstacle, or NaN", METRE))
        for some in filter(None, (parts, near, tripped)):
            of_free = xr.concat(some, "block", coords="minimal", compat="override").reindex(block=runs["block"].values)
            results = results.merge(of_free, compat="override", join="exact")
        if near and risk is not None:
            results = results.merge(_either(results, falls, risk.years), compat="override", join="exact")
            results = results.drop_vars([f"{MORE_RATE}{end}" for end in ENDS], errors="ignore")
        results = results.assign(gated(results[INSTEAD], falls))
        return results.assign_attrs({SLIDES_ON: sorted(cut)} if cut else {})

    def chances(self, blocks: Sequence[Block], plane: bool) -> xr.Dataset:
        """Return the chances of the friction itself (`of`) on block, NaN for blocks that are held or uneven."""
        chances = np.full((2, len(blocks)), np.nan)
        for i in free_of(blocks):
            friction, level = self.friction_of(blocks[i]), blocks[i].b / blocks[i].h
            chances[:, i] = friction.below(np.array(level)), near_uplift(friction, [blocks[i]], plane)[0]
        slides = described("chance of a friction with which the block slides, never rocks")
        return xr.Dataset(
            {INSTEAD: ("block", chances[0], slides), NEAR: ("block", chances[1], described(of_near(plane)))},
            coords={"block": np.array([block.label for block in blocks], dtype=object)},
        )

    def _run(self, rocking: xr.Dataset, motions: Any, block: Block, client: Runner) -> xr.Dataset:
        """Return the runs of one block with random friction; both ways if front and back differ."""
        edge = block.edge
        sided = edge is not None and edge.front != edge.back
        polarity = self.polarity if sided else AS_RECORDED
        contact = Contact(self.friction_of(block), self.ratio_of(block))
        return slide_runs(rocking, motions, contact, client=client, polarity=polarity, trip=self.trip_of(block))

    def _most(self, runs: xr.Dataset, block: Block) -> float:
        """Return the chance that a block slides in the strongest shaking: its friction is below b/h, or it is lifted.

        Under both components it may also slide with a friction below half the depth over h.
        """
        if (runs["mode"] == Mode.AIRBORNE).any():
            return 1.0
        half = max(block.b, 0.5 * (block.depth or 0.0)) if in_plane(runs) else block.b
        return float(self.friction_of(block).below(np.array(half / block.h)))

    def _of_block(self, runs: xr.Dataset, fit: Fit, risk: Risk | None, most: float) -> xr.Dataset:
        """Return the chances of sliding and of slips of one block."""
        states = [Slip(distance) for distance in self.distances]
        slid = runs.assign(overturned=runs["mode"] == Mode.SLIDES)
        share = overturning_probability(slid, fit.confidence)["probability"].isel(model=0, drop=True)
        variables = {SHARE: bare(share).assign_attrs(described("probability that the block slides"))}
        observed = [overturning_probability(runs, fit.confidence, state) for state in states]
        for end, old in zip(ENDS, ("probability", "lower", "upper"), strict=True):
            variables[f"{SLIP}{end}"] = _stacked(
                [shares[old] for shares in observed], "probability of a greater slip", end
            )
        if risk is not None:
            rates = [self._rates(runs, state, fit, risk, most) for state in states]
            for end in ENDS:
                if all(f"rate{end}" in rate for rate in rates):
                    of_slips = [rate[f"rate{end}"] for rate in rates]
                    variables[f"{SLIP_RATE}{end}"] = _stacked(of_slips, "annual rate of a greater slip", end)
        slip = xr.Variable("slip", list(self.distances), described("slip that is exceeded", METRE))
        return xr.Dataset(variables).drop_vars("model", errors="ignore").assign_coords(slip=slip)

    def _trips(self, runs: xr.Dataset, fit: Fit, risk: Risk | None, most: float) -> xr.Dataset:
        """Return the chances of one block to trip over the obstacle near it."""
        chance = overturning_probability(runs, fit.confidence, TRIPS).isel(model=0, drop=True)
        text = "that the block slides into an obstacle, fast enough to turn over it"
        variables = {}
        for end, old in zip(ENDS, ("probability", "lower", "upper"), strict=True):
            variables[f"{TRIP}{end}"] = _named(chance[old], f"probability {text}", end)
        if risk is not None:
            rates = self._rates(runs, TRIPS, fit, risk, most).isel(model=0, drop=True)
            for end in ENDS:
                if f"rate{end}" in rates:
                    variables[f"{TRIP_RATE}{end}"] = _named(
                        rates[f"rate{end}"], f"annual rate at which {text[5:]}", end
                    )
        return xr.Dataset(variables)

    def _falls(self, runs: xr.Dataset, rocking: xr.Dataset, fit: Fit, risk: Risk | None, most: float) -> xr.Dataset:
        """Return chances of a block near an edge to fall off, and to fall at all; `more_rate`: the rise of its rate."""
        off = overturning_probability(runs, fit.confidence, FALLEN_OFF).isel(model=0, drop=True)
        ways = runs.sizes["motion"] // rocking.sizes["motion"]
        overturned = reached(rocking, OVERTURNED).isel(motion=np.repeat(np.arange(rocking.sizes["motion"]), ways))
        rest = {name: coordinate.variable for name, coordinate in runs.coords.items() if name != "model"}

        def with_flags(flags: Any, laws: Any) -> xr.Dataset:
            coordinates = {**rest, "model": ("model", laws, rocking["model"].attrs)}
            return xr.Dataset({"overturned": (overturned.dims, flags)}, coordinates, runs.attrs)

        laws = rocking["model"].values
        either = overturned.values | runs[FALLEN_OFF].values
        both = overturning_probability(with_flags(either, laws), fit.confidence)
        variables = {}
        for end, old in zip(ENDS, ("probability", "lower", "upper"), strict=True):
            variables[f"{FALL_OFF}_probability{end}"] = _named(off[old], f"probability of {OFF}", end)
            variables[f"{FALLS}_probability{end}"] = _named(both[old], f"probability of {EITHER}", end)
        if risk is not None:
            rates = self._rates(runs, FALLEN_OFF, fit, risk, most).isel(model=0, drop=True)
            pairs = [*(f"{law}, either" for law in laws), *(f"{law}, alone" for law in laws)]
            flags = np.concatenate([either, overturned.values], axis=overturned.dims.index("model"))
            curves = self._curve(with_flags(flags, np.array(pairs, dtype=object)), OVERTURNED, fit)
            either, alone = (
                curves.isel(model=part).assign_coords(model=laws)
                for part in (slice(None, len(laws)), slice(len(laws), None))
            )
            low = risk.rates(alone, fit.confidence, LEAST)
            raised = _difference(_rates_up_to(most, either, fit, risk, alone), low, fit.confidence)
            for end in ENDS:
                if f"rate{end}" in rates:
                    variables[f"{FALL_OFF}_rate{end}"] = _named(rates[f"rate{end}"], f"annual rate of {OFF}", end)
                    variables[f"{MORE_RATE}{end}"] = raised[f"rate{end}"]
        return xr.Dataset(variables)

    def _rates(self, runs: xr.Dataset, state: State, fit: Fit, risk: Risk, most: float) -> xr.Dataset:
        """Return the rates of a slip or a fall, which has at most the chance `most`."""
        return _rates_up_to(most, self._curve(runs, state, fit), fit, risk)

    def _curve(self, runs: xr.Dataset, state: State, fit: Fit) -> xr.Dataset:
        """Return the curve of a slip or a fall, which need not rise to 1: a block with much friction never slides."""
        return fit_fragility(
            runs,
            fit.confidence,
            form="isotonic",
            replicates=fit.replicates,
            seed=fit.seed,
            keep_replicates=True,
            state=state,
        )


def free_of(blocks: Sequence[Block]) -> list[int]:
    """Return the places of the blocks whose sliding is known (`is_free`)."""
    return [i for i, block in enumerate(blocks) if is_free(block)]


def gated(slides: xr.DataArray, falls: Mapping[str, xr.DataArray]) -> dict[str, xr.Variable]:
    """Return ``gated_probability`` and ``gated_rate`` (`Slides.of`) of the results on falls."""
    rocks = 1.0 - slides.variable
    variables = {}
    for name, ungated, text, units in (
        (GATED, "probability", "probability of overturning where blocks slide instead", DIMENSIONLESS),
        (GATED_RATE, "rate", "annual rate of overturning where blocks slide instead", PER_YEAR),
    ):
        if ungated in falls:
            dims = falls[ungated].dims
            values = (falls[ungated].variable * rocks).transpose(*dims)
            variables[name] = xr.Variable(dims, values.values, described(text, units))
    return variables


def _rates_up_to(most: float, curves: xr.Dataset, fit: Fit, risk: Risk, base: xr.Dataset | None = None) -> xr.Dataset:
    """Return the rates of tabulated curves that rise to a limit above their levels: `most` more than the top of `base`.

    A rate is linear in its curve, so the curve over its limit, which rises to 1 (`OUTSIDE`), has the rate over the
    limit. The lower end assumes no rise above the levels. For an event in no run, the upper end is the rate of the
    upper ends at the levels, within the limit.
    """
    limits, over = {}, {}
    for name in ("probability", "probability_sample"):
        if name in curves:
            top = 0.0 * curves[name] if base is None else base[name]
            limits[name] = (top.isel(level=-1, drop=True) + most).clip(max=1.0)
            over[name] = (curves[name] / limits[name].where(limits[name] > 0.0, 1.0)).clip(max=1.0)
    limit = limits["probability"]
    limited = curves.assign(over)
    rates, least = risk.rates(limited, fit.confidence), risk.rates(limited, fit.confidence, LEAST)
    scaled = {"rate": rates["rate"] * limit}
    if "rate_lower" in rates:
        last = curves["level"] == curves["level"][-1]
        upper = curves["probability_upper"]
        unseen = upper.where((upper < limit) & ~last, limit)
        bound = risk.rates(without_replicates(curves).assign(probability=unseen), fit.confidence, LEAST)["rate"]
        seen = (curves["probability"] > 0.0).any("level")
        scaled["rate_lower"] = least["rate_lower"] * limit
        scaled["rate_upper"] = (rates["rate_upper"] * limit).where(seen, bound)
        scaled["rate_sample"] = rates["rate_sample"] * limits.get("probability_sample", limit)
    for name, values in scaled.items():
        rates[name] = rates[name].copy(data=values.transpose(*rates[name].dims).values)
    return rates


def _either(results: xr.Dataset, falls: Mapping[str, xr.DataArray], years: float) -> xr.Dataset:
    """Return the rate of either fall, and chances of both in years: ends are of two quantities that grow together."""
    never = (falls["probability"] == 0.0).all("level")  # (then the rate of overturning counts as 0)
    more: dict[str, xr.DataArray] = {}
    for end in ENDS:
        if f"{MORE_RATE}{end}" not in results or f"rate{end}" not in falls:
            continue
        plain = falls[f"rate{end}"].where(~never, 0.0)
        rate = (plain + results[f"{MORE_RATE}{end}"].variable).transpose(*plain.dims).assign_attrs(units=PER_YEAR)
        more[f"{FALLS}_rate{end}"] = _named(rate, f"annual rate of {EITHER}", end)
        for name, text in ((FALL_OFF, OFF), (FALLS, EITHER)):
            of = more[f"{FALLS}_rate{end}"] if name == FALLS else results[f"{FALL_OFF}_rate{end}"]
            chance = of.copy(data=probability_in(of.values, years)).assign_attrs(units=DIMENSIONLESS)
            more[f"{name}_risk_probability{end}"] = _named(chance, f"probability of {text} in {years_text(years)}", end)
    return xr.Dataset(more)


def _difference(high: xr.Dataset, low: xr.Dataset, confidence: float) -> dict[str, xr.DataArray]:
    """Return the difference of two rates, at least 0, with its interval over their common samples."""
    dims = high["rate"].dims
    rates = {"rate": (high["rate"] - low["rate"]).clip(0.0)}
    if "rate_sample" in high and "rate_sample" in low:
        samples = (high["rate_sample"] - low["rate_sample"]).clip(0.0)
        weights = (
            None if "weight" not in high.coords else np.tile(high["weight"].values, samples.sizes.get("replicate", 1))
        )
        values = samples.transpose(*dims, *(dim for dim in ("replicate", "realisation") if dim in samples.dims)).values
        ends = percentile_interval(values.reshape(*high["rate"].shape, -1), confidence, weights)
        rates |= {
            f"rate{end}": rates["rate"].copy(data=end_values)
            for end, end_values in zip(ENDS[1:], ends[:2], strict=True)
        }
    return {
        name: bare(values_of).assign_attrs(units=PER_YEAR, long_name="raise of the rate")
        for name, values_of in rates.items()
    }


def in_plane(runs: xr.Dataset) -> bool:
    """Return True for runs whose motions have both horizontal components, under which blocks slide in the plane."""
    return bool(configuration_of(runs).get(AXES))


def near_uplift(friction: Friction, blocks: Sequence[Block], plane: bool) -> Array:
    """Return the chance (block,) of a friction between b/h and 1.3 b/h; in the plane along the width or the depth."""
    width = np.array([block.b / block.h for block in blocks])
    chance: Array = friction.below(BAND * width) - friction.below(width)
    if plane:
        depth = np.array([0.5 * (block.depth or block.width) / block.h for block in blocks])
        chance = chance + friction.below(BAND * depth) - friction.below(np.clip(BAND * width, depth, BAND * depth))
    return chance


def of_near(plane: bool) -> str:
    """Return the description of `near_uplift`, for a long name."""
    return "chance of a friction between b/h and 1.3 b/h" + (", along the width or the depth" if plane else "")


def slide_notes(
    results: xr.Dataset,
    blocks: Sequence[Block],
    exact: Sequence[str],
    motions: Sequence[str] = (),
    plane: bool = False,
) -> list[Fact]:
    """Return the limits of the results on sliding; `exact`: labels of blocks whose friction has no dispersion."""
    on = np.isin(np.arange(len(motions)), results.attrs.get(SLIDES_ON, []))
    facts = doubted(doubt.sentence for doubt in end_doubts(on, motions))
    if TRIP in results:
        facts.append(Fact("sliding.trip_criterion"))
    if plane and any(map(is_free, blocks)):
        facts.append(Fact("sliding.in_plane"))
    near = [
        str(value)
        for value, chance in zip(results["block"].values, results[NEAR].values, strict=True)
        if chance > LARGE
    ]
    chance = float(np.fmax.reduce(results[NEAR].values, initial=0.0))
    for what, value, named in (
        ("sliding.held", math.nan, [block.label for block in blocks if not is_free(block)]),
        ("sliding.friction_near_uplift", chance, near),
        (
            "sliding.squat",
            math.nan,
            [block.label for block in blocks if is_free(block) and block.h < SQUAT_RATIO * block.b],
        ),
    ):
        if named:
            facts.append(Fact(what, value, names=tuple(named), more={"plane": plane}))
    return [*facts, Fact("friction.exact", names=tuple(exact))] if exact else facts


def edge_notes(results: xr.Dataset, blocks: Sequence[Block], known: bool, state: State) -> list[Fact]:
    """Return the reason why falls over the edges of blocks are not evaluated, or nothing; `known`: with friction."""
    near = tuple(block.label for block in blocks if block.edge is not None)
    cloud, one_way = not has_levels(results), state != OVERTURNED
    why = "friction" if not known else "cloud" if cloud else "state" if one_way else ""
    return [Fact("sliding.edge_unknown", names=near, more={"why": why})] if near and why else []


def is_free(block: Block) -> bool:
    """Return True for a block whose sliding is known: not held, and alike at front and back."""
    try:
        check_free(block)
    except ValueError:
        return False
    return True


def _named(values: xr.DataArray, text: str, end: str) -> xr.DataArray:
    """Return values without other coordinates, as the estimate or an end of the interval of `text`."""
    return bare(values).assign_attrs(units=values.attrs["units"], long_name=of_end(end, text))


def _stacked(values: Sequence[xr.DataArray], text: str, end: str) -> xr.DataArray:
    """Join the values of slips along a dimension after block; `end`: which end of the interval they are."""
    plain = [value.isel(model=0, drop=True) for value in values]
    stacked = xr.concat([bare(value_of) for value_of in plain], "slip", coords="minimal", compat="override")
    return _named(stacked.transpose("block", "slip", ...), text, end).assign_attrs(units=values[0].attrs["units"])


def has_levels(runs: xr.Dataset) -> bool:
    """Return True for runs whose probabilities are known at levels: all except runs of a cloud."""
    return "level" in runs.dims or "stripe" in runs.coords


def bare(values: xr.DataArray) -> xr.DataArray:
    """Return an array without the coordinates that are no dimensions."""
    return values.drop_vars([name for name in values.coords if name not in values.dims])
