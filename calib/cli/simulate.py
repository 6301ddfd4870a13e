"""The command `simulate`: a design file to a loading curve, and with the finite elements to its error and its pictures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import err, not_usable, quantity, refusing_bad_input, say
from calib.errors import Fault, InputError
from calib.files import require_writable, write_text

if TYPE_CHECKING:
    from models.fem import FiniteElements, Solution
    from models.layers import LayeredDesign
    from models.response import Response
    from models.sensor import Design


class ModelName(StrEnum):
    """Forward models to choose from."""

    surrogate = "surrogate"
    fem = "fem"
    closed_form = "closed-form"


class ShownField(StrEnum):
    """What a picture of the deformed sensor shows."""

    pressure = "pressure"
    thickness_stretch = "thickness_stretch"
    largest_stretch = "largest_stretch"


def simulate(
    design: Annotated[Path, typer.Argument(help="The design file (TOML): indenter, sensor, padding or layers.")],
    displacement: Annotated[str | None, typer.Option(help='Indentation to go to, with unit, e.g. "0.7 mm".')] = None,
    force: Annotated[str | None, typer.Option(help='Force to go to instead, e.g. "5 N".')] = None,
    steps: Annotated[int, typer.Option(min=1, max=100000, help="Equal steps up to there (of --force in force).")] = 14,
    model: Annotated[
        ModelName, typer.Option(help="fem is exact and slow, closed-form rough and instant.")
    ] = ModelName.surrogate,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV file to write [default: the screen].")] = None,
    surrogate_file: Annotated[
        Path | None, typer.Option("--surrogate", help="Surrogate file to use instead of the shipped one.")
    ] = None,
    unload: Annotated[bool, typer.Option("--unload", help="Come back the same steps to the first (fem).")] = False,
    accuracy: Annotated[
        float | None, typer.Option(min=1e-5, max=0.1, help="Relative accuracy to mesh for (fem) [default: 0.001].")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Solve again on a finer mesh and print the estimated error (fem).")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Image file of the deformed section at the deepest step (fem): png, pdf, svg.")
    ] = None,
    view: Annotated[
        Path | None, typer.Option(help="Image file (png) of the sensor in 3-D, cut open (fem, with the extra `view`).")
    ] = None,
    field: Annotated[ShownField, typer.Option(help="What colours the picture.")] = ShownField.pressure,
    vtk: Annotated[Path | None, typer.Option(help="ParaView file (pvd) of all steps to write (fem).")] = None,
) -> None:
    """Simulate the loading curve of one design, up to an indentation or a force.

    Example: `calib simulate design.toml --displacement "0.7 mm" -o curve.csv`

    Another: `calib simulate design.toml --force "5 N" --steps 20 --model fem --check --picture deformed.png -o curve.csv`

    Writes: one row per step, the last one at the requested end, columns displacement_m, force_N, contact_radius_m,
    capacitance_F, capacitance_change (C/C0 - 1). With --unload the rows go on back to the first step.

    Exit codes: 0 done; 2 bad input or outside the model's range, nothing written; 3 no equilibrium found before the end, the
    rows up to there written.
    """
    with refusing_bad_input():
        from calib.experiment import forward_of_design, read_design, require_use_of
        from models.analytic import caution
        from models.curves import loading_curve
        from models.sensor import Design

        if (displacement is None) == (force is None):
            raise InputError(Fault("give either --displacement or --force", advice='For example --displacement "0.7 mm"'))
        written = {"-o": output, "--picture": picture, "--view": view, "--vtk": vtk}
        _check_outputs(design, written)
        depth = quantity(displacement, "m", "--displacement") if displacement is not None else None
        load = quantity(force, "N", "--force") if force is not None else None
        for name, value in (("--displacement", depth), ("--force", load)):
            if value is not None and value <= 0:
                raise InputError(Fault(f"{name} must be positive, got {displacement or force}"))
        asked = {
            "--unload": unload,
            "--accuracy": accuracy,
            "--check": check,
            **{k: v for k, v in written.items() if k != "-o"},
        }
        for name, wanted in asked.items():
            if wanted and model is not ModelName.fem:
                raise InputError(Fault(f"{name} needs the finite elements", advice="Add --model fem"))
        require_use_of(surrogate_file, model)
        pressed = read_design(design)
        if model is ModelName.fem:
            path = _Path(depth, load, steps, unload)
            _simulate_fem(pressed, path, accuracy, output, _Pictures(picture, view, vtk, field), check=check)
            return
        if not isinstance(pressed, Design):
            covered = "a ball on a sensor and padding of one law, neo-Hookean or Gent, on a base that is bonded or slips freely"
            message = f"the {model} covers {covered}; the design is another"
            raise InputError(Fault(message, design, advice="Add --model fem"))
        forward = forward_of_design(pressed, model, surrogate_file)
        curve = loading_curve(forward, pressed, displacement=depth, force=load, steps=steps)
        _write_curve(curve, output, f"{steps} steps, {model}")
        if rough := caution(forward, pressed):
            err().print(f"Warning: {rough}", style="yellow", markup=False, soft_wrap=True)


def _check_outputs(design: Path, written: dict[str, Path | None]) -> None:
    """Refuse outputs that cannot be written before the finite elements are solved, not after."""
    for name, path in written.items():
        if path is None:
            continue
        if path.exists() and design.exists() and path.samefile(design):
            raise InputError(Fault("the output would overwrite the design file itself", path, advice=f"Choose another {name}"))
        require_writable(path, "Create it first")
    kinds = {"--picture": (".png", ".pdf", ".svg"), "--view": (".png",), "--vtk": (".pvd",)}
    for name, endings in kinds.items():
        path = written[name]
        if path is not None and path.suffix not in endings:
            raise InputError(Fault(f"{name} must end in {' or '.join(endings)}", path))


@dataclass(frozen=True)
class _Path:
    """Where the ball goes: to an indentation [m] or a force [N] (the other is None) in equal steps, and back if asked."""

    depth: float | None
    force: float | None
    steps: int
    unload: bool

    @property
    def n_step(self) -> int:
        """Steps there, and back to the first."""
        return 2 * self.steps - 1 if self.unload else self.steps


@dataclass(frozen=True)
class _Pictures:
    """Files to draw the deformed sensor into, None for none, and what colours them."""

    section: Path | None
    view: Path | None
    vtk: Path | None
    field: ShownField


def _simulate_fem(
    design: Design | LayeredDesign,
    path: _Path,
    accuracy: float | None,
    output: Path | None,
    pictures: _Pictures,
    *,
    check: bool,
) -> None:
    """Simulate with finite elements, which alone have a way back, an error estimate and pictures."""
    from calib.report import check_in_words
    from models.fem import FiniteElements

    elements = FiniteElements() if accuracy is None else FiniteElements(accuracy)
    solution = _solve(elements, design, path)
    if not solution.states:
        solution.checked()
    _draw(solution, pictures)
    # Last, since a picture that cannot be made is refused, and then nothing is to be written.
    _write_curve(solution.response, output, f"{len(solution.states)} of {path.n_step} steps, fem")
    if solution.failure is None and check:
        for line in check_in_words(elements, solution):
            err().print(line, markup=False, soft_wrap=True)
    if solution.failure is not None:
        reached, reason = solution.states[-1].depth * solution.units.length, solution.failure.reason
        message = f"Ended early: no equilibrium beyond an indentation of {reached * 1e3:.4g} mm: {reason}"
        err().print(message, style="red", markup=False, soft_wrap=True)
        raise not_usable("the curve ends before what was asked for")


def _solve(elements: FiniteElements, design: Design | LayeredDesign, path: _Path) -> Solution:
    import numpy as np

    ramp = np.linspace(0.0, (path.depth if path.depth is not None else path.force) or 0.0, path.steps + 1)[1:]
    way = np.concatenate([ramp, ramp[-2::-1]]) if path.unload else ramp
    return elements.solve(design, way) if path.depth is not None else elements.solve_to_force(design, way)


def _draw(solution: Solution, pictures: _Pictures) -> None:
    """Every picture asked for, of the deepest step, and the steps for ParaView."""
    if pictures.section is None and pictures.view is None and pictures.vtk is None:
        return
    from calib.report import cross_section_figure, revolved_picture, write_figure, write_vtk

    depths = [s.depth for s in solution.states]
    deepest = depths.index(max(depths))
    if pictures.section is not None:
        write_figure(cross_section_figure(solution, deepest, pictures.field.value), pictures.section)
        err().print(f"Written: {pictures.section}", markup=False, soft_wrap=True)
    if pictures.view is not None:
        revolved_picture(solution, deepest, pictures.field.value, pictures.view)
        err().print(f"Written: {pictures.view}", markup=False, soft_wrap=True)
    if pictures.vtk is not None:
        write_vtk(solution, pictures.vtk)
        err().print(f"Written: {pictures.vtk}", markup=False, soft_wrap=True)


def _write_curve(curve: Response, output: Path | None, what: str) -> None:
    from calib.report import curve_csv

    text = curve_csv(curve)
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_text(output, text)
        say(f"Written: {output} ({what})")
