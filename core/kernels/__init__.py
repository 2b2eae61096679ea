"""Compiled loops over functions of the C library: plain numbers and arrays only."""
