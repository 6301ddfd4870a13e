"""Parts of `benchmarks/sampling.py`: targets whose moments are known, and what a run makes of them."""
