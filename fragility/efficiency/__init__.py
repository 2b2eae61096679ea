"""Comparison of intensity measures: capacities of motions, candidate measures, regressions and the ranking."""
