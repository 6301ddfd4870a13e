"""One BLAS thread for all tests: the matrices are small, and two workers with two threads each get into each other's way."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
