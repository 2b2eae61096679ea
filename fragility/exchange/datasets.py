"""Conversion between datasets of curves (block, model, …) and the rows that exchange formats read and write."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, UNITS, described, provenance
from ...motions.arrays import floor_coordinates
from ...motions.intensity.naming import FLOOR, GROUND, place_in
from ..curves.curve import ISOTONIC, LINKED, UPLIFT
from ..fitting.links import LOGNORMAL
from ..fitting.states import ABSENT, DIRECTIONS, OK, OVERTURNED, state_named
from ..numerics.slabs import spread
from ..runs.provenance import levels_of_the_ground, tilt_limits, upper_floors
from .files import ExchangeError
from .ids import OPENQUAKE_MARKS, TABLE_MARKS, check_ids, is_id, make_ids
from .rows import (
    CURVE_NUMBERS,
    CURVE_WORDS,
    FORMS,
    LEVEL,
    LIMIT_STATE,
    OVERTURNING,
    PARAMETERS,
    CurveParameters,
    CurveRow,
    CurveSet,
    known_measure,
    levels_problem,
)

MAX_NUMBERS = 5_000_000
# Variables that are put on block alone where their values depend on the block alone.
OF_THE_BLOCK = ("width", "height", "directional")


def curve_set(curves: xr.Dataset, marks: str, chosen: Sequence[str] | None = None) -> CurveSet:
    """Return the curves of a dataset as rows, with ids of letters, digits and `marks`, or with the `chosen` ids."""
    if not isinstance(curves, xr.Dataset):
        raise TypeError(f"curves must be a dataset of fragility curves, got {type(curves).__name__}")
    checks.plain("curves", curves)
    form = _form(curves)
    base = curves["probability" if form == ISOTONIC else "median"]
    if base.size > MAX_NUMBERS:
        raise ValueError(f"curves must hold at most {MAX_NUMBERS:,} numbers, got {base.size:,}")
    levels = _levels(curves) if form == ISOTONIC else None
    dims = tuple(str(dim) for dim in base.dims if dim != "level")
    of_levels = curves["level"] if "level" in curves.coords else base
    im = str(curves.attrs.get("im") or of_levels.attrs.get("im", ""))
    units = _si_unit(im, str((of_levels if form == ISOTONIC else base).attrs.get("units", DIMENSIONLESS)))
    checks.not_empty("curves", curves, *dims)
    axes = [[_text(value) for value in curves[dim].values] for dim in dims]
    for dim, axis in zip(dims, axes, strict=True):
        repeated, times = Counter(axis).most_common(1)[0]
        if times > 1:
            raise ValueError(f"labels of curves must differ, got {repeated!r:.60} {times:,} times on {dim}")
    labels = list(itertools.product(*axes))
    parameters = [CurveParameters()] * len(labels)
    probabilities: list[Array | None] = [None] * len(labels)
    if form == ISOTONIC:
        table = np.asarray(base.transpose(*dims, "level").values, dtype=float).reshape(len(labels), -1)
        probabilities = [None if np.isnan(curve).all() else curve for curve in table]
    else:
        names = PARAMETERS if form == UPLIFT else PARAMETERS[:2]
        columns = {name: column for name in names if (column := _column(curves, name, dims)) is not None}
        if len(columns) < len(names):
            raise ValueError(f"{' and '.join(names)} of curves must be numbers on {dims}")
        parameters = [
            CurveParameters(**dict(zip(names, numbers, strict=True)), link=form if form in LINKED else LOGNORMAL)
            for numbers in zip(*(columns[name].tolist() for name in names), strict=True)
        ]
    accompanying = {name: column for name in CURVE_NUMBERS if (column := _column(curves, name, dims)) is not None}
    words = {name: texts for name in CURVE_WORDS if (texts := _texts(curves, name, dims)) is not None}
    statuses = _texts(curves, "status", dims) or [OK] * len(labels)
    rows = []
    for i, label in enumerate(labels):
        row = CurveRow(
            label,
            parameters[i],
            statuses[i],
            probabilities[i],
            {name: float(column[i]) for name, column in accompanying.items() if math.isfinite(column[i])},
            {name: texts[i] for name, texts in words.items() if texts[i]},
        )
        if row.problem:
            raise ValueError(f"curve {' / '.join(label)!r:.100}: {row.problem}")
        rows.append(row.with_reason())
    title = str(curves.attrs.get("title", "Fragility curves"))
    ids = _ids(curves, dims, labels, marks, chosen)
    at_ground = levels_of_the_ground(curves)
    return CurveSet(
        im,
        units,
        at_ground,
        dims,
        ids,
        tuple(rows),
        form,
        levels,
        title,
        tuple(upper_floors(curves)),
        _state(curves),
        GROUND if at_ground else place_in(str(of_levels.attrs.get("long_name", ""))) or FLOOR,
    )


def _state(curves: xr.Dataset) -> str:
    """Return the limit state of curves, with the tilts that count as overturning, too."""
    state, limits = _text(curves.attrs.get("state", OVERTURNING)), tilt_limits(curves)
    if not limits or state_named(state) not in (OVERTURNED, *DIRECTIONS):
        return state
    tilts = " or ".join(f"{limit:.3g}°" for limit in sorted({*limits.values()}))
    return f"{state} or a tilt of {tilts}{'' if len(limits) == curves['block'].size else ' of some blocks'}"


def curve_dataset(curves: CurveSet, source: str) -> xr.Dataset:
    """Return rows as a dataset of curves on the set's dimensions; missing combinations are NaN."""
    taken = {*PARAMETERS, *CURVE_NUMBERS, *CURVE_WORDS, "probability", "level", "status", "converged", "id"} & {
        *curves.dims
    }
    if taken or len(set(curves.dims)) < len(curves.dims):
        raise ExchangeError(f"{source}: {' and '.join(curves.dims)!r:.100} must not name the labels of curves")
    axes = [list(dict.fromkeys(curve.labels[k] for curve in curves.curves)) for k in range(len(curves.dims))]
    shape = tuple(len(axis) for axis in axes)
    levels = 1 if curves.levels is None else curves.levels.size
    if math.prod(shape) * levels > MAX_NUMBERS:
        sizes = " x ".join(f"{n} {dim}" for n, dim in zip((*shape, levels), (*curves.dims, "levels"), strict=True))
        raise ExchangeError(f"{source}: {sizes} are more than {MAX_NUMBERS:,} numbers")
    by_labels: dict[tuple[str, ...], tuple[str, CurveRow]] = {}
    for name, curve in zip(curves.ids, curves.curves, strict=True):
        if curve.labels in by_labels:
            raise ExchangeError(f"{source}: holds the curve {' / '.join(curve.labels)!r:.100} twice")
        if curve.problem:
            raise ExchangeError(f"{source}: curve {name}: {curve.problem}")
        by_labels[curve.labels] = name, curve.with_reason()
    rows = [by_labels.get(labels, ("", CurveRow(labels, status=ABSENT))) for labels in itertools.product(*axes)]
    coords = _labels(curves.dims, axes)
    if curves.levels is not None:
        attributes = {"units": curves.units, "long_name": curves.long_name, "im": curves.im}
        coords["level"] = xr.Variable("level", curves.levels, attributes)
    variables = _variables(curves, [row for _, row in rows], shape)
    coords |= {name: variables.pop(name) for name in OF_THE_BLOCK if name in variables}
    coords["id"] = _id_variable(curves.dims, [name for name, _ in rows], shape)
    return xr.Dataset(
        variables,
        coords=coords,
        attrs={
            "title": curves.title,
            **provenance({"im": curves.im, "source": source}),
            "im": curves.im,
            "form": curves.form,
            **({} if LIMIT_STATE in curves.dims else {"state": curves.state}),
            **({"im_at": "ground"} if curves.ground else {}),
        },
    )


