"""The result of asking whether a sensor on its padding will meet a specification: as numbers, as a table and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ndtri

from calib.checks import BAND_LEVELS, Verdict, verdict_from_plain
from calib.decision.causes import Cause
from calib.decision.enough_draws import left_open, left_open_in_words
from calib.decision.guard_band import Drawing, crossings, inwards, nominals, step_of
from calib.decision.words import EXTRAPOLATION, PROVISO, TOLERANCE_KEY, about, percent, void_in_words
from calib.experiment import LIMITED, Limit, Specification, limited_in_words, specification_from_plain
from models.sensor import BoolArray, FloatArray

if TYPE_CHECKING:
    import pandas as pd

# Pads over which it is averaged whether a drawing accepts them.
_N_PAD = 401


@dataclass(frozen=True, eq=False)
class Built:
    """One sensor that may be built, thickness by thickness of its padding.

    Arrays are (n_thickness,) unless said otherwise, nan where the model covers fewer than 95 % of the draws.

    Attributes
    ----------
    name : what is chosen beside the thickness of the padding.
    left_out : why no model serves it; "" if one does. Then all else is nan.
    not_judged : which nominal thicknesses the model does not cover, and why; "" where it covers all.
    covered : whether it is known at this thickness.
    probability : [1], of conforming, of pads made to this nominal thickness.
    error : [1], Monte Carlo standard error of that.
    exact : [1], of conforming, of pads that have exactly this thickness.
    not_carried : [1], share of draws that do not carry a load inside the model's range; each counts as a failure.
    fails : [1], (n_limit, n_thickness), share of draws outside each limit.
    alone : [1], (n_limit, n_thickness), share of draws that are outside this limit and keep all others.
    shortfall : [1], expected shortfall: by which share of a limit draws miss it in the mean; one that does not carry a load
        misses by a whole limit and more.
    regret : [1], by how much less a draw would fall short on the padding that is best for it, in the mean.
    avoidable : [1], share of draws that fail here, and would conform on another padding.
    signal, stroke : [1], [m], (5, n_thickness), quantiles 5, 25, 50, 75, 95 % at the largest load under the first ball.
    best : [m], of the thicknesses that conform most probably, as far as the draws can tell, that in the middle of what its own
        drawing accepts; where there is none, that of the least expected shortfall; nan if left out.
    best_probability, best_error : [1], there.
    interval : [m], thicknesses about `best` whose pads, made to them, conform with the probability asked for; None for none.
    """

    name: str
    left_out: str
    not_judged: str
    covered: BoolArray
    probability: FloatArray
    error: FloatArray
    exact: FloatArray
    not_carried: FloatArray
    fails: FloatArray
    alone: FloatArray
    shortfall: FloatArray
    regret: FloatArray
    avoidable: FloatArray
    signal: FloatArray
    stroke: FloatArray
    best: float
    best_probability: float
    best_error: float
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class Needed:
    """What one limit would have to be for the specification to be met with the probability asked for, all else as it is.

    Attributes
    ----------
    limit : index of it.
    value : [SI], that it would have to be.
    error : [SI], Monte Carlo standard error of that.
    thickness : [m], of the padding, there.
    """

    limit: int
    value: float
    error: float
    thickness: float


@dataclass(frozen=True)
class OfMember:
    """What one model of an average says by itself.

    Attributes
    ----------
    name : of the model.
    n_draw : how many of the draws are its.
    probability : [1], of conforming at the thickness that is advised; nan with too few draws, as are the others.
    best, best_probability : [m], [1], thickness that it would advise, and of conforming there.
    """

    name: str
    n_draw: int
    probability: float
    best: float
    best_probability: float


@dataclass(frozen=True, eq=False)
class Conformity:
    """How probably a sensor on its padding conforms to a specification, and which padding to build. SI throughout.

    `in_words` says it in a few sentences, `to_dataframe` gives it thickness by thickness.

    Attributes
    ----------
    specification : what was asked.
    thickness : [m], (n_thickness,), nominal ones.
    built : the sensors that may be built; the first is the one that is advised.
    drawing : tolerance, guard band and risks of its pads; None where it does not conform with the probability asked for.
    needed : what each limit alone would have to be, the least change first; tighter than asked if the specification is met.
        Empty where no limit alone would do.
    all_needed : [1], x by which all limits together would have to give way at the advised thickness: least values to 1 - x
        and most values to 1 / (1 - x) of what was asked; negative if they could be tighter. Infinite where none would do.
    causes : what the doubt comes from, at the advised thickness.
    of_models : what each model of an average says by itself.
    open_models : models that the data do not rule out, in words.
    conditions : what it holds for, in words.
    sensor_in_words : whose sensor it is for.
    n_draw, n_effective : draws that were used, and how many independent ones they are worth.
    seed : of the choice of draws.
    verdict : whether it may be built on.
    """

    specification: Specification
    thickness: FloatArray
    built: tuple[Built, ...]
    drawing: Drawing | None
    needed: tuple[Needed, ...]
    all_needed: float
    causes: tuple[Cause, ...]
    of_models: tuple[OfMember, ...]
    open_models: tuple[str, ...]
    conditions: tuple[str, ...]
    sensor_in_words: str
    n_draw: int
    n_effective: int
    seed: int
    verdict: Verdict

    @property
    def best(self) -> Built:
        """The sensor that is advised."""
        return self.built[0]

    @property
    def at_best(self) -> int:
        """Index of the advised thickness."""
        return int(np.nanargmin(np.abs(self.thickness - self.best.best)))

    @property
    def met(self) -> bool:
        """Whether some padding conforms with the probability that was asked for."""
        return self.best.best_probability >= self.specification.probability

    @property
    def close_call(self) -> bool:
        """Whether so few draws leave it open whether the specification is met."""
        return left_open(self.best.best_probability, self.specification.probability, self.best.best_error)

    @property
    def always(self) -> bool:
        """Whether every thickness conforms: the specification does not choose."""
        p = self.best.probability[self.best.covered]
        return bool(p.size and np.min(p) >= self.specification.probability)

    @property
    def _kind(self) -> str:
        return "" if self.specification.padding_tolerance is None else "nominal "

    @property
    def exact_that_conform(self) -> tuple[float, float] | None:
        """Pads [m] of the advised sensor that conform if they have exactly this thickness; None for none."""
        exact = self.best.exact
        if not np.any(np.isfinite(exact)):
            return None
        return crossings(self.thickness, exact, self.specification.probability, int(np.nanargmax(exact)))

    @property
    def front(self) -> tuple[tuple[int, int], ...]:
        """Which sensor and which thickness no other beats in both signal and stroke, by their medians, the softest last."""
        places = [(i, k) for i, b in enumerate(self.built) for k in np.flatnonzero(b.covered & np.isfinite(b.signal[2]))]
        ordered = sorted(places, key=lambda at: (self.built[at[0]].stroke[2, at[1]], -self.built[at[0]].signal[2, at[1]]))
        found, most = [], -math.inf
        for i, k in ordered:
            if self.built[i].signal[2, k] > most:
                most = float(self.built[i].signal[2, k])
                found.append((i, int(k)))
        return tuple(found)

    def to_dataframe(self) -> pd.DataFrame:
        """Thickness by thickness, to plot or to save: one row for each sensor that may be built and each thickness.

        Returns
        -------
        Columns sensor, thickness_m, covered, probability, probability_error, probability_exact, not_carried, one share of
        failures for each limit, expected_shortfall, regret, avoidable, signal_05, ..., stroke_95_m; SI.
        """
        import pandas as pd

        limits = self.specification.limits
        names = ["_".join(["fails", x.quantity, x.side, *([f"{x.at:g}_N"] if x.at is not None else [])]) for x in limits]
        parts = []
        for b in self.built:
            if b.left_out:
                continue
            columns: dict[str, object] = {"sensor": b.name, "thickness_m": self.thickness, "covered": b.covered}
            columns |= {"probability": b.probability, "probability_error": b.error, "probability_exact": b.exact}
            columns |= {"not_carried": b.not_carried, **dict(zip(names, b.fails, strict=True))}
            columns |= {"expected_shortfall": b.shortfall, "regret": b.regret, "avoidable": b.avoidable}
            for name, rows, unit in (("signal", b.signal, ""), ("stroke", b.stroke, "_m")):
                columns |= {f"{name}_{round(100 * q):02d}{unit}": row for q, row in zip(BAND_LEVELS, rows, strict=True)}
            parts.append(pd.DataFrame(columns))
        return pd.concat(parts, ignore_index=True)

    @property
    def unserved_in_words(self) -> tuple[str, ...]:
        """Sensors that were asked for and are left out, each with the reason."""
        return tuple(f"{b.name}: {b.left_out}" for b in self.built if b.left_out)

    @property
    def asked_in_words(self) -> str:
        """The limits, in a sentence."""
        return "; ".join(limit.in_words for limit in self.specification.limits)

    @property
    def in_short(self) -> str:
        """What to build, how sure that is, and what stands on the drawing, of which `in_words` says more; a line for each."""
        if self.verdict.colour == "red":
            return void_in_words(self.verdict)
        return "\n".join([*self._lead, *self._drawing_in_words[:1]])

    @property
    def _lead(self) -> list[str]:
        """Whether it is met, and by what."""
        s, b = self.specification, self.best
        wanted = f"{100 * s.probability:g} %"
        chosen = "" if b.name == "as measured" else f" ({b.name})"
        p = about(b.best_probability, b.best_error)
        lines = []
        beyond = any(reason.gate == EXTRAPOLATION for reason in self.verdict.reasons)
        if self.met:
            build = f"{PROVISO}build" if beyond else "Build"
            lines.append(
                f"{build} {b.best * 1e3:.2f} mm of padding{chosen}: it conforms with a probability of {p} ({wanted} asked for)."
            )
        else:
            found = f"no {self._kind}thickness conforms with {wanted}"
            found = f"not met: {found}" if not self.close_call else f"not shown to be met with {wanted}"
            lines.append(f"The specification is {found}. The best is {b.best * 1e3:.2f} mm of padding{chosen}, with {p}.")
            if (exact := self.exact_that_conform) is not None and s.padding_tolerance is not None:
                lines.append(
                    f"Pads of exactly {self._span(exact)} would conform: what stands in the way is how pads are made, with "
                    f"{s.padding_tolerance.in_words} ({TOLERANCE_KEY})."
                )
        if self.close_call:
            lines.append(f"{self.n_draw} draws {left_open_in_words(p, s.probability)}.")
        return lines

    @property
    def in_words(self) -> str:
        """What to build and how sure that is, or why it cannot be met and what is nearest, a line for each thing.

        Where the verdict is red there is nothing to build, and no number is said.
        """
        if self.verdict.colour == "red":
            return void_in_words(self.verdict)
        s, b, k = self.specification, self.best, self.at_best
        wanted = f"{100 * s.probability:g} %"
        lines = self._lead
        sure = self.met and not self.close_call  # nothing is said to conform with what the draws cannot tell
        if sure and self.always:
            span = self._span((self.thickness[b.covered][0], self.thickness[b.covered][-1]))
            lines.append(f"So does every thickness from {span}: the specification does not choose.")
        lines += self._drawing_in_words
        drawn = self.drawing is None or self.drawing.limits is not None
        if sure and drawn and not self.always and b.interval is not None and b.interval[1] > b.interval[0]:
            lines.append(
                f"With a drawing of its own, any nominal thickness from {self._span(b.interval)} would do: pads made to it "
                f"conform with at least {wanted}."
            )
        lines += [self._not_judged_in_words, self._binding_in_words(k), self._needed_in_words, self._causes_in_words]
        if not self.met or b.avoidable[k] >= 0.005:
            lines.append(
                f"On another padding {percent(b.avoidable[k])} of the draws would conform that fail on this one; the expected "
                f"shortfall is {100 * b.shortfall[k]:.3g} % of a limit, {100 * b.regret[k]:.3g} % less on the best for each."
            )
        if self.of_models:
            lines.append(f"By model: {', '.join(f'{m.name} {percent(m.probability)}' for m in self.of_models if m.n_draw)}.")
        return "\n".join(line.strip() for line in (*lines, self.sensor_in_words) if line)

    def _span(self, ends: tuple[float, float]) -> str:
        """Thicknesses that were found to do, rounded so that they are no more."""
        step = step_of(ends)
        first, last = inwards(ends, step)
        if first > last:
            first, last = ends
        places = _places(step)
        return f"{first * 1e3:.{places}f} to {last * 1e3:.{places}f} mm"

    @property
    def _drawing_in_words(self) -> list[str]:
        """What stands on the drawing, which is the answer, and the tolerance that was given, which is another."""
        d, s = self.drawing, self.specification
        if d is None:
            return []
        if d.accepted is None:
            return [
                f"There is no tolerance for the drawing: pads from {self._span(d.tolerance)} conform, which guard bands of "
                f"{d.guard_band * 1e3:.3g} mm on both sides leave nothing of: measure pads better than {s.gauge * 1e3:.3g} mm."
            ]
        if d.limits is None:
            width = (d.accepted[1] - d.accepted[0]) * 1e6
            return [f"There is no tolerance for the drawing: pads conform in a range of {width:.2g} µm, which no gauge tells."]
        nominal, low, high = (x * 1e3 for x in d.limits)
        step = step_of(d.accepted)
        places = _places(step)
        which = "For the drawing"
        if not d.accepts_nominal:
            which = f"For a drawing, which does not accept the {d.nominal * 1e3:.{places}f} mm that conform best"
        guard = f"guard bands of {d.guard_band * 1e3:.3g} mm included" if d.guard_band > 0 else "no gauge given: no guard band"
        text = (
            f"{which}: {nominal:.{places}f} mm +{high - nominal:.{places}f}/-{nominal - low:.{places}f}. That is what "
            f"to accept: readings from {low:.{places}f} to {high:.{places}f} mm ({guard}; rounded inwards to {step * 1e3:g} mm)"
        )
        ends = [word for word, there in (("thinner", d.open_below), ("thicker", d.open_above)) if there]
        if ends:
            text += f", and perhaps {' and '.join(ends)} ones, which were not asked for or are not covered"
        if s.padding_tolerance is None:
            given = (
                "How exactly pads are made was not given: all were taken to have the nominal thickness, and no risk is known."
            )
        else:
            given = (
                f"What was given is how pads are made, with {s.padding_tolerance.in_words}: of such pads "
                f"{percent(d.accepted_share)} are accepted, consumer's risk {_risk(d.consumers_risk)}, producer's risk "
                f"{_risk(d.producers_risk)}."
            )
        return [f"{text}.", given, *self._other_nominals_in_words]

    @property
    def _other_nominals_in_words(self) -> list[str]:
        """Which thicknesses beside the one that is advised pads may be made to and still be within the drawing."""
        d, s = self.drawing, self.specification
        if d is None or d.limits is None or self.close_call:
            return []
        z, tolerance = ndtri((np.arange(_N_PAD) + 0.5) / _N_PAD), s.padding_tolerance

        def made_to(nominal: float) -> FloatArray:
            return np.array([nominal]) if tolerance is None else tolerance.pads(nominal, z)

        found = nominals(d.limits[1:], made_to, s.gauge, s.probability)
        if found is None:
            return []
        told = (
            f"the drawing accepts pads made to any nominal thickness from {self._span(found)}, at least "
            f"{100 * s.probability:g} % of them."
        )
        one_of_them = found[0] <= d.nominal <= found[1]
        return [f"The named one is not the only one: {told}" if one_of_them else f"{told[0].upper()}{told[1:]}"]

    @property
    def _not_judged_in_words(self) -> str:
        """Nominal thicknesses of which nothing is known, and why."""
        why = self.best.not_judged
        return f"Not all thicknesses that were asked for are judged: {why}." if why else ""

    def _binding_in_words(self, k: int) -> str:
        b = self.best
        failing = [
            (share, limit.in_words) for limit, share in zip(self.specification.limits, b.fails[:, k], strict=True) if share > 0
        ]
        text = ""
        if failing:
            told = ", ".join(f"{words} ({percent(share)} of the draws)" for share, words in sorted(failing, reverse=True)[:3])
            text = f"What binds: {told}. "
        if b.not_carried[k] > 0:
            text += (
                f"Of the draws {percent(b.not_carried[k])} do not carry the load within what the model covers (the sensor "
                "bottoms out, or the ball is in by half its radius): they count as failures. "
            )
        return text

    @property
    def _needed_in_words(self) -> str:
        limits = self.specification.limits
        if not self.needed:
            if self.met:
                return ""
            there = f"on {self.best.best * 1e3:.2f} mm of padding"
            if self.all_needed >= 1:
                why = "" if math.isfinite(self.all_needed) else ": too many draws do not carry the load"
                return f"No change of limits meets it {there}{why}. "
            if len(limits) == 1:
                return ""
            factor = 1 / (1 - self.all_needed)
            together = f"{there} all of them together would have to give way by a factor of {factor:.3g}"
            return f"To change one limit alone would not do: {together}. "
        if self.met:
            if not self.always or self.close_call:
                return ""
            told = [_would(limits[n.limit], n) for n in self.needed]
            return f"It would still hold with one of: {'; '.join(told)}. "
        told = [f"{_would(limits[n.limit], n)} (at {n.thickness * 1e3:.2f} mm)" for n in self.needed[:3]]
        return f"It would be met with {100 * self.specification.probability:g} %, if asked for {', or '.join(told)}. "

    @property
    def _causes_in_words(self) -> str:
        told = [f"{c.name}, {100 * c.share:.0f} %" for c in self.causes if c.counts][:3]
        return f"What the doubt comes from (of the variance of the worst margin): {'; '.join(told)}. " if told else ""

    def to_plain(self) -> dict[str, Any]:
        """What files hold of it; the inverse is `conformity_from_plain`."""
        plain = {f.name: getattr(self, f.name) for f in fields(self)}
        plain |= {"specification": self.specification.to_plain(), "verdict": self.verdict.to_plain()}
        plain["built"] = [{f.name: getattr(b, f.name) for f in fields(b)} for b in self.built]
        plain |= {name: [asdict(one) for one in plain[name]] for name in ("needed", "causes", "of_models")}
        plain["drawing"] = None if self.drawing is None else asdict(self.drawing)
        return {"said": self.in_words, "met": self.met, "left_open": self.close_call, **plain}


_NUMBERS = (
    "probability",
    "error",
    "exact",
    "not_carried",
    "fails",
    "alone",
    "shortfall",
    "regret",
    "avoidable",
    "signal",
    "stroke",
)


def conformity_from_plain(plain: Mapping[str, Any]) -> Conformity:
    """The result that `Conformity.to_plain` wrote."""
    read = {f.name: plain[f.name] for f in fields(Conformity)}
    read["specification"] = specification_from_plain(read["specification"])
    read["thickness"] = np.asarray(read["thickness"], dtype=float)
    read["built"] = tuple(_built_from_plain(one) for one in read["built"])
    read["drawing"] = None if read["drawing"] is None else Drawing(**_with_numbers(read["drawing"], Drawing))
    read["needed"] = tuple(Needed(**one) for one in read["needed"])
    read["all_needed"] = math.inf if read["all_needed"] is None else read["all_needed"]
    read["causes"] = tuple(Cause(**one) for one in read["causes"])
    read["of_models"] = tuple(OfMember(**_with_numbers(one, OfMember)) for one in read["of_models"])
    read |= {name: tuple(read[name]) for name in ("open_models", "conditions")}
    read["verdict"] = verdict_from_plain(read["verdict"])
    return Conformity(**read)


def _built_from_plain(plain: Mapping[str, Any]) -> Built:
    read = dict(plain) | {name: np.asarray(plain[name], dtype=float) for name in _NUMBERS}
    read |= {name: math.nan if plain[name] is None else plain[name] for name in ("best", "best_probability", "best_error")}
    read["covered"] = np.asarray(plain["covered"], dtype=bool)
    return Built(**read | {"interval": None if plain["interval"] is None else tuple(plain["interval"])})


def _with_numbers(plain: Mapping[str, Any], of: type[Drawing] | type[OfMember]) -> dict[str, Any]:
    """Null is nan where a number is meant; pairs are tuples."""
    read: dict[str, Any] = {}
    for f in fields(of):
        value = plain[f.name]
        read[f.name] = tuple(value) if isinstance(value, list) else math.nan if value is None and f.type == "float" else value
    return read


def _places(step: float) -> int:
    """Decimals [mm] of numbers that are multiples of a step [m]."""
    return round(-math.log10(step * 1e3))


def _risk(share: float) -> str:
    return f"{100 * share:.2g} %" if share >= 0.001 else "below 0.1 %"


def _would(limit: Limit, needed: Needed) -> str:
    load = "" if limit.at is None else f" at {limit.at:.4g} N"
    name, side = limit.quantity.replace("_", " "), limit.side.replace("_", " ")
    new, old = (limited_in_words(limit.quantity, v) for v in (needed.value, limit.value))
    row = LIMITED[limit.quantity]
    error = f" (± {needed.error * row.display_scale:.1g} {row.display_unit})" if needed.error > 0 else ""
    return f"{name} {side} {new}{error} instead of {old}{load}"
