"""From points and a loss there to a small smooth network, and from a network to its values anywhere.

A network is layers of tanh with linear ends, or the mean of several such, which lie beside each other in memory. It is trained
by SOAP (Vyas et al., arXiv 2409.11321): Adam in the slowly turning eigenbasis of Shampoo's preconditioner, which on the smooth
functions met here is ahead, after half a minute, of what limited-memory BFGS and Levenberg-Marquardt reach in four. It is
trained and kept in single precision, whose rounding, 1e-6 of a result, is far below the errors of a fit, and evaluated in
double: instruments resolve 1e-5 of a capacitance, so that such rounding would be noise of 0.02 on a log posterior, and ruin
every derivative that is taken of it by differences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from models.rows import whole_groups
from models.sensor import FloatArray, IntArray

#: Single precision, or complex where a derivative is taken by a complex step.
_Array = npt.NDArray[Any]
#: Derivatives of a loss by what a network says: from outputs (n, n_out) at some points, and these points' numbers, (n, n_out).
Slope = Callable[[_Array, IntArray], _Array]

# Points evaluated together: what a layer gives of them stays in the processor's cache.
_TOGETHER = 512

# SOAP: learning rate at its top, share of the steps that warm up, memory of the averages, steps between turns of the basis.
_RATE = 6e-3
_WARM_UP = 0.02
_MEMORY = 0.95
_TURN = 10


@dataclass(frozen=True, eq=False)
class Network:
    """Layers of tanh from n_in inputs to n_out outputs.

    Attributes
    ----------
    centre, width : (n_in,), inputs are taken as (x - centre) / width.
    layers : matrices (n + 1, m), the last row of each the offset; of the mean of k networks (k, n + 1, m).
    """

    centre: FloatArray
    width: FloatArray
    layers: tuple[_Array, ...]

    @cached_property
    def _double(self) -> tuple[_Array, ...]:
        """The layers in double precision."""
        return tuple(layer.astype(float) for layer in self.layers)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of inputs, of units in each hidden layer, and of outputs."""
        return (len(self.centre), *(layer.shape[-1] for layer in self.layers))

    @property
    def members(self) -> int:
        """Of how many networks it is the mean."""
        return len(self.layers[0]) if self.layers[0].ndim == 3 else 1

    @property
    def singles(self) -> list[Network]:
        """The networks of which it is the mean."""
        if self.members == 1:
            return [self]
        return [Network(self.centre, self.width, tuple(layer[k] for layer in self.layers)) for k in range(self.members)]

    def __call__(self, x: _Array) -> _Array:
        """Values (n, n_out) at inputs (n, n_in), in double precision; complex for complex inputs."""
        if len(x) > _TOGETHER:
            return np.concatenate([self(x[first : first + _TOGETHER]) for first in range(0, len(x), _TOGETHER)])
        a = whole_groups((x - self.centre) / self.width)
        *hidden, last = self._double
        for layer in hidden:
            a = a @ layer[..., :-1, :]
            a += layer[..., -1:, :]
            np.tanh(a, out=a)
        values = a @ last[..., :-1, :] + last[..., -1:, :]
        return np.asarray((values if values.ndim == 2 else np.mean(values, axis=0))[: len(x)])

    def arrays(self, name: str) -> dict[str, _Array]:
        """Give the network as arrays to be saved, which `network_from` reads back."""
        layers = {f"{name}_layer_{i}": layer for i, layer in enumerate(self.layers)}
        return {f"{name}_centre": self.centre, f"{name}_width": self.width, **layers}


def network_from(arrays: Mapping[str, _Array], name: str) -> Network:
    """Read a network back from arrays by name.

    Parameters
    ----------
    arrays : among them those that `Network.arrays` gave.
    name : that it was given there.

    Returns
    -------
    The network.

    Raises
    ------
    KeyError
        If an array is missing.
    """
    n = sum(key.startswith(f"{name}_layer_") for key in arrays)
    if n < 2:
        raise KeyError(name)
    return Network(arrays[f"{name}_centre"], arrays[f"{name}_width"], tuple(arrays[f"{name}_layer_{i}"] for i in range(n)))


def mean_network(networks: Sequence[Network]) -> Network:
    """Make the network that says the mean of what others say.

    Parameters
    ----------
    networks : of the same sizes, which take their inputs alike; one is given back as it is.

    Returns
    -------
    The network.

    Raises
    ------
    ValueError
        If they differ in their sizes, or in how they take their inputs.
    """
    first, *others = networks
    for other in others:
        if other.sizes != first.sizes:
            raise ValueError(f"networks of {first.sizes} and {other.sizes} have no mean; give some of the same sizes")
        if not (np.array_equal(other.centre, first.centre) and np.array_equal(other.width, first.width)):
            raise ValueError(
                "networks that take their inputs by different centres or widths have no mean; train them on one set"
            )
    if not others:
        return first
    layers = tuple(np.stack(same) for same in zip(*(network.layers for network in networks), strict=True))
    return Network(first.centre, first.width, layers)


def least_squares(y: FloatArray, weight: FloatArray | None = None) -> Slope:
    """Slope of the mean squared error, for training on plain values.

    Parameters
    ----------
    y : (n, n_out), the values.
    weight : (n,), of the points; None for equal weight.

    Returns
    -------
    What `train_network` takes.
    """
    values = y.astype(np.float32)
    weights = np.ones((len(y), 1), np.float32) if weight is None else (weight / np.mean(weight)).astype(np.float32)[:, None]

    def slope(out: _Array, rows: IntArray) -> _Array:
        return (out - values[rows]) * weights[rows] * np.float32(2 / len(rows))

    return slope


