"""Compiled likelihoods and resampling: plain numbers and arrays only."""
