"""Hazard curves: annual rates of exceedance of an intensity measure, and the readers of hazard files."""
