"""A solution of the finite elements in, pictures out: the deformed section, its revolution in space, files for ParaView."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from ctypes.util import find_library
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Literal
from xml.sax.saxutils import quoteattr

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from calib.errors import Fault, InputError
from calib.files import open_up, require_folder, whole_file
from calib.report.style import GREY, INK, styled_figure
from models.fem import Solution
from models.fem.elements import shape_1d
from models.fem.fields import Fields, fields_of, sheet
from models.fem.laplace import positions
from models.layers import Base, LayeredDesign, Profile
from models.sensor import FloatArray

#: What a picture can be coloured by; see `models.fem.fields.Fields`.
FieldName = Literal["pressure", "thickness_stretch", "largest_stretch"]
_LABELS = {
    "pressure": "pressure",
    "thickness_stretch": "stretch through the thickness",
    "largest_stretch": "largest principal stretch",
}
#: Where each field is at rest, and whether compression is below (-1) or above (1) that.
_RESTS = {"pressure": (0.0, 1), "thickness_stretch": (1.0, -1), "largest_stretch": (1.0, 1)}
_METAL = "#c9ced6"

#: Kinds of drawn material lines.
_LINES: dict[str, dict[str, Any]] = {
    "outline": {"color": INK, "lw": 0.9, "zorder": 4},
    "interface": {"color": INK, "lw": 0.7, "ls": (0, (5, 2)), "zorder": 4},
    "electrode": {"color": INK, "lw": 1.5, "zorder": 5},
}
_MM = 1e3


@dataclass(frozen=True)
class _Scale:
    """How a field becomes a colour: `factor` times SI is shown, from `low` to `high`; `extend` says what lies beyond."""

    label: str
    factor: float
    low: float
    high: float
    extend: Literal["neither", "min", "max", "both"]
    colours: ListedColormap


@styled_figure
def section_figure(solution: Solution, step: int = -1, field: FieldName = "pressure") -> Figure:
    """The deformed section through the axis, mirrored, coloured by a field, with indenter, layers, electrodes and base.

    A disc much wider than the contact is shown around the contact only. What lies beyond the colours are the extreme 0.2 % of
    the area shown, such as corners where the stress has no bound.

    Parameters
    ----------
    step : index into `solution.states`; negative ones count from the end.
    field : pressure, thickness_stretch or largest_stretch, see `models.fem.fields.Fields`.

    Raises
    ------
    ValueError
        If there is no such step or field.
    """
    fields, design = fields_of(solution, step), solution.design
    half = _half_width(solution)
    scale = _scale(fields, field, half)
    names = [_layer_name(design, k) for k in range(len(design.layers))]

    # All margins in inches, so that nothing depends on the aspect of the section.
    width, left, below, above = 7.2, 0.55, 1.05, 0.32
    across = width - left - 0.3 - 0.067 * max(len(name) for name in names)
    inch = 2 * half / across
    low, high = -0.19 * inch, design.thickness + 0.75 * inch
    tall = (high - low) / inch
    height = tall + below + above
    fig = Figure(figsize=(width, height))
    ax = fig.add_axes((left / width, below / height, across / width, tall / height))
    ax.set_xlim(-half * _MM, half * _MM)
    ax.set_ylim(low * _MM, high * _MM)
    ax.grid(False)

    for layer in range(len(design.layers)):
        r, z, value = (_refined(sheet(fields, v, layer)) for v in (fields.r, fields.z, getattr(fields, field)))
        filled = ax.pcolormesh(
            _MM * _mirrored(r, -1),
            _MM * _mirrored(z),
            scale.factor * _mirrored(value),
            shading="gouraud",
            cmap=scale.colours,
            norm=Normalize(scale.low, scale.high),
            rasterized=True,
        )
    lines = _material_lines(solution, step)
    for kind, (r, z) in lines:
        ax.plot(_MM * _mirrored(r, -1), _MM * _mirrored(z), gid=kind, **_LINES[kind])
    _draw_indenter(ax, design, _tip(solution, step), inch)
    _draw_base(ax, design.base)
    _name_layers(ax, fields, names, inch)

    beyond = f"; the disc ends at {_MM * design.radius:g} mm" if half < np.max(fields.r) else ""
    ax.set_xlabel(f"radius (mm){beyond}")
    ax.set_ylabel("height (mm)")
    ax.set_yticks([t for t in ax.get_yticks() if 0 <= t <= high * _MM])
    ax.set_title(_caption(solution, step))
    # An electrode hides the interface it lies on.
    electrodes = [x for d in design.dielectrics for x in (d.lower, d.upper)]
    faces = np.cumsum([x.thickness for x in design.layers])[:-1]
    bare = [design.electrode_radius < half or not np.any(np.isclose(face, electrodes)) for face in faces]
    kinds = ["electrode", "interface"] if any(bare) else ["electrode"]
    named = {"electrode": "electrode", "interface": "layer interface"}
    fig.legend(
        [Line2D([], [], **_LINES[k]) for k in kinds],
        [named[k] for k in kinds],
        loc="center left",
        bbox_to_anchor=(left / width, 0.3 / height),
        bbox_transform=fig.transFigure,
        borderpad=0,
        borderaxespad=0,
    )
    bar = fig.add_axes(((left + 0.45 * across) / width, 0.4 / height, 0.55 * across / width, 0.11 / height))
    fig.colorbar(filled, cax=bar, orientation="horizontal", extend=scale.extend)
    bar.set_xlabel(scale.label, labelpad=2)
    bar.grid(False)
    return fig


@styled_figure
def revolved_figure(solution: Solution, step: int = -1, field: FieldName = "pressure") -> Figure:
    """Sensor and indenter in space, a quarter of the sensor cut away so that its section shows, coloured by a field.

    Drawn off screen: needs no display, but on Linux a library that draws without one (libEGL or libOSMesa).

    Raises
    ------
    ValueError
        If there is no such step or field.
    InputError
        If PyVista is not installed, or there is nothing to draw with.
    """
    pv = _optional("pyvista")
    fields = fields_of(solution, step)
    scale = _scale(fields, field, np.inf)
    with _drawing_quietly():
        image = _trimmed(_in_space(pv, solution, step, fields, scale, scale.factor * getattr(fields, field)))
    width, margin, below, above = 7.2, 0.15, 0.72, 0.34
    tall = (width - 2 * margin) * image.shape[0] / image.shape[1]
    height = tall + below + above
    fig = Figure(figsize=(width, height))
    ax = fig.add_axes((margin / width, below / height, 1 - 2 * margin / width, tall / height))
    ax.imshow(image, interpolation="lanczos")
    ax.set_axis_off()
    ax.set_title(_caption(solution, step))
    bar = fig.add_axes((0.25, 0.44 / height, 0.5, 0.11 / height))
    fig.colorbar(
        ScalarMappable(Normalize(scale.low, scale.high), scale.colours), cax=bar, orientation="horizontal", extend=scale.extend
    )
    bar.set_xlabel(scale.label, labelpad=2)
    bar.grid(False)
    return fig


def revolved_picture(solution: Solution, step: int, field: FieldName, path: Path) -> None:
    """`revolved_figure` written to `path`; errors as there and of `write_figure`."""
    require_folder(path)
    write_figure(revolved_figure(solution, step, field), path)


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure as .png, .pdf or .svg, whole or not at all.

    Raises
    ------
    InputError
        If the name ends in something else, or its folder does not exist.
    """
    if path.suffix not in (".png", ".pdf", ".svg"):
        raise InputError(Fault("the name of a picture ends in .png, .pdf or .svg", path, advice="Choose another"))
    with whole_file(path) as whole:
        figure.savefig(whole, dpi=250)


