"""A sweep, a forward model and draws of the unknowns in, what the instruments should read and its covariance out.

Measurement model of a sweep, readings i of the tester and j of the LCR meter:

    d_i = (reading_i - d_0) / g_x - c_m f_i / g_F   true indentation; before contact F = 0 and C = C0              (1)
    f_i = g_F F(d_i) + F_0 + F_1 [d_i > 0] + error                                                                (2)
    C_j = g_C C(d_j) + C_p + error                                                                                (3)

with the gains g_x, g_F and g_C of the instruments, 1 unless they are unknown, F_1 the step of a load zero that was set anew at
the touch, 0 unless it is, which sets in over one distance of the points, and d_j from (1) at the tester's record at time
t_j + clock offset; or from F^-1((f_j - F_0) / g_F), where the LCR file has a force column; or from (1) at its own displacement
column. The errors of a channel (n points) are normal with covariance

    diag(s^2 / n_effective) + V V^T + delta^2 diag(g) K diag(g)                                                   (4)

Where the load that (1) takes is the reading f_i itself, one that is off by e stands for a depth that is off by c_m e / g_F,
and what is left of it after (2) is too large. To first order what the crosshead's reading alone predicts is off by

    [f_i - F_0 - g_F F(d_i)] (1 - c_m s_i g_x / g_F),   s_i = df/dreading at the point                              (5)

with s_i as it was read; and so are the last two terms of (4). The noise is not, as the frame gives way by the true load.
s is the noise of one reading, V the forward model's own error, the last term the model discrepancy: a Gaussian process along
the sweep of sd delta g, g = g_F F(d) or g_C (C(d) - C0), with a squared-exponential correlation K over the depth at the
sweep's nominal points and a fixed length. Sweeps of one specimen under one ball share it, and V, as both are functions of depth
(`calib.problem.plan`): (4) is then that of all their points, and K is over their true depths. K is used as U U^T + diag(rest)
with its few large eigenvectors, so that (4) is diagonal plus low rank.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.catalogue import bounds_of
from calib.experiment import Experiment
from calib.lab import Sweep
from calib.problem.channels import CHANNEL_MODELS
from calib.problem.plan import ChannelPlan, SweepPlan, at_time, present, shared_correlation
from calib.problem.readings import Discrepancy, PredictedReadings, SweepModel
from calib.problem.values import Calibrated, design_columns, design_values, designed, lookup
from models.curves import Lookup, curves_of, look_up, look_up_force, table_depths
from models.layers import LARGEST_BASE_FRICTION
from models.response import Asked, Column, Curves, Forward, Response
from models.sensor import INCOMPRESSIBLE, BoolArray, Design, FloatArray

# Least factor of (5): a frame that gives way by more than the crosshead moves is none.
_LEAST_SHARE = 0.1


def model_sweep(
    known: Calibrated,
    forward: Forward,
    plan: SweepPlan,
    values: Mapping[str, FloatArray],
    table: FloatArray | None = None,
) -> SweepModel:
    """Predict what the instruments should read in one sweep, with the errors that readings may have, for a batch of draws.

    Equations (1) to (4), in one call of the forward model.

    Parameters
    ----------
    known : the experiment and all its sweeps: a `Problem` or a `Posterior`.
    forward : the model of the sensor.
    plan : the sweep, from `plan_sweeps`.
    values : name of an unknown -> SI values (n_draw,), fixed ones included.
    table : depths [m] (n_draw, n_node) of the loading curve along which a channel that is not tied to depth directly is
        looked up, from zero upwards; default `table_depths` to the end of what the forward model covers. A draw whose
        readings lie beyond its last node is not covered.

    Returns
    -------
    The prediction, for the draws that are covered.

    Raises
    ------
    ValueError
        If the forward model gives something that is not finite inside the range it says it covers.
    """
    return next(model_sweeps(known, forward, [plan], values, [table]))


def model_sweeps(
    known: Calibrated,
    forward: Forward,
    plans: Sequence[SweepPlan],
    values: Mapping[str, FloatArray],
    tables: Sequence[FloatArray | None] | None = None,
) -> Iterator[SweepModel]:
    """Do what `model_sweep` does for many sweeps at once: what does not depend on the depth is worked out once for all of them.

    Parameters
    ----------
    known, forward, values : as in `model_sweep`.
    plans : the sweeps.
    tables : one for each sweep, see `model_sweep`.

    Yields
    ------
    One for each sweep, so that a thousand of them need not be held at once.

    Raises
    ------
    ValueError
        As in `model_sweep`.
    """
    ways = ways_down(known, forward, plans, values)
    return (_press(forward, way, table) for way, table in zip(ways, tables or [None] * len(plans), strict=True))


@dataclass(frozen=True, eq=False)
class WayDown:
    """What is known of a sweep before it is pressed, for a batch of draws.

    Attributes
    ----------
    plan : the sweep.
    own : values of its unknowns.
    direct : channel -> true indentation [m] (n_draw, n_point), of those whose depth the records hold.
    limit : largest depth [m] that the forward model covers, (n_draw,); 0 for an invalid design or one that is not covered.
    covered : (n_draw,), draws whose `direct` depths it covers.
    range_use : (n_draw,), deepest of these over the limit; inf where the design is not covered.
    curves : loading curves of the draws that are covered, None if there are none.
    """

    plan: SweepPlan
    own: _SweepValues
    direct: Mapping[str, FloatArray]
    limit: FloatArray
    covered: BoolArray
    range_use: FloatArray
    curves: Curves | None


def ways_down(
    known: Calibrated, forward: Forward, plans: Sequence[SweepPlan], values: Mapping[str, FloatArray]
) -> Iterator[WayDown]:
    """Find which draws the forward model covers at the readings of many sweeps, and make their loading curves.

    Sweeps under the same ball of specimens of the same thicknesses share their designs.

    Parameters
    ----------
    known, forward, plans, values : as in `model_sweeps`.

    Yields
    ------
    One for each sweep; whether a draw is covered is final if the sweep does not need its curve (`SweepPlan.needs_curve`).
    """
    n_draw = next(iter(values.values())).size
    places: dict[tuple[float, ...], int] = {}
    designs: list[dict[str, FloatArray]] = []
    place_of = []
    for plan in plans:
        # The columns are those of `values`, so that the same ones are the same design.
        columns = design_columns(known, values, plan.sweep)
        key = (plan.sweep.indenter_radius, *(id(column) for column in columns.values()))
        if key not in places:
            places[key] = len(designs)
            designs.append(design_values(known, values, plan.sweep))
        place_of.append(places[key])
    whole = _together(designs)
    valid = _valid(whole)
    limit = np.zeros(valid.size)
    curves = None
    if np.any(valid):
        curves = curves_of(forward, _batch(whole, valid, known.experiment))
        limit[valid] = curves.limit
    of_design = np.arange(valid.size).reshape(len(designs), n_draw)
    starts = np.concatenate([[0], np.cumsum(valid)])
    for plan, place in zip(plans, place_of, strict=True):
        rows = of_design[place]
        own = _SweepValues(values, plan.sweep)
        direct = {name: _direct_depth(own, plan.sweep, c) for name, c in plan.channels.items() if not c.needs_curve}
        end = limit[rows]
        inside = end > 0
        deepest = np.max([np.max(d, axis=1) for d in direct.values()], axis=0) if direct else np.zeros(n_draw)
        use = np.full(n_draw, np.inf)
        use[inside] = np.maximum(deepest[inside], 0.0) / end[inside]
        covered = inside & (deepest <= end)
        some = None
        if curves is not None and np.any(covered):
            some = curves if len(designs) == 1 else curves.only(slice(starts[rows[0]], starts[rows[-1] + 1]))
            kept = covered[valid[rows]]
            some = some if np.all(kept) else some.only(kept)
        yield WayDown(plan, own, direct, end, covered, use, some)


def _press(forward: Forward, way: WayDown, table: FloatArray | None) -> SweepModel:
    """Predict the readings of a sweep, in one look at its loading curves."""
    plan, covered, use = way.plan, way.covered.copy(), way.range_use.copy()
    if way.curves is None:
        return SweepModel(covered, use, {})
    every = bool(np.all(covered))
    own = way.own if every else way.own.of(covered)
    limit = way.limit if every else way.limit[covered]
    asked = {name: Asked(d if every else d[covered], (CHANNEL_MODELS[name].column,)) for name, d in way.direct.items()}
    needing = [name for name, channel in plan.channels.items() if channel.needs_curve]
    along = []
    if needing:
        nodes = table_depths(limit) if table is None else table[covered]
        columns: set[Column] = {"force", *(CHANNEL_MODELS[name].column for name in needing)}
        along = [Asked(nodes, tuple(sorted(columns)))]
    parts = way.curves.press([*asked.values(), *along])
    for one, part in zip([*asked.values(), *along], parts, strict=True):
        _require_finite(forward, part, one.columns)

    at = dict(zip(asked, parts, strict=False))
    places: dict[str, Lookup] = {}
    reached = np.ones(limit.size, dtype=bool)
    for name in needing:
        at[name], places[name] = parts[-1], _look_up_tied(own, plan.channels[name], parts[-1])
        reached &= ~np.any(np.isnan(places[name].weight), axis=1)
    for name, place in places.items():
        looked_up = np.max(place.at(at[name].depth), axis=1) / limit
        use[covered] = np.where(reached, np.maximum(use[covered], looked_up), np.inf)
    predicted = {name: _predict(own, name, c, at[name], places.get(name)) for name, c in plan.channels.items()}
    if not np.all(reached):
        predicted = {name: readings.only(reached) for name, readings in predicted.items()}
        covered[covered] = reached
    return SweepModel(covered, use, predicted)


def why_outside(known: Calibrated, forward: Forward, plan: SweepPlan, values: Mapping[str, FloatArray]) -> str:
    """Say in a sentence why the forward model does not cover a draw at a sweep's readings: a broken rule or a violated bound.

    Parameters
    ----------
    known, forward, plan : as in `model_sweep`.
    values : of the one draw, (1,).
    """
    sweep = plan.sweep
    try:
        given = design_values(known, values, sweep)
        design = designed(given, known.experiment)
    except ValueError as error:
        return str(error)
    own = _SweepValues(values, sweep)
    depths = [_direct_depth(own, sweep, channel) for channel in plan.channels.values() if not channel.needs_curve]
    if reason := forward.outside(design, np.concatenate([np.zeros((1, 1)), *depths], axis=1)):
        return reason
    table = forward.respond(design, table_depths(forward.max_depth(design)))
    return f"its loading curve ends at {np.max(table.force):.4g} N ({table.depth[0, -1] * 1e3:.4g} mm), short of the readings"


def reach(
    known: Calibrated, forward: Forward, plan: SweepPlan, values: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Find how far the forward model covers a press, in terms of what the instruments read: crosshead and load.

    Parameters
    ----------
    known, forward, plan, values : as in `model_sweep`.

    Returns
    -------
    Reading of the crosshead [m] (at no less, as the machine gives), and load [N], (n_draw,); -inf where it does not cover the
    design.
    """
    own = _SweepValues(values, plan.sweep)
    design = design_values(known, values, plan.sweep)
    valid = _valid(design)
    reading, load = np.full(valid.size, -np.inf), np.full(valid.size, -np.inf)
    if not np.any(valid):
        return reading, load
    limit = np.zeros(valid.size)
    limit[valid] = forward.max_depth(_batch(design, valid, known.experiment))
    inside = limit > 0
    if np.any(inside):
        ends = forward.respond(_batch(design, inside, known.experiment), limit[inside][:, None])
        some = own.of(inside)
        reading[inside] = (limit[inside][:, None] * some.gain("displacement") + some["contact_offset"])[:, 0]
        load[inside] = (ends.force * some.gain("force") + some["load_zero"] + some["load_step"])[:, 0]
    return reading, load


