"""Lab files in, a `Sweep` for every press out, with what was judged of it; knows no prior and no model."""
