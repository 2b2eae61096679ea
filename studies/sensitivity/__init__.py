"""Sensitivity to delta and e: paired comparisons and findings."""