class _SweepValues:
    """Values of the unknowns that hold for one sweep, as columns (n_draw, 1); zero for an unknown that does not exist."""

    def __init__(self, values: Mapping[str, FloatArray], sweep: Sweep, rows: BoolArray | None = None) -> None:
        self._values, self._sweep, self._rows = values, sweep, rows

    def of(self, rows: BoolArray) -> _SweepValues:
        """The same for a selection of the draws."""
        return _SweepValues(self._values, self._sweep, rows)

    def __getitem__(self, parameter: str) -> FloatArray:
        column = lookup(self._values, parameter, self._sweep.specimen, self._sweep.name)
        if column is None:
            column = np.zeros(next(iter(self._values.values())).shape)
        return (column if self._rows is None else column[self._rows])[:, None]

    def gain(self, channel: str) -> FloatArray | float:
        """Reading over true value of an instrument, (n_draw, 1); 1 where it is not unknown."""
        column = lookup(self._values, f"{channel}_gain", self._sweep.specimen, self._sweep.name)
        if column is None:
            return 1.0
        return np.asarray((column if self._rows is None else column[self._rows])[:, None], dtype=float)


def _crosshead_depth(own: _SweepValues, reading: FloatArray, force: FloatArray) -> FloatArray:
    """True indentation [m] by (1), (n_draw, n_point)."""
    travel = (reading - own["contact_offset"]) / own.gain("displacement")
    return np.asarray(travel - own["machine_compliance"] * (force / own.gain("force")), dtype=float)