def _variables(curves: CurveSet, rows: Sequence[CurveRow], shape: tuple[int, ...]) -> dict[str, xr.Variable]:
    """Return every variable of the rows, including the variables in `OF_THE_BLOCK`."""
    variables: dict[str, xr.Variable] = {}

    def add(name: str, values: Any, unit: str, text: str, dtype: Any = float) -> None:
        dims = curves.dims if name != "probability" else (*curves.dims, "level")
        sizes = shape if curves.levels is None or name != "probability" else (*shape, curves.levels.size)
        array = np.array(values, dtype=dtype).reshape(sizes)
        variables[name] = xr.Variable(dims, array, described(text, unit))

    if curves.levels is not None:
        nothing = np.full(curves.levels.size, np.nan)
        values = [nothing if row.probability is None else row.probability for row in rows]
        add("probability", values, DIMENSIONLESS, "probability of the limit state")
    else:
        kind = "standard deviation of ln(capacity)" if curves.form in LINKED else "lognormal standard deviation"
        table = {
            "median": (curves.units, f"median {curves.long_name}"),
            "dispersion": (DIMENSIONLESS, f"{kind} of the fragility curve"),
            "uplift_median": (curves.units, "median level of uplift"),
            "uplift_dispersion": (DIMENSIONLESS, "lognormal standard deviation of the uplift curve, 0 for a step"),
        }
        for name in PARAMETERS if curves.form == UPLIFT else PARAMETERS[:2]:
            add(name, [getattr(row.parameters, name) for row in rows], *table[name])
    add("status", [row.status for row in rows], DIMENSIONLESS, "ok, or why there is no curve", object)
    add("converged", [row.estimated for row in rows], DIMENSIONLESS, "whether there is a curve", bool)
    for name, (unit, text) in CURVE_NUMBERS.items():
        numbers = [row.numbers.get(name, math.nan) for row in rows]
        if not all(map(math.isnan, numbers)):
            add(name, numbers, curves.units if unit == LEVEL else unit, text)
            if name in OF_THE_BLOCK:
                variables[name] = _of_the_block(variables[name])
    for name, text in CURVE_WORDS.items():
        texts = [row.words.get(name, "") for row in rows]
        if any(texts):
            add(name, texts, DIMENSIONLESS, text, object)
    return variables


