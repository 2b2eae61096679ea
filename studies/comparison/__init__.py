"""Comparison of two studies' results: their differences, and a test if the motions explain them."""
