"""Writing of curves as OpenQuake's fragility models (NRML 0.5): lognormal functions, and discrete functions for others.

NRML's mean and stddev are of the lognormal variable itself, not its median and dispersion. PGA and SA are in g, PGV and
PGD in cm/s and cm.
"""

import json
import math
import os
import re
from collections.abc import Sequence
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import scipy
import xarray as xr

from ....core import checks
from ....core.aliases import Array
from ....core.units import STANDARD_GRAVITY
from ....motions.intensity.naming import GROUND
from ..datasets import curve_set
from ..discrete import grid, probability_at
from ..files import ExchangeError, write_text
from ..ids import OPENQUAKE_MARKS, component_record
from ..rows import CurveRow, CurveSet, Written, spectral_period

NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
CATEGORY = "contents"  # of the assets, and of the losses: one that OpenQuake knows
STEP = 1e-9  # width of a step in probability, relative to its level
COMMENT_MARK = "toppling"  # beginning of our comments


IMTS = {
    "pga": ("PGA", STANDARD_GRAVITY),
    "pgv": ("PGV", 0.01),
    "pgd": ("PGD", 0.01),
    "arias": ("IA", 1.0),
    "cav": ("CAV", STANDARD_GRAVITY),
}
"""OpenQuake's names of measures, and the SI values of its own units."""


def write_nrml(
    curves: xr.Dataset, path: str | os.PathLike[str], tail: float = 1e-4, ids: Sequence[str] | None = None
) -> Written:
    """Write curves as a fragility model of OpenQuake, each a function named by its id.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves of any form on block, model, floor or any other dimensions; ``limit_state`` makes the limit states.
    path : path
        The XML.
    tail : float
        Probability below which OpenQuake takes a continuous function as 0, and distance from 1 above which it takes the
        function as constant, 1e-9 to 0.01. Values minIML (and noDamageLimit) and maxIML are the levels at which the
        curve is that far from 0 and 1.
    ids : sequence of str, optional
        Ids of the components, one for each combination of labels other than the limit state; the last dimension of the
        curves changes fastest. An id has a letter, then letters, digits, ``_``, ``:`` and ``-``, at most 60 characters.
        If not given, ids are the curves' own (coordinate ``id``) or made of the labels. Points of own ids become
        underscores, because OpenQuake's ids have none.

    Returns
    -------
    Written
        Files, ids, and the components without an estimate: NRML cannot represent them, its description names them.

    Raises
    ------
    ExchangeError
        Measures that OpenQuake does not know, floors other than the ground if the measure is the floor's own, no
        estimate at all, a file that cannot be written.

    Notes
    -----
    A lognormal curve has mean = median exp(beta²/2) and stddev = mean sqrt(exp(beta²) - 1).  Log-logistic and Weibull
    curves, and curves with a factor for uplift, become discrete functions of some hundred levels, linear between them
    (errors below 1e-4).

    OpenQuake's classical calculations evaluate a continuous function at ``continuous_fragility_discretization`` levels
    evenly spaced from minIML to maxIML. A job should set a number larger than the default 20.
    """
    file = checks.path(path)
    share = checks.number("tail", tail, at_least=1e-9, at_most=0.01)
    model = curve_set(curves, OPENQUAKE_MARKS, ids)
    imt, unit = _imt(model)
    _refuse_floors(model)
    states = _limit_states(model)
    missing = model.missing()
    components = {name: rows for name, rows in model.components().items() if name not in missing}
    if not components:
        raise ExchangeError(f"{file}: NRML holds estimates alone, and none of {len(missing)} curves has one")
    lines = [
        "<?xml version='1.0' encoding='utf-8'?>",
        f"<nrml xmlns={quoteattr(NAMESPACE)}>",
        _comment({"title": model.title}),
        f'<fragilityModel id="toppling" assetCategory="{CATEGORY}" lossCategory="{CATEGORY}">',
        f"<description>{escape(_description(model, missing))}</description>",
        f"<limitStates>{' '.join(states)}</limitStates>",
    ]
    for name, rows in components.items():
        lines += ["", _comment(component_record(model, rows)), *_function(name, model, rows, states, imt, unit, share)]
    lines += ["", "</fragilityModel>", "</nrml>", ""]
    return Written((write_text(file, "\n".join(lines)),), tuple(components), missing)


