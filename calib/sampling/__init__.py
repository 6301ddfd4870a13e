"""A `Problem` in, a `Posterior` out, kept in files that can be resumed and read by ArviZ; knows no report."""
