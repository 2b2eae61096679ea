"""Small datasets for figures, made by hand: no engine behind them, so that images change with the drawing alone.

`faults` says what a reader would stumble over in a figure: texts over each other, off the sheet, or small.
"""

import json
import math

import numpy as np
import xarray as xr
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from scipy.special import ndtr

from toppling.fragility.numerics.proportions import wilson_interval

LAWS = ["housner e=e_R", "energy-consistent e=e_R δ=0.05", "discrete e=0.9 δ=0.05"]
MODELS = {"model": LAWS, "law": ("model", ["housner", "energy-consistent", "discrete"])}
LEVELS = np.geomspace(0.5, 8.0, 9)
PGA = {"units": "m s-2", "long_name": "peak ground acceleration", "im": "pga"}
SMALLEST = 8.0
TITLE = "Figures by hand"


def curves(blocks=("shelf", "rack")):
    """Curves and observed fractions of 50 motions."""
    median = 2.0 * (1.0 + 0.5 * np.arange(len(blocks)))[:, None] * np.array([1.0, 1.1, 0.8])
    falls = np.rint(50.0 * ndtr(np.log(LEVELS / median[..., None]) / 0.4)).astype(int)
    lower, upper = wilson_interval(falls, np.full_like(falls, 50))
    on, over = ("block", "model"), ("block", "model", "level")
    return xr.Dataset(
        {
            "probability": (over, falls / 50.0),
            "lower": (over, lower),
            "upper": (over, upper),
            "median": (on, median, {"units": "m s-2"}),
            "half_level": (on, median, {"units": "m s-2"}),
            "dispersion": (on, np.full(median.shape, 0.4)),
            "converged": (on, np.ones(median.shape, bool)),
        },
        {
            "block": list(blocks),
            **MODELS,
            "level": ("level", LEVELS, PGA),
            "motion": [f"m{i}" for i in range(50)],
            "width": ("block", np.full(len(blocks), 0.4)),
            "height": ("block", np.full(len(blocks), 1.8)),
            "alpha": ("block", np.full(len(blocks), 0.22)),
        },
        {"title": TITLE, "form": "lognormal", "confidence": 0.95, "im": "pga", "kind": "fragility"},
    )


def cloud():
    """300 motions, each once: who falls is decided by where 7 i mod 100 lies under the curve."""
    at = np.geomspace(0.3, 9.0, 300)
    chance = ndtr(np.log(at[None, None, :] / np.array([2.0, 2.2, 1.6])[None, :, None]) / 0.4)
    fell = (np.arange(300) * 7 % 100 + 0.5) / 100.0 < chance
    found = curves(("shelf",)).drop_vars(["probability", "lower", "upper"]).drop_dims(["level", "motion"])
    return found.assign(overturned=(("block", "model", "motion"), fell)).assign_coords(
        motion=[f"m{i}" for i in range(300)], intensity=("motion", at, PGA)
    )


