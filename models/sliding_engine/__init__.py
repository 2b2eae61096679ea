"""Compiled engine of blocks that slide on a floor with Coulomb friction: exact between the samples of a record.

The block moves with the floor until the acceleration exceeds the limit of friction, and slides until its velocity
relative to the floor is zero. Within a sample the floor's acceleration, and its vertical acceleration, are straight
lines, so the velocity is a quadratic and the slip a cubic. The instants at which the block begins to slide, stops or
turns round are roots of lines and quadratics. Runs of one record advance in lockstep, with an array of lanes for each
quantity. Under both horizontal components (`plane`) the slip is a plane curve, of which one piece after the other is a
series.
"""
