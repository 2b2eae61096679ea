"""How often intervals hold the truth: studies drawn from known truths, and the share of intervals that hold it."""
