"""A posterior in, what its sensors do on any padding under any load of a range, tabulated so that one can look about, out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from calib.checks import Member, Verdict, band, judge_posterior, members_or, verdict_of
from calib.decision.conditions import COVERED_SHARE
from calib.decision.extrapolation import Aim, Covered, Measured, beyond, measured_presses
from calib.decision.padding import at_loads
from calib.decision.sensors import ModelDraws, sensors_of, smooth_normals
from calib.decision.words import spans_in_words
from calib.errors import Fault, InputError
from calib.experiment import Limit
from calib.sampling import Posterior
from models.response import Forward
from models.sensor import BoolArray, FloatArray

#: What a limit may be on here; the strain of the dielectric takes the finite-element fields that `conform` looks up.
LIMITED_HERE = ("signal", "force_resolution", "stroke", "height")

#: Where paddings begin and end that carry a load is told to this [m], from the thinnest that is tabulated on.
PLACE = 0.05e-3

# Loads that are tabulated, closer to each other where they are small, and those through which one between them is interpolated.
_N_LOAD, _ORDER = 33, 4
# What is asked of the model, by its names there; a part of a place by which it is taken for a thickness that is tabulated [m].
_ASKED, _HARDLY = ("change", "sd", "depth", "sensitivity"), 1e-9
# The smallest load that is tabulated, as a share of the largest.
_LEAST_LOAD = 0.01


@dataclass(frozen=True, eq=False)
class View:
    """What is seen at one load, thickness by thickness. Bands are quantiles `BAND_LEVELS`, (5, n_thickness).

    What is not covered is nan.

    Attributes
    ----------
    force : [N], the load.
    thickness : [m], (n_thickness,): those that are tabulated, and between them the places where what is covered begins or ends.
    covered : (n_thickness,), whether 95 % of the draws carry the load inside the model's range.
    change, depth, resolution : [1], [m], [N], bands of signal, stroke, and force that one reading tells from noise.
    height : [m], bands of sensor and padding together.
    conforming : [1], (n_thickness,), probability that every limit is kept by a pad made to this thickness; nan if not covered.
    fails : [1], (n_limit, n_thickness), probability that a limit is missed, one by one.
    verdict : at each thickness whether it may be relied on: that of the calibration, amber at best beyond what was measured.
    """

    force: float
    thickness: FloatArray
    covered: BoolArray
    change: FloatArray
    depth: FloatArray
    resolution: FloatArray
    height: FloatArray
    conforming: FloatArray
    fails: FloatArray
    verdict: tuple[Verdict, ...]


@dataclass(frozen=True, eq=False)
class Landscape:
    """What each draw does on each thickness of padding under each load; `view` looks at it.

    Arrays are of shape (n_draw, n_thickness, n_load).

    Attributes
    ----------
    presses : of the data.
    parts : the draws, model by model.
    thickness : [m], (n_thickness,).
    force : [N], (n_load,), ascending.
    change, sd, depth, sensitivity : [1], its standard deviation from model and discrepancy, [m], [1/N]; nan where not carried.
    carries : [N], the largest load that each draw carries inside the model's range, (n_draw, n_thickness).
    error : standard normals, smooth along the thickness, (n_draw, n_thickness).
    sensor : [m], thickness of each draw's sensor, (n_draw,).
    ball : [m], radius.
    known : verdict on the calibration.
    """

    presses: Sequence[Measured]
    parts: Sequence[ModelDraws]
    thickness: FloatArray
    force: FloatArray
    change: FloatArray
    sd: FloatArray
    depth: FloatArray
    sensitivity: FloatArray
    carries: FloatArray
    error: FloatArray
    sensor: FloatArray
    ball: float
    known: Verdict

    @cached_property
    def reach(self) -> FloatArray:
        """The load [N] up to which a thickness is covered, (n_thickness,); 0 for none."""
        n_draw = len(self.carries)
        return np.asarray(np.sort(self.carries, axis=0)[n_draw - math.ceil(COVERED_SHARE * n_draw)], dtype=float)

    @cached_property
    def _reach_at(self) -> PchipInterpolator:
        """The same at any thickness between those that are tabulated."""
        return PchipInterpolator(self.thickness, self.reach)

    def view(self, force: float, limits: Sequence[Limit] = (), tolerance: float = 0.0) -> View:
        """Look at one load: bands over the thickness, and how probably limits are kept.

        The load is interpolated between those that are tabulated; of a draw that carries it, but not the next larger one of
        these, through those below. Where what is covered begins or ends between two thicknesses the model itself is asked.

        Parameters
        ----------
        force : [N], from the smallest to the largest that is tabulated.
        limits : of `LIMITED_HERE`, which hold at this load.
        tolerance : [m], pads lie anywhere within plus or minus this of what they are made to.

        Raises
        ------
        InputError
            If the load is not tabulated, a limit is on something else, or the tolerance is negative.
        """
        self._check(force, limits, tolerance)
        thickness, (change, sd, depth, sensitivity, error) = self._with_edges(force)
        signal = change + sd * error
        with np.errstate(divide="ignore"):
            resolution = 1 / sensitivity
        height = self.sensor[:, None] + thickness
        carried = np.isfinite(change)
        covered = np.mean(carried, axis=0) >= COVERED_SHARE
        found = {"signal": signal, "stroke": depth, "force_resolution": resolution, "height": height}
        kept = [carried & _keeps(limit, found[limit.quantity]) for limit in limits]
        every = np.all(kept, axis=0) if kept else carried
        bands = {name: np.where(covered, band(values), np.nan) for name, values in found.items()}
        fails = np.array([1 - np.mean(one, axis=0) for one in kept]).reshape(len(limits), thickness.size)
        return View(
            force=force,
            thickness=thickness,
            covered=covered,
            change=bands["signal"],
            depth=bands["stroke"],
            resolution=bands["force_resolution"],
            height=bands["height"],
            conforming=np.where(covered, _spread(thickness, np.mean(every, axis=0), tolerance), np.nan),
            fails=np.where(covered, fails, np.nan),
            verdict=tuple(self._verdicts(force, thickness, covered, bands["stroke"][2], thickness)),
        )

    def _with_edges(self, force: float) -> tuple[FloatArray, list[FloatArray]]:
        """Thicknesses [m] that are looked at, and change, sd, depth, sensitivity and error on each, (n_draw, n_thickness)."""
        carried = self.carries >= force
        tables = (self.change, self.sd, self.depth, self.sensitivity)
        columns = [*(_at_load(table, self.force, force, carried) for table in tables), self.error]
        thickness = self.thickness
        for edge, asked in self._edges(force):
            k = int(np.searchsorted(thickness, edge))
            share = (edge - thickness[k - 1]) / (thickness[k] - thickness[k - 1])
            error = (1 - share) * columns[-1][:, k - 1] + share * columns[-1][:, k]
            columns = [np.insert(column, k, own, axis=1) for column, own in zip(columns, [*asked, error], strict=True)]
            thickness = np.insert(thickness, k, edge)
        return thickness, columns

    def _edges(self, force: float) -> Iterator[tuple[float, list[FloatArray]]]:
        """The outermost place [m] that is covered between a thickness that is and one that is not, and what draws do there."""
        inside = self.reach >= force
        places = np.arange(self.thickness[0], self.thickness[-1], PLACE)
        carrying = places[self._reach_at(places) >= force]
        for k in np.flatnonzero(inside[1:] != inside[:-1]).tolist():
            low, high = self.thickness[k : k + 2]
            between = carrying[(carrying > low + _HARDLY) & (carrying < high - _HARDLY)]
            for place in (between if inside[k + 1] else between[::-1]).tolist():
                asked = [at_loads(part, place, np.array([force])) for part in self.parts]
                columns = [np.concatenate([getattr(at, name)[:, 0] for at in asked]) for name in _ASKED]
                if np.mean(np.isfinite(columns[0])) >= COVERED_SHARE:
                    yield place, columns
                    break

    def verdicts(self, view: View, thickness: FloatArray) -> tuple[Verdict, ...]:
        """Whether what is seen may be relied on at other thicknesses than those that are tabulated, each named as it is.

        Parameters
        ----------
        view : at one load.
        thickness : [m], (n,), within those that are tabulated.
        """
        return tuple(self._verdicts(view.force, view.thickness, view.covered, view.depth[2], thickness))

    def _verdicts(
        self, force: float, seen: FloatArray, covered: BoolArray, depth: FloatArray, at: FloatArray
    ) -> Iterator[Verdict]:
        others = spans_in_words(seen, covered) if np.any(covered) else ""
        depths = np.interp(at, seen, np.nan_to_num(depth))
        reaches = self._reach_at(at)
        for thickness, middle, reach in zip(at.tolist(), depths.tolist(), reaches.tolist(), strict=True):
            more = beyond(self.presses, Aim(force, thickness, middle, (self.ball,)), Covered(reach, others))
            yield verdict_of([*self.known.reasons, *more])

    def _check(self, force: float, limits: Sequence[Limit], tolerance: float) -> None:
        faults = []
        if not self.force[0] <= force <= self.force[-1]:
            message = f"the load must lie between {self.force[0]:.4g} and {self.force[-1]:.4g} N, got {force:.6g} N"
            advice = "Give a larger load" if force < self.force[0] else "Table the sensors up to a larger load"
            faults.append(Fault(message, advice=advice))
        for limit in limits:
            if limit.quantity not in LIMITED_HERE:
                faults.append(Fault(f"{limit.quantity} is not told here", advice="Write a specification for it"))
        if not tolerance >= 0:
            faults.append(Fault(f"the tolerance must not be negative, got {tolerance * 1e3:.6g} mm"))
        if faults:
            raise InputError(faults)


def landscape(
    posterior: Posterior,
    forward: Forward,
    *,
    force: float,
    lower: float,
    upper: float,
    n_thickness: int = 73,
    n_load: int = _N_LOAD,
    n_draw: int = 300,
    seed: int = 1,
    verdict: Verdict | None = None,
    members: Sequence[Member] = (),
) -> Landscape:
    """Table what a sensor like those measured, or the next one of their lot, does on every padding under every load.

    It is what `recommend` goes by, for many loads at once, so that one can look about; the advice itself is that of `recommend`
    and `conform`.

    Parameters
    ----------
    posterior, forward : of the calibration.
    force : [N], the largest load.
    lower, upper : [m], range of thicknesses.
    n_thickness : how many of that range, evenly spaced.
    n_load : how many loads.
    n_draw : draws of the posterior to use.
    seed : of the choice of draws and specimens.
    verdict : on the calibration; None to judge the posterior here, without its predictions.
    members : the models that the posterior is an average of; none for one model.

    Raises
    ------
    InputError
        If the load is not positive or the range is empty.
    """
    if not (force > 0 and 0 <= lower < upper and n_thickness >= 3 and n_load >= _ORDER):
        got = f"{force:.6g} N and {lower * 1e3:.6g} to {upper * 1e3:.6g} mm"
        raise InputError(Fault(f"a landscape needs a positive load and a range of thicknesses, got {got}"))
    rng = np.random.default_rng(seed)
    models = members_or(members, posterior, forward)
    parts = sensors_of(models, posterior.experiment.pooling, n_draw, None, rng, seed).parts
    grid = np.linspace(lower, upper, n_thickness)
    loads = force * np.linspace(np.sqrt(_LEAST_LOAD), 1.0, n_load) ** 2
    columns: list[list[FloatArray]] = [[], [], [], [], []]
    for part in parts:
        answers = [at_loads(part, thickness, loads) for thickness in grid]
        for column, name in zip(columns, (*_ASKED, "reach"), strict=True):
            column.append(np.stack([getattr(at, name) for at in answers], axis=1))
    change, sd, depth, sensitivity, carries = (np.concatenate(column) for column in columns)
    sensor = np.concatenate([np.asarray(part.base.sensor.thickness) for part in parts])
    return Landscape(
        presses=measured_presses(posterior),
        parts=parts,
        thickness=grid,
        force=loads,
        change=change,
        sd=sd,
        depth=depth,
        sensitivity=sensitivity,
        carries=carries,
        error=smooth_normals(float(np.median(sensor)) + grid, sensor.size, rng),
        sensor=sensor,
        ball=float(np.asarray(parts[0].base.indenter.radius)[0]),
        known=judge_posterior(posterior) if verdict is None else verdict,
    )


def _at_load(table: FloatArray, loads: FloatArray, force: float, carried: BoolArray) -> FloatArray:
    """Interpolate a table at a load, where it is carried: by a polynomial through loads about it, else through those below."""
    x = np.sqrt(loads)
    at = np.sqrt(force)
    cell = int(np.clip(np.searchsorted(x, at) - 1, 0, x.size - 2))
    found = np.full(table.shape[:-1], np.nan)
    for last in (cell, cell + 1, min(max(cell + _ORDER // 2, _ORDER - 1), x.size - 1)):
        own = np.arange(max(last - _ORDER + 1, 0), last + 1)
        weights = np.array([np.prod([(at - x[m]) / (x[k] - x[m]) for m in own if m != k]) for k in own])
        smooth = table[..., own] @ weights
        found = np.where(np.isfinite(smooth), smooth, found)
    return np.where(carried, found, np.nan)


def _keeps(limit: Limit, values: FloatArray) -> BoolArray:
    """Whether each value keeps a limit; nan does not."""
    return np.asarray(values >= limit.value if limit.side == "at_least" else values <= limit.value)


def _spread(thickness: FloatArray, probability: FloatArray, tolerance: float) -> FloatArray:
    """Mean of a probability over pads that lie anywhere within a tolerance; what would be thinner than nothing is nothing."""
    if tolerance == 0:
        return probability
    off = tolerance * (2 * (np.arange(21) + 0.5) / 21 - 1)
    made = np.maximum(thickness[:, None] + off, 0.0)
    return np.asarray(np.mean(np.interp(made, thickness, probability), axis=1))
