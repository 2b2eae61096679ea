"""Figures, one module for each subject; every function takes matplotlib axes and returns them."""
