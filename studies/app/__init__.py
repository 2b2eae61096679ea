"""The live page: one piece, its chance of falling and the study behind every number, on this machine alone."""
