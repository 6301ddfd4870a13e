"""Pictures and ParaView files of a solution: what is drawn is where it is, files are whole and can be read back."""

import itertools
import sys
from functools import cache
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from calib.errors import InputError
from calib.report.deformed import revolved
from calib.report.deformed.colours import field_colours
from calib.report.deformed.cross_section import cross_section_figure
from calib.report.deformed.paraview import write_vtk
from calib.report.deformed.revolved import revolved_picture
from calib.report.pictures import write_figure
from models.fem import FiniteElements, Solution
from models.fem.fields import fields_of
from models.layers import Dielectric, Layer, LayeredDesign, Profile, cone, flat_punch, sphere
from models.sensor import Base, FloatArray

NO_FIELD: Any = "stress"
DEPTHS = (0.2e-3, 0.4e-3)
BALL = sphere(2e-3)


@cache
def pressed(
    profile: Profile = BALL,
    path: tuple[float, ...] = DEPTHS,
    modulus: float = 0.6e6,
    radius: float = 6e-3,
    base: Base = "bonded",
) -> Solution:
    layers = (Layer(1.1e-3, modulus / 3, name="padding"), Layer(0.7e-3, modulus), Layer(0.05e-3, 2 * modulus, name="skin"))
    dielectrics = (Dielectric(1.1e-3, 1.4e-3, 2.8), Dielectric(1.4e-3, 1.8e-3, 2.8))
    design = LayeredDesign(profile, layers, radius, 0.8 * radius, dielectrics, base=base)
    return FiniteElements(4e-3).solve(design, np.array(path))


def drawn(figure: Figure, kind: str) -> list[FloatArray]:
    return [np.array(line.get_data()) for line in figure.axes[0].lines if line.get_gid() == kind]


def words(figure: Figure) -> list[str]:
    return [t.get_text() for t in figure.axes[0].texts]


@pytest.mark.parametrize(
    "profile", [sphere(2e-3), flat_punch(1.5e-3, 0.1e-3), cone(np.radians(60), 0.3e-3), Profile(0.5e-3, 0.2e-3, 1.2)], ids=repr
)
def test_the_drawn_surface_touches_the_drawn_indenter_and_nowhere_enters_it(profile: Profile) -> None:
    solution = pressed(profile)
    figure = cross_section_figure(solution)
    (outline,), (indenter,) = drawn(figure, "outline"), drawn(figure, "indenter")
    tip = np.min(indenter[1])
    assert tip == pytest.approx(1.85 - 0.4, abs=1e-9)
    # The meridian that is drawn is the profile's.
    heights = [1e3 * profile.height_at(abs(r) * 1e-3) for r in indenter[0] if abs(r) * 1e-3 < profile.flat_radius + 1e-4]
    within = np.abs(indenter[0]) * 1e-3 < profile.flat_radius + 1e-4
    np.testing.assert_allclose(indenter[1][within] - tip, heights, atol=1e-9)
    edge = 1e3 * solution.response.contact_radius[-1]
    assert indenter[0][-1] > edge
    surface = outline[:, np.abs(outline[0]) < 0.97 * edge]
    assert surface.shape[1] > 10
    above = tip + np.array([1e3 * profile.height_at(abs(r) * 1e-3) for r in surface[0]])
    np.testing.assert_allclose(surface[1], above, atol=2e-5 if profile.flat_radius == 0 else 1e-3)
    free = outline[:, (np.abs(outline[0]) > edge) & (np.abs(outline[0]) < np.max(indenter[0]))]
    assert np.all(free[1] <= tip + np.array([1e3 * profile.height_at(abs(r) * 1e-3) for r in free[0]]) + 1e-3)


def test_electrodes_and_interfaces_are_where_the_material_is() -> None:
    solution = pressed()
    figure, fields = cross_section_figure(solution), fields_of(solution)
    electrodes = drawn(figure, "electrode")
    assert len(electrodes) == 3  # the one between the two dielectrics is one line
    for line, height in zip(electrodes, (1.1e-3, 1.4e-3, 1.8e-3), strict=True):
        np.testing.assert_allclose(line, line[:, ::-1] * [[-1], [1]], atol=1e-12)
        assert line[0, -1] == pytest.approx(1e3 * 0.8 * 6e-3, abs=0.1)
        assert line[1, -1] == pytest.approx(1e3 * height, abs=0.1)
    faces = drawn(figure, "interface")
    assert len(faces) == 2
    lower = np.isclose(fields.rest_z, 1.1e-3)
    for r, z in 1e3 * np.stack([fields.r[lower], fields.z[lower]], axis=1):
        assert np.min(np.hypot(faces[0][0] - r, faces[0][1] - z)) < 1e-9


