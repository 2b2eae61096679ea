"""Checks of any results: units and names, intervals about their values, totals about their parts."""

import numpy as np
import xarray as xr

from toppling.studies.buildings.variables import OF_A_YEAR, WHOLES

UNITS = {
    *("1", "Hz", "N", "m", "m s-1", "m s-2", "rad", "rad s-1", "s", "day", "year-1", "day year-1", "EUR", "EUR-1"),
    *("EUR year-1", "year-1 EUR-1", "day EUR-1", "day year-1 EUR-1"),
    "SI",  # (of selections: the coordinate `selected_unit` names that of each measure)
}
DIMENSIONS = {
    *("block", "model", "level", "motion", "floor", "run", "look", "trial", "bin", "fraction", "slip"),
    *("measure", "other_measure", "covariate", "selected_level", "selected_measure", "reason", "quantile"),
    *("branch", "epistemic_fractile", "epistemic_source", "sample", "input", "output", "component", "factor"),
    *("value", "comparison", "span", "replicate", "half_cycle", "scaled_time"),
    *("place", "variant", "realisation", "consequence", "kit", "step"),
    *("number_threshold", "loss_threshold", "downtime_threshold", "injuries_threshold"),
    *("check", "variable", "vertex", "face", "face_term", "region_axis", "pooled_run", "degree_of"),
    *("near_term", "near_term_too", "curve_term", "curve_term_too", "rate_term", "rate_term_too"),
    *("event_level", "event_motion", "event_quantile"),
}
ENDS = "_lower", "", "_upper"
CLOSE = 1.0 + 1e-9


def check_results(results):
    """Assert what holds of all results of studies."""
    for name, variable in results.data_vars.items():
        assert variable.attrs["units"] in UNITS, name
        assert variable.attrs["long_name"], name
        assert set(variable.dims) <= DIMENSIONS, name
    check_intervals(results)
    if "place" in results.dims:
        check_totals(results)


def check_intervals(results):
    """Assert that every value lies within its interval, and a share or a chance between 0 and 1.

    An interval has both ends or none; at a level, every value that is known has one.
    """
    for name in results.data_vars:
        value = results[name]
        if {f"{name}{end}" for end in ENDS} <= set(results.data_vars):
            low, middle, high = (each.values for each in xr.broadcast(*(results[f"{name}{end}"] for end in ENDS)))
            np.testing.assert_array_equal(np.isnan(low), np.isnan(high), name)
            known = np.isfinite(middle)
            rounding = 1e-9 * np.abs(middle[known])
            assert not np.any(low[known] > middle[known] + rounding), name
            assert not np.any(high[known] < middle[known] - rounding), name
            assert "level" not in value.dims or not np.any(np.isnan(low[known])), name
        if "probability" in str(name):
            assert not np.any((value.values < -1e-9) | (value.values > CLOSE)), name


def check_totals(results):
    """Assert that a building has at least what its largest part has, with both ends, and a chance at most their sum.

    Annual values have both ends, also if all motions agree on them.

    Rates of farther slips and larger amounts are at most those of shorter and smaller ones.
    """
    for part, whole in WHOLES.items():
        for end in ENDS if part in results and whole in results else ():
            of_part, of_whole = results[f"{part}{end}"], results[f"{whole}{end}"]
            if "place" in of_whole.dims and "place" not in of_part.dims:
                of_whole = of_whole.isel(place=0)
            assert not (of_part > CLOSE * of_whole).any(), f"{part}{end}"
    yearly = {*OF_A_YEAR} | {part for part in WHOLES if not part.startswith("kit_")} | {"ranked_saving", "ranked_left"}
    for name in yearly & {*results.data_vars}:
        for end in ENDS if f"{name}_lower" in results else ():
            assert not np.any(np.isnan(results[f"{name}{end}"]) & np.isfinite(results[name])), f"{name}{end}"
    for name in {*OF_A_YEAR, *OF_A_YEAR.values()} & {*results.data_vars}:
        if "place" in results[name].dims:
            largest = results[name].isel(place=slice(1, None)).max("place")
            assert not (largest > CLOSE * results[name].isel(place=0)).any(), name
    for name in ("probability", "rate"):
        every, pieces = f"any_{name}", "probability" if name == "probability" else "rate"
        if every in results and pieces in results:
            most = (results["count"] * results[pieces]).sum("block")
            assert not (results[every].isel(place=0) > CLOSE * most).any(), every
            assert not (results[pieces] > CLOSE * results[every].isel(place=0)).any(), every
    for name in results.data_vars:
        value = results[name]
        if "place" in value.dims and name in {*OF_A_YEAR, *OF_A_YEAR.values()}:
            floors = value.isel(place=slice(1, None))
            assert not (value.isel(place=0) > CLOSE * floors.sum("place")).any(), name
        steps = [dim for dim in value.dims if str(dim).endswith(("slip", "threshold"))]
        if steps and str(name).endswith(("_rate", "_rate_lower", "_rate_upper")):
            assert not (value.diff(steps[0]) > (CLOSE - 1.0) * value.max(steps[0])).any(), name
