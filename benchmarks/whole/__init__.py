"""Whole commands as a user runs them: what starting up costs, and frozen studies from the file to the report."""
