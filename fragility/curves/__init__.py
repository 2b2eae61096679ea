"""Fragility curves as functions: observed probabilities, comparisons of curves, means over motions, and published
criteria.
"""