def test_words_and_numbers_of_a_figure() -> None:
    figure = cross_section_figure(pressed(), 0)
    response = pressed().response
    title = figure.axes[0].get_title(loc="left")
    assert title.startswith("indentation 0.200 mm, force ")
    assert float(title.split("force ")[1].split(" N")[0]) == pytest.approx(response.force[0], rel=5e-3)
    assert title.endswith(f"capacitance change +{100 * response.capacitance_change[0]:.2f} %")
    for text in ("padding, 0.2 MPa", "layer 2, 0.6 MPa", "skin, 1.2 MPa", "bonded base", "sphere, radius 2 mm"):
        assert text in words(figure)
    assert "slippery base" in words(cross_section_figure(pressed(base="slippery")))
    assert figure.axes[1].get_xlabel() == "pressure (kPa)"
    assert cross_section_figure(pressed(modulus=60e6)).axes[1].get_xlabel() == "pressure (MPa)"
    assert cross_section_figure(pressed(), field="largest_stretch").axes[1].get_xlabel() == "largest principal stretch"


def test_the_legend_names_what_can_be_seen() -> None:
    # Both interfaces lie under electrodes: seen only where the disc is shown beyond those.
    for radius, names in ((6e-3, ["electrode"]), (2.5e-3, ["electrode", "layer interface"])):
        (legend,) = cross_section_figure(pressed(radius=radius)).legends
        assert [t.get_text() for t in legend.get_texts()] == names


def test_a_disc_much_wider_than_the_contact_is_shown_around_the_contact() -> None:
    narrow, wide = cross_section_figure(pressed(radius=2.5e-3)), cross_section_figure(pressed(radius=15e-3))
    assert narrow.axes[0].get_xlim()[1] > 2.5
    assert narrow.axes[0].get_xlabel() == "radius (mm)"
    edge = 1e3 * pressed(radius=15e-3).response.contact_radius[-1]
    assert 1.5 * edge < wide.axes[0].get_xlim()[1] < 5 * edge
    assert wide.axes[0].get_xlabel() == "radius (mm); the disc ends at 15 mm"


def test_a_figure_is_written_with_equal_axes_and_nothing_cut_off(tmp_path: Path) -> None:
    figure = cross_section_figure(pressed(), field="thickness_stretch")
    write_figure(figure, tmp_path / "section.png")
    assert (tmp_path / "section.png").read_bytes().startswith(b"\x89PNG")
    ax, renderer = figure.axes[0], FigureCanvasAgg(figure).get_renderer()
    box = ax.get_window_extent(renderer)
    assert box.width / np.ptp(ax.get_xlim()) == pytest.approx(box.height / np.ptp(ax.get_ylim()), rel=1e-6)
    for text in [*ax.texts, ax.title, ax.xaxis.label, ax.yaxis.label, figure.axes[1].xaxis.label]:
        extent = text.get_window_extent(renderer)
        assert figure.bbox.x0 <= extent.x0
        assert extent.x1 <= figure.bbox.x1, text.get_text()
        assert figure.bbox.y0 <= extent.y0
        assert extent.y1 <= figure.bbox.y1
    names = sorted((t.get_window_extent(renderer) for t in ax.texts if t.get_text().endswith("MPa")), key=lambda e: e.y0)
    assert all(low.y1 <= high.y0 + 4 for low, high in itertools.pairwise(names))


def test_a_figure_of_the_stack_at_rest_can_be_drawn() -> None:
    FigureCanvasAgg(cross_section_figure(pressed(path=(0.0, 0.2e-3)), 0)).draw()


def test_a_field_a_step_or_a_name_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no field 'stress'; there are pressure, thickness_stretch, largest_stretch"):
        cross_section_figure(pressed(), field=NO_FIELD)
    with pytest.raises(ValueError, match="there is no step 7"):
        cross_section_figure(pressed(), 7)
    figure = cross_section_figure(pressed())
    with pytest.raises(InputError, match=r"ends in \.png, \.pdf or \.svg"):
        write_figure(figure, tmp_path / "section.bmp")
    with pytest.raises(InputError, match="does not exist"):
        write_figure(figure, tmp_path / "nowhere" / "section.png")
    assert list(tmp_path.iterdir()) == []


def test_vtk_files_are_read_back_with_the_fields_and_the_displaced_tip(tmp_path: Path) -> None:
    solution = pressed()
    write_vtk(solution, tmp_path / "press.pvd")
    assert sorted(p.name for p in (tmp_path / "press").iterdir()) == [
        "indenter_0001.vtu",
        "indenter_0002.vtu",
        "section_0001.vtu",
        "section_0002.vtu",
    ]
    for step, depth in enumerate(DEPTHS):
        fields = fields_of(solution, step)
        mesh = meshio.read(tmp_path / "press" / f"section_{step + 1:04d}.vtu")
        (cells,) = mesh.cells
        assert cells.type == "quad9"
        np.testing.assert_array_equal(cells.data, fields.cells)
        np.testing.assert_array_equal(mesh.cell_data["layer"][0], fields.layer)
        np.testing.assert_allclose(mesh.points[:, [0, 2]], np.stack([fields.rest_r, fields.rest_z], axis=1), atol=1e-15)
        np.testing.assert_array_equal(mesh.point_data["pressure_Pa"], fields.pressure)
        assert {"displacement", "thickness_stretch", "largest_stretch"} < set(mesh.point_data)
        top = np.flatnonzero((mesh.points[:, 0] == 0) & np.isclose(mesh.points[:, 2], 1.85e-3))
        np.testing.assert_allclose(mesh.point_data["displacement"][top], [[0, 0, -depth]], atol=1e-4 * depth)
        rigid = meshio.read(tmp_path / "press" / f"indenter_{step + 1:04d}.vtu")
        np.testing.assert_allclose(rigid.point_data["displacement"], np.tile([0, 0, -depth], (len(rigid.points), 1)))
        assert np.min(rigid.points[:, 2]) == pytest.approx(1.85e-3, rel=1e-12)


