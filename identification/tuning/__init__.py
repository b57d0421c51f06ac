"""Bayesian optimisation of how the networks are trained."""
