"""A solution of the finite elements in, files for ParaView out."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from calib.errors import Fault, InputError
from calib.files import open_up, require_folder, whole_file
from calib.report.deformed.outline import MM, indenter_meridian
from models.fem import Solution
from models.fem.fields import fields_of
from models.sensor import FloatArray

_STEP_FILE = re.compile(r"(section|indenter)_\d{4,}\.vtu")
_COLLECTION = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1">
  <Collection>
{}
  </Collection>
</VTKFile>
"""


def write_vtk(solution: Solution, path: Path) -> None:
    """Write every step for ParaView: a collection (.pvd) and, in a folder of its name beside it, two files (.vtu) per step.

    One file holds the section on biquadratic quadrilaterals in the plane y = 0, undeformed [m], with point data `displacement`
    [m], `pressure_Pa`, `thickness_stretch`, `largest_stretch` and cell data `layer`; the other the meridian of the indenter at
    first touch with its `displacement`. "Warp by Vector" deforms both.

    The collection's time is the way of the indenter in mm: the indentation while it goes down, and on from there when it comes
    back. Files of an earlier call are replaced, all or none.

    Parameters
    ----------
    solution : with at least one state.
    path : of the collection.

    Raises
    ------
    ValueError
        If the solution has no states.
    InputError
        If `path` does not end in .pvd, its folder does not exist, or the folder beside it holds files that are not of this
        function.
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
    way = np.cumsum(np.abs(np.diff(depth, prepend=0.0))) * MM
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
    r, z = indenter_meridian(solution)
    line = [("line", np.stack([np.arange(r.size - 1), np.arange(1, r.size)], axis=1))]
    lowered = np.tile([0.0, 0.0, -depth], (r.size, 1))
    return {
        "section": meshio.Mesh(points, cells, point_data=data, cell_data={"layer": [fields.layer]}),
        "indenter": meshio.Mesh(in_plane(r, design.thickness + z), line, point_data={"displacement": lowered}),
    }
