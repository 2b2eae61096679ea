"""Regions: many blocks as columns, from the file that lists them to the tables of the results."""