def write_vtk(solution: Solution, path: Path) -> None:
    """Every step for ParaView: a collection `path` (.pvd) and, in a folder of its name beside it, two files (.vtu) per step.

    One file holds the section on biquadratic quadrilaterals in the plane y = 0, undeformed [m], with point data `displacement`
    [m], `pressure_Pa`, `thickness_stretch`, `largest_stretch` and cell data `layer`; the other the meridian of the indenter at
    first touch with its `displacement`. "Warp by Vector" deforms both.

    The collection's time is the way of the indenter in mm: the indentation while it goes down, and on from there when it comes
    back. Files of an earlier call are replaced, all or none.

    Raises
    ------
    ValueError
        If the solution has no states.
    InputError
        If `path` does not end in .pvd, its folder does not exist, or the folder beside it holds
        files that are not of this function.
    """
    if path.suffix != ".pvd":
        raise InputError(Fault("the name of a ParaView collection ends in .pvd", path, advice="Choose another"))
    require_folder(path)
    folder = path.with_suffix("")
    if not solution.states:
        raise ValueError("there is nothing to write: the solution has no states")
    # A folder is replaced only if all that is in it was put there by an earlier call.
    strangers = [p.name for p in folder.iterdir() if not _STEP_FILE.fullmatch(p.name)] if folder.is_dir() else []
    if strangers or (folder.exists() and not folder.is_dir()):
        what = f"holds {strangers[0]}" if strangers else "is a file"
        raise InputError(Fault(f"{folder} {what} and is not overwritten", path, advice="Choose another name"))

    depth = np.array([s.depth for s in solution.states]) * solution.units.length
    way = np.cumsum(np.abs(np.diff(depth, prepend=0.0))) * _MM
    new = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{folder.name}."))
    try:
        entries = []
        for k, time in enumerate(way):
            for part, (name, mesh) in enumerate(_vtk_meshes(solution, k).items()):
                file = f"{name}_{k + 1:04d}.vtu"
                mesh.write(new / file)
                place = quoteattr(f"{folder.name}/{file}")
                entries.append(f'    <DataSet timestep="{time:.9g}" part="{part}" name="{name}" file={place}/>')
        open_up(new, 0o777)
        with whole_file(path) as whole:
            whole.write_text(_COLLECTION.format("\n".join(entries)), encoding="utf-8", newline="\n")
            if folder.is_dir():
                shutil.rmtree(folder)
            new.rename(folder)
    finally:
        shutil.rmtree(new, ignore_errors=True)


