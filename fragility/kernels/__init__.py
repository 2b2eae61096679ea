"""Compiled likelihoods, resampling and products: plain numbers and arrays only."""
