"""Annual rates of overturning: fragility curves integrated over a hazard curve, deaggregation, and the sizes that meet
a target.
"""
