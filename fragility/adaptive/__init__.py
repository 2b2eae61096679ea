"""Sequential analysis: which levels the next motions are run at, what they say of one curve, and when to stop."""
