"""Experiment, sweeps and forward model in, a `Problem` out: unknowns, values at z, likelihood; knows no sampler."""
