"""posterior.nc: it reads back to the last bit, and ArviZ's functions run on it and say what the report says."""

from __future__ import annotations

import json
import os
import subprocess
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import h5py
import matplotlib as mpl
import numpy as np
import pytest
import xarray
from matplotlib import pyplot as plt
from small_run import BLOCK, in_small_steps

from calib.errors import InputError
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab.sweep import Sweep
from calib.priors.distributions import Fixed, Normal, Prior
from calib.problem.problem import build_problem
from calib.problem.readings import PredictedReadings
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.unknowns import list_unknowns
from calib.sampling.archive import load_arviz
from calib.sampling.diagnostics import Gate
from calib.sampling.groups import N_PRIOR, make_groups, to_arviz
from calib.sampling.layout import chain_order, constants, observed, stacked, unknowns
from calib.sampling.posterior import Posterior
from calib.sampling.replicate import new_readings
from calib.sampling.sampler import sample
from calib.sampling.storage import FORMAT, load_posterior, save_posterior
from models.analytic import ClosedForm
from models.response import Forward, Response
from models.seal import sealed, unsealed
from models.sensor import Design, FloatArray, design_from

az = load_arviz()

GROUPS = {
    *("posterior", "prior", "posterior_predictive", "prior_predictive"),
    *("observed_data", "constant_data", "log_likelihood", "sample_stats"),
}
FORWARD = ClosedForm()
TRUTH = {
    "indenter_radius": 5e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.7e6,
    "relative_permittivity": 2.8,
    "sensor_thickness": 0.74e-3,
    "padding_thickness": 1.1e-3,
}
RIG = Rig(contact_offset=0.05e-3, machine_compliance=2e-6, load_zero=0.1)
THICKNESSES: dict[str, Prior] = {"sensor_thickness": Fixed(0.74e-3), "padding_thickness": Normal(1.1e-3, 0.03e-3)}

Maker = Callable[..., Posterior]


def plan(*specimens: Specimen) -> Experiment:
    shared: dict[str, Prior] = {"machine_compliance": Fixed(2e-6), "force_noise": Fixed(5e-3)}
    return Experiment("small", Path("e.toml"), "", 5e-3, 10e-3, "sensor", shared, specimens, "closed form", "off")


def press(specimen: str, name: str = "", with_capacitance: bool = False, seed: int = 0) -> Sweep:
    rng, design = np.random.default_rng(seed), design_from(dict(TRUTH))
    tie: Literal["clock", "none"] = "clock" if with_capacitance else "none"
    return synthetic_sweep(FORWARD, design, 0.4e-3, RIG, rng, specimen=specimen, name=name, n_points=12, tie=tie)


