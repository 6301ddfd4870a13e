"""A `Sweep`, the data of one press as the likelihood uses them: tens of points of every channel, and how deep each was read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.lab.clocks import ClockOffset
from calib.lab.quality import Grade
from calib.lab.reduction import NoiseEstimate
from calib.records import record_from_text, record_to_text
from models.sensor import FloatArray

if TYPE_CHECKING:
    import pandas as pd

# Layout of sweeps as JSON.
_FORMAT = 4

#: Largest number of nodes of a `Track`.
TRACK_NODES = 2000
#: Least time [s] a `Track` reaches beyond the loading branch on both sides, so that the clock offset may move.
TRACK_MARGIN = 5.0


@dataclass(frozen=True, eq=False)
class Points:
    """The data of one channel of a sweep: a few dozen means of neighbouring readings on the loading branch.

    Arrays of shape (n_point,), in the order of loading. The true depth is not known yet, as it depends on unknowns such as the
    contact point: a point carries what the depth can be computed from, the crosshead's reading, a load or a time.

    Attributes
    ----------
    value : in the unit of the channel, not zeroed; force is positive in compression.
    n_effective : independent readings in the point: its sd is the channel's noise / sqrt(n_effective).
    displacement : [m], crosshead reading of the same record; None if it has none.
    force : [N], load of the same record, not zeroed, compression positive; None if it has none, or if it is the value itself.
    time : [s], clock of the LCR meter, where that ties the points to the tester's `Track`; else None.
    """

    value: FloatArray
    n_effective: FloatArray
    displacement: FloatArray | None = None
    force: FloatArray | None = None
    time: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Track:
    """The tester's record over its own time, by which readings of a meter with a clock of its own get a crosshead reading.

    Group means of at most `TRACK_NODES` nodes over the loading branch and on both sides `TRACK_MARGIN`, or four
    sd of the clock offset where that is more. The noise of the displacement is averaged out over a twentieth of the branch:
    taken for motion, it makes the likelihood rough in the clock offset.

    Attributes
    ----------
    time : [s], (n_node,), strictly increasing.
    displacement : [m], (n_node,).
    force : [N], (n_node,).
    """

    time: FloatArray
    displacement: FloatArray
    force: FloatArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """One press of a ball into a specimen, prepared for the likelihood: thousands of readings reduced to tens of points.

    `read_sweeps` makes one from the lab files that an experiment names, `make_sweep` from the files themselves::

        sweep = make_sweep("sensor 1", "", 5e-3, Path("sensor1_instron.csv"), Path("sensor1_lcr.csv"))
        sweep.channels["force"].value  # [N], about forty numbers

    Attributes
    ----------
    specimen, name : of the specimen and the sweep; the name is empty for the only sweep of a specimen.
    indenter_radius : [m].
    channels : name of a channel (see `calib.catalogue.CHANNELS`) -> its points, those that were measured.
    track : the tester's record; None where no channel is tied to it by time.
    noise : channel -> sd of one reading as estimated from the data, in the unit of the channel.
    clock_offset, clock_offset_sd : [s], clock of the tester minus clock of the LCR meter; nan if not tied by clock.
    clock : the same with its evidence and how sure it is; None if not tied by clock.
    readings : channel -> noise, correlation and resolution of its readings, and how many there are; empty for what was not
        measured.
    files : (file name, sha256) of each file.
    notes : what the report must say: rows left out with counts and reasons, signs turned, resolution.
    grades : on the quality of each file, made before anything was reduced.
    contact : [m], crosshead reading where contact begins as estimated, which a depth that limits the use counts from; nan
        without a displacement. Nothing is calibrated against it.
    """

    specimen: str
    name: str
    indenter_radius: float
    channels: Mapping[str, Points]
    track: Track | None
    noise: Mapping[str, float]
    clock_offset: float
    clock_offset_sd: float
    files: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    clock: ClockOffset | None = None
    readings: Mapping[str, NoiseEstimate] = field(default_factory=dict)
    grades: tuple[Grade, ...] = ()
    contact: float = float("nan")

    @property
    def title(self) -> str:
        """Name for people: its specimen, and its own name if it has one."""
        return f"{self.specimen}, {self.name}" if self.name else self.specimen

    def to_dataframe(self) -> pd.DataFrame:
        """All points of all channels as a table, to look at or to plot.

        Returns
        -------
        One row per point: channel, value and sd (of the point) in the SI unit of the channel, n_effective, and where it was
        read: displacement [m], force [N], time [s]; nan for what its record does not have.
        """
        import pandas as pd

        frames = []
        for name, points in self.channels.items():
            sd = self.noise.get(name, float("nan")) / np.sqrt(points.n_effective)
            columns = {"value": points.value, "sd": sd, "n_effective": points.n_effective, "displacement": points.displacement}
            columns |= {"force": self.load_at(name), "time": points.time}
            filled = {k: np.full(points.value.size, np.nan) if v is None else v for k, v in columns.items()}
            frames.append(pd.DataFrame({"channel": [name] * points.value.size, **filled}))
        return pd.concat(frames, ignore_index=True)

    def tied_by(self, channel: str) -> str:
        """By what the depth of a channel's readings is known.

        Returns
        -------
        The most direct there is: "displacement", the crosshead column of the same record; "force", its load column; "clock",
        the time that it shares with the tester's record; "" if the record has none of these, or the channel was not measured.
        """
        points = self.channels.get(channel)
        if points is None:
            return ""
        if points.displacement is not None:
            return "displacement"
        if points.force is not None:
            return "force"
        return "clock" if points.time is not None and self.track is not None else ""

    def load_at(self, channel: str) -> FloatArray | None:
        """Load [N] at the points of a channel, from the same record, (n_point,); None if the record has no load."""
        points = self.channels[channel]
        return points.value if channel == "force" else points.force


def sweeps_to_json(sweeps: Sequence[Sweep]) -> str:
    """Sweeps as JSON text; numbers come back to the last bit, nan included."""
    return record_to_text("sweeps", _FORMAT, {"sweeps": [_to_plain(s) for s in sweeps]}, indent=None, exact=True)


def _to_plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if is_dataclass(value):
        return {f.name: _to_plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {key: _to_plain(v) for key, v in value.items()}
    if isinstance(value, tuple):
        return [_to_plain(v) for v in value]
    return value


def sweeps_from_json(text: str) -> tuple[Sweep, ...]:
    """The sweeps that `sweeps_to_json` wrote.

    Raises
    ------
    ValueError
        If the text is another record, or of another format.
    """
    return tuple(_sweep(plain) for plain in record_from_text("sweeps", _FORMAT, text)["sweeps"])


def _arrays(plain: Mapping[str, Sequence[float] | None]) -> dict[str, Any]:
    return {name: None if values is None else np.array(values, dtype=np.float64) for name, values in plain.items()}


def _sweep(plain: Mapping[str, Any]) -> Sweep:
    track = plain["track"]
    made = {
        "channels": {name: Points(**_arrays(points)) for name, points in plain["channels"].items()},
        "track": None if track is None else Track(**_arrays(track)),
        "files": tuple((file, sha256) for file, sha256 in plain["files"]),
        "notes": tuple(plain["notes"]),
        "grades": tuple(Grade(**v) for v in plain["grades"]),
        "clock": _clock(plain["clock"]),
        "readings": {name: NoiseEstimate(**found) for name, found in plain["readings"].items()},
    }
    return Sweep(**{**plain, **made})


def _clock(plain: Mapping[str, Any] | None) -> ClockOffset | None:
    if plain is None:
        return None
    several = {k: None if plain[k] is None else tuple(plain[k]) for k in ("turning_point", "onset", "alternatives", "evidence")}
    return ClockOffset(**{**plain, **several})
