"""Rates from selected stripes put to the test: hazards whose rate of overturning is known."""
