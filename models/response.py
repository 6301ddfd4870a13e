"""What every forward model takes and gives: `Forward` maps a `Design` and depths to a `Response`, or says why it cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from models.sensor import BoolArray, Design, FloatArray

#: What can be asked of loading curves besides the depth, see `Curves.press`.
Column = Literal["force", "contact radius", "capacitance"]


class OutOfRangeError(ValueError):
    """A design or a depth lies outside what a forward model covers; the message names the bound."""


class ConvergenceError(RuntimeError):
    """No equilibrium was found by a forward model that looks for one.

    Attributes
    ----------
    depth_reached : [m], the deepest equilibrium found.
    reason : why there is none beyond.
    response : up to there, None if there is none.
    """

    def __init__(self, depth_reached: float, reason: str, response: Response | None) -> None:
        self.depth_reached = depth_reached
        self.reason = reason
        self.response = response
        super().__init__(f"no equilibrium beyond an indentation of {depth_reached * 1e3:.4g} mm: {reason}")

    def __reduce__(self) -> tuple[type[ConvergenceError], tuple[float, str, Response | None]]:
        # By default an exception is made anew from its message alone, which a worker process could not send back.
        return type(self), (self.depth_reached, self.reason, self.response)


@dataclass(frozen=True, eq=False)
class Response:
    """Loading curves over depth, arrays of shape (n_depth,), or (n_draw, n_depth) for a design that is a batch of draws.

    Attributes
    ----------
    depth : [m], indentation; zero or less means no contact.
    force : [N].
    contact_radius : [m], in the deformed configuration.
    capacitance : [F], without parasitic capacitance.
    rest_capacitance : [F], C0; shape () or (n_draw,).
    force_error, capacitance_error : [N], [F], shape (..., n_depth, n_mode).
        Factors V of the model's own error: its covariance along the sweep is V V^T. No mode (n_mode = 0) for a model
        that claims no error of its own.
    own_modes : how many of the last factors are errors from depth to depth, which no other response repeats; the others are
        functions of depth, the same in every response of a design.
    """

    depth: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    capacitance: FloatArray
    rest_capacitance: FloatArray
    force_error: FloatArray
    capacitance_error: FloatArray
    own_modes: int = 0

    @property
    def capacitance_change(self) -> FloatArray:
        """C / C0 - 1, shape as `capacitance`."""
        return self.capacitance / self.rest_capacitance[..., None] - 1

    def columns(self) -> dict[str, FloatArray]:
        """The loading curve of one design, column by column, for a table or a plot (`pandas.DataFrame(curve.columns())`).

        Returns
        -------
        displacement_m, force_N, contact_radius_m, capacitance_F and capacitance_change, each (n_depth,).

        Raises
        ------
        ValueError
            If it is of several draws; `draw` gives one of them.
        """
        if self.depth.ndim > 1 and self.depth.shape[0] > 1:
            raise ValueError(f"columns are of one design, not of {self.depth.shape[0]} draws; take one with draw(index)")
        named = {"displacement_m": self.depth, "force_N": self.force, "contact_radius_m": self.contact_radius}
        named |= {"capacitance_F": self.capacitance, "capacitance_change": self.capacitance_change}
        return {name: values.reshape(-1) for name, values in named.items()}

    def at(self, part: slice) -> Response:
        """Some of the depths of a batch."""
        return Response(
            self.depth[:, part],
            self.force[:, part],
            self.contact_radius[:, part],
            self.capacitance[:, part],
            self.rest_capacitance,
            self.force_error[:, part],
            self.capacitance_error[:, part],
            self.own_modes,
        )

    def draw(self, index: int) -> Response:
        """One draw of a batch."""
        return Response(
            self.depth[index],
            self.force[index],
            self.contact_radius[index],
            self.capacitance[index],
            self.rest_capacitance[index],
            self.force_error[index],
            self.capacitance_error[index],
            self.own_modes,
        )


class Forward(Protocol):
    """A model of the sensor: closed form, finite elements, or surrogate. All take the same and give the same."""

    @property
    def name(self) -> str:
        """Short name for tables and reports."""
        ...

    @property
    def identity(self) -> str:
        """One line about what a model computes: two models that share it give the same numbers for every design and depth.

        It holds what decides the numbers (the content of a surrogate, the accuracy of finite elements, the version of a
        formula) and nothing else: no name for people, no path of a file. Whoever keeps results of a model keeps this beside
        them, to know whether others may be added.
        """
        ...

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] the model covers, per draw, shape (n_draw,); 0 where the design itself is not covered."""
        ...

    def outside(self, design: Design, depth: FloatArray) -> str:
        """Say which bound of the model a design or a depth violates.

        Parameters
        ----------
        design : one, or a batch of draws.
        depth : [m], shape (n_depth,) or (n_draw, n_depth).

        Returns
        -------
        Empty if every draw and every depth is covered, else one sentence that names the violated bound.
        """
        ...

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """Press: force, contact and capacitance of `design` at given depths.

        Parameters
        ----------
        design : one, or a batch of draws.
        depth : [m], shape (n_depth,) or (n_draw, n_depth); needs not be sorted. Zero or less is before contact: F = 0, C = C0.

        Returns
        -------
        Arrays of shape (n_depth,) for one design, (n_draw, n_depth) for a batch.

        Raises
        ------
        OutOfRangeError
            If the model does not cover the design or a depth.
        """
        ...


@dataclass(frozen=True, eq=False)
class Asked:
    """Depths [m], (n_draw, n_depth), and what is wanted there."""

    depth: FloatArray
    columns: tuple[Column, ...] = ("force", "capacitance")


class Curves(Protocol):
    """Loading curves of a batch of designs, ready to be asked at depths: what no depth changes has been worked out."""

    @property
    def limit(self) -> FloatArray:
        """Largest depth [m] covered, (n_draw,); 0 where the design itself is not covered."""
        ...

    def only(self, rows: slice | BoolArray) -> Curves:
        """The curves of some of the designs."""
        ...

    def press(self, asked: Sequence[Asked]) -> list[Response]:
        """Read the curves at depths that the model covers, as the caller has made sure by `limit`.

        Returns
        -------
        For each that was asked arrays (n_draw, n_depth); a column that was not may be nan.
        """
        ...


@runtime_checkable
class WithCurves(Protocol):
    """A forward model that works out once what it needs of designs, whatever is asked of them then."""

    def curves(self, design: Design) -> Curves:
        """Make the loading curves of a batch of designs."""
        ...
