"""Size and depth in, a table of wall time and force out: our finite elements beside CalculiX and scikit-fem, in one run.

`python benchmarks/fem_peers.py [--size 0.1] [--until 0.7] [--peers calculix scikit-fem]`

All solve the paper's sensor on one core, axisymmetric: a nearly incompressible neo-Hookean disc bonded to a rigid base, and a
frictionless rigid sphere pressed in by equal steps of 0.05 mm. Lengths in mm, stresses in MPa, forces in N. A missing peer is
skipped. The finest CalculiX grid worth a wait is `--size 0.05 --until 0.2`: several minutes.

CalculiX (`ccx` on the path; tried with 2.20) gets a uniform grid of CAX8R elements and penalty contact. At K/mu = 1e4 no
contact stiffness and increment tried took it beyond 0.3 mm, so it gets 1e3. At 0.7 mm the softer bulk takes 0.30 % off the
force (our model: 7.739 N at 1e4, 7.716 N at 1e3) and the contact stiffness of 400 N/mm^3 with CalculiX's default tolerances
another 0.15 to 0.25 %.

scikit-fem (`pip install scikit-fem`) is an assembler, so one Newton iteration of it is timed, on a graded grid of as many
elements as ours with the same Q2 displacement and discontinuous P1 pressure, and multiplied by the number of iterations that
we need. A penalty contact solve with it gives its force and shows that what was assembled is right.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import numpy.typing as npt

from models.fem import FiniteElements
from models.sensor import design_from

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Sphere radius, thickness of sensor and padding, disc radius [mm]; shear modulus [MPa]; step of indentation [mm].
SPHERE, SENSOR, PADDING, DISC = 5.0, 0.74, 1.10, 10.0
HEIGHT = SENSOR + PADDING
SHEAR = 0.23
STEP = 0.05
#: Bulk over shear modulus: ours, which scikit-fem gets too, and the largest at which CalculiX gets to 0.7 mm.
BULK_RATIO = 1e4
CALCULIX_BULK_RATIO = 1e3
#: Newton iterations of our model on the 14 steps to 0.7 mm.
OUR_ITERATIONS = 49
#: Largest share of a step that CalculiX may take at once, the next where it fails. At whole steps it diverges by 0.5 mm.
INCREMENTS = (0.25, 0.1)
#: Contact stiffness of the scikit-fem solve [N/mm^3]; at 3e3 its Newton iterations cycle. Costs 0.2 % of the force.
PENALTY = 1e3


class Row(NamedTuple):
    """A line of the table."""

    who: str
    elements: str
    seconds: float
    force: float


def main() -> None:
    """Run everyone and print the table."""
    parser = argparse.ArgumentParser(description="Time our finite elements beside CalculiX and scikit-fem.")
    parser.add_argument("--size", type=float, default=0.1, help="edge of CalculiX's elements [mm]")
    parser.add_argument("--until", type=float, default=0.7, help="largest indentation [mm], reached by steps of 0.05 mm")
    parser.add_argument("--peers", nargs="*", choices=["calculix", "scikit-fem"], default=["calculix", "scikit-fem"])
    parser.add_argument("--stiffness", type=float, default=400.0, help="CalculiX's contact stiffness [N/mm^3]")
    args = parser.parse_args()
    depths = STEP * np.arange(1, max(1, round(args.until / STEP)) + 1)
    rows = [ours(depths)]
    if "scikit-fem" in args.peers:
        rows += scikit_fem(depths)
    if "calculix" in args.peers:
        rows += calculix(depths, args.size, args.stiffness)
    print_table(rows, depths)


def print_table(rows: list[Row], depths: FloatArray) -> None:
    """Print the rows; the first is what the others are compared with."""
    print(f"{depths.size} steps to {depths[-1]:g} mm, one core")
    print(f"{'who':<48}{'elements':>9}{'wall s':>10}{'x ours':>9}{'end force N':>13}{'x ours':>9}")
    for row in rows:
        slower, force = row.seconds / rows[0].seconds, row.force / rows[0].force
        print(f"{row.who:<48}{row.elements:>9}{row.seconds:>10.3f}{slower:>9.1f}{row.force:>13.4f}{force:>9.4f}")


# --- ours ---


def ours(depths: FloatArray) -> Row:
    """Our finite elements, capacitance and all: median of repeats after a warm-up."""
    design = design_from(
        {
            "indenter_radius": SPHERE * 1e-3,
            "sensor_thickness": SENSOR * 1e-3,
            "sensor_radius": DISC * 1e-3,
            "young_modulus": 3 * SHEAR * 1e6,
            "relative_permittivity": 2.8,
            "padding_thickness": PADDING * 1e-3,
        }
    )
    force = FiniteElements().respond(design, 1e-3 * depths).force
    seconds = median_seconds(lambda: FiniteElements().respond(design, 1e-3 * depths), 7)
    return Row("ours", "its own", seconds, float(force[-1]))


def median_seconds(job: Callable[[], object], repeats: int) -> float:
    """Median wall time of `job`."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


