"""Sliding blocks: the law beside those of rocking, runs, single histories, and whether a block slides or rocks."""