def train_network(
    x: FloatArray,
    slope: Slope,
    sizes: tuple[int, ...],
    *,
    steps: int,
    rng: np.random.Generator,
    batch: int = 1024,
    progress: Callable[[int, int], None] | None = None,
    start: Network | None = None,
) -> Network:
    """Train a network that makes a loss small over given points.

    Parameters
    ----------
    x : (n, n_in), the points.
    slope : of the loss, see `Slope`.
    sizes : of the layers, the last its outputs.
    steps : of the training.
    rng : of its start and the order of the points.
    batch : points a step, drawn without repetition until all have been seen.
    progress : called now and then with the steps done and `steps`.
    start : a network of these sizes to go on from, at half the rate; a random one if None.

    Returns
    -------
    The network.

    Raises
    ------
    ValueError
        If `start` is of other sizes.
    """
    centre, width = x.mean(axis=0), x.std(axis=0)
    width = np.where(width > 0, width, 1.0)
    layers = _initial((x.shape[1], *sizes), rng)
    top = _RATE
    if start is not None:
        if [layer.shape for layer in start.layers] != [layer.shape for layer in layers]:
            raise ValueError(f"the network to go on from has layers of {start.sizes}, wanted are {(x.shape[1], *sizes)}")
        centre, width, layers, top = start.centre, start.width, list(start.layers), _RATE / 2
    points = ((x - centre) / width).astype(np.float32)
    states = [_nothing_yet((layer.shape[0], layer.shape[1])) for layer in layers]
    batch = min(batch, len(x))
    order, at = rng.permutation(len(x)), 0
    for step in range(1, steps + 1):
        if at + batch > len(order):
            order, at = rng.permutation(len(x)), 0
        rows = order[at : at + batch]
        at += batch
        gradients = _gradients(layers, points[rows], slope, rows)
        rate = top * _schedule(step / steps)
        moves = [state.after(g, step) for state, g in zip(states, gradients, strict=True)]
        layers = [layer - rate * direction for layer, (direction, _) in zip(layers, moves, strict=True)]
        states = [state for _, state in moves]
        if progress is not None and (step % 500 == 0 or step == steps):
            progress(step, steps)
    return Network(centre, width, tuple(layers))


def _schedule(done: float) -> np.float32:
    """Linear warm-up, then half a cosine down to nothing."""
    return np.float32(done / _WARM_UP if done < _WARM_UP else 0.5 * (1 + np.cos(np.pi * done)))


def _initial(sizes: tuple[int, ...], rng: np.random.Generator) -> list[_Array]:
    layers = []
    for n, m in pairwise(sizes):
        offset = rng.normal(scale=0.3, size=(1, m))
        layers.append(np.vstack([rng.normal(size=(n, m)) / np.sqrt(n), offset]).astype(np.float32))
    layers[-1][-1] = 0
    return layers


def _gradients(layers: list[_Array], x: _Array, slope: Slope, rows: IntArray) -> list[_Array]:
    """Derivatives by layer of the loss with this `slope` over the points x (n, n_in), number `rows` of all points."""
    values = [x]
    for layer in layers[:-1]:
        values.append(np.tanh(values[-1] @ layer[:-1] + layer[-1]))
    back = slope(values[-1] @ layers[-1][:-1] + layers[-1][-1], rows)
    out = []
    for value, layer in zip(reversed(values), reversed(layers), strict=True):
        out.append(np.vstack([value.T @ back, back.sum(axis=0)]))
        back = (back @ layer[:-1].T) * (1 - value**2)
    return out[::-1]


@dataclass(frozen=True, eq=False)
class _Soap:
    """What SOAP remembers of one layer: averages of the gradient, of its turned square, and of Shampoo's factors."""

    factors: tuple[_Array, _Array]
    bases: tuple[_Array, _Array] | None
    mean: _Array
    square: _Array

    def after(self, gradient: _Array, step: int) -> tuple[_Array, _Soap]:
        """Where to go for a `gradient`, of the shape of the layer, and what is then remembered (Algorithm 3 of the paper)."""
        keep, take = np.float32(_MEMORY), np.float32(1 - _MEMORY)
        outer = (gradient @ gradient.T, gradient.T @ gradient)
        factors = (keep * self.factors[0] + take * outer[0], keep * self.factors[1] + take * outer[1])
        if self.bases is None:
            # The first gradient only sets the basis.
            left, right = (np.ascontiguousarray(np.linalg.eigh(f)[1][:, ::-1]) for f in factors)
            return np.zeros_like(gradient), replace(self, factors=factors, bases=(left, right))
        left, right = self.bases
        mean = keep * self.mean + take * gradient
        square = keep * self.square + take * (left.T @ gradient @ right) ** 2
        unbias = np.float32(np.sqrt(1 - _MEMORY**step) / (1 - _MEMORY**step))
        turned = (left.T @ mean @ right) / (np.sqrt(square) + np.float32(1e-10)) * unbias
        direction = np.asarray(left @ turned @ right.T)
        if step % _TURN == 0:
            left, right = np.linalg.qr(factors[0] @ left)[0], np.linalg.qr(factors[1] @ right)[0]
        return direction, _Soap(factors, (left, right), mean, square)


def _nothing_yet(shape: tuple[int, int]) -> _Soap:
    n, m = shape
    zeros = np.zeros(shape, np.float32)
    return _Soap((np.zeros((n, n), np.float32), np.zeros((m, m), np.float32)), None, zeros, zeros)
