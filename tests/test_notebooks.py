"""Every notebook runs from top to bottom, in its own folder; those that sample are kept with what came out.

They are kept as they came out of sampling until convergence; here they sample for less long, with fewer walkers, after one
climb and two rounds of steps, and are compared with coarse finite elements. Functions of the sampler are replaced in their
kernels for that: a notebook calls `calib.sample` as its reader would, who has no such choice.
"""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
#: What is sampled less long, by the notebook that it stands in.
BRIEF = ("problem, seed=1)", "problem, seed=1, max_steps=10, n_walkers=32, processes=0)")
SHORTER = {
    "calibrate": (
        (
            "calib.sample(problem, seed=1), problem.forward",
            "calib.sample(problem, seed=1, max_steps=20, n_walkers=32, processes=0), problem.forward, FiniteElements(1e-2)",
        ),
    ),
    "decide": (BRIEF,),
    "next_measurement": (BRIEF,),
    "compare_models": (BRIEF, ("other, seed=2)", "other, seed=2, max_steps=10, n_walkers=32, processes=0)")),
}
BRIEFLY = f"""
import sys
from contextlib import ExitStack
sys.path.insert(0, {str(Path(__file__).parent / "calib" / "runs")!r})
from models.fem import FiniteElements
from small_run import in_small_steps
briefly = ExitStack()
briefly.enter_context(in_small_steps())
"""


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda p: p.stem)
@pytest.mark.filterwarnings("default")
def test_notebook_runs(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    if path.stem in SHORTER:
        notebook.cells.insert(0, nbformat.v4.new_code_cell(BRIEFLY))
        for whole, short in SHORTER[path.stem]:
            assert sum(cell.source.count(whole) for cell in notebook.cells) == 1
            for cell in notebook.cells:
                cell.source = cell.source.replace(whole, short)
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(NOTEBOOKS)}}).execute()


@pytest.mark.parametrize(
    ("name", "results"),
    [
        ("calibrate", ("converged: True  surrogate honest: True", "build about 5.5 mm of padding")),
        ("decide", ("converged: True", "mm of padding", "For the drawing")),
        ("next_measurement", ("converged: True", "Most for an hour in the lab")),
        ("compare_models", ("converged: True",)),
        ("finite_elements", ("force off by about", "work of the ball over stored energy")),
    ],
)
def test_what_came_out_is_kept(name: str, results: tuple[str, ...]) -> None:
    cells = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4).cells
    outputs = [output for cell in cells if cell.cell_type == "code" for output in cell.outputs]
    said = "".join(output.get("text", "") for output in outputs)
    assert [result for result in results if result not in said] == []
    assert not any(output.output_type == "error" or output.get("name") == "stderr" for output in outputs)


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda p: p.stem)
def test_every_notebook_is_kept_as_it_ran(path: Path) -> None:
    cells = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert any(output.get("data", {}).get("image/png") or output.get("text") for cell in cells for output in cell.outputs)
