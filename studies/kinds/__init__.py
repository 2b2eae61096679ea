"""The kinds of studies, one module for each, from a study file to one result dataset."""
