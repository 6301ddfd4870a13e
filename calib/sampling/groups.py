"""A posterior and its forward model in, the groups of data sets that ArviZ's functions expect out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from calib.problem import prior_values
from calib.sampling.archive import inference_data
from calib.sampling.layout import Kind, constants, labelled, observed, of_readings, unknowns
from calib.sampling.posterior import Posterior, named_draws
from calib.sampling.replicate import Replicates, replicate
from models.response import Forward
from models.sensor import FloatArray

if TYPE_CHECKING:
    import xarray

#: Draws of the prior, and how many batches of as many are drawn at most to find them inside the forward model's range.
N_PRIOR = 500
_PRIOR_BATCHES = 20

# Streams of random numbers of their own beside the seed's, so that no other draws depend on them.
_PREDICTIVE, _PRIOR = 1, 2


def to_arviz(posterior: Posterior, forward: Forward | None = None) -> Any:
    """Turn a posterior into an `arviz.InferenceData`, ready for ArviZ's summaries, checks and plots.

    The groups are those of `posterior.nc`, see `make_groups`.

    Parameters
    ----------
    posterior : as sampled or loaded.
    forward : the forward model it was sampled with. Without it there is nothing predictive: no groups posterior_predictive and
        prior_predictive, no densities of single points.

    Examples
    --------
    `az.plot_ppc(to_arviz(posterior, forward))`
    """
    return inference_data(make_groups(posterior, forward), describe(posterior, forward))


def describe(posterior: Posterior, forward: Forward | None) -> dict[str, str]:
    """Write the texts that go with the groups of a posterior, so that a reader of the file alone understands it.

    Parameters
    ----------
    posterior : as sampled or loaded.
    forward : as in `to_arviz`.

    Returns
    -------
    Title, forward model, seed, units and the order of the draws, by key.
    """
    said = {
        "title": posterior.experiment.name,
        "forward": posterior.forward_name,
        "seed": str(posterior.seed),
        "units": "SI, see each variable",
        "chains": "independent ensembles of walkers; draws: the early half, then the late half, in each walker by walker",
    }
    if forward is None:
        said["predictive"] = "left out: it takes the forward model, which was not given"
    return said


def make_groups(posterior: Posterior, forward: Forward | None = None) -> dict[str, xarray.Dataset]:
    """Lay out a posterior in the groups that ArviZ's functions expect, each a data set with labelled dimensions and units.

    Dimensions and order of draws are those of `calib.sampling.layout`.

    - posterior, prior: draws of the unknowns, `N_PRIOR` of the prior.
    - posterior_predictive, prior_predictive: one new reading at each point for each draw, from the measurement model. The
      former also has new readings given what the other points of the sweep read, for
      `az.loo_pit(idata, y="force", y_hat="force_given_others")`: residuals are correlated, so that without this condition
      the values crowd around 1/2.
    - log_likelihood: of each channel, log density of each point given the others of its sweep, for `az.loo`; `blocks` of
      about eight neighbouring points, for comparing models.
    - sample_stats: log posterior density, and which walker and step a draw is. observed_data, constant_data: the readings.

    Parameters
    ----------
    posterior : as sampled or loaded.
    forward : as in `to_arviz`.
    """
    import xarray

    n_chain, n_draw, n_parameter = posterior.draws.shape
    order = posterior.order
    prior, prior_predictive = _prior_groups(posterior, forward)
    groups = {"posterior": posterior.to_xarray(), "prior": prior}
    blocks = _blocks(posterior)
    groups["log_likelihood"] = blocks
    if forward is not None:
        rng = np.random.default_rng([posterior.seed, _PREDICTIVE])
        made = replicate(posterior, forward, named_draws(posterior, posterior.draws.reshape(-1, n_parameter)), rng)

        def dataset(columns: Mapping[str, npt.NDArray[np.floating]], kind: Kind) -> xarray.Dataset:
            ordered = {name: values.reshape(n_chain, n_draw, -1)[:, order] for name, values in columns.items()}
            return of_readings(posterior.sweeps, ordered, kind)

        both = [dataset(made.readings, "new"), dataset(made.given_others, "given others")]
        groups["posterior_predictive"] = xarray.merge(both, join="exact", compat="equals")
        groups["log_likelihood"] = xarray.merge([dataset(made.log_density, "density"), blocks], join="exact", compat="equals")
    if prior_predictive is not None:
        groups["prior_predictive"] = prior_predictive
    groups["sample_stats"] = _sample_stats(posterior)
    groups["observed_data"] = observed(posterior.sweeps)
    groups["constant_data"] = constants(posterior.sweeps)
    return groups


def _prior_groups(posterior: Posterior, forward: Forward | None) -> tuple[xarray.Dataset, xarray.Dataset | None]:
    """Draws of the prior and, with a forward model, what would be read under them."""
    rng = np.random.default_rng([posterior.seed, _PRIOR])
    if forward is None:
        draws = _table(posterior, prior_values(posterior, rng, N_PRIOR))
        said = "drawn from the priors; whether a forward model covers them was not asked"
        return unknowns(posterior.parameters, posterior.sweeps, draws[None]).assign_attrs(draws=said), None
    tables: list[FloatArray] = []
    found: list[Replicates] = []
    n_tried = n_covered = 0
    for _ in range(_PRIOR_BATCHES):
        values = prior_values(posterior, rng, N_PRIOR)
        found.append(replicate(posterior, forward, values, rng))
        tables.append(_table(posterior, values)[found[-1].covered])
        n_tried, n_covered = n_tried + N_PRIOR, n_covered + tables[-1].shape[0]
        if n_covered >= N_PRIOR:
            break
    draws = np.concatenate(tables)[:N_PRIOR]
    said = (
        f"drawn from the priors; {n_tried - n_covered} of {n_tried} draws were left out, as the {forward.name} does not cover "
        "them and they have no posterior density either"
    )
    new = {name: np.concatenate([f.readings[name][f.covered] for f in found])[None, :N_PRIOR] for name in found[0].readings}
    prior = unknowns(posterior.parameters, posterior.sweeps, draws[None]).assign_attrs(draws=said)
    return prior, of_readings(posterior.sweeps, new, "new").assign_attrs(draws=said)


def _table(posterior: Posterior, values: Mapping[str, FloatArray]) -> FloatArray:
    return np.stack([values[p.name] for p in posterior.parameters], axis=-1)


def _blocks(posterior: Posterior) -> xarray.Dataset:
    import xarray

    said = "log density of about eight neighbouring points of a sweep given all its other points and the draw"
    values = posterior.log_likelihood[:, posterior.order]
    variables = {"blocks": (("chain", "draw", "block"), values, {"units": "1", "long_name": said})}
    coords = {
        "chain": np.arange(values.shape[0]),
        "draw": np.arange(values.shape[1]),
        "block": np.array(posterior.blocks, dtype=object),
    }
    return labelled(xarray.Dataset(variables, coords))


def _sample_stats(posterior: Posterior) -> xarray.Dataset:
    import xarray

    n_chain, n_draw = posterior.log_prob.shape
    dims, order, found = ("chain", "draw"), posterior.order, posterior.diagnostics
    step, walker = np.divmod(order, posterior.n_walkers)
    said = "log posterior density in standard-normal coordinates of the priors, up to a constant"
    numbers = {"step": (step, "kept step, from 0"), "walker": (walker, "walker of the ensemble, from 0")}
    variables: dict[str, object] = {"lp": (dims, posterior.log_prob[:, order], {"units": "1", "long_name": said})}
    for name, (number, label) in numbers.items():
        rows = np.tile(number.astype(np.int32), (n_chain, 1))
        variables[name] = (dims, rows, {"units": "1", "long_name": label})
    if posterior.of_model is not None:
        names = "; ".join(f"{k}: {m.name}" for k, m in enumerate(found.models))
        of_model = posterior.of_model[:, order].astype(np.int32)
        variables["model"] = (dims, of_model, {"units": "1", "long_name": f"model that a draw is of ({names})"})
    coords = {"chain": np.arange(n_chain), "draw": np.arange(n_draw)}
    attrs = {
        "inference_library": "emcee",
        "acceptance_fraction": list(found.acceptance_fraction),
        "steps": found.steps,
        "burn_in": found.burn_in,
        "thin": found.thin,
        "n_walkers": posterior.n_walkers,
    }
    return labelled(xarray.Dataset(variables, coords, attrs))
