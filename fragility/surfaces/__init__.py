"""Pooled analysis of many blocks: one smooth surface of medians and dispersions through single runs of a few blocks."""