_STEP_FILE = re.compile(r"(section|indenter)_\d{4,}\.vtu")
_COLLECTION = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1">
  <Collection>
{}
  </Collection>
</VTKFile>
"""


def _vtk_meshes(solution: Solution, step: int) -> dict[str, Any]:
    """What `write_vtk` writes of one step, in the plane y = 0."""
    import meshio

    fields, design = fields_of(solution, step), solution.design
    depth = solution.states[step].depth * solution.units.length

    def in_plane(r: FloatArray, z: FloatArray) -> FloatArray:
        return np.stack([r, np.zeros_like(r), z], axis=1)

    data = {
        "displacement": in_plane(fields.r - fields.rest_r, fields.z - fields.rest_z),
        "pressure_Pa": fields.pressure,
        "thickness_stretch": fields.thickness_stretch,
        "largest_stretch": fields.largest_stretch,
    }
    points, cells = in_plane(fields.rest_r, fields.rest_z), [("quad9", fields.cells)]
    r, z = _indenter(solution)
    line = [("line", np.stack([np.arange(r.size - 1), np.arange(1, r.size)], axis=1))]
    lowered = np.tile([0.0, 0.0, -depth], (r.size, 1))
    return {
        "section": meshio.Mesh(points, cells, point_data=data, cell_data={"layer": [fields.layer]}),
        "indenter": meshio.Mesh(in_plane(r, design.thickness + z), line, point_data={"displacement": lowered}),
    }


def _mirrored(values: FloatArray, sign: float = 1.0) -> FloatArray:
    """Values along r from the axis outwards, continued to the other side of the axis."""
    return np.concatenate([sign * values[:0:-1], values])


def _refined(values: FloatArray, columns: int = 300) -> FloatArray:
    """Nodal values of biquadratic elements (n_column, n_row) on a finer grid of points, at most about `columns` wide."""
    parts = max(1, columns // values.shape[0])
    for _ in range(2):
        ends = np.arange(0, values.shape[0] - 1, 2)
        shape, _slope = shape_1d(np.linspace(-1, 1, 2 * parts + 1)[:-1])
        inner = np.einsum("kp,ken->epn", shape, np.stack([values[ends + k] for k in range(3)]))
        values = np.concatenate([inner.reshape(-1, values.shape[1]), values[-1:]]).T
    return values


def _tip(solution: Solution, step: int) -> float:
    """Height of the lowest point of the indenter above the base [m]."""
    return solution.design.thickness - solution.states[step].depth * solution.units.length


def _caption(solution: Solution, step: int) -> str:
    r = replace(solution, states=(solution.states[step],)).response
    change = f"{r.capacitance_change[0] * 100:+.2f} %".replace("-", "−")
    return f"indentation {r.depth[0] * _MM:#.3g} mm, force {r.force[0]:#.3g} N, capacitance change {change}"


def _half_width(solution: Solution) -> float:
    """Half of the width of the section shown [m], the same for every step: the whole disc, or the contact's surroundings."""
    design, units = solution.design, solution.units
    contact = max(s.contact_radius for s in solution.states) * units.length
    wanted = max(2.2 * contact, 1.2 * design.profile.flat_radius, design.thickness)
    u_r = [s.u.reshape(solution.model.mesh.r.size, -1, 2)[-1, :, 0] for s in solution.states]
    whole = 1.03 * (design.radius + max(0.0, float(np.max(u_r))) * units.length)
    return whole if whole < 1.6 * wanted else wanted


