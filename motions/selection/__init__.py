"""Motions that agree with a hazard: the measures it asks for at a level, and the choice of motions that have them."""
