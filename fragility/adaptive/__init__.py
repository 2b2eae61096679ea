"""Sequential analysis: levels of the next motions, their results for one curve, and the decision to stop."""