def _of_the_block(variable: xr.Variable) -> xr.Variable:
    """Return a variable on block alone if its values depend on the block alone."""
    if "block" not in variable.dims or len(variable.dims) == 1:
        return variable
    moved = variable.transpose("block", ...).values.reshape(variable.sizes["block"], -1)
    first = np.array([next(iter(row[np.isfinite(row)]), np.nan) for row in moved])
    same = np.isnan(moved) | (moved == first[:, None])
    return xr.Variable("block", first, variable.attrs) if same.all() else variable


def _labels(dims: Sequence[str], axes: Sequence[Sequence[str]]) -> dict[str, xr.Variable]:
    coords: dict[str, xr.Variable] = {}
    for dim, axis in zip(dims, axes, strict=True):
        if dim == "floor" and all(re.fullmatch(r"0|[1-9][0-9]{0,8}", label) for label in axis):
            coords |= floor_coordinates([int(label) for label in axis])
        else:
            attributes = described(dim.replace("_", " "))
            coords[dim] = xr.Variable(dim, np.array(axis, dtype=object), attributes)
    return coords


def _id_variable(dims: tuple[str, ...], names: Sequence[str], shape: tuple[int, ...]) -> xr.Variable:
    """Return the ids of the components, which are the same for every limit state of a component."""
    table = np.array(names, dtype=object).reshape(shape)
    if LIMIT_STATE in dims:
        table = np.asarray(np.max(table, axis=dims.index(LIMIT_STATE)), dtype=object)
    of_components = tuple(dim for dim in dims if dim != LIMIT_STATE)
    return xr.Variable(of_components, table, described("id in the exchange file"))


