"""Sliding blocks: their law, runs and single histories, and the choice between sliding and rocking."""