@pytest.fixture(scope="module", params=[3 * BLOCK, 2 * BLOCK], ids=["even", "odd"])
def sampled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Posterior:
    """A short run with an even and with an odd number of kept steps."""
    specimen = Specimen("a/b", (SweepFiles("", Path("f.csv"), None, 5e-3),), THICKNESSES)
    problem = build_problem(plan(specimen), [press("a/b")], FORWARD)
    folder = tmp_path_factory.mktemp("run")
    with in_small_steps():
        found = sample(
            problem, seed=1, checkpoint=folder, max_steps=request.param, processes=0, n_walkers=64, gate=Gate(ess=1e9)
        )
    assert (found.draws.shape[1] // found.n_walkers) % 2 == (request.param == 2 * BLOCK)
    return found


@pytest.fixture(scope="module")
def file(make_posterior: Maker, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a posterior of two specimens, only one of them with a clock offset."""
    path = tmp_path_factory.mktemp("file") / "posterior.nc"
    save_posterior(make_posterior(), path, FORWARD)
    return path


@pytest.fixture
def data(file: Path) -> Iterator[Any]:
    """The same as ArviZ reads it."""
    found = az.from_netcdf(str(file))
    yield found
    found.close()
    plt.close("all")


# --- back to the last bit -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("forward", [None, FORWARD], ids=["without forward", "with forward"])
def test_a_saved_posterior_reads_back_equal(sampled: Posterior, tmp_path: Path, forward: Forward | None) -> None:
    path = tmp_path / "posterior.nc"
    save_posterior(sampled, path, forward)
    assert [p.name for p in tmp_path.iterdir()] == ["posterior.nc"]
    found = load_posterior(path)
    for name in ("draws", "log_prob", "log_likelihood"):
        np.testing.assert_array_equal(getattr(found, name), getattr(sampled, name))
    for name in ("parameters", "fixed", "forward_name", "blocks", "n_walkers", "seed", "diagnostics", "attrs", "experiment"):
        assert getattr(found, name) == getattr(sampled, name), name
    first, second = (p.sweeps[0].channels["force"] for p in (found, sampled))
    np.testing.assert_array_equal(first.value, second.value)
    assert found.parameters[-1].specimen == "a/b"


def test_a_posterior_of_several_specimens_reads_back_equal(make_posterior: Maker, file: Path) -> None:
    written, found = make_posterior(), load_posterior(file)
    for name in ("draws", "log_prob", "log_likelihood"):
        np.testing.assert_array_equal(getattr(found, name), getattr(written, name))
    assert found.parameters == written.parameters


def test_a_file_that_is_no_posterior_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        load_posterior(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("time,force\n", encoding="utf-8")
    with pytest.raises(InputError, match="not a posterior"):
        load_posterior(tmp_path / "text.nc")
    xarray.Dataset({"x": ("t", np.zeros(3))}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(InputError, match="not a posterior as calib wrote it"):
        load_posterior(tmp_path / "other.nc")
    seal(tmp_path / "other.nc")
    with pytest.raises(InputError, match="not a posterior"):
        load_posterior(tmp_path / "other.nc")


@pytest.mark.parametrize(
    ("attrs", "said"),
    [
        ({"diagnostics": "{}", "names": "[]"}, "it does not say what it is of"),
        ({"calib_format": str(FORMAT + 1)}, "format 3, this version reads format 2"),
        ({"calib_format": "new"}, "not a posterior"),
        ({"calib_format": str(FORMAT)}, "not a posterior"),  # and nothing else
    ],
)
def test_a_file_of_another_version_is_refused_in_a_sentence(attrs: dict[str, str], said: str, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    xarray.Dataset(attrs=attrs).to_netcdf(path, engine="h5netcdf")
    seal(path)
    with pytest.raises(InputError, match=said):
        load_posterior(path)


def test_a_damaged_record_is_refused_in_a_sentence(make_posterior: Maker, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    save_posterior(make_posterior(), path)
    with xarray.open_dataset(path, engine="h5netcdf") as root:
        attrs = dict(root.attrs)
    path.write_bytes(unsealed(path.read_bytes()))
    xarray.Dataset(attrs={**attrs, "diagnostics": "{"}).to_netcdf(path, mode="a", engine="h5netcdf")
    seal(path)
    with pytest.raises(InputError, match="not a posterior"):
        load_posterior(path)


# --- damage and full disks ----------------------------------------------------------------------------------------------


def seal(path: Path) -> None:
    path.write_bytes(sealed(path.read_bytes()))


def test_a_changed_byte_a_cut_off_end_or_zeros_never_load(file: Path, tmp_path: Path) -> None:
    data, path, rng = file.read_bytes(), tmp_path / "posterior.nc", np.random.default_rng(1)
    places = [0, 8, 40, len(data) - 70, len(data) - 1, *rng.integers(0, len(data), 40)]
    flipped = [data[:at] + bytes([data[at] ^ 1 << int(rng.integers(8))]) + data[at + 1 :] for at in places]
    others = [data[: len(data) // 2], data[:-1], data + b"\n", data[:-5000] + bytes(5000), data[:3000] * 2 + data[3000:], b""]
    for damaged in flipped + others:
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"posterior\.nc: this is not a posterior as calib wrote it .*--resume"):
            load_posterior(path)


def test_what_another_program_adds_is_not_taken_for_what_was_written(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    path.write_bytes(file.read_bytes())
    xarray.Dataset({"x": ("t", np.zeros(3))}).to_netcdf(path, mode="a", group="mine", engine="h5netcdf")
    with pytest.raises(InputError, match="not a posterior as calib wrote it"):
        load_posterior(path)


def test_other_programs_open_the_file_without_being_told_of_its_checksum(file: Path) -> None:
    with xarray.open_dataset(file, group="posterior") as found:
        assert found.sizes["chain"] == 4
    with h5py.File(file) as found:
        assert set(found) == GROUPS


@pytest.mark.parametrize(
    ("name", "said"), [("draws", "draws"), ("log_prob", "log posterior densities"), ("log_likelihood", "log likelihoods")]
)
def test_numbers_that_are_not_finite_are_refused(make_posterior: Maker, name: str, said: str, tmp_path: Path) -> None:
    posterior, path = make_posterior(), tmp_path / "posterior.nc"
    values = getattr(posterior, name).copy()
    values[1, 2], values[3, 4] = np.nan, np.inf
    save_posterior(replace(posterior, **{name: values}), path)
    with pytest.raises(InputError, match=rf"posterior\.nc: .*of the \d+ {said} are not finite"):
        load_posterior(path)


def test_a_full_disk_is_an_error_with_the_name_and_leaves_the_earlier_file(make_posterior: Maker, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    path = tmp_path / "posterior.nc"
    save_posterior(make_posterior(), path)
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) // 2, limits[1]))
    try:
        with pytest.raises(OSError, match="too large") as caught:
            save_posterior(make_posterior(), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.filename == str(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["posterior.nc"]


def test_what_a_drive_loses_while_it_says_that_it_writes_takes_no_name(
    make_posterior: Maker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = Path.write_bytes
    monkeypatch.setattr(Path, "write_bytes", lambda path, data: whole(path, data[:-4096] + bytes(4096)))
    with pytest.raises(OSError, match="Input/output"):
        save_posterior(make_posterior(), tmp_path / "posterior.nc")
    assert list(tmp_path.iterdir()) == []


# --- one order of draws -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("n_step", "n_walker"), [(4, 6), (5, 6), (5, 7), (1, 4), (2, 1)])
def test_an_ensemble_is_early_then_late_and_each_half_walker_by_walker(n_step: int, n_walker: int) -> None:
    order = chain_order(n_step * n_walker, n_walker)
    assert sorted(order) == list(range(n_step * n_walker))
    n = order.size // 2
    for half, steps in ((order[:n], range((n_step + 1) // 2)), (order[-n:], range(n_step // 2, n_step))):
        step, walker = np.divmod(half, n_walker)
        assert set(step) <= set(steps)
        assert np.all(np.diff(walker) >= 0)
        assert np.all(np.diff(step)[np.diff(walker) == 0] == 1)


def test_arviz_says_of_the_file_what_the_report_says(sampled: Posterior, tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    save_posterior(sampled, path)
    data = az.from_netcdf(str(path))
    numbers = {"r_hat": az.rhat(data), "ess_bulk": az.ess(data), "ess_tail": az.ess(data, method="tail")}
    for p in sampled.parameters:
        for name, found in numbers.items():
            assert float(found[p.parameter].values.item()) == getattr(sampled.diagnostics.parameters[p.name], name), p.name
    table = az.summary(data, round_to="none")
    assert set(table["ess_bulk"]) == {s.ess_bulk for s in sampled.diagnostics.parameters.values()}
    data.close()


def test_a_table_has_a_column_for_each_unknown_and_a_row_for_each_draw(make_posterior: Maker) -> None:
    posterior = make_posterior()
    table, draws = posterior.to_dataframe(), posterior.to_xarray()
    assert list(table.columns) == list(posterior.diagnostics.parameters)
    assert table.shape == (posterior.log_prob.size, len(posterior.parameters))
    assert table.loc[(2, 17), "young_modulus"] == float(draws["young_modulus"].sel(chain=2, draw=17))
    thickness = draws["sensor_thickness"].sel(specimen="sensor 2", chain=0)
    np.testing.assert_array_equal(table.loc[0, "sensor_thickness[sensor 2]"], thickness)
    assert table.loc[(0, 1), "young_modulus"] == posterior.draws[0, posterior.n_walkers, 0]  # the first walker's second step


# --- names, dimensions, units -------------------------------------------------------------------------------------------


def test_the_file_has_all_groups_with_units_and_words(data: Any) -> None:
    assert set(data.groups()) == GROUPS
    for group in data.groups():
        for name, variable in data[group].data_vars.items():
            assert variable.attrs["units"], (group, name)
            assert variable.attrs["long_name"], (group, name)
    assert data.posterior["young_modulus"].attrs == {"units": "Pa", "long_name": "Young's modulus of the sensor"}
    assert data.sample_stats.attrs["acceptance_fraction"].tolist() == [0.31, 0.33, 0.30, 0.32]


def test_specimens_and_sweeps_are_dimensions(data: Any) -> None:
    posterior = data.posterior
    assert posterior["young_modulus"].dims == ("chain", "draw")
    assert posterior["sensor_thickness"].dims == ("chain", "draw", "specimen")
    assert posterior["contact_offset"].dims == ("chain", "draw", "sweep")
    assert posterior["clock_offset"].dims == ("chain", "draw", "clock_offset_sweep")
    assert list(posterior["clock_offset_sweep"].values) == ["sensor 2"]
    assert list(posterior["specimen"].values) == ["sensor 1", "sensor 2"]
    assert data.prior["clock_offset"].shape == (1, N_PRIOR, 1)
    assert set(data.prior.data_vars) == set(posterior.data_vars)
    for group in ("posterior", "prior", "posterior_predictive", "prior_predictive", "log_likelihood", "observed_data"):
        for name, variable in data[group].data_vars.items():
            assert np.all(np.isfinite(variable.values)), (group, name)


def test_sweeps_of_all_specimens_are_one_flat_dimension() -> None:
    files = tuple(SweepFiles(name, None, None, 5e-3) for name in ("ball 1", "ball 2"))
    one, two = Specimen("sensor 1", files, THICKNESSES), Specimen("sensor 2", (SweepFiles("", None, None, 5e-3),), {})
    two = replace(two, priors={**THICKNESSES, "sensor_thickness": Normal(0.8e-3, 0.02e-3), "load_zero": Fixed(0.0)})
    sweeps = [press("sensor 1", "ball 1", True), press("sensor 1", "ball 2"), press("sensor 2", "", True)]
    infos, _ = list_unknowns(plan(one, two), sweeps)
    draws = np.random.default_rng(0).standard_normal((2, 5, len(infos)))
    found = unknowns(infos, sweeps, draws)
    np.testing.assert_array_equal(stacked(infos, found), draws)
    titles = ["sensor 1, ball 1", "sensor 1, ball 2", "sensor 2"]
    assert list(found["contact_offset"]["sweep"].values) == titles
    assert list(found["load_zero"]["load_zero_sweep"].values) == titles[:2]
    assert list(found["clock_offset"]["clock_offset_sweep"].values) == [titles[0], titles[2]]
    assert list(found["sensor_thickness"]["sensor_thickness_specimen"].values) == ["sensor 2"]
    assert list(found["padding_thickness"]["specimen"].values) == ["sensor 1", "sensor 2"]
    names = [i.name for i in infos]
    one_sweep = found["contact_offset"].sel(sweep="sensor 1, ball 2")
    np.testing.assert_array_equal(one_sweep, draws[..., names.index("contact_offset[sensor 1, ball 2]")])
    seen, known = observed(sweeps), constants(sweeps)
    assert list(known["sweep_specimen"].values) == ["sensor 1", "sensor 1", "sensor 2"]
    assert seen["force"].shape == (36,)
    assert seen["capacitance"].shape == (24,)
    assert list(seen["capacitance_sweep"].values[[0, 12]]) == [titles[0], titles[2]]
    assert seen["force_number"].values[[0, 11, 12]].tolist() == [1, 12, 1]
    third = sweeps[2].channels["force"]
    np.testing.assert_array_equal(seen["force"].values[24:], third.value)
    np.testing.assert_array_equal(known["force_displacement"].values[24:], third.displacement)


# --- new readings -------------------------------------------------------------------------------------------------------


def test_new_readings_have_mean_and_covariance_of_the_measurement_model() -> None:
    rng = np.random.default_rng(0)
    n, shape = 40_000, (40_000, 3)
    mean, variance, modes = np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]), rng.standard_normal((3, 2))
    many, spread = np.broadcast_to(mean, shape), np.broadcast_to(variance, shape)
    channel = PredictedReadings(many, many, spread, np.tile(modes, (n, 1, 1)), mean)
    found = new_readings(channel, rng)
    covariance = np.diag(variance) + modes @ modes.T
    np.testing.assert_allclose(found.mean(axis=0), mean, atol=5 * np.sqrt(covariance.max() / n))
    np.testing.assert_allclose(np.cov(found.T), covariance, atol=0.03 * covariance.max())


def test_new_readings_surround_the_data_and_depend_on_the_seed_alone(make_posterior: Maker) -> None:
    first, again = (make_groups(make_posterior(), FORWARD) for _ in range(2))
    other = make_groups(replace(make_posterior(), seed=8), FORWARD)
    for group in ("prior", "posterior_predictive", "prior_predictive"):
        assert first[group].identical(again[group])
        assert not first[group].identical(other[group])
    assert first["posterior"].identical(other["posterior"])
    predicted, actual = first["posterior_predictive"], first["observed_data"]
    for name in ("force", "capacitance"):
        assert predicted[name].dtype == np.float32
        low, high = (predicted[name].quantile(q, dim=["chain", "draw"]) for q in (0.005, 0.995))
        assert float(((actual[name] > low) & (actual[name] < high)).mean()) > 0.9
    spread = [float(predicted[name].std(["chain", "draw"]).mean()) for name in ("force", "force_given_others")]
    assert spread[1] <= spread[0]


@dataclass(frozen=True)
class Narrow:
    """The closed form, but only where the modulus is below its prior's median."""

    name: str = "narrow closed form"
    identity: str = "narrow closed form"

    def max_depth(self, design: Design) -> FloatArray:
        return np.where(np.atleast_1d(design.sensor.young_modulus) < 0.7e6, FORWARD.max_depth(design), 0.0)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return FORWARD.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        return FORWARD.respond(design, depth)


def test_prior_draws_that_the_forward_model_does_not_cover_are_left_out_and_counted(make_posterior: Maker) -> None:
    groups = make_groups(make_posterior(), Narrow())
    assert groups["prior"]["young_modulus"].shape == (1, N_PRIOR)
    assert float(groups["prior"]["young_modulus"].max()) < 0.7e6
    assert np.all(np.isfinite(groups["prior_predictive"]["force"]))
    said = groups["prior"].attrs["draws"]
    left_out, tried = (int(word) for word in said.replace(";", "").split() if word.isdigit())
    assert 0.3 < left_out / tried < 0.7
    assert groups["prior_predictive"].attrs["draws"] == said


def test_without_a_forward_model_there_is_nothing_predictive_and_it_says_so(make_posterior: Maker) -> None:
    found = to_arviz(make_posterior())
    assert set(found.groups()) == GROUPS - {"posterior_predictive", "prior_predictive"}
    assert set(found.log_likelihood.data_vars) == {"blocks"}
    assert "forward model" in found.attrs["predictive"]


# --- ArviZ's functions --------------------------------------------------------------------------------------------------


def quietly(call: Callable[[], Any]) -> Any:
    """What a call gives, without the warnings that ArviZ 0.23 itself causes in newer libraries, or that are the finding."""
    with warnings.catch_warnings(), mpl.rc_context({"backend": "agg"}), az.rc_context({"plot.max_subplots": 100}):
        warnings.filterwarnings("ignore", "Passing a dict or None as alias_mapping", mpl.MatplotlibDeprecationWarning)
        warnings.filterwarnings("ignore", "Estimated shape parameter of Pareto distribution", UserWarning)
        return call()


@pytest.mark.parametrize(
    "draw",
    [
        lambda data: az.plot_ppc(data, num_pp_samples=50),
        lambda data: az.plot_ppc(data, group="prior", num_pp_samples=50),
        az.plot_dist_comparison,
        az.plot_trace,
        lambda data: az.plot_loo_pit(data, y="force", y_hat="force_given_others"),
    ],
    ids=["plot_ppc", "plot_ppc of the prior", "plot_dist_comparison", "plot_trace", "plot_loo_pit"],
)
def test_arviz_plots_the_file_as_it_is(draw: Callable[[Any], Any], data: Any) -> None:
    axes = np.ravel(quietly(lambda: draw(data)))
    assert axes.size
    assert all(a.has_data() for a in axes if a is not None)


@pytest.mark.parametrize("channel", ["force", "capacitance"])
def test_arviz_leaves_out_points_of_the_file(channel: str, data: Any) -> None:
    found = quietly(lambda: az.loo(data, var_name=channel))
    assert found.n_data_points == 80
    assert np.isfinite(found.elpd_loo)
    for name in (channel, f"{channel}_given_others"):
        pit = quietly(partial(az.loo_pit, idata=data, y=channel, y_hat=name))
        assert pit.shape == (80,)
        assert np.all((pit >= 0) & (pit <= 1))
    assert quietly(lambda: az.loo(data, var_name="blocks")).n_data_points == data.log_likelihood.sizes["block"]


def test_what_is_handed_to_arviz_is_what_the_file_holds(make_posterior: Maker, data: Any) -> None:
    found = to_arviz(make_posterior(), FORWARD)
    assert set(found.groups()) == GROUPS
    for group in found.groups():
        xarray.testing.assert_identical(found[group], data[group].load())


@pytest.mark.skipif(not hasattr(xarray, "open_datatree"), reason="xarray has trees from 2024.10 on")
def test_the_file_is_a_tree_of_plain_netcdf_groups(file: Path, data: Any) -> None:
    # What `arviz.from_netcdf` of ArviZ 1.x makes of it.
    with xarray.open_datatree(file, engine="h5netcdf") as tree:
        assert set(tree.children) == GROUPS
        for group in GROUPS:
            xarray.testing.assert_identical(tree[group].to_dataset().load(), data[group].load())


ARVIZ_1 = """
import json, sys, warnings
import arviz as az
data = az.from_netcdf(sys.argv[1])
found = {"version": az.__version__, "container": type(data).__name__, "groups": sorted(data.children)}
found["r_hat"] = float(az.rhat(data)["young_modulus"])
found["ess"] = float(az.ess(data)["young_modulus"])
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    found["elpd"] = float(az.loo(data, var_name="force").elpd)
    found["pit"] = int(az.loo_pit(data, var_names="force")["force"].size)
    found["rows"] = len(az.summary(data))
print(json.dumps(found))
"""


@pytest.mark.skipif("ARVIZ_1_PYTHON" not in os.environ, reason="ArviZ 1.x takes another Python: name one in ARVIZ_1_PYTHON")
def test_arviz_1_reads_the_file_and_finds_the_same(file: Path, data: Any) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [os.environ["ARVIZ_1_PYTHON"], "-c", ARVIZ_1, str(file)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    found = json.loads(run.stdout)
    assert found["version"].startswith("1.")
    assert found["container"] == "DataTree"
    assert set(found["groups"]) == GROUPS
    assert found["r_hat"] == pytest.approx(float(az.rhat(data)["young_modulus"]), rel=1e-9)
    assert found["ess"] == pytest.approx(float(az.ess(data)["young_modulus"]), rel=1e-9)
    assert found["elpd"] == pytest.approx(float(quietly(lambda: az.loo(data, var_name="force")).elpd_loo), rel=1e-3)
    assert found["pit"] == 80
    assert found["rows"] == len(load_posterior(file).parameters)


def test_draws_of_a_lot_and_of_its_specimens_are_kept_apart(make_lot: Callable[..., Posterior], tmp_path: Path) -> None:
    posterior = make_lot()
    save_posterior(posterior, tmp_path / "posterior.nc", ClosedForm())
    found = load_posterior(tmp_path / "posterior.nc")
    np.testing.assert_array_equal(found.draws, posterior.draws)
    assert found.experiment.pooling == "partial"
    of_lots = [p.name for p in found.parameters[len(found.unknowns) :]]
    assert of_lots[:2] == ["young_modulus", "young_modulus_spread"]
    assert of_lots[-2:] == ["padding_thickness", "padding_thickness_spread"]
    variables = posterior.to_xarray()
    assert variables["young_modulus"].dims == ("chain", "draw")
    for quantity in ("young_modulus", "padding_thickness"):
        assert variables[f"{quantity}_of_specimens"].dims == ("chain", "draw", "specimen")


def test_draws_of_the_prior_of_a_lot_are_of_lots_with_their_specimens(make_lot: Callable[..., Posterior]) -> None:
    prior = make_groups(make_lot(spread=Fixed(0.01)))["prior"]
    away = np.log(prior["young_modulus_of_specimens"].values / prior["young_modulus"].values[..., None])
    assert np.std(away) == pytest.approx(0.01, rel=0.1)
    assert np.std(np.log(prior["young_modulus"].values)) == pytest.approx(np.log(1.6), rel=0.1)
