"""The result of a recommendation: which padding to build and how sure that is, as numbers, as a table and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from calib.checks import BAND_LEVELS, Verdict
from calib.decision.conformity import Conformity
from calib.decision.requirement import Requirement
from calib.decision.words import EXTRAPOLATION, PROVISO, percent, sensor_in_words, spans_in_words, void_in_words
from calib.digits import interval_text, number_or_unknown, places_of
from calib.sampling import share_between
from models.sensor import BoolArray, FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: A thickness belongs to the recommended interval when it is near the best with at least this probability.
INTERVAL_PROBABILITY = 0.8


def places_of_thickness(interval: tuple[float, float] | None) -> int:
    """Decimals [mm] that a thickness deserves: those of the interval [m] that is as good, else of the grid.

    Parameters
    ----------
    interval : None where no range stands out.
    """
    first, last = interval or (0.0, 0.0)
    return min(places_of(1e3 * (last - first)), 2) if last > first else 2


@dataclass(frozen=True)
class OfModel:
    """What one of the models of an average says by itself.

    Attributes
    ----------
    name, model : of the model, and its choices in words.
    weight : [1], how much it counts.
    n_draw : how many of the draws are its.
    change : [1], mean and standard deviation of the capacitance change at the recommended thickness; nan without draws.
    best : [m], the thickness that it would recommend; nan with too few draws.
    young_modulus : [Pa], mean and standard deviation; nan if fixed.
    """

    name: str
    model: str
    weight: float
    n_draw: int
    change: tuple[float, float]
    best: float
    young_modulus: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Recommendation:
    """Which padding to build, and how sure that is; `recommend` makes it. SI throughout.

    `in_words` says it in a few sentences, `to_dataframe` gives it thickness by thickness. A band holds the 5, 25, 50, 75 and
    95 % quantiles over the draws, shape (5, n_thickness).

    Attributes
    ----------
    requirement : what was asked.
    indenter_radius : [m], of the ball that the recommendation holds for.
    thickness : [m], (n_thickness,), the grid.
    coverage : [1], (n_thickness,), share of draws whose force is reached inside the model's range.
    covered : (n_thickness,), whether `coverage` is at least 95 %; bands and probability are nan where it is not.
    change : [1], capacitance change C/C0 - 1 at the force, with the model's own error and discrepancy.
    depth : [m], indentation at the force: the stiffness one feels.
    resolution : [N], smallest force that one reading distinguishes from noise, capacitance_noise / (dC/dF).
    probability : [1], (n_thickness,), that this thickness gives at least 1 - tolerance of the draw's best; a draw that is not
        covered counts as not doing so.
    optimum : [m], (n_draw,), each draw's best thickness.
    best : [m], the recommended thickness: the largest `probability`, among equals the largest mean share of the best change.
    best_probability : [1], `probability` there.
    interval : [m], the run of thicknesses around `best` with a probability of at least 80 %, or none.
    change_at_best, depth_at_best, resolution_at_best : (5,), bands at `best`.
    present_padding : [m], of the measured specimens.
    present_change : (5,), the change that it gives.
    gain : (5,), ratio of the change at `best` to that at present, draw by draw; nan where the model does not cover it.
    border : empty, or in words that `best` lies at the end of the asked or of the covered range.
    conditions : what the recommendation holds for, in words.
    open_models : models that these data do not rule out beside the one that predicted, in words.
    of_models : what each model says by itself, if they were averaged.
    verdict : whether it may be built on: what speaks against the calibration, and against going beyond what was measured.
    forward_name : the model that predicted.
    sensor : whose padding it is: "measured" for a sensor like those measured, of their material; "next" for one that has
        not been measured, of the same lot (partial pooling), with how it may differ in the intervals.
    seed : of the choice of draws.
    draws_sha256 : of the draws that it follows from, see `calib.Posterior.draws_sha256`.
    conformity : whether a specification will be met, and by which padding, if one was given: then that is the advice, and all
        else is what gives the largest signal.
    """

    requirement: Requirement
    indenter_radius: float
    thickness: FloatArray
    coverage: FloatArray
    covered: BoolArray
    change: FloatArray
    depth: FloatArray
    resolution: FloatArray
    probability: FloatArray
    optimum: FloatArray
    best: float
    best_probability: float
    interval: tuple[float, float] | None
    change_at_best: FloatArray
    depth_at_best: FloatArray
    resolution_at_best: FloatArray
    present_padding: float
    present_change: FloatArray
    gain: FloatArray
    border: str
    conditions: tuple[str, ...]
    open_models: tuple[str, ...]
    of_models: tuple[OfModel, ...]
    verdict: Verdict
    forward_name: str
    sensor: Literal["measured", "next"]
    seed: int
    draws_sha256: str
    conformity: Conformity | None = None

    def to_dataframe(self) -> pd.DataFrame:
        """The recommendation thickness by thickness, to plot or to save: one row for each thickness of the grid.

        Returns
        -------
        Columns thickness_m, coverage, covered, change_05, ..., change_95, depth_05_m, ..., depth_95_m, resolution_05_N, ...,
        resolution_95_N, probability; SI. Where a thickness is not covered, what is predicted for it is nan.
        """
        import pandas as pd

        columns = {"thickness_m": self.thickness, "coverage": self.coverage, "covered": self.covered}
        for name, quantiles, unit in (
            ("change", self.change, ""),
            ("depth", self.depth, "_m"),
            ("resolution", self.resolution, "_N"),
        ):
            columns |= {f"{name}_{round(100 * q):02d}{unit}": row for q, row in zip(BAND_LEVELS, quantiles, strict=True)}
        return pd.DataFrame({**columns, "probability": self.probability})

    @property
    def places(self) -> int:
        """Decimals [mm] that the thickness is shown with: of a specification two, as on a drawing."""
        return places_of_thickness(self.interval) if self.conformity is None else 2

    @property
    def best_in_words(self) -> str:
        """The recommended thickness, as exactly as it matters: to a place of the interval of those that are as good."""
        return f"{self.best * 1e3:.{self.places}f} mm"

    @property
    def advised_in_words(self) -> str:
        """The padding that is advised: of a specification the one that conforms, else that of the largest signal."""
        if self.conformity is None:
            return self.best_in_words
        advised = self.conformity.best.best
        return f"{advised * 1e3:.2f} mm" if math.isfinite(advised) else "no padding"

    @property
    def asked_in_words(self) -> str:
        """What was asked for: a force and paddings, or a specification."""
        if self.conformity is not None:
            return f"a specification ({'; '.join(limit.in_words for limit in self.conformity.specification.limits)})"
        r = self.requirement
        return f"{r.force:g} N and {r.lower * 1e3:g} to {r.upper * 1e3:g} mm of padding"

    @property
    def interval_in_words(self) -> str:
        """The thicknesses that are as good; "" where no range stands out."""
        if self.interval is None:
            return ""
        first, last = (f"{end * 1e3:.{self.places}f}" for end in self.interval)
        return f"{first} to {last} mm"

    @property
    def sensor_in_words(self) -> str:
        """Whose sensor it is for, in a sentence."""
        return sensor_in_words(of_next=self.sensor == "next")

    @property
    def sureness(self) -> str:
        """How sure the recommendation is, in a few words: never more than the model behind it."""
        p = self.best_probability
        if p < 0.8:
            return "not sure" if p >= 0.5 else "no clear best"
        if self.verdict.colour == "red":
            return "not to be relied on"
        if self._open_beyond:
            return "sure among those that the model covers, but see what speaks against it"
        if self.verdict.colour == "amber":
            return f"sure within the {'models' if self.of_models else 'model'}, but see what speaks against it"
        if self.open_models:
            return (
                f"sure if {'one of the models' if self.of_models else 'the model'} is right, and these data leave others open"
            )
        return "very sure" if p >= 0.95 else "fairly sure"

    @property
    def share_of_choice(self) -> dict[str, float]:
        """What of the variance of the signal and of Young's modulus is the choice of model [1]; empty without an average."""
        found = {}
        said = [m for m in self.of_models if m.n_draw]
        if said:
            found["change"] = share_between([m.n_draw for m in said], *zip(*(m.change for m in said), strict=True))
        known = [m for m in self.of_models if math.isfinite(m.young_modulus[0])]
        if known and len(known) == len(self.of_models):
            found["young_modulus"] = share_between(
                [m.weight for m in known], *zip(*(m.young_modulus for m in known), strict=True)
            )
        return found

    @property
    def choice_in_words(self) -> str:
        """What of the doubt is the choice of model, in a sentence; "" without an average."""
        names = {"change": "the signal", "young_modulus": "Young's modulus"}
        told = [f"{100 * share:.0f} % of the variance of {names[name]}" for name, share in self.share_of_choice.items()]
        return f"The choice of model is {' and '.join(told)}." if told else ""

    @property
    def _open_end(self) -> str:
        """Whether the interval may go on beyond what was asked for or is covered."""
        if self.interval is None or self.border:
            return ""
        first, last = self.thickness[self.covered][[0, -1]]
        sides = [s for s, holds in (("thinner", self.interval[0] == first > 0), ("thicker", self.interval[1] == last)) if holds]
        return f" (and perhaps {' and '.join(sides)} padding, which was not asked for or is not covered)" if sides else ""

    @property
    def _among_in_words(self) -> str:
        """Among which paddings it is the best: those that were asked for, if the model covers them all."""
        asked = f"between {self.requirement.lower * 1e3:g} and {self.requirement.upper * 1e3:g} mm"
        if np.all(self.covered):
            return asked
        known, other = (spans_in_words(self.thickness, chosen) for chosen in (self.covered, ~self.covered))
        if self._open_beyond:
            return f"with {known} of padding, all that the model covers {asked} at this force"
        return f"{asked} ({other} not covered by the model at this force)"

    @property
    def _open_beyond(self) -> bool:
        """Whether a padding that the model does not cover may be the best: see `beyond_the_covered`."""
        return any(reason.gate == "coverage" for reason in self.verdict.reasons)

    @property
    def _start(self) -> str:
        """What to build, with the proviso that it goes beyond the data where it does, without the full stop."""
        start = f"build about {self.best_in_words} of padding"
        if self.best_probability < 0.5:
            start = f"there is no clear best padding; the least doubtful choice is about {self.best_in_words}"
        beyond = any(reason.gate == EXTRAPOLATION for reason in self.verdict.reasons)
        return f"{PROVISO}{start}" if beyond else f"{start[0].upper()}{start[1:]}"

    @property
    def in_short(self) -> str:
        """The recommendation in two or three short sentences, of which `in_words` says more; why there is none if it is red."""
        if self.verdict.colour == "red":
            return void_in_words(self.verdict)
        as_good = f" ({self.interval_in_words} is as good)" if self.interval and self.interval[0] < self.interval[1] else ""
        change, within = _middle_and_ends(self.change_at_best * 100)
        text = f"{self._start}{as_good}. At {self.requirement.force:g} N it gives a capacitance change of {change} % "
        text += f"(90 %: {within} %)"
        if np.isfinite(self.gain[2]):
            text += f", {_middle_and_ends(self.gain)[0]} times that of the measured specimens"
        return f"{text}. {self.border}".strip()

    @property
    def in_words(self) -> str:
        """The recommendation in words and numbers, in a few sentences; none where the verdict is red, which has no results."""
        if self.verdict.colour == "red":
            return void_in_words(self.verdict)
        r, mm = self.requirement, 1e3
        change, within = _middle_and_ends(self.change_at_best * 100)
        text = (
            f"{self._start}. At {r.force:g} N it gives a capacitance change of {change} % "
            f"(90 % interval {within} %), and with a probability of {percent(self.best_probability)} it is within "
            f"{r.tolerance * 100:g} % of the best this sensor can do {self._among_in_words} ({self.sureness}). "
        )
        if self.interval is None:
            text += (
                f"No thickness reaches a probability of {INTERVAL_PROBABILITY * 100:g} %: the data do not single out a range. "
            )
        elif self.interval[0] < self.interval[1]:
            text += (
                f"Anything from {self.interval_in_words} is as good with a probability "
                f"of at least {INTERVAL_PROBABILITY * 100:g} %{self._open_end}. "
            )
        else:
            text += f"Its neighbours on the grid fall below a probability of {INTERVAL_PROBABILITY * 100:g} %. "
        if np.isfinite(self.gain[2]):
            now, (gain, ends) = _middle_and_ends(self.present_change * 100)[0], _middle_and_ends(self.gain)
            text += (
                f"The measured specimens ({self.present_padding * mm:.2f} mm of padding) give {now} %: it is {gain} times as "
                f"much signal (90 % interval {ends}). "
            )
        if self.border:
            text += f"{self.border} "
        if self.of_models:
            text += f"{self.choice_in_words} "
        text += f"{self.sensor_in_words} "
        return text.strip()


def _middle_and_ends(bands: FloatArray) -> tuple[str, str]:
    """Median and 90 % interval, with as many digits as the width of that deserves."""
    lo, middle, hi = (float(v) for v in bands[[0, 2, 4]])
    return number_or_unknown(middle, f".{places_of(hi - lo) if hi > lo else 6}f"), interval_text(lo, hi)
