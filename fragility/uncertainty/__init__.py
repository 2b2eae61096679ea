"""Uncertain blocks and laws: random inputs, analyses of their samples, shares of variance, and the indices of Sobol'
of any function of the inputs.
"""
