"""A posterior made by hand: known truth, data drawn from the closed form, draws close around the truth."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from calib.catalogue import QUANTITIES, bounds_of
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab.sweep import Points, Sweep, Track
from calib.priors.distributions import HalfNormal, LogNormal, Normal, Prior, Uniform
from calib.problem.likelihood import block_names, log_likelihood_blocks, log_posterior
from calib.problem.prior import values_of_lot
from calib.problem.problem import build_problem
from calib.problem.unknowns import list_unknowns, of_lot
from calib.problem.values import columns_at
from calib.report.sections import section_modules
from calib.sampling.diagnostics import Diagnostics, Gate
from calib.sampling.findings import ParameterSummary, SpotCheck
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.sensor import design_from

# Tests of run folders and of pages import what they share by name.
for room in ("runs", "serve"):
    sys.path.insert(0, str(Path(__file__).parent / room))

SHARED: dict[str, tuple[float, float, Prior]] = {
    "young_modulus": (0.62e6, 0.004e6, LogNormal(0.7e6, 1.6)),
    "relative_permittivity": (2.8, 0.0003, Normal(2.8, 0.2)),
    "machine_compliance": (2e-6, 0.3e-6, HalfNormal(5e-6)),
    "parasitic_capacitance": (0.4e-12, 0.002e-12, Normal(0.0, 2e-12)),
    "force_noise": (0.01, 0.0005, LogNormal(0.01, 2.0)),
    "capacitance_noise": (5e-15, 0.3e-15, LogNormal(5e-15, 2.0)),
    "force_discrepancy": (0.003, 0.001, HalfNormal(0.01)),
    "capacitance_discrepancy": (0.005, 0.002, HalfNormal(0.02)),
}
SPECIMENS: dict[str, dict[str, tuple[float, float, Prior]]] = {
    "sensor 1": {
        "sensor_thickness": (0.74e-3, 0.0001e-3, Normal(0.74e-3, 0.02e-3)),
        "padding_thickness": (1.10e-3, 0.006e-3, Normal(1.10e-3, 0.03e-3)),
        "contact_offset": (0.05e-3, 0.001e-3, Uniform(-0.5e-3, 0.5e-3)),
        "load_zero": (0.03, 0.002, Normal(0.0, 1.0)),
    },
    "sensor 2": {
        "sensor_thickness": (0.80e-3, 0.0001e-3, Normal(0.80e-3, 0.02e-3)),
        "padding_thickness": (1.30e-3, 0.006e-3, Normal(1.30e-3, 0.03e-3)),
        "contact_offset": (-0.03e-3, 0.001e-3, Uniform(-0.5e-3, 0.5e-3)),
        "load_zero": (-0.01, 0.002, Normal(0.0, 1.0)),
        "clock_offset": (0.0, 0.02, Normal(0.0, 0.2)),
    },
}


def _sweep(specimen: str, rng: np.random.Generator, by_clock: bool) -> Sweep:
    own = {k: v[0] for k, v in {**SHARED, **SPECIMENS[specimen]}.items()}
    design = design_from({**own, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
    depth = np.linspace(-0.05e-3, 0.6e-3, 40)
    r = ClosedForm().respond(design, depth)
    n = np.full(40, 4.0)
    displacement = depth + own["contact_offset"] + own["machine_compliance"] * r.force
    force = r.force + own["load_zero"] + rng.normal(0, own["force_noise"] / 2, 40)
    capacitance = r.capacitance + own["parasitic_capacitance"] + rng.normal(0, own["capacitance_noise"] / 2, 40)
    time = np.linspace(0.0, 60.0, 40)
    return Sweep(
        specimen=specimen,
        name="",
        indenter_radius=5e-3,
        channels={
            "force": Points(force, n, displacement=displacement),
            "capacitance": Points(capacitance, n, time=time if by_clock else None, force=None if by_clock else force),
        },
        track=Track(time, displacement, r.force + own["load_zero"]) if by_clock else None,
        noise={"force": 0.01, "capacitance": 5e-15},
        clock_offset=0.0 if by_clock else np.nan,
        clock_offset_sd=0.1 if by_clock else np.nan,
        files=((f"{specimen}_force.csv", "ab" * 32), (f"{specimen}_lcr.csv", "cd" * 32)),
        notes=("312 of 5000 rows not used: 300 unloading branch, 12 empty cell",),
    )


def _at_the_median(prior: Prior) -> tuple[float, float, Prior]:
    low, median, high = prior.ppf_normal(np.array([-0.01, 0.0, 0.01]))
    return float(median), float(high - low), prior


def _experiment(names: tuple[str, ...]) -> Experiment:
    return Experiment(
        name="Padded sensor, two specimens",
        path=Path("experiment.toml"),
        sha256="ef" * 32,
        indenter_radius=5e-3,
        sensor_radius=10e-3,
        padding_material="sensor",
        priors={k: v[2] for k, v in SHARED.items()},
        specimens=tuple(
            Specimen(
                name,
                (SweepFiles("", Path(f"{name}_force.csv"), Path(f"{name}_lcr.csv"), 5e-3),),
                {k: v[2] for k, v in SPECIMENS[name].items()},
            )
            for name in names
        ),
        model="closed form",
        discrepancy="on",
    )


@pytest.fixture(scope="session")
def make_posterior() -> Callable[..., Posterior]:
    """Function that makes a posterior by hand: converged or not, of one or two specimens, honest or not, of data of a seed."""

    @cache
    def make(
        converged: bool = True,
        n_specimen: int = 2,
        widen: float = 1.0,
        honest: bool | None = None,
        seed: int = 20240501,
    ) -> Posterior:
        rng = np.random.default_rng(seed)
        names = tuple(SPECIMENS)[:n_specimen]
        sweeps = tuple(_sweep(name, rng, by_clock=i == 1) for i, name in enumerate(names))
        experiment = _experiment(names)
        infos, fixed = list_unknowns(experiment, sweeps)
        # An unknown that is not named above is at its prior's median, and known well.
        rows = [(SPECIMENS[i.specimen] if i.specimen else SHARED).get(i.parameter, _at_the_median(i.prior)) for i in infos]
        mean, sd = np.array([r[0] for r in rows]), np.array([r[1] for r in rows]) * widen
        draws = mean + sd * rng.standard_normal((4, 240, len(rows)))
        # The ridge of capacitance: permittivity over dielectric thickness is known well, neither of them is.
        along = 0.006 * widen * rng.standard_normal((4, 240))
        for i, info in enumerate(infos):
            if info.parameter in ("relative_permittivity", "sensor_thickness"):
                draws[:, :, i] *= 1 + along
        positive = np.array([bounds_of(i.parameter) != "any" for i in infos])
        draws = np.where(positive, np.abs(draws), draws)
        summaries = {
            i.name: ParameterSummary(
                QUANTITIES[i.parameter].unit,
                float(m),
                float(s),
                float(m),
                (float(m - 1.645 * s), float(m + 1.645 * s)),
                1.002 if converged else 1.31,
                900.0 if converged else 37.0,
                850.0,
                0.97 if i.parameter != "relative_permittivity" else 0.04,
                0.1,
            )
            for i, m, s in zip(infos, mean, sd, strict=True)
        }
        reasons = () if converged else ("R-hat of young_modulus is 1.31, above 1.01",)
        problem = build_problem(experiment, sweeps, ClosedForm())
        theta = np.stack([i.prior.to_normal(draws[:, :, k]).ravel() for k, i in enumerate(infos)], axis=-1)
        return Posterior(
            experiment=experiment,
            sweeps=sweeps,
            parameters=infos,
            fixed=fixed,
            forward_name="closed form",
            draws=draws,
            log_prob=-0.5 * np.sum(((draws - mean) / sd) ** 2, axis=-1),
            log_likelihood=log_likelihood_blocks(problem, theta).reshape(4, 240, -1),
            blocks=block_names(problem),
            n_walkers=24,
            seed=7,
            diagnostics=Diagnostics(
                converged=converged,
                reasons=reasons,
                warnings=(),
                parameters=summaries,
                steps=1200,
                burn_in=300,
                thin=5,
                n_walker=24,
                acceptance_fraction=(0.31, 0.33, 0.30, 0.32),
                tau={i.name: 38.0 for i in infos},
                gate=Gate(),
                spot_check=None
                if honest is None
                else SpotCheck("closed form", 12, 0.05, 0.01, 0.8 if honest else 9.0, 0.9, ()),
            ),
            attrs={"command": "calib calibrate experiment.toml -o RUN --seed 7", "version of numpy": np.__version__},
        )

    return make


@pytest.fixture(scope="session")
def make_lot(make_posterior: Callable[..., Posterior]) -> Callable[..., Posterior]:
    """Function that makes a posterior by hand of specimens of one lot, near the medians of their priors."""

    @cache
    def make(spread: Prior | None = None, n_specimen: int = 2) -> Posterior:
        shared = make_posterior(n_specimen=n_specimen)
        priors = {**shared.experiment.priors, **({} if spread is None else {"young_modulus_spread": spread})}
        experiment = replace(shared.experiment, pooling="partial", priors=priors)
        problem = build_problem(experiment, shared.sweeps, ClosedForm())
        rng = np.random.default_rng(20240502)
        z = 0.05 * rng.standard_normal((4 * 240, len(problem.names)))
        parameters = (*problem.parameters, *of_lot(problem))
        columns = np.column_stack([columns_at(problem, z), *values_of_lot(problem, z, rng).values()])
        summaries = {
            p.name: replace(
                shared.diagnostics.parameters["young_modulus"],
                prior_shift=0.1,
                mean=float(np.mean(columns[:, k])),
                median=float(np.median(columns[:, k])),
                sd=float(np.std(columns[:, k])),
            )
            for k, p in enumerate(parameters)
        }
        return replace(
            shared,
            experiment=experiment,
            parameters=parameters,
            fixed=problem.fixed,
            draws=columns.reshape(4, 240, -1),
            log_prob=log_posterior(problem, z).reshape(4, 240),
            diagnostics=replace(shared.diagnostics, parameters=summaries, tau=dict.fromkeys(problem.names, 38.0)),
        )

    return make


def _empty(*_: object, **__: object) -> Figure:
    return Figure()


@contextmanager
def _undrawn() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for module in section_modules():
            for name in [name for name in vars(module) if name.endswith("_figure")]:
                patch.setattr(module, name, _empty)
        patch.setattr("calib.report.pictures.figure_address", lambda *_, **__: "data:,")
        yield


@pytest.fixture(scope="session")
def undrawing() -> Callable[[], AbstractContextManager[None]]:
    """A block whose pages have empty pictures, for what is made for tests that draw; see `undrawn`."""
    return _undrawn


@pytest.fixture
def undrawn() -> Iterator[None]:
    """Pages with empty pictures, which are what takes time, for tests of what a page says; figures have tests of their own."""
    with _undrawn():
        yield


@pytest.fixture(scope="module")
def all_undrawn() -> Iterator[None]:
    """The same for all tests of a module, and for what is made for all of them."""
    with _undrawn():
        yield


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A folder with a small experiment and its lab file."""
    from small_run import make_lab

    return make_lab(tmp_path)
