"""A `Posterior` and a requirement in, what to build out, and how sure that is; knows no page."""
