"""Questions whether a table applies to results."""

import xarray as xr

from toppling.studies.tables.registry import REGISTRY


def test_components_of_records_are_no_sources_of_variance():
    curves = xr.Dataset({"half_level": ("block", [1.0])}, {"component": ("motion", ["H1", "H2"])})
    assert not REGISTRY["shares"].applies(curves)
    uncertain = xr.Dataset({"half_level": ("block", [1.0]), "capacity_share": ("component", [1.0])})
    assert REGISTRY["shares"].applies(uncertain)
