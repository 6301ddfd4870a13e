"""The finite-element sensor model: exact and slow. A design and depths (or forces) in, a `Response` out; knows no surrogate."""

from models.fem.finite_elements import FiniteElements
from models.fem.solution import Solution, Units, capacitance_of, dimensionless
from models.response import ConvergenceError

__all__ = ["ConvergenceError", "FiniteElements", "Solution", "Units", "capacitance_of", "dimensionless"]
