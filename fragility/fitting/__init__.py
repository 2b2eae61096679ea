"""Fitting of fragility curves, behind `fit_fragility`: trials, likelihoods, forms, bootstrap and goodness of fit."""
