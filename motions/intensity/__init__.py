"""Intensity measures: response spectra, cumulative measures, peaks, and the measures that a name selects."""
