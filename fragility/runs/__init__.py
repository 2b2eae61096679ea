"""Runs of blocks under scaled motions: the request, scale factors, chunks of work and where they run, labels of
results, and the provenance that is read from labelled results.
"""
