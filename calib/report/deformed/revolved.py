"""A solution of the finite elements in, a picture of sensor and indenter in space out, a quarter cut away."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes.util import find_library
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from calib.errors import Fault, InputError
from calib.files import require_folder
from calib.report.deformed.colours import FieldName, Scale, scale_of
from calib.report.deformed.outline import LINES, MM, caption, indenter_meridian, material_lines, refined, tip_height
from calib.report.pictures import write_figure
from calib.report.style import GREY, INK, styled_figure
from models.fem import Solution
from models.fem.fields import Fields, fields_of, sheet
from models.sensor import FloatArray

#: Directions between which the body is there; the quarter cut away faces the camera, one of its faces more than the other.
_FACES = (0.0, 1.5 * np.pi)
#: Azimuth and elevation.
_CAMERA = np.radians([-58.0, 24.0])


@styled_figure
def revolved_figure(solution: Solution, step: int = -1, field: FieldName = "pressure") -> Figure:
    """Draw sensor and indenter in space, a quarter cut away so that the inside shows, coloured by a field.

    Drawn off screen: needs no display, but on Linux a library that draws without one (libEGL or libOSMesa).

    Parameters
    ----------
    solution : with at least one state.
    step : index into its states; negative ones count from the end.
    field : what to colour by, see `models.fem.fields.Fields`.

    Raises
    ------
    ValueError
        If there is no such step or field.
    InputError
        If PyVista is not installed, or there is nothing to draw with.
    """
    pv = _optional("pyvista")
    fields = fields_of(solution, step)
    scale = scale_of(fields, field, np.inf)
    with _off_screen():
        image = _trimmed(_in_space(pv, solution, step, fields, scale, scale.factor * getattr(fields, field)))
    width, margin, below, above = 7.2, 0.15, 0.72, 0.34
    tall = (width - 2 * margin) * image.shape[0] / image.shape[1]
    height = tall + below + above
    fig = Figure(figsize=(width, height))
    ax = fig.add_axes((margin / width, below / height, 1 - 2 * margin / width, tall / height))
    ax.imshow(image, interpolation="lanczos")
    ax.set_axis_off()
    ax.set_title(caption(solution, step))
    bar = fig.add_axes((0.25, 0.44 / height, 0.5, 0.11 / height))
    fig.colorbar(
        ScalarMappable(Normalize(scale.low, scale.high), scale.colours), cax=bar, orientation="horizontal", extend=scale.extend
    )
    bar.set_xlabel(scale.label, labelpad=2)
    bar.grid(False)
    return fig


def revolved_picture(solution: Solution, step: int, field: FieldName, path: Path) -> None:
    """Write `revolved_figure` to a file; where it cannot go is said before anything is drawn.

    Parameters
    ----------
    solution : with at least one state.
    step : index into its states; negative ones count from the end.
    field : what to colour by, see `models.fem.fields.Fields`.
    path : see `write_figure`.

    Raises
    ------
    ValueError, InputError
        As `revolved_figure` and `write_figure`.
    """
    require_folder(path)
    write_figure(revolved_figure(solution, step, field), path)


def _in_space(pv: Any, solution: Solution, step: int, fields: Fields, scale: Scale, values: FloatArray) -> Any:
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
    plot.camera.focal_point = (0.0, 0.0, MM * solution.design.thickness)
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
    return pv.StructuredGrid(*(MM * x[:, :, None] for x in grid))


def _add_body(pv: Any, plot: Any, solution: Solution, step: int, fields: Fields, scale: Scale, values: FloatArray) -> None:
    """Skin and cut faces of the sensor with their lines."""
    look = {"cmap": scale.colours, "clim": (scale.low, scale.high), "show_scalar_bar": False, "scalars": "shown"}
    around = np.linspace(*_FACES, 181)
    top = len(fields.shapes) - 1
    for k in range(top + 1):
        r, z, value = (refined(sheet(fields, v, k)) for v in (fields.r, fields.z, values))
        side, above = (r[-1], z[-1], value[-1]), (r[:, -1], z[:, -1], value[:, -1])
        for line_r, line_z, line_value in (side,) if k < top else (side, above):
            skin = _revolved(pv, line_r, line_z, around)
            skin["shown"] = np.tile(line_value, around.size)
            plot.add_mesh(skin, smooth_shading=True, ambient=0.55, diffuse=0.5, n_colors=512, **look)
        for angle in _FACES:
            face = pv.StructuredGrid(*(MM * x[:, :, None] for x in (r * np.cos(angle), r * np.sin(angle), z)))
            face["shown"] = value.ravel(order="F")
            plot.add_mesh(face, lighting=False, n_colors=512, **look)
    # Lines lie a little before the faces, or they would sink into them here and there.
    before = 2e-3 * solution.design.radius
    for kind, (r, z) in material_lines(solution, step):
        for angle, outwards in zip(_FACES, (-np.pi / 2, np.pi / 2), strict=True):
            x, y = (r * f(angle) + before * f(angle + outwards) for f in (np.cos, np.sin))
            line = pv.lines_from_points(MM * np.stack([x, y, z], axis=1))
            plot.add_mesh(line, color=INK, line_width=3.0 * LINES[kind]["lw"], lighting=False)


def _add_rigid(pv: Any, plot: Any, solution: Solution, step: int, rim: float) -> None:
    """Base, a little wider than the `rim` of the disc, and the indenter as translucent metal with the same quarter cut away."""
    h, tip = solution.design.thickness, tip_height(solution, step)
    plate = rim * np.array([0.0, 1.08, 1.08]), np.array([-2e-3 * h, -2e-3 * h, -0.08 * rim])
    skin = _revolved(pv, *plate, np.linspace(0, 2 * np.pi, 241))
    plot.add_mesh(skin, color="#d0d0d0", smooth_shading=True, split_sharp_edges=True, ambient=0.4, diffuse=0.6)
    r, z = indenter_meridian(solution)
    # A hair above the surface it touches, for the same reason as the lines.
    z = tip + 5e-3 * h + z
    metal = {"color": "#a9b4c2", "specular": 0.7, "specular_power": 30, "ambient": 0.25}
    skin = _revolved(pv, np.append(r, 0.0), np.append(z, z[-1]), np.linspace(*_FACES, 181))
    plot.add_mesh(skin, opacity=0.4, smooth_shading=True, split_sharp_edges=True, **metal)
    for angle in _FACES:
        x, y = (np.stack([0 * r, r]) * f(angle) for f in (np.cos, np.sin))
        plot.add_mesh(pv.StructuredGrid(*(MM * v[:, :, None] for v in (x, y, np.stack([z, z])))), opacity=0.5, **metal)
        border = np.concatenate([[[0.0, 0.0, z[-1]]], np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)[::-1]])
        plot.add_mesh(pv.lines_from_points(MM * border), color=GREY, line_width=2.0, lighting=False)


def _optional(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        advice = 'Install it with: pip install "dielectric-elastomer-calibration[view]"'
        raise InputError(Fault(f"this needs the package {name}, which is not installed", advice=advice)) from None


@contextmanager
def _off_screen() -> Iterator[None]:
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