# --- CalculiX ---


def calculix(depths: FloatArray, size: float, stiffness: float) -> list[Row]:
    """CalculiX's row; none where there is no `ccx` or it does not reach the last depth."""
    if shutil.which("ccx") is None:
        print("CalculiX: no ccx on the path, skipped")
        return []
    told = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    release = "".join(re.findall(r"Version\s+(\S+)", told))
    for increment in INCREMENTS:
        text, n_element = deck(depths, size, stiffness, increment)
        seconds, forces = run_calculix(text)
        if forces.size == depths.size:
            return [Row(f"CalculiX {release}, contact {stiffness:g} N/mm^3", str(n_element), seconds, float(forces[-1]))]
        reached = depths[forces.size - 1] if forces.size else 0.0
        print(f"CalculiX: diverged beyond {reached:g} mm in increments of {increment:g} steps, {seconds:.0f} s not counted")
    return []


def run_calculix(text: str) -> tuple[float, FloatArray]:
    """Wall time of one run in a folder of its own, and the force at the end of every step that it finished."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "job.inp").write_text(text)
        start = time.perf_counter()
        subprocess.run(["ccx", "job"], cwd=folder, capture_output=True, check=False, env=os.environ | {"OMP_NUM_THREADS": "1"})
        seconds = time.perf_counter() - start
        result = Path(folder, "job.dat")
        return seconds, end_forces(result.read_text() if result.exists() else "")


def end_forces(text: str) -> FloatArray:
    """Force on the sphere [N] at the ends of the steps, which last a unit of time each, from a .dat file.

    CalculiX makes a wedge of 2 degrees of axisymmetric elements and prints the reaction of that wedge: a 180th of the whole.
    """
    found = re.findall(r"total force.*set BALL and time\s+(\S+)\s+\S+\s+(\S+)", text)
    forces = {float(time): -180 * float(force) for time, force in found}
    return np.array([force for time, force in sorted(forces.items()) if abs(time - round(time)) < 1e-6])


def deck(depths: FloatArray, size: float, stiffness: float, increment: float) -> tuple[str, int]:
    """CalculiX's input and the number of elements in the disc.

    The sphere is one layer of elements along an eighth of its circle, every node of which is moved: exactly rigid.
    """
    nodes, quads, grid = eight_node_grid(
        np.linspace(0, DISC, max(1, round(DISC / size)) + 1),
        np.concatenate(
            [
                np.linspace(0, PADDING, max(1, round(PADDING / size)) + 1),
                np.linspace(PADDING, HEIGHT, max(1, round(SENSOR / size)) + 1)[1:],
            ]
        ),
    )
    n_arc = max(4, round(np.pi / 4 * SPHERE / size))
    polar, shell, _ = eight_node_grid(np.linspace(0, np.pi / 4, n_arc + 1), np.array([SPHERE, SPHERE + size]))
    # Angle runs to the right and the second coordinate up, into the sphere, so the elements keep their sense of rotation.
    radius = 2 * SPHERE - polar[:, 1]
    ball = np.stack([radius * np.sin(polar[:, 0]), HEIGHT + SPHERE - radius * np.cos(polar[:, 0])], axis=1)
    n_node, n_quad, n_row = len(nodes), len(quads), (grid.shape[1] - 1) // 2
    lines = ["*NODE", *node_lines(nodes, quads, 1), *node_lines(ball, shell, 1 + n_node)]
    lines += ["*ELEMENT, TYPE=CAX8R, ELSET=DISC", *element_lines(quads, 1, 1)]
    lines += ["*ELEMENT, TYPE=CAX8R, ELSET=SPHERE", *element_lines(shell, 1 + n_quad, 1 + n_node)]
    used = np.isin(grid, quads)
    lines += ["*NSET, NSET=BASE", *(f"{n + 1}" for n in grid[:, 0][used[:, 0]])]
    lines += ["*NSET, NSET=AXIS", *(f"{n + 1}" for n in grid[0][used[0]])]
    lines += ["*NSET, NSET=BALL", *(f"{n + 1 + n_node}" for n in np.unique(shell))]
    lines += ["*SURFACE, NAME=TOP, TYPE=ELEMENT", *(f"{e}, S3" for e in range(n_row, n_quad + 1, n_row))]
    lines += ["*SURFACE, NAME=ARC, TYPE=ELEMENT", *(f"{e}, S1" for e in range(1 + n_quad, 1 + n_quad + n_arc))]
    lines += ["*MATERIAL, NAME=SILICONE", "*HYPERELASTIC, NEO HOOKE"]
    lines += [f"{SHEAR / 2:.12g}, {2 / (CALCULIX_BULK_RATIO * SHEAR):.12g}"]  # C10 = mu/2, D1 = 2/K
    lines += ["*SOLID SECTION, ELSET=DISC, MATERIAL=SILICONE"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2e5, 0.3", "*SOLID SECTION, ELSET=SPHERE, MATERIAL=STEEL"]
    lines += ["*SURFACE INTERACTION, NAME=SLIP", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:g}"]
    lines += ["*CONTACT PAIR, INTERACTION=SLIP, TYPE=SURFACE TO SURFACE", "TOP, ARC"]
    lines += ["*BOUNDARY", "BASE, 1, 2", "AXIS, 1, 1"]
    for depth in depths:
        lines += ["*STEP, NLGEOM, INC=200", "*STATIC", f"{increment:g}, 1., 1e-5, {increment:g}"]
        lines += ["*BOUNDARY", "BALL, 1, 1", f"BALL, 2, 2, {-depth:.12g}"]
        lines += ["*NODE PRINT, NSET=BALL, TOTALS=ONLY", "RF", "*END STEP"]
    return "\n".join(lines) + "\n", n_quad


def eight_node_grid(x: FloatArray, y: FloatArray) -> tuple[FloatArray, IntArray, IntArray]:
    """Nodes (n, 2) of a grid with mid-points, its eight-node elements, column by column, and node numbers (column, row)."""
    x, y = with_midpoints(x), with_midpoints(y)
    n = np.arange(x.size * y.size).reshape(x.size, y.size)
    low, mid, high = slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)
    around = ((low, low), (high, low), (high, high), (low, high), (mid, low), (high, mid), (mid, high), (low, mid))
    quads = np.stack([n[at].ravel() for at in around], axis=1)
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2), quads, n


def with_midpoints(ends: FloatArray) -> FloatArray:
    """The ends of intervals with the middle of each in between."""
    return np.interp(np.arange(2 * ends.size - 1) / 2, np.arange(ends.size), ends)


def node_lines(nodes: FloatArray, quads: IntArray, first: int) -> list[str]:
    """Lines of the nodes that elements use; the grid's inner nodes they do not."""
    return [f"{n + first}, {nodes[n, 0]:.12g}, {nodes[n, 1]:.12g}" for n in np.unique(quads)]


