"""A solution of the finite elements in, what is drawn of it out: outline, layers, electrodes, indenter, caption."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from calib.report.style import INK
from models.fem import Solution
from models.fem.elements import shape_1d
from models.fem.laplace import positions
from models.layers import Profile
from models.sensor import FloatArray

#: How each kind of line in the material is drawn.
LINES: dict[str, dict[str, Any]] = {
    "outline": {"color": INK, "lw": 0.9, "zorder": 4},
    "interface": {"color": INK, "lw": 0.7, "ls": (0, (5, 2)), "zorder": 4},
    "electrode": {"color": INK, "lw": 1.5, "zorder": 5},
}
#: Pictures are in mm.
MM = 1e3


def material_lines(solution: Solution, step: int) -> list[tuple[str, FloatArray]]:
    """Follow the lines that are drawn on the rubber: its outline, the interfaces of its layers, its electrodes.

    Parameters
    ----------
    solution : with its states.
    step : index into them.

    Returns
    -------
    list of (str, array)
        The kind of each line (a key of `LINES`), and its deformed positions (2, n) [m] from the axis outwards.
    """
    design, mesh, length = solution.model.design, solution.model.mesh, solution.units.length
    u = solution.states[step].u

    def line(r: FloatArray, z: FloatArray) -> FloatArray:
        return length * positions(mesh, u, r, z).reshape(2, -1)

    top = np.array([design.thickness])
    electrodes = sorted({round(z, 12) for d in design.dielectrics for z in (d.lower, d.upper)})
    covered = np.append(mesh.r[mesh.r < design.electrode_radius], design.electrode_radius)
    faces = np.cumsum([layer.thickness for layer in design.layers])[:-1]
    side = line(np.array([design.radius]), mesh.z[::-1])
    return [
        ("outline", np.concatenate([line(mesh.r, top), side[:, 1:]], axis=1)),
        *(("interface", line(mesh.r, np.array([z]))) for z in faces),
        *(("electrode", line(covered, np.array([z]))) for z in electrodes),
    ]


def meridian(profile: Profile, height: float) -> FloatArray:
    """Follow the surface of the indenter from the axis outwards.

    Parameters
    ----------
    profile : of the indenter.
    height : [m], above its lowest point, up to where it is drawn.

    Returns
    -------
    array
        (2, n) [m], radius and height above the lowest point.
    """
    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    arc = np.linspace(0.0, min(angle, np.arccos(max(1 - height / rho, -1.0))), 181)
    x, z = b + rho * np.sin(arc), rho * (1 - np.cos(arc))
    start = ([0.0], [0.0]) if b > 0 else ([], [])
    end = ([profile.radius_at(height)], [height]) if height > z[-1] * (1 + 1e-9) else ([], [])
    return np.stack([np.concatenate([start[0], x, end[0]]), np.concatenate([start[1], z, end[1]])])


def indenter_meridian(solution: Solution) -> FloatArray:
    """The `meridian` as far as it is shown in space: well above the surface, and not much wider than the disc."""
    design, a = solution.design, solution.design.radius
    deepest = max(s.depth for s in solution.states) * solution.units.length
    height = max(min(0.5 * a, design.profile.height_at(0.65 * a)), 1.2 * deepest, 0.15 * a)
    r, z = meridian(design.profile, height)
    return np.stack([np.minimum(r, 1.2 * a), z])


def tip_height(solution: Solution, step: int) -> float:
    """Height of the lowest point of the indenter above the base [m].

    Parameters
    ----------
    solution : with its states.
    step : index into them.
    """
    return solution.design.thickness - solution.states[step].depth * solution.units.length


def caption(solution: Solution, step: int) -> str:
    """Say in words how far the sensor is pressed in a picture: indentation, force and capacitance change.

    Parameters
    ----------
    solution : with its states.
    step : index into them.
    """
    r = replace(solution, states=(solution.states[step],)).response
    change = f"{r.capacitance_change[0] * 100:+.2f} %".replace("-", "−")
    return f"indentation {r.depth[0] * MM:#.3g} mm, force {r.force[0]:#.3g} N, capacitance change {change}"


def mirrored(values: FloatArray, sign: float = 1.0) -> FloatArray:
    """Continue values along the radius to the other side of the axis.

    Parameters
    ----------
    values : (n, ...), from the axis outwards.
    sign : of the values over there; -1 for the radius itself.
    """
    return np.concatenate([sign * values[:0:-1], values])


def refined(values: FloatArray, columns: int = 300) -> FloatArray:
    """Interpolate nodal values on a finer grid, so that curved elements look curved.

    Parameters
    ----------
    values : (n_column, n_row), at the nodes of biquadratic elements.
    columns : about how wide the finer grid may become.
    """
    parts = max(1, columns // values.shape[0])
    for _ in range(2):
        ends = np.arange(0, values.shape[0] - 1, 2)
        shape, _slope = shape_1d(np.linspace(-1, 1, 2 * parts + 1)[:-1])
        inner = np.einsum("kp,ken->epn", shape, np.stack([values[ends + k] for k in range(3)]))
        values = np.concatenate([inner.reshape(-1, values.shape[1]), values[-1:]]).T
    return values
