"""Time the forward models on the paper's sensor in one run on one core: `python benchmarks/forward_models.py [--draws 2048]`.

Prints milliseconds (median of repeats) and ratios; set OMP_NUM_THREADS=1 for one core.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from models.analytic import ClosedForm
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.sensor import design_from
from models.surrogate import FAMILIES, is_shipped, load_surrogate
from models.surrogate.gradients import gradients

#: 14 steps to 0.7 mm.
STEPS = np.linspace(0, 0.7e-3, 15)[1:]


def median_ms(job: Callable[[], object], repeats: int) -> float:
    """Median wall time of `job` in milliseconds after one warm-up."""
    job()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=2048, help="designs of a batch")
    n_draw = parser.parse_args().draws
    single = design_from(PAPER_SENSOR)
    rng = np.random.default_rng(0)
    varied = {"sensor_thickness": rng.normal(0.74e-3, 0.02e-3, n_draw), "young_modulus": rng.normal(0.7e6, 5e4, n_draw)}
    batch = design_from(PAPER_SENSOR | varied)
    depth = np.linspace(0, 0.65e-3, 40)
    surrogate = load_surrogate()
    fem = median_ms(lambda: FiniteElements().respond(single, STEPS), 7)
    one = median_ms(lambda: surrogate.respond(single, STEPS), 50)
    many = median_ms(lambda: surrogate.respond(batch, depth), 20) / n_draw
    derivatives = median_ms(lambda: gradients(surrogate, batch, depth), 3) / n_draw
    closed = median_ms(lambda: ClosedForm().respond(batch, depth), 20) / n_draw
    print(f"finite elements, 14 steps to 0.7 mm      {fem:10.2f} ms a curve")
    print(f"surrogate, one design                    {one:10.3f} ms a curve   {fem / one:8.0f} times faster")
    shape = f"{n_draw} designs x {depth.size} depths"
    print(f"surrogate, {shape}      {many:10.4f} ms a curve   {fem / many:8.0f} times faster, {1e3 / many:.0f} curves a second")
    print(f"the same with all ten gradients          {derivatives:10.4f} ms a curve")
    print(f"closed form, {shape}    {closed:10.4f} ms a curve   {fem / closed:8.0f} times faster")
    for family in filter(is_shipped, FAMILIES.values()):
        own = {g.parameter: np.full(n_draw, float(g.value(np.array(g.end / 2)))) for g in family.own}
        of_family = design_from(PAPER_SENSOR | varied | own, base=family.base)
        its = load_surrogate(family=family)
        took = median_ms(partial(its.respond, of_family, depth), 20) / n_draw
        print(f"surrogate of the family {family.name:<16} {took:10.4f} ms a curve   {1e3 / took:8.0f} curves a second")


if __name__ == "__main__":
    main()