def _direct_depth(own: _SweepValues, sweep: Sweep, channel: ChannelPlan) -> FloatArray:
    """True indentation [m] at the points of a channel whose crosshead reading and load are known without the forward model."""
    if channel.tie == "clock":
        return _crosshead_depth(own, *at_time(present(sweep.track), present(channel.points.time) + own["clock_offset"]))
    return _crosshead_depth(own, present(channel.points.displacement), present(channel.load))


def _look_up_tied(own: _SweepValues, channel: ChannelPlan, table: Response) -> Lookup:
    """Where on each draw's loading curve the points of a channel were read, known by force or by crosshead alone."""
    if channel.tie == "force":
        return look_up_force(table, (present(channel.points.force) - own["load_zero"]) / own.gain("force"))
    # No load was read here: (1) with the model's own force, which grows with depth.
    crosshead = np.maximum.accumulate(table.depth + own["machine_compliance"] * table.force, axis=-1)
    return look_up(crosshead, (present(channel.points.displacement) - own["contact_offset"]) / own.gain("displacement"))


def _predict(own: _SweepValues, name: str, channel: ChannelPlan, at: Response, place: Lookup | None) -> PredictedReadings:
    """Equations (2) to (4) of one channel, directly at its points or interpolated in a table along the loading curve."""
    model, points, gain = CHANNEL_MODELS[name], channel.points, own.gain(name)
    depth, ideal, error = at.depth, model.ideal(at), np.asarray(gain)[..., None] * model.error(at)
    variance = own[f"{name}_noise"] ** 2 / points.n_effective
    if place is not None:
        if channel.tie == "force":
            # A force reading stands for depth here: its noise shows as its own slope over force times it.
            slope = gain * np.gradient(ideal, axis=-1) / np.maximum(np.gradient(at.force, axis=-1), 1e-12) / own.gain("force")
            variance = variance + (place.at(slope) * own["force_noise"]) ** 2 / points.n_effective
        depth, ideal, error = place.at(depth), place.at(ideal), place.at(error)
    own_sd = own[f"{name}_discrepancy"] * gain * model.signal(ideal, at)
    mean = gain * ideal + own[model.zero]
    if name == "force":
        mean = mean + own["load_step"] * _in_contact(depth, points.displacement)
    if channel.slope is not None:
        share = np.maximum(1 - own["machine_compliance"] * channel.slope * own.gain("displacement") / gain, _LEAST_SHARE)
        mean = points.value - (points.value - mean) * share
        own_sd, error = own_sd * share, error * share[..., None]
    if at.own_modes and np.isfinite(channel.deepest):  # presses that repeat each other do not share these
        variance = variance + np.sum(error[..., -at.own_modes :] ** 2, axis=-1)
        error = error[..., : -at.own_modes]
    correlation = channel.correlation
    if correlation is None:
        deepest = channel.deepest / own.gain("displacement") - own["machine_compliance"] * channel.deepest_load
        correlation = shared_correlation(depth / np.maximum(deepest, _LEAST_SHARE * channel.deepest))
    variance = variance + own_sd**2 * correlation.rest
    return PredictedReadings(depth, mean, variance, error, points.value, Discrepancy(own_sd, correlation))