def _form(curves: xr.Dataset) -> str:
    stated = curves.attrs.get("form")
    if stated is None:
        stated = UPLIFT if "uplift_median" in curves else LOGNORMAL
    if str(stated) not in FORMS:
        raise ValueError(f"form of curves must be one of {', '.join(FORMS)}, got {stated!r:.60}")
    needed = {UPLIFT: PARAMETERS, ISOTONIC: ("probability",)}.get(str(stated), PARAMETERS[:2])
    if not all(name in curves for name in needed):
        held = ", ".join(map(str, curves.data_vars)) or "nothing"
        raise ValueError(f"{stated} curves must hold {' and '.join(needed)}, got {held:.200}")
    return str(stated)


def _levels(curves: xr.Dataset) -> Array:
    if "level" not in curves["probability"].dims or "level" not in curves.coords:
        raise ValueError(f"probability of curves must lie on level, got {curves['probability'].dims}")
    levels = np.asarray(curves["level"].values, dtype=float)
    problem = levels_problem(levels)
    if problem:
        raise ValueError(f"{problem}, got {levels[:5].tolist()}")
    return levels


def _si_unit(im: str, stated: str) -> str:
    """Return the unit of the curves, which must be the measure's unit; a user-defined measure may have any unit."""
    measure = known_measure(im)
    if measure is not None and UNITS.get(stated) != (1.0, measure.units):
        raise ValueError(f"curves of {im} must be in {measure.units}, got {stated!r:.40}")
    return stated if measure is None else measure.units


def _column(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> Array | None:
    """Return a variable at every row; None if the dataset has no such numbers on (some of) these dimensions."""
    array = _at_every_row(curves, name, dims)
    return None if array is None or array.dtype.kind not in "iufb" else np.asarray(array, dtype=float)


def _texts(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> list[str] | None:
    array = _at_every_row(curves, name, dims)
    return None if array is None else [_text(value) for value in array]


def _at_every_row(curves: xr.Dataset, name: str, dims: tuple[str, ...]) -> NDArray[Any] | None:
    if name not in curves.variables or not {str(dim) for dim in curves[name].dims} <= set(dims):
        return None
    return spread(curves[name], {dim: curves.sizes[dim] for dim in dims}).reshape(-1)


def _text(value: Any) -> str:
    text = str(value)
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise ValueError(f"label {text!r:.60} holds characters that no text file can hold") from None
    return text


def _ids(
    curves: xr.Dataset,
    dims: tuple[str, ...],
    labels: Sequence[tuple[str, ...]],
    marks: str,
    chosen: Sequence[str] | None,
) -> tuple[str, ...]:
    """Return the chosen ids, else the dataset's own if there is one a component, else ids made of the labels.

    The dataset's own ids are kept if they are legal with `marks`; ids of another program are made legal.
    """
    at = [k for k, dim in enumerate(dims) if dim != LIMIT_STATE]
    keys = [tuple(label[k] for k in at) for label in labels]
    components = list(dict.fromkeys(keys))
    if chosen is not None:
        by_key = dict(zip(components, check_ids(chosen, len(components), marks), strict=True))
        return tuple(by_key[key] for key in keys)
    of_components = [dims[k] for k in at]
    brought = _texts(curves, "id", dims)
    if brought is not None:
        ids = dict(zip(keys, brought, strict=True)).values()
        if len(set(ids)) == len(components) and all(is_id(name, OPENQUAKE_MARKS + TABLE_MARKS) for name in ids):
            if all(is_id(name, marks) for name in ids):
                return tuple(brought)
            keys, of_components = [(name,) for name in brought], []
    made = make_ids(list(dict.fromkeys(keys)), of_components)
    return tuple(made[key] for key in keys)
