"""A design and depths (or forces) in, a `Response` by finite elements out, exact and slow; knows no surrogate and no data."""

from models.fem.finite_elements import FiniteElements
from models.fem.solution import Solution, Units, capacitance_of, dimensionless
from models.response import ConvergenceError

__all__ = ["ConvergenceError", "FiniteElements", "Solution", "Units", "capacitance_of", "dimensionless"]
