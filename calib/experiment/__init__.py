"""A TOML file (or Python) in, a checked `Experiment` out, its sweeps and the forward model it names; knows no likelihood."""