def adaptive(place=2.0, spread=0.4, each=3, motions=240):
    """Runs at levels of their own under a known curve: most at a few levels near its median, the others far below it.

    The fractions of falls near any level are those of the curve, as even as can be.
    """
    far = np.geomspace(0.02 * place, 0.7 * place, motions * each // 3)
    near = place * np.exp(spread * np.linspace(-0.2, 0.2, motions * each - far.size))
    at = np.concatenate([far, near])
    # (steps of the golden section are evenly spread over 0 to 1, however many of them are taken)
    fell = np.arange(at.size) * (math.sqrt(5.0) - 1.0) / 2.0 % 1.0 < ndtr(np.log(at / place) / spread)
    found = curves(("shelf",)).isel(model=[0]).drop_vars(["probability", "lower", "upper"]).drop_dims("motion")
    on = ("block", "model")
    found = found.drop_dims("level").assign(
        median=(on, [[place]], {"units": "m s-2"}), dispersion=(on, [[spread]]), overturned=("run", fell)
    )
    return found.assign_coords(
        intensity=("run", at, PGA),
        run_block=("run", np.zeros(at.size, int)),
        run_model=("run", np.zeros(at.size, int)),
        run_motion=("run", np.arange(at.size) % motions),
        block_number=("block", [0]),
        model_number=("model", [0]),
        motion=[f"m{i}" for i in range(motions)],
    )


def rates(above=0.35):
    """Annual rates, with a tail of `above` from beyond the hazard curve's levels."""
    edges = np.geomspace(0.4, 6.0, 21)
    middle = np.sqrt(edges[1:] * edges[:-1])
    share = np.exp(-0.5 * (np.log(middle / np.array([2.0, 2.5, 1.5])[:, None]) / 0.35) ** 2)
    tail = np.array([0.5, 1.0, 0.2]) * above
    share = share / share.sum(-1, keepdims=True) * (1.0 - tail)[:, None]
    rate = np.array([[4e-4, 2e-4, 9e-4], [8e-5, 5e-5, 2e-4]])
    on = ("block", "model")
    return xr.Dataset(
        {
            "rate": (on, rate),
            "rate_lower": (on, 0.8 * rate),
            "rate_upper": (on, 1.3 * rate),
            "share": ((*on, "bin"), np.stack([share, share])),
            "share_below": (on, np.zeros((2, 3))),
            "share_above": (on, np.stack([tail, tail])),
        },
        {
            "block": ["shelf", "rack"],
            **MODELS,
            "bin": ("bin", middle, PGA),
            "bin_lower": ("bin", edges[:-1], PGA),
            "bin_upper": ("bin", edges[1:], PGA),
        },
        {"title": TITLE, "confidence": 0.95},
    )


def dear(floors=4):
    """Values of some 100 000 on each of many floors under one law, which make long numbers beside the axes."""
    whole = assessment(1)
    values = whole[[name for name in whole.data_vars if name.startswith("loss_") and "rate" not in name]]
    values = 850.0 * values.isel(place=[0, *[2] * floors]).assign_coords(motion=whole["motion"])
    here = [f"floor {i + 1}" for i in range(floors)]
    return values.assign_coords(
        place=["building", *here],
        item=here,
        floor=("block", [str(i + 1) for i in range(floors)]),
        count=("block", [5] * floors),
        value=("block", [850.0 * 110.0] * floors),
        anchored=("block", [False] * floors),
    ).assign_attrs(whole.attrs)


def assessment(laws=3):
    """An inventory on two floors: 3 + 5 pieces, with a hazard."""
    level = np.geomspace(0.5, 8.0, 8)
    place = ["building", "floor 0", "floor 3"]
    most = np.array([8.0, 3.0, 5.0])
    median = np.array([2.0, 2.4, 1.6])
    mean = most[None, :, None] * ndtr(np.log(level / median[:, None, None]) / 0.5)
    spread = np.stack([mean * 0.4, mean, np.minimum(1.6 * mean, most[None, :, None])], -1)
    count = np.arange(1.0, 9.0)
    worth = np.geomspace(10.0, 900.0, 12)
    number = (
        1e-2
        * np.exp(-0.6 * count)
        * np.where(count <= most[:, None], 1.0, 0.0)
        / np.array([1, 1.5, 0.7])[:, None, None]
    )
    loss = (
        1e-2
        / (1.0 + worth / 40.0)
        * np.where(worth < 110.0 * most[:, None], 1.0, 0.0)
        * np.array([1, 0.7, 1.3])[:, None, None]
    )
    at, year = ("model", "place", "level"), ("model", "place")
    found = {}
    for name, scale, rate in (("number", 1.0, number), ("loss", 110.0, loss)):
        found |= {
            f"{name}_mean": (at, scale * mean),
            f"{name}_mean_lower": (at, 0.9 * scale * mean),
            f"{name}_mean_upper": (at, np.minimum(1.1 * mean, most[None, :, None]) * scale),
            f"{name}_quantile": ((*at, "quantile"), scale * spread),
            f"{name}_rate": ((*year, f"{name}_threshold"), rate),
            f"{name}_rate_lower": ((*year, f"{name}_threshold"), 0.7 * rate),
            f"{name}_rate_upper": ((*year, f"{name}_threshold"), 1.4 * rate),
            f"annual_{name}": (year, rate.sum(-1)),
        }
    whole = xr.Dataset(
        found,
        {
            **MODELS,
            "place": place,
            "level": ("level", level, PGA),
            "quantile": [0.1, 0.5, 0.9],
            "number_threshold": count,
            "loss_threshold": worth,
            "block": ["shelf", "rack"],
            "floor": ("block", ["0", "3"]),
            "count": ("block", [3, 5]),
            "value": ("block", [110.0, 110.0]),
            "anchored": ("block", [False, False]),
            "motion": np.arange(40),
        },
        {"title": TITLE, "confidence": 0.95, "currency": "EUR", "im": "pga"},
    )
    return whole.isel(model=slice(laws))


def ranking(laws=3, items=("shelf", "rack", "a cabinet with a long name, loaded on top", "cart")):
    """What anchoring saves."""
    n = len(items)
    saving = np.linspace(4.0, 1.0, n) * np.array([1.0, 0.8, 1.5])[:, None]
    left = saving.sum(-1, keepdims=True) - np.concatenate([np.zeros((3, 1)), np.cumsum(saving, -1)], -1)
    on, steps = ("model", "block"), ("model", "step")
    units = {"units": "EUR year-1"}
    found = xr.Dataset(
        {
            "rank": (on, np.tile(np.arange(1, n + 1), (3, 1))),
            "saving": (on, saving, units),
            "saving_lower": (on, 0.8 * saving),
            "saving_upper": (on, 1.2 * saving),
            "alone": (on, 1.3 * saving),
            "left": (steps, left, units),
            "left_lower": (steps, 0.8 * left),
            "left_upper": (steps, 1.2 * left),
            "total_cost": (steps, np.tile(100.0 * np.arange(n + 1), (3, 1))),
        },
        {**MODELS, "block": list(items), "floor": ("block", ["3"] * n), "step": np.arange(n + 1)},
        {
            "title": TITLE,
            "confidence": 0.95,
            "currency": "EUR",
            "per_cost": 0,
            "objective_text": "expected annual value overturned",
        },
    )
    return found.isel(model=slice(laws))


def measured():
    """Measures ranked for one block under three laws."""
    names = ["pga", "pgv", "arias", "AvgSa(0.2 0.4 0.6 0.8 1.0)"]
    beta = np.array([0.5, 0.3, 0.4, 0.28]) * np.array([1.0, 1.1, 0.9])[:, None]
    on = ("block", "model", "measure")
    return xr.Dataset(
        {
            "dispersion": (on, beta[None]),
            "amplitude_dispersion": (on, beta[None]),
            "amplitude_dispersion_lower": (on, 0.8 * beta[None]),
            "amplitude_dispersion_upper": (on, 1.25 * beta[None]),
            "rank": (on, beta[None].argsort(-1).argsort(-1) + 1),
            "distinguishable": (on, beta[None] > 0.35),
            "power": ("measure", [1.0, 1.0, 2.0, 1.0]),
            "status": (on, np.full((1, 3, 4), "ok")),
        },
        {"block": ["shelf"], **MODELS, "measure": names, "measure_long_name": ("measure", ["ground motion"] * 4)},
        {"title": TITLE, "confidence": 0.95, "motions": 60},
    )


def uncertain(blocks=("shelf",)):
    """An uncertainty study of blocks under three laws."""
    median = np.array([2.0, 2.2, 1.6])
    p = np.stack([ndtr(np.log(LEVELS / median[:, None]) / 0.5)] * len(blocks))
    spread = np.stack([p**2, p, 1.0 - (1.0 - p) ** 2], -1)
    share = np.array([0.3, 0.1, 0.2, 0.15, 0.25])
    names = ["motion", "model", "sample", "motion × sample", "motion × model × sample"]
    first = np.array([0.5, 0.3, -0.02])
    on = ("block", "model", "output", "input")
    ones = np.ones((len(blocks), 3, LEVELS.size, 1))
    found = {
        "probability": (("block", "model", "level"), p),
        "probability_quantile": (("block", "model", "level", "quantile"), spread),
        "flag_share": (("block", "level", "component"), np.tile(share, (len(blocks), LEVELS.size, 1))),
        "sobol_first": (on, ones * first),
        "sobol_first_lower": (on, ones * (first - 0.1)),
        "sobol_first_upper": (on, ones * (first + 0.1)),
        "sobol_total": (on, ones * (first + 0.1)),
        "sobol_total_lower": (on, ones * (first + 0.02)),
        "sobol_total_upper": (on, ones * (first + 0.18)),
    }
    return xr.Dataset(
        found,
        {
            "block": list(blocks),
            **MODELS,
            "level": ("level", LEVELS, PGA),
            "quantile": [0.05, 0.5, 0.95],
            "component": names,
            "input": ["alpha_factor", "restitution_factor", "inertia_factor"],
            "sample": np.arange(16),
            "motion": np.arange(40),
        },
        {"title": TITLE, "kind": "uncertainty"},
    )


def with_ranking(found, ranked):
    """A performance study's results: the ranking stands beside the assessment, whose shelf can injure people."""
    beside = {f"ranked_{name}": one for name, one in ranked.data_vars.items()}
    shape = found.sizes["model"], found.sizes["block"]
    for i, end in enumerate(("_lower", "", "_upper")):
        beside[f"rate{end}"] = (("model", "block"), np.full(shape, 1e-3 * (1 + i)))
    beside["probability"] = (("model", "block", "level"), np.zeros((*shape, found.sizes["level"])))
    found = found.assign_coords(
        consequences=("block", ["injury", "none"]), anchoring_cost=("block", np.full(shape[1], np.nan))
    )
    plain = {name: value for name, value in ranked.attrs.items() if name not in found.attrs}
    return found.assign(beside).assign_attrs(ranking=json.dumps(plain), kind="performance")


def texts(figure):
    """Every text that is seen, with its box in pixels."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    found = []

    def walk(artist, axis=None):
        if not artist.get_visible():
            return
        if isinstance(artist, Text):
            if not artist.get_text().strip():
                return
            box = artist.get_window_extent(renderer)
            if box.width > 0.0 and box.height > 0.0:
                found.append((artist, box))
            return
        if isinstance(artist, Axis):
            # an axis keeps labels that it does not draw: of ticks outside its limits
            low, high = sorted(artist.get_view_interval())
            for tick in artist.get_major_ticks():
                inside = low - 1e-9 * abs(low) <= tick.get_loc() <= high + 1e-9 * abs(high)
                for label in (tick.label1, tick.label2) if inside else ():
                    walk(label)
            walk(artist.label)
            return
        for child in artist.get_children():
            walk(child)

    walk(figure)
    return found


def faults(figure):
    """What is wrong with the texts of a figure: a line each; none where it reads well."""
    seen = texts(figure)
    said = []
    sheet = figure.bbox
    for artist, box in seen:
        name = artist.get_text()
        if box.x0 < sheet.x0 - 1 or box.x1 > sheet.x1 + 1 or box.y0 < sheet.y0 - 1 or box.y1 > sheet.y1 + 1:
            said.append(f"cut: {name!r}")
        if artist.get_fontsize() < SMALLEST:
            said.append(f"small: {name!r} at {artist.get_fontsize():g} pt")
    for i, (one, box) in enumerate(seen):
        for other, beside in seen[i + 1 :]:
            across = min(box.x1, beside.x1) - max(box.x0, beside.x0)
            down = min(box.y1, beside.y1) - max(box.y0, beside.y0)
            # (boxes hold the room above and below letters: touching is no overlap)
            if across > 1.0 and down > 2.0:
                said.append(f"over each other: {one.get_text()!r} and {other.get_text()!r}")
    return said