def _scale(fields: Fields, field: FieldName, half: float) -> _Scale:
    if field not in _LABELS:
        raise ValueError(f"there is no field {field!r}; there are {', '.join(_LABELS)}")
    values = np.asarray(getattr(fields, field))
    seen = fields.r <= half
    areas = [
        np.outer(np.gradient(sheet(fields, fields.rest_r, k)[:, 0]), np.gradient(sheet(fields, fields.rest_z, k)[0])).ravel()
        for k in range(len(fields.shapes))
    ]
    shown, area = values[seen], np.concatenate(areas)[seen]
    order = np.argsort(shown)
    share = np.cumsum(area[order])
    low, high = np.interp([0.001, 0.999], share / share[-1], shown[order])
    rest, sign = _RESTS[field]
    low, high = min(low, rest), max(high, rest)
    if high == low:
        low, high = rest - 1e-3, rest + 1e-3
    slack = 0.02 * (high - low)
    below, above = bool(np.min(shown) < low - slack), bool(np.max(shown) > high + slack)
    extend: Literal["neither", "min", "max", "both"] = (
        "both" if below and above else "min" if below else "max" if above else "neither"
    )
    factor, unit = (1.0, "") if field != "pressure" else (1e-6, " (MPa)") if max(-low, high) >= 1e6 else (1e-3, " (kPa)")
    colours = _colours((low - rest) * sign, (high - rest) * sign)
    return _Scale(_LABELS[field] + unit, factor, float(low) * factor, float(high) * factor, extend, colours)


def _colours(start: float, end: float) -> ListedColormap:
    """From `start` to `end`: lightest at 0, darker with the distance from it, warm above and cold below."""
    x = np.linspace(start, end, 512) / max(abs(start), abs(end))
    warm, cold = colormaps["magma"](1 - 0.8 * np.maximum(x, 0)), colormaps["YlGnBu"](0.85 * np.maximum(-x, 0) + 0.07)
    return ListedColormap(np.where(x[:, None] >= 0, warm, cold), name="warm and cold")


def _material_lines(solution: Solution, step: int) -> list[tuple[str, FloatArray]]:
    """Deformed outline, layer interfaces and electrodes, each with its kind; positions (2, n) [m] from the axis outwards."""
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


def _meridian(profile: Profile, height: float) -> FloatArray:
    """Radius and height above the lowest point (2, n) of the indenter up to `height` [m]."""
    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    arc = np.linspace(0.0, min(angle, np.arccos(max(1 - height / rho, -1.0))), 181)
    x, z = b + rho * np.sin(arc), rho * (1 - np.cos(arc))
    start = ([0.0], [0.0]) if b > 0 else ([], [])
    end = ([profile.radius_at(height)], [height]) if height > z[-1] * (1 + 1e-9) else ([], [])
    return np.stack([np.concatenate([start[0], x, end[0]]), np.concatenate([start[1], z, end[1]])])


