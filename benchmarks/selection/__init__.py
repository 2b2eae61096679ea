"""Rates from selected stripes put to the test: invented sites whose rate of overturning is known."""
