"""The report: one page for people, with the answer first, then figures, tables, checks and method."""