def _indenter(solution: Solution) -> FloatArray:
    """The meridian (2, n) as far as it is shown in space: well above the surface, and not much wider than the disc."""
    design, a = solution.design, solution.design.radius
    deepest = max(s.depth for s in solution.states) * solution.units.length
    height = max(min(0.5 * a, design.profile.height_at(0.65 * a)), 1.2 * deepest, 0.15 * a)
    r, z = _meridian(design.profile, height)
    return np.stack([np.minimum(r, 1.2 * a), z])


def _indenter_name(profile: Profile) -> str:
    def mm(x: float) -> str:
        return f"{x * _MM:.3g} mm"

    b, rho, angle = profile.flat_radius, profile.rounding_radius, profile.flank_angle
    if angle == np.pi / 2:
        return f"flat punch, radius {mm(b + rho)}, edge {mm(rho)}" if b > 0 else f"sphere, radius {mm(rho)}"
    half_angle = f"half-angle {90 - np.degrees(angle):.3g}°"
    return f"blunt cone, {half_angle}, face {mm(b)}, edge {mm(rho)}" if b > 0 else f"cone, {half_angle}, tip {mm(rho)}"


def _draw_indenter(ax: Axes, design: LayeredDesign, tip: float, inch: float) -> None:
    half, high = ax.get_xlim()[1] / _MM, ax.get_ylim()[1] / _MM
    r, z = _meridian(design.profile, high + 0.2 * inch - tip)
    x, y = _MM * _mirrored(r, -1), _MM * (tip + _mirrored(z))
    ax.fill(x, y, facecolor=_METAL, edgecolor="none", zorder=6)
    ax.plot(x, y, color=INK, lw=0.9, zorder=6, gid="indenter")
    # The name in two lines at most, inside where it fits, else beside.
    words = _indenter_name(design.profile).split(", ")
    at = high - 0.2 * inch
    within = min(design.profile.radius_at(at - 0.1 * inch - tip), half) / inch
    for lines in (1, 2):
        text = ", ".join(words) if lines == 1 else words[0] + "\n" + ", ".join(words[1:])
        if max(len(t) for t in text.split("\n")) * 0.066 < 2 * within:
            ax.text(0, _MM * at, text, ha="center", va="center", fontsize=8.5, zorder=7)
            return
    outside = design.profile.radius_at(high - tip) + 0.1 * inch
    ax.text(_MM * outside, _MM * at, ", ".join(words), ha="left", va="center", fontsize=8.5, zorder=7)


def _draw_base(ax: Axes, base: Base) -> None:
    (left, right), low = ax.get_xlim(), ax.get_ylim()[0]
    ax.add_patch(Rectangle((left, low), right - left, -low, facecolor="white", edgecolor=GREY, hatch="/////", lw=0, zorder=2))
    ax.plot([left, right], [0, 0], color=INK, lw=1.2, zorder=4)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.2}
    ax.text(0, low / 2, f"{base} base", ha="center", va="center", fontsize=8.5, bbox=box, zorder=5)


def _layer_name(design: LayeredDesign, k: int) -> str:
    layer = design.layers[k]
    return f"{layer.name or f'layer {k + 1}'}, {layer.young_modulus * 1e-6:.3g} MPa"


def _name_layers(ax: Axes, fields: Fields, names: Sequence[str], inch: float) -> None:
    """Names to the right of the picture, each with a line to its layer, pushed apart where layers are thin."""
    half, high = ax.get_xlim()[1] / _MM, ax.get_ylim()[1] / _MM
    ends = []
    for k in range(len(names)):
        r, z = sheet(fields, fields.r, k), sheet(fields, fields.z, k)
        middle = r.shape[1] // 2
        ends.append((min(half, r[-1, middle]), np.interp(half, r[:, middle], z[:, middle])))
    heights = _apart([end[1] for end in ends], 0.16 * inch, 0.05 * inch, high)
    for name, end, height in zip(names, ends, heights, strict=True):
        ax.annotate(
            name,
            (_MM * end[0], _MM * end[1]),
            (_MM * (half + 0.2 * inch), _MM * height),
            va="center",
            fontsize=8.5,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.7, "shrinkA": 1, "shrinkB": 0},
        )