def arithmetic(median: float, dispersion: float) -> tuple[float, float]:
    """Return mean and standard deviation of a lognormal variable, the parameters that NRML uses."""
    mean = median * math.exp(0.5 * dispersion**2)
    return mean, mean * math.sqrt(math.expm1(dispersion**2))


def _imt(model: CurveSet) -> tuple[str, float]:
    spectral = spectral_period(model.im)
    if model.im in IMTS:
        return IMTS[model.im]
    if spectral is not None and spectral[0] == "Sa":
        return f"SA({spectral[1]!r})", STANDARD_GRAVITY
    raise ExchangeError(
        f"OpenQuake has no measure for {model.im or 'levels without a name'}, "
        f"allowed are {', '.join(IMTS)} and Sa(T) with 5 % damping"
    )


def _refuse_floors(model: CurveSet) -> None:
    """Raise ExchangeError for measures of a floor's motion: OpenQuake would apply them to the ground motion."""
    if model.floors:
        raise ExchangeError(
            f"OpenQuake knows the ground's shaking alone, and {model.im} is that of {model.floors[0]}: scale the "
            "ground motions (im_at of a study, ground in Python), or export for pelicun"
        )


def _limit_states(model: CurveSet) -> list[str]:
    """Return a name that NRML accepts for each limit state."""
    names = [re.sub(r"[^A-Za-z0-9_:]+", "_", state).strip("_") for state in model.limit_states]
    if "" in names or len(set(names)) < len(names):
        raise ExchangeError(
            f"limit states must have names of letters and digits, each its own, got {model.limit_states}"
        )
    return names


def _description(model: CurveSet, missing: dict[str, str]) -> str:
    where = "" if model.place == GROUND else " where the block stands"
    states = " and of ".join(model.limit_states)
    text = f"{model.title}: probability of {states} given the {model.long_name}{where}, made by toppling."
    if missing:
        text += f" Without an estimate and not here: {', '.join(f'{k} ({reason})' for k, reason in missing.items())}."
    return _plain(text)


def _plain(text: str) -> str:
    """Return a text on one line with printable characters alone."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _comment(content: dict[str, Any]) -> str:
    """Return a comment that describes the following element to people."""
    text = json.dumps(content, ensure_ascii=False)
    # JSON escapes characters that XML does not allow, and double hyphens, which would end the comment
    text = "".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in text).replace("--", "-\\u002d")
    return f"<!-- {COMMENT_MARK} {text} -->"


def _function(
    name: str, model: CurveSet, rows: Sequence[CurveRow], states: Sequence[str], imt: str, unit: float, tail: float
) -> list[str]:
    if all(row.lognormal for row in rows):
        low, high = (value / unit for value in _range(rows, tail))
        lines = [
            f'<fragilityFunction id={quoteattr(name)} format="continuous" shape="logncdf">',
            f'<imls imt={quoteattr(imt)} minIML="{low!r}" maxIML="{high!r}" noDamageLimit="{low!r}"/>',
        ]
        for state, row in zip(states, rows, strict=True):
            mean, stddev = arithmetic(row.parameters.median / unit, row.parameters.dispersion)
            lines.append(f'<params ls="{state}" mean="{mean!r}" stddev="{stddev!r}"/>')
        return [*lines, "</fragilityFunction>"]
    levels = model.levels if model.levels is not None else grid(rows, tail, STEP)
    lines = [
        f'<fragilityFunction id={quoteattr(name)} format="discrete">',
        f"<imls imt={quoteattr(imt)}>{_written(levels / unit)}</imls>",
    ]
    for state, row in zip(states, rows, strict=True):
        p = row.probability if row.probability is not None else probability_at(row.parameters, levels)
        lines.append(f'<poes ls="{state}">{_written(p)}</poes>')
    return [*lines, "</fragilityFunction>"]


def _written(values: Array) -> str:
    return " ".join(repr(value) for value in values.tolist())


def _range(rows: Sequence[CurveRow], tail: float) -> tuple[float, float]:
    """Return the lowest and the highest level (SI), where the tails begin."""
    z = -float(scipy.special.ndtri(tail))
    parameters = [row.parameters for row in rows]
    low = min(parameter.median * math.exp(-z * parameter.dispersion) for parameter in parameters)
    return low, max(parameter.median * math.exp(z * parameter.dispersion) for parameter in parameters)
