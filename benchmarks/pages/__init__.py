"""Pages of the documentation that are computed, one module each: `python -m toppling.benchmarks.pages NAME`."""