def _apart(wanted: Sequence[float], distance: float, low: float, high: float) -> FloatArray:
    """Increasing heights at least `distance` apart, close to the `wanted` ones, from `low` to about `high`."""
    steps = distance * np.arange(len(wanted))
    # Of all heights with the distance taken out that increase, the nearest: pool neighbours that are in the wrong order.
    pools: list[list[float]] = []
    for x in np.asarray(wanted) - steps:
        pools.append([float(x)])
        while len(pools) > 1 and np.mean(pools[-2]) > np.mean(pools[-1]):
            pools[-2:] = [pools[-2] + pools[-1]]
    free = np.concatenate([np.full(len(p), np.mean(p)) for p in pools])
    return np.asarray(np.clip(free, low, max(low, high - steps[-1])) + steps)


#: Directions between which the body is there; the quarter cut away faces the camera, one of its faces more than the other.
_FACES = (0.0, 1.5 * np.pi)
#: Azimuth and elevation.
_CAMERA = np.radians([-58.0, 24.0])


def _in_space(pv: Any, solution: Solution, step: int, fields: Fields, scale: _Scale, values: FloatArray) -> Any:
    """Rendered image (height, width, 3) on white, coloured by `values`."""
    plot = pv.Plotter(off_screen=True, window_size=(1900, 1380), lighting="none")
    plot.set_background("white")
    plot.enable_anti_aliasing("ssaa")
    plot.enable_depth_peeling(8)
    _add_body(pv, plot, solution, step, fields, scale, values)
    _add_rigid(pv, plot, solution, step, float(np.max(fields.r)))
    for place, intensity in (((-0.7, 0.9, 1.0), 0.75), ((0.6, 0.1, 1.0), 0.35)):
        plot.add_light(pv.Light(position=place, light_type="camera light", intensity=intensity))
    direction = np.array([*(np.cos(_CAMERA[1]) * f(_CAMERA[0]) for f in (np.cos, np.sin)), np.sin(_CAMERA[1])])
    plot.camera.focal_point = (0.0, 0.0, _MM * solution.design.thickness)
    plot.camera.position = plot.camera.focal_point + direction
    plot.camera.up = (0.0, 0.0, 1.0)
    plot.camera.view_angle = 20.0
    plot.reset_camera()
    plot.camera.zoom(1.25)
    image = np.asarray(plot.screenshot(return_img=True))
    plot.close()
    return image