def _in_contact(depth: FloatArray, reading: FloatArray | None) -> FloatArray:
    """Which points of the force lie in contact, 0 to 1, (n_draw, n_point): a point is the mean of what lies about it."""
    apart = float(np.median(np.abs(np.diff(present(reading)))))
    return np.asarray(np.clip(depth / max(apart, 1e-9) + 0.5, 0.0, 1.0))


def _require_finite(forward: Forward, response: Response, columns: Sequence[Column]) -> None:
    for name in columns:
        if not np.isfinite(response.force if name == "force" else response.capacitance).all():
            raise ValueError(f"the {forward.name} gave a {name} that is not finite inside the range it says it covers")


def _together(designs: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    """Designs one after the other as one batch; what is given for some of them only is said for all."""
    names = dict.fromkeys(name for design in designs for name in design)
    return {name: np.concatenate([_given(design, name) for design in designs]) for name in names}


def _given(design: Mapping[str, FloatArray], name: str) -> FloatArray:
    """A quantity of a design, worked out as `models.sensor.Design` does where it is not given."""
    if name in design:
        return design[name]
    return design["sensor_thickness"] / 2 if name == "dielectric_thickness" else design["sensor_radius"]


def _valid(design: Mapping[str, FloatArray]) -> BoolArray:
    """Draws whose design breaks no rule of `models.sensor`, (n_draw,)."""
    good = np.ones(next(iter(design.values())).shape, dtype=bool)
    for name, value in design.items():
        good &= np.isfinite(value) & ((value >= 0) if bounds_of(name) == "not negative" else (value > 0))
    slack = 1 + 1e-9
    if "padding_poisson_ratio" in design:
        good &= design["padding_poisson_ratio"] <= INCOMPRESSIBLE
    if "base_friction_coefficient" in design:
        good &= design["base_friction_coefficient"] <= LARGEST_BASE_FRICTION
    if "dielectric_thickness" in design:
        good &= design["dielectric_thickness"] <= design["sensor_thickness"] / 2 * slack
    if "electrode_radius" in design:
        good &= design["electrode_radius"] <= design["sensor_radius"] * slack
    return good


def _batch(design: Mapping[str, FloatArray], rows: BoolArray, experiment: Experiment) -> Design:
    return designed({name: value[rows] for name, value in design.items()}, experiment)