def element_lines(quads: IntArray, first: int, first_node: int) -> list[str]:
    """Lines of the elements."""
    return [f"{first + e}, " + ", ".join(str(n) for n in quad + first_node) for e, quad in enumerate(quads)]


# --- scikit-fem ---


def scikit_fem(depths: FloatArray) -> list[Row]:
    """Two rows: a penalty contact solve, and one Newton iteration of it times our number of iterations."""
    if importlib.util.find_spec("skfem") is None:
        print("scikit-fem: not installed, skipped")
        return []
    release = importlib.metadata.version("scikit-fem")
    start = time.perf_counter()
    spaces = make_spaces()
    states, iterations = solve_contact(spaces, depths)
    seconds = time.perf_counter() - start
    elements = str(spaces.inside.mesh.nelements)
    if len(states) < depths.size:
        print(f"scikit-fem: Newton did not converge beyond step {len(states)} of {depths.size}")
        return []
    last, depth = states[-1], float(depths[-1])
    force = sphere_force(spaces, last, depth)
    once = median_seconds(lambda: newton_step(spaces, last, depth), 7)
    n = round(OUR_ITERATIONS * depths.size / 14)
    print(f"scikit-fem: one assembly and sparse solve takes {1e3 * once:.1f} ms; 'one iteration x {n}' is that times {n}")
    return [
        Row(f"scikit-fem {release}, one iteration x {n}", elements, n * once, force),
        Row(f"scikit-fem {release}, penalty solve, {iterations} iterations", elements, seconds, force),
    ]


