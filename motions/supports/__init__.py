"""Supports between a floor and a block: benches, isolators and platforms, and the motions on top of them."""
