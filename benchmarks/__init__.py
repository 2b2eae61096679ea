"""Benchmark of the engine: cost and errors, compared with its rivals and a 40-digit truth (`make benchmark`)."""