class Spaces(NamedTuple):
    """scikit-fem bases of displacement and pressure and of the displacement on the top; unknowns that are held."""

    inside: Any
    pressure: Any
    top: Any
    held: IntArray


def make_spaces() -> Spaces:
    """Bases on a graded grid, 3 x 3 Gauss points an element, as ours, and 2 an edge."""
    import skfem

    mesh = skfem.MeshQuad.init_tensor(*grid_lines())
    inside = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=5)
    pressure = inside.with_element(linear_pressure())
    top = skfem.FacetBasis(mesh, inside.elem, facets=mesh.facets_satisfying(lambda x: x[1] > HEIGHT - 1e-9), intorder=3)
    base = inside.get_dofs(mesh.facets_satisfying(lambda x: x[1] < 1e-9)).all()
    axis = inside.get_dofs(mesh.facets_satisfying(lambda x: x[0] < 1e-9)).all(["u^1"])
    return Spaces(inside, pressure, top, np.union1d(base, axis))


def grid_lines() -> tuple[FloatArray, FloatArray]:
    """Lines of 35 columns, fine below 0.6 R and growing by a fifth beyond, and 11 rows, the sensor's of one height."""
    fine = 0.6 * SPHERE * np.linspace(0, 1, 25) ** 1.5
    beyond = np.cumsum(1.2 ** np.arange(11))
    down = np.cumsum(1.3 ** np.arange(5))
    padding = PADDING * (1 - down[::-1] / down[-1])
    return (
        np.concatenate([fine, fine[-1] + (DISC - fine[-1]) * beyond / beyond[-1]]),
        np.concatenate([padding, np.linspace(PADDING, HEIGHT, 7)]),
    )


def linear_pressure() -> Any:
    """The discontinuous P1 element on quadrilaterals, 1, x, y on each: scikit-fem's own are discontinuous only as Q1."""
    from skfem.element import ElementH1
    from skfem.refdom import RefQuad

    class LinearPressure(ElementH1):
        """Discontinuous P1."""

        interior_dofs = 3
        maxdeg = 1
        dofnames = ("p", "p_x", "p_y")
        doflocs = np.full((3, 2), 0.5)
        refdom = RefQuad

        def lbasis(self, X: FloatArray, i: int) -> tuple[FloatArray, FloatArray]:
            """Value and gradient of function i at points X (2, ...) of the unit square."""
            gradient = np.zeros_like(X)
            if i == 0:
                return np.ones_like(X[0]), gradient
            gradient[i - 1] = 1
            return X[i - 1] - 0.5, gradient

    return LinearPressure()


def solve_contact(spaces: Spaces, depths: FloatArray) -> tuple[list[FloatArray], int]:
    """Unknowns at each depth up to the first where Newton fails, and the number of iterations."""
    x = before = np.zeros(spaces.inside.N + spaces.pressure.N)
    states: list[FloatArray] = []
    iterations = 0
    for depth in depths:
        last, x = x, 2 * x - before
        for _ in range(40):
            step = newton_step(spaces, x, float(depth))
            x = x + step
            iterations += 1
            if np.max(np.abs(step[: spaces.inside.N])) < 3e-7 * depth:
                break
        else:
            return states, iterations
        before = last
        states.append(x)
    return states, iterations


