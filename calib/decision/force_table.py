"""What force a reading on a gripper means, as a table: the frozen results of an inversion, and how one reading is looked up."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from calib.checks import Reason, Verdict
from calib.decision.gripper import LEVEL, WIDTH_IN_SD, Gripper
from calib.decision.retreat import RetreatBand
from calib.digits import interval_text
from models.sensor import FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

#: Rows of a table: as many as leave a float and an integer version of it below 4 kB together.
N_ROW = 97


# From so many times what is expected on a tare is in another unit.
_ANOTHER_UNIT = 50.0

#: Which sensor a table is of.
Kind = Literal["specimen", "next", "design"]


class Status(IntEnum):
    """What may be made of a reading."""

    VALID = 0
    NO_CONTACT = 1
    BEYOND_RANGE = 2
    BELOW_REST = 3
    BAD_INPUT = 4


@dataclass(frozen=True, eq=False)
class ForceReading:
    """What readings mean, arrays of the shape of the readings.

    Attributes
    ----------
    force : [N].
    lower, upper : [N], that hold the force with a probability of `LEVEL` each time it is read; `upper` is no bound beyond the
        range, nor below rest, and there is none for a bad input.
    sigma : [N], the wider side of the bounds over `WIDTH_IN_SD`.
    status : of `Status`.
    """

    force: FloatArray
    lower: FloatArray
    upper: FloatArray
    sigma: FloatArray
    status: IntArray


@dataclass(frozen=True)
class WorkingPoint:
    """What a sensor is like near a force, as medians over the draws, and 90 % intervals where there are two numbers more.

    Attributes
    ----------
    force : [N].
    depth : [m].
    stiffness : [N/m], dF/dd; then its 90 % interval.
    ratio : [1], reading c / c0 - 1.
    gain : [1/N], its derivative; then its 90 % interval.
    capacitance_gain : [F/N].
    noise : [N], standard deviation of the force by the noise of one reading alone.
    sigma : [N], standard deviation of the force by all that is not known.
    """

    force: float
    depth: float
    stiffness: tuple[float, float, float]
    ratio: float
    gain: tuple[float, float, float]
    capacitance_gain: float
    noise: float
    sigma: float


@dataclass(frozen=True, eq=False)
class ForceTable:
    """What force a reading r = c / c0 - 1 of one sensor means. SI; arrays (n_row,), each of them growing.

    Attributes
    ----------
    name : of the sensor, for people.
    sensor : "specimen" that was measured, "next" for one of the same lot that was not, "design" for that on other padding.
    padding_thickness, indenter_radius : [m].
    ratio : [1], readings.
    force, lower, upper : [N], what they mean: median and bounds.
    below : [1], reading under which there is less than no contact explains.
    touch : [1], reading from which contact is certain at the level of the bounds.
    rated : [N], largest force that was asked for.
    end : [N], largest force that a valid reading may mean.
    looked : [N], up to which the model covers forces.
    turn : [N], from which on a larger force reads like a smaller one; nan if none does up to `looked`.
    rest_capacitance, tare : [F], (3,), 5, 50 and 95 % of C0, and of it with what the leads add.
    parasitic : [F], mean and standard deviation of that.
    noise : [F], of one reading, its median.
    points : what the sensor is like at some forces.
    verdict : whether the table may be used.
    conditions : what it holds for, in words.
    retreat : by how much the force is another while a load is let go, which bounds do not hold; None where it was not measured.
    """

    name: str
    sensor: Kind
    padding_thickness: float
    indenter_radius: float
    ratio: FloatArray
    force: FloatArray
    lower: FloatArray
    upper: FloatArray
    below: float
    touch: float
    rated: float
    end: float
    looked: float
    turn: float
    rest_capacitance: FloatArray
    tare: FloatArray
    parasitic: tuple[float, float]
    noise: float
    points: tuple[WorkingPoint, ...]
    verdict: Verdict
    conditions: tuple[str, ...]
    retreat: RetreatBand | None = None

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of the force [N], row by row, see `ForceReading`."""
        return np.asarray(np.maximum(self.upper - self.force, self.force - self.lower) / WIDTH_IN_SD, dtype=float)

    @property
    def largest(self) -> float:
        """The largest force [N] that a valid reading is said to mean; its upper bound is `end`."""
        return float(self.force[-1])

    def read(self, ratio: npt.ArrayLike) -> ForceReading:
        """Look up what readings mean, by straight lines between rows: what the exported files do, in the same words.

        Parameters
        ----------
        ratio : [1], c / c0 - 1, any shape.
        """
        r = np.asarray(ratio, dtype=float)
        bad = ~np.isfinite(r)
        at = np.clip(np.where(bad, self.ratio[0], r), self.ratio[0], self.ratio[-1])
        force, lower, upper = (np.interp(at, self.ratio, column) for column in (self.force, self.lower, self.upper))
        force, lower, upper = np.where(bad, 0.0, force), np.where(bad, 0.0, lower), np.where(bad, self.end, upper)
        status = np.select(
            [bad, r < self.below, r < self.touch, r > self.ratio[-1]],
            [Status.BAD_INPUT, Status.BELOW_REST, Status.NO_CONTACT, Status.BEYOND_RANGE],
            Status.VALID,
        )
        sigma = np.maximum(upper - force, force - lower) / WIDTH_IN_SD
        return ForceReading(force, lower, upper, sigma, np.asarray(status, dtype=np.int64))

    def force_at(self, capacitance: npt.ArrayLike, tare: npt.ArrayLike) -> ForceReading:
        """Look up what a capacitance means, see `read`.

        Parameters
        ----------
        capacitance, tare : c and c0 in any unit, the same for both.
        """
        c, c0 = np.asarray(capacitance, dtype=float), np.asarray(tare, dtype=float)
        good = np.isfinite(c) & np.isfinite(c0) & (c > 0) & (c0 > 0)
        return self.read(np.where(good, (c - c0) / np.where(good, c0, 1.0), np.nan))

    @property
    def tare_in_words(self) -> str:
        """What tare is to be expected of the sensor."""
        low, high = (float(c) * 1e12 for c in self.tare[[0, 2]])
        return f"{interval_text(low, high)} pF ({LEVEL * 100:g} %)" if high > low else f"about {low:.4g} pF"

    @property
    def tare_limits(self) -> tuple[float, float]:
        """Between what a tare [F] may be one of this sensor: beyond it is more than noise away from what is to be expected."""
        return float(self.tare[0]) * (1 - self.touch), float(self.tare[2]) * (1 + self.touch)

    def tare_doubt(self, tare: float) -> Reason | None:
        """Why a tare cannot well be one of this sensor, if it is too far off what is to be expected.

        Parameters
        ----------
        tare : [F], c0.
        """
        low, most = self.tare_limits
        if low <= tare <= most:
            return None
        above = tare / float(self.tare[2]) - 1
        finding = f"{self.name}: a tare of {tare * 1e12:.6g} pF is not what is to be expected of it, {self.tare_in_words}"
        if not 1 / _ANOTHER_UNIT < tare / float(self.tare[1]) < _ANOTHER_UNIT:
            return Reason("tare", "amber", finding, "Check its unit, and that of the readings")
        load = self.read(above if tare > most else float(self.tare[0]) / tare - 1)
        more = "more than " if load.status == Status.BEYOND_RANGE else ""
        if tare < low:
            finding += f": what is expected at rest reads as {more}{float(load.force):.2g} N with it"
            action = "Look whether it is a tare of this sensor; if its leads are not those of the lab, state them (--parasitic)"
            return Reason("tare", "amber", finding, action)
        finding += (
            f": it is what {more}{float(load.force):.2g} N would make of it, and all that is read with it is then too small"
        )
        action = "Tare it without contact; if its leads are not those of the lab, state them (--parasitic)"
        return Reason("tare", "amber", finding, action)

    def reading_doubt(self, capacitance: float, tare: float) -> Reason | None:
        """Why a reading tells no force, or none but that it is at least so large.

        Parameters
        ----------
        capacitance, tare : [F], c and c0.
        """
        read, status = f"{capacitance * 1e12:.4g} pF", Status(int(self.force_at(capacitance, tare).status))
        if status == Status.BELOW_REST:
            finding = f"{self.name}: {read} is farther below rest than noise explains, and means no force"
            return Reason("reading", "amber", finding, "Tare it again without contact, and look whether it has drifted")
        if status == Status.BEYOND_RANGE:
            most = tare * (1 + float(self.ratio[-1])) * 1e12
            finding = f"{self.name}: {read} is beyond its table, which ends at {most:.4g} pF: the force may be any larger one"
            return Reason("reading", "amber", finding, "Check its unit; keep the gripper below, or ask for more (--force)")
        return None

    def to_dataframe(self) -> pd.DataFrame:
        """The table to plot or to save: columns ratio, force_N, lower_N, upper_N, sigma_N."""
        import pandas as pd

        columns = {"ratio": self.ratio, "force_N": self.force, "lower_N": self.lower, "upper_N": self.upper}
        return pd.DataFrame({**columns, "sigma_N": self.sigma})


@dataclass(frozen=True, eq=False)
class GripperTables:
    """Capacitance to force for all sensors of a calibration; `invert` makes it.

    Attributes
    ----------
    gripper : what was asked.
    tables : one for each sensor.
    verdict : on all of them.
    experiment : its name.
    forward_name : of the model that predicts.
    seed : of the choice of draws.
    posterior_sha256, fingerprint : of the posterior's file and of the run; empty if there is none.
    draws_sha256 : of the draws that they follow from, see `calib.Posterior.draws_sha256`.
    versions : name of a package -> its version, with which the run was made.
    """

    gripper: Gripper
    tables: tuple[ForceTable, ...]
    verdict: Verdict
    experiment: str
    forward_name: str
    seed: int
    posterior_sha256: str
    fingerprint: str
    draws_sha256: str
    versions: tuple[tuple[str, str], ...]
