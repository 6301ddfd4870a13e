"""From a sensor on its padding to force and capacitance change by FElupe: displacement elements of high order, a penalty."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from models.sensor import FloatArray, IntArray

#: Poisson's ratio of the sensor: displacement elements lock, and their Newton's method fails, where it is much nearer to 0.5.
SENSOR_POISSON_RATIO = 0.49
#: Largest step of the depth, over the thickness of the stack.
LARGEST_STEP = 0.015
#: Contact pressure over overlap, in Young's moduli of the sensor per thickness of the stack; results are taken to infinity.
PENALTIES = (500.0, 1000.0)


@dataclass(frozen=True)
class Stack:
    """Sensor on a bonded padding under a frictionless ball; lengths in mm, moduli in MPa; electrodes over the whole disc."""

    sensor: float
    padding: float
    disc: float
    ball: float
    modulus: float
    padding_modulus: float
    poisson_ratio: float


@dataclass(frozen=True)
class _Grid:
    """Nodes (n, 2) column by column, cells of sensor and padding, corners of the columns, and the rows of the electrodes."""

    points: FloatArray
    sensor: IntArray
    padding: IntArray
    ends: FloatArray
    rows: tuple[int, int, int]


def _between(ends: FloatArray, order: int) -> FloatArray:
    steps = np.diff(ends)[:, None] * np.arange(order) / order
    return np.append((ends[:-1, None] + steps).ravel(), ends[-1])


def _grid(stack: Stack, contact: float, order: int, size: float) -> _Grid:
    """Columns `size` wide under the contact, growing beyond it; rows as high in the sensor, growing below it."""
    fine = np.linspace(0, 1.15 * contact, int(np.ceil(1.15 * contact / size)) + 1)
    ends = list(fine)
    step = size
    while ends[-1] < stack.disc - 1e-9:
        step = min(1.25 * step, 0.3 * (stack.sensor + stack.padding))
        ends.append(min(ends[-1] + step, stack.disc))
    # Fine again at the rim, whose side is free.
    last = ends[-1] - ends[-2]
    ends[-1:] = [ends[-2] + share * last for share in (0.5, 0.75, 0.9, 1.0)]
    n_sensor, n_padding = 2 * int(np.ceil(stack.sensor / size / 2)), int(np.ceil(stack.padding / size / 1.5))
    z = np.concatenate(
        [np.linspace(0, stack.padding, n_padding + 1), stack.padding + np.linspace(0, stack.sensor, n_sensor + 1)[1:]]
    )
    columns, rows = _between(np.array(ends), order), _between(z, order)
    points = np.stack(np.meshgrid(columns, rows, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(len(ends) - 1), np.arange(z.size - 1), indexing="ij"))
    inside = (np.arange(order + 1)[:, None] * rows.size + np.arange(order + 1)).ravel()
    cells = (order * i * rows.size + order * j)[:, None] + inside
    top = rows.size - 1
    return _Grid(
        points,
        cells[j >= n_padding],
        cells[j < n_padding],
        np.array(ends),
        (order * n_padding, top - order * n_sensor // 2, top),
    )


def _bodies(grid: _Grid, stack: Stack, order: int) -> list[tuple[Any, Any]]:
    """FElupe's solid bodies with their fields, each over all nodes; the energy is written as it is defined."""
    felupe, tensor = importlib.import_module("felupe"), importlib.import_module("tensortrax.math")

    def energy(c: Any, mu: float, lame: float) -> Any:
        j = tensor.sqrt(tensor.linalg.det(c))
        return mu / 2 * (tensor.trace(c) - 3) - mu * tensor.log(j) + lame / 2 * (j - 1) ** 2

    found = []
    for cells, modulus, nu in (
        (grid.sensor, stack.modulus, SENSOR_POISSON_RATIO),
        (grid.padding, stack.padding_modulus, stack.poisson_ratio),
    ):
        mu = modulus / (2 * (1 + nu))
        lame = 2 * mu * nu / (1 - 2 * nu)
        mesh = felupe.Mesh(grid.points[:, ::-1], cells, "VTK_LAGRANGE_QUADRILATERAL")
        quadrature = felupe.GaussLegendre(order=order, dim=2, permute=False)
        region = felupe.RegionLagrange(mesh, order=order, dim=2, quadrature=quadrature, permute=False)
        field = felupe.FieldContainer([felupe.FieldAxisymmetric(region, dim=2)])
        found.append((felupe.SolidBody(felupe.Hyperelastic(energy, mu=mu, lame=lame), field), field))
    return found


