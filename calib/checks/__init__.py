"""A `Posterior` in, whether it may be believed out: predictive, spot check, re-weighting, comparison; changes no draw."""
