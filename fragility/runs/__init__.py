"""Runs of blocks under scaled motions: request, scale factors, execution of chunks, labels and provenance."""
