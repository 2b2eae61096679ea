"""Curves in the files of other programs: CSV, pelicun, and OpenQuake's NRML."""
