"""Analyses: incremental dynamic analysis, multiple stripes and cloud, and the one way from a request to labelled and
screened runs that they share.
"""