def test_pyvista_reads_the_collection_at_every_indentation(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    write_vtk(pressed(), tmp_path / "press & hold.pvd")
    reader = pyvista.get_reader(str(tmp_path / "press & hold.pvd"))
    np.testing.assert_allclose(reader.time_values, [0.2, 0.4])
    reader.set_active_time_value(0.4)
    body, rigid = reader.read()
    assert np.unique(body.celltypes) == pyvista.CellType.BIQUADRATIC_QUAD
    warped = body.warp_by_vector("displacement")
    assert warped.bounds[5] < 1.95e-3
    assert np.min(rigid.warp_by_vector("displacement").points[:, 2]) == pytest.approx(1.85e-3 - 0.4e-3, abs=1e-9)
    area = body.compute_cell_sizes(length=False, volume=False)["Area"]
    assert np.sum(area) == pytest.approx(6e-3 * 1.85e-3, rel=1e-3)


def test_times_go_on_when_the_indenter_comes_back(tmp_path: Path) -> None:
    write_vtk(pressed(path=(0.2e-3, 0.4e-3, 0.2e-3, 0.0)), tmp_path / "cycle.pvd")
    times = [line.split('"')[1] for line in (tmp_path / "cycle.pvd").read_text().splitlines() if "section" in line]
    assert times == ["0.2", "0.4", "0.6", "0.8"]


def test_vtk_files_replace_those_of_an_earlier_call_and_nothing_else(tmp_path: Path) -> None:
    write_vtk(pressed(), tmp_path / "press.pvd")
    write_vtk(pressed(path=(0.3e-3,)), tmp_path / "press.pvd")
    assert sorted(p.name for p in (tmp_path / "press").iterdir()) == ["indenter_0001.vtu", "section_0001.vtu"]
    assert (tmp_path / "press.pvd").read_text().count("<DataSet") == 2
    before = (tmp_path / "press.pvd").read_text()
    (tmp_path / "press" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"press holds notes\.txt and is not overwritten"):
        write_vtk(pressed(), tmp_path / "press.pvd")
    assert (tmp_path / "press.pvd").read_text() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["press", "press.pvd"]


def test_vtk_files_are_not_begun_where_they_cannot_go(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.pvd"):
        write_vtk(pressed(), tmp_path / "press.vtu")
    with pytest.raises(InputError, match="does not exist"):
        write_vtk(pressed(), tmp_path / "nowhere" / "press.pvd")
    assert list(tmp_path.iterdir()) == []


def test_without_pyvista_it_is_said_what_installs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(InputError) as caught:
        revolved_picture(pressed(), -1, "pressure", tmp_path / "space.png")
    assert "needs the package pyvista, which is not installed" in str(caught.value)
    assert 'pip install "dielectric-elastomer-calibration[view]"' in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_machine_without_anything_to_draw_with_is_told_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    vtk = pytest.importorskip("vtkmodules.vtkRenderingCore")

    class vtkOSOpenGLRenderWindow:
        pass

    monkeypatch.setattr(vtk, "vtkRenderWindow", vtkOSOpenGLRenderWindow)
    monkeypatch.setattr(revolved, "find_library", lambda _: None)
    with pytest.raises(InputError, match="neither a display nor a library that draws without one"):
        revolved_picture(pressed(), -1, "pressure", tmp_path / "space.png")
    assert list(tmp_path.iterdir()) == []


def test_the_revolved_picture_shows_the_section_in_the_colours_of_the_field(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    try:
        revolved_picture(pressed(), -1, "pressure", tmp_path / "space.png")
    except InputError as error:
        pytest.skip(str(error))
    picture = imread(tmp_path / "space.png")[..., :3]
    assert picture.shape[1] == 1800
    # The darkest colour of the scale, under the tip, and the grey of the base; white at the corners.
    darkest = np.array(field_colours(-0.3, 1.0)(1.0)[:3])
    for colour, share in ((darkest, 1e-4), (to_rgb("#b0b0b0"), 0.02)):
        assert np.mean(np.all(np.abs(picture - colour) < 0.1, axis=2)) > share
    np.testing.assert_array_equal(picture[0, 0], [1, 1, 1])