def newton_step(spaces: Spaces, x: FloatArray, depth: float) -> FloatArray:
    """One assembly of tangent and residual at the unknowns `x`, and one sparse solve: what is timed."""
    import skfem
    from scipy.sparse import bmat

    inside, pressure, top = spaces.inside, spaces.pressure, spaces.top
    r = inside.global_coordinates()[0]
    weight = 2 * np.pi * r
    f = deformation(inside.interpolate(x[: inside.N]), r)
    p = np.asarray(pressure.interpolate(x[inside.N :]))
    cof, jacobian = cofactor(f), (f[0] * f[3] - f[1] * f[2]) * f[4]
    stress = weight * (SHEAR * f + (p - SHEAR / jacobian) * cof)
    tangent = weight * elasticity(f, p, cof, jacobian)
    swelling = weight * (jacobian - 1 - p / (BULK_RATIO * SHEAR))
    cof, compliance = weight * cof, weight / (BULK_RATIO * SHEAR)

    def stiffness(u: Any, v: Any, _: Any) -> Any:
        du, dv = strain(u, r), strain(v, r)
        return sum(dv[m] * sum(tangent[m, n] * du[n] for n in range(5)) for m in range(5))

    def coupling(q: Any, v: Any, _: Any) -> Any:
        return sum(c * s for c, s in zip(cof, strain(v, r), strict=True)) * q

    uu = skfem.BilinearForm(stiffness).assemble(inside)
    up = skfem.BilinearForm(coupling).assemble(pressure, inside)
    pp = skfem.BilinearForm(lambda q, s, _: -compliance * q * s).assemble(pressure)
    ru = skfem.LinearForm(lambda v, _: sum(c * s for c, s in zip(stress, strain(v, r), strict=True))).assemble(inside)
    rp = skfem.LinearForm(lambda s, _: swelling * s).assemble(pressure)

    push, normal, block = contact(spaces, x, depth)
    uu += skfem.BilinearForm(lambda u, v, _: sum(v[i] * block[i][j] * u[j] for i in (0, 1) for j in (0, 1))).assemble(top)
    ru -= skfem.LinearForm(lambda v, _: push * (normal[0] * v[0] + normal[1] * v[1])).assemble(top)
    system = bmat([[uu, up], [up.T, pp]], "csr")
    return np.asarray(skfem.solve(*skfem.condense(system, -np.concatenate([ru, rp]), D=spaces.held)))


def strain(v: Any, r: FloatArray) -> tuple[FloatArray, ...]:
    """Gradient of an axisymmetric displacement, the five components rr, rz, zr, zz, tt."""
    return v.grad[0][0], v.grad[0][1], v.grad[1][0], v.grad[1][1], v[0] / r


def deformation(u: Any, r: FloatArray) -> FloatArray:
    """Deformation gradient of the displacement, shape (5, element, point)."""
    f = np.stack(strain(u, r))
    f[[0, 3, 4]] += 1
    return f


def cofactor(f: FloatArray) -> FloatArray:
    """dJ/df."""
    return np.stack([f[3] * f[4], -f[2] * f[4], -f[1] * f[4], f[0] * f[4], f[0] * f[3] - f[1] * f[2]])


def elasticity(f: FloatArray, p: FloatArray, cof: FloatArray, jacobian: FloatArray) -> FloatArray:
    """d2W/df2 of W = mu/2 (f.f - 3 - 2 ln J) + p (J - 1) - p^2 / (2 K), shape (5, 5, element, point)."""
    a = SHEAR / jacobian**2 * cof[:, None] * cof
    a[range(5), range(5)] += SHEAR
    second = {(0, 3): f[4], (1, 2): -f[4], (0, 4): f[3], (1, 4): -f[2], (2, 4): -f[1], (3, 4): f[0]}
    for (m, n), value in second.items():
        a[m, n] += (p - SHEAR / jacobian) * value
        a[n, m] += (p - SHEAR / jacobian) * value
    return a


def contact(spaces: Spaces, x: FloatArray, depth: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Penalty pressure, normal of the sphere (2, ...) and stiffness (2, 2, ...) on the top, weighted by 2 pi r."""
    at = spaces.top.global_coordinates()
    u = spaces.top.interpolate(x[: spaces.inside.N])
    from_centre = np.stack([at[0] + u[0], at[1] + u[1] - (HEIGHT + SPHERE - depth)])
    distance = np.hypot(*from_centre)
    normal = from_centre / distance
    push = 2 * np.pi * at[0] * PENALTY * np.maximum(SPHERE - distance, 0)
    nn = normal[:, None] * normal
    touching = 2 * np.pi * at[0] * PENALTY * (distance < SPHERE)
    lateral = np.eye(2)[:, :, None, None] - nn
    return push, normal, touching * nn - push / distance * lateral


def sphere_force(spaces: Spaces, x: FloatArray, depth: float) -> float:
    """Force of the penalty pressure on the sphere."""
    push, normal, _ = contact(spaces, x, depth)
    return -float(np.sum(push * normal[1] * spaces.top.dx))


if __name__ == "__main__":
    main()