def _along(order: int, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values and slopes (n, order + 1) of the Lagrange polynomials of an edge at n Gauss points of [0, 1], and weights."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w, nodes = (x + 1) / 2, w / 2, np.arange(order + 1) / order
    inverse = np.linalg.inv(np.vander(nodes, order + 1, increasing=True))
    powers = np.arange(order + 1)
    slopes = powers * x[:, None] ** np.maximum(powers - 1, 0)
    return np.vander(x, order + 1, increasing=True) @ inverse, slopes @ inverse, w


def _change(grid: _Grid, stack: Stack, u: FloatArray, order: int) -> float:
    """C/C0 - 1 of the two halves of the sensor, by rings between their faces with the thickness normal to the middle."""
    value, slope, w = _along(order, 12)
    places = (grid.points + u).reshape(order * (grid.ends.size - 1) + 1, -1, 2)
    edges = order * np.arange(grid.ends.size - 1)[:, None] + np.arange(order + 1)
    line = [(value @ places[edges, row], slope @ places[edges, row]) for row in grid.rows]
    total = 0.0
    for (low, d_low), (high, d_high) in pairwise(line):
        middle, along, across = (low + high) / 2, (d_low + d_high) / 2, high - low
        area = along[..., 0] * across[..., 1] - along[..., 1] * across[..., 0]
        total += float(np.sum(2 * np.pi * middle[..., 0] * np.sum(along**2, axis=-1) / area * w))
    return total / (2 * np.pi * stack.disc**2 / (stack.sensor / 2)) - 1


def press(stack: Stack, depth: FloatArray, order: int, size: float) -> FloatArray:
    """Force [N] and capacitance change at increasing depths [mm], (n_depth, 2), taken to an infinite penalty.

    Parameters
    ----------
    stack : what is pressed.
    depth : (n_depth,).
    order : of the elements.
    size : of the elements under the contact [mm].
    """
    contact = np.sqrt(2 * stack.ball * depth[-1] - depth[-1] ** 2)
    grid = _grid(stack, contact, order, size)
    soft, hard = (_loading(grid, stack, depth, order, factor) for factor in PENALTIES)
    return hard + (hard - soft) * PENALTIES[0] / (PENALTIES[1] - PENALTIES[0])


def _loading(grid: _Grid, stack: Stack, depth: FloatArray, order: int, factor: float) -> FloatArray:
    bodies = _bodies(grid, stack, order)
    stiffness = factor * stack.modulus / (stack.sensor + stack.padding)
    n_row = grid.rows[-1] + 1
    on_base, on_axis = np.arange(0, grid.points.shape[0], n_row), np.arange(n_row)
    held = np.zeros((grid.points.shape[0], 2), dtype=bool)
    held[on_base] = True
    held[on_axis, 0] = True
    free = np.flatnonzero(~held.ravel())
    top = order * np.arange(grid.ends.size - 1)[:, None] * n_row + np.arange(order + 1) * n_row + grid.rows[-1]
    value, _, w = _along(order, 16)
    rest_r = grid.points[top, 0] @ value.T
    weight = 2 * np.pi * rest_r * w * np.diff(grid.ends)[:, None]
    dofs = (2 * top[:, :, None] + np.arange(2)).reshape(top.shape[0], -1)
    u, before, rows = np.zeros_like(grid.points), np.zeros_like(grid.points), []
    ways = np.diff(np.append(0.0, depth))
    cuts = np.ceil(ways / (LARGEST_STEP * (stack.sensor + stack.padding)) - 1e-9).astype(int)
    steps, wanted = np.repeat(ways / cuts, cuts), np.cumsum(cuts)
    last = np.inf
    for number, (d, way) in enumerate(zip(np.cumsum(steps), steps, strict=True), start=1):
        u, before = u + way / last * (u - before), u
        last = way
        for _ in range(60):
            r, k = _inner(bodies, u)
            force, push, tangent = _contact(grid, stack, u, d, top, value, weight * stiffness)
            np.add.at(r, dofs, push)
            index = np.broadcast_to(dofs[:, :, None], tangent.shape), np.broadcast_to(dofs[:, None, :], tangent.shape)
            k = k + csr_array((tangent.ravel(), (index[0].ravel(), index[1].ravel())), shape=k.shape)
            step = np.zeros(u.size)
            step[free] = -splu(k[free][:, free].tocsc()).solve(r[free])
            # A long first step would turn elements inside out.
            u = u + min(1.0, 0.05 * stack.sensor / np.max(np.abs(step))) * step.reshape(-1, 2)
            if np.max(np.abs(step)) < 1e-8 * stack.ball:
                break
        else:
            raise RuntimeError(f"FElupe did not converge at {d:g} mm")
        if number in wanted:
            rows.append((force, _change(grid, stack, u, order)))
    return np.array(rows)


def _inner(bodies: list[tuple[Any, Any]], u: FloatArray) -> tuple[FloatArray, Any]:
    """Force and stiffness of the bodies; FElupe has the axis first."""
    force, stiffness = np.zeros(u.size), csr_array((u.size, u.size))
    for body, field in bodies:
        field[0].values[:] = u[:, ::-1]
        force += body.assemble.vector(field).toarray().ravel()
        stiffness = stiffness + csr_array(body.assemble.matrix(field))
    swapped = np.arange(u.size).reshape(-1, 2)[:, ::-1].ravel()
    return force[swapped], stiffness[swapped][:, swapped]


def _contact(
    grid: _Grid, stack: Stack, u: FloatArray, depth: float, top: IntArray, value: FloatArray, weight: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Force of the ball, and force and stiffness of its penalty k/2 (R - distance)^2 per undeformed area on every edge."""
    place = value @ (grid.points + u)[top]
    away = place - np.array([0.0, stack.sensor + stack.padding - depth + stack.ball])
    distance = np.linalg.norm(away, axis=-1)
    normal = away / distance[..., None]
    overlap = np.maximum(stack.ball - distance, 0.0)
    pull = -(weight * overlap)[..., None] * normal
    turned = np.eye(2) - normal[..., :, None] * normal[..., None, :]
    each = (weight * (overlap > 0))[..., None, None] * (
        normal[..., :, None] * normal[..., None, :] - (overlap / distance)[..., None, None] * turned
    )
    tangent = np.einsum("qi,qj,eqab->eiajb", value, value, each, optimize=True)
    n = top.shape[0]
    return (
        float(np.sum(pull[..., 1])),
        np.einsum("qi,eqa->eia", value, pull).reshape(n, -1),
        tangent.reshape(n, 2 * value.shape[1], -1),
    )
