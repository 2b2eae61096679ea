"""Shared tools of all packages: units, checks of inputs, random streams, wording, compiled functions."""