def _trimmed(image: Any) -> Any:
    """Without its white margins."""
    ink = np.any(image < 250, axis=2)
    rows, columns = (np.flatnonzero(np.any(ink, axis=k)) for k in (1, 0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def _revolved(pv: Any, r: FloatArray, z: FloatArray, angles: FloatArray) -> Any:
    """The surface that a line (n,) sweeps about the axis, points numbered along the line first [mm]."""
    grid = np.multiply.outer(r, np.cos(angles)), np.multiply.outer(r, np.sin(angles)), np.repeat(z[:, None], angles.size, 1)
    return pv.StructuredGrid(*(_MM * x[:, :, None] for x in grid))


def _add_body(pv: Any, plot: Any, solution: Solution, step: int, fields: Fields, scale: _Scale, values: FloatArray) -> None:
    """Skin and cut faces of the sensor with their lines."""
    look = {"cmap": scale.colours, "clim": (scale.low, scale.high), "show_scalar_bar": False, "scalars": "shown"}
    around = np.linspace(*_FACES, 181)
    top = len(fields.shapes) - 1
    for k in range(top + 1):
        r, z, value = (_refined(sheet(fields, v, k)) for v in (fields.r, fields.z, values))
        side, above = (r[-1], z[-1], value[-1]), (r[:, -1], z[:, -1], value[:, -1])
        for line_r, line_z, line_value in (side,) if k < top else (side, above):
            skin = _revolved(pv, line_r, line_z, around)
            skin["shown"] = np.tile(line_value, around.size)
            plot.add_mesh(skin, smooth_shading=True, ambient=0.55, diffuse=0.5, n_colors=512, **look)
        for angle in _FACES:
            face = pv.StructuredGrid(*(_MM * x[:, :, None] for x in (r * np.cos(angle), r * np.sin(angle), z)))
            face["shown"] = value.ravel(order="F")
            plot.add_mesh(face, lighting=False, n_colors=512, **look)
    # Lines lie a little before the faces, or they would sink into them here and there.
    before = 2e-3 * solution.design.radius
    for kind, (r, z) in _material_lines(solution, step):
        for angle, outwards in zip(_FACES, (-np.pi / 2, np.pi / 2), strict=True):
            x, y = (r * f(angle) + before * f(angle + outwards) for f in (np.cos, np.sin))
            line = pv.lines_from_points(_MM * np.stack([x, y, z], axis=1))
            plot.add_mesh(line, color=INK, line_width=3.0 * _LINES[kind]["lw"], lighting=False)


def _add_rigid(pv: Any, plot: Any, solution: Solution, step: int, rim: float) -> None:
    """Base, a little wider than the `rim` of the disc, and the indenter as translucent metal with the same quarter cut away."""
    h, tip = solution.design.thickness, _tip(solution, step)
    plate = rim * np.array([0.0, 1.08, 1.08]), np.array([-2e-3 * h, -2e-3 * h, -0.08 * rim])
    skin = _revolved(pv, *plate, np.linspace(0, 2 * np.pi, 241))
    plot.add_mesh(skin, color="#d0d0d0", smooth_shading=True, split_sharp_edges=True, ambient=0.4, diffuse=0.6)
    r, z = _indenter(solution)
    # A hair above the surface it touches, for the same reason as the lines.
    z = tip + 5e-3 * h + z
    metal = {"color": "#a9b4c2", "specular": 0.7, "specular_power": 30, "ambient": 0.25}
    skin = _revolved(pv, np.append(r, 0.0), np.append(z, z[-1]), np.linspace(*_FACES, 181))
    plot.add_mesh(skin, opacity=0.4, smooth_shading=True, split_sharp_edges=True, **metal)
    for angle in _FACES:
        x, y = (np.stack([0 * r, r]) * f(angle) for f in (np.cos, np.sin))
        plot.add_mesh(pv.StructuredGrid(*(_MM * v[:, :, None] for v in (x, y, np.stack([z, z])))), opacity=0.5, **metal)
        border = np.concatenate([[[0.0, 0.0, z[-1]]], np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)[::-1]])
        plot.add_mesh(pv.lines_from_points(_MM * border), color=GREY, line_width=2.0, lighting=False)


def _optional(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        advice = 'Install it with: pip install "dielectric-elastomer-calibration[view]"'
        raise InputError(Fault(f"this needs the package {name}, which is not installed", advice=advice)) from None


@contextmanager
def _drawing_quietly() -> Iterator[None]:
    """Without VTK's remarks that there is no display.

    Raises
    ------
    InputError
        If VTK has nothing to draw with, which would end the program.
    """
    logger = _optional("vtkmodules.vtkCommonCore").vtkLogger
    _optional("vtkmodules.vtkRenderingOpenGL2")
    before = logger.GetCurrentVerbosityCutoff()
    logger.SetStderrVerbosity(logger.VERBOSITY_ERROR)
    try:
        window = type(_optional("vtkmodules.vtkRenderingCore").vtkRenderWindow()).__name__
        no_mesa = window == "vtkOSOpenGLRenderWindow" and find_library("OSMesa") is None
        if no_mesa or (window == "vtkXOpenGLRenderWindow" and not os.environ.get("DISPLAY")):
            advice = "Install libEGL or libOSMesa (Debian and Ubuntu: apt install libegl1), or draw where there is a display"
            raise InputError(Fault("there is neither a display nor a library that draws without one", advice=advice))
        yield
    finally:
        logger.SetStderrVerbosity(before)
