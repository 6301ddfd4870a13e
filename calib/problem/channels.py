"""How each channel's readings follow from the response of the sensor: one row per channel, for the measurement model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from models.response import Column, Response
from models.sensor import FloatArray


@dataclass(frozen=True)
class ChannelModel:
    """How the readings of one channel follow from the response of the sensor, as the measurement model needs it.

    The functions are those of equations (2) and (3) of `calib.problem.measurement`.

    Attributes
    ----------
    column : what to ask of loading curves.
    ideal : response -> what an ideal instrument would read, SI, (n_draw, n_depth).
    signal : ideal reading (n_draw, n_point), response -> the part of it that the model discrepancy is a share of.
    error : response -> factors V of the forward model's own error of this channel, (n_draw, n_depth, n_mode).
    zero : name of the unknown that the instrument adds to every reading.
    """

    column: Column
    ideal: Callable[[Response], FloatArray]
    signal: Callable[[FloatArray, Response], FloatArray]
    error: Callable[[Response], FloatArray]
    zero: str


#: Name of a channel (see `calib.catalogue.CHANNELS`) -> its model.
CHANNEL_MODELS: Mapping[str, ChannelModel] = MappingProxyType(
    {
        "force": ChannelModel(
            column="force",
            ideal=lambda response: response.force,
            signal=lambda ideal, _: ideal,
            error=lambda response: response.force_error,
            zero="load_zero",
        ),
        "capacitance": ChannelModel(
            column="capacitance",
            ideal=lambda response: response.capacitance,
            signal=lambda ideal, response: ideal - response.rest_capacitance[:, None],
            error=lambda response: response.capacitance_error,
            zero="parasitic_capacitance",
        ),
    }
)
