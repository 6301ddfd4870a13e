"""The catalogue of what a calibration deals with: one row for each channel that instruments measure, one for each unknown.

Experiment keys, priors and their defaults, the list of unknowns, labels and units in reports, and `calib unknowns` follow from
these rows. A new nuisance is a row here and its line in `calib.problem.measurement`; a new channel is a row here, with the
unknowns that it brings, and its model in `calib.problem.channels`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from textwrap import fill
from types import MappingProxyType
from typing import Literal

from models.sensor import PARAMETERS, Parameter

# --- channels -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Channel:
    """A quantity that an instrument measures while the ball presses, and that the likelihood compares with the model.

    Force is the channel of the testing machine, capacitance that of the LCR meter.

    Attributes
    ----------
    name : in code, in lab tables and in results; its noise is the unknown `<name>_noise`, its discrepancy `<name>_discrepancy`.
    label : of the reading, for axes.
    unit : SI.
    display_unit, display_scale : unit for people, and the factor from SI to it; as in `models.sensor.Parameter`.
    fine_unit, fine_scale : the same for noise and resolution, which are much smaller than the readings.
    instrument : that measures it, as the `kind` of one in an experiment file.
    """

    name: str
    label: str
    unit: str
    display_unit: str
    display_scale: float
    fine_unit: str
    fine_scale: float
    instrument: str

    @property
    def axis(self) -> str:
        """Label and unit for the axis of a figure."""
        return f"{self.label} ({self.display_unit})" if self.display_unit else self.label


#: All channels, that of the testing machine first.
CHANNELS: Mapping[str, Channel] = MappingProxyType(
    {
        row.name: row
        for row in (
            Channel("force", "load cell reading", "N", "N", 1.0, "N", 1.0, "load cell"),
            Channel("capacitance", "LCR reading", "F", "pF", 1e12, "fF", 1e15, "LCR meter"),
        )
    }
)


#: Unknowns that are the width of something: of the scatter of readings, of what the model leaves out.
SCALES = frozenset(f"{channel}_{kind}" for channel in CHANNELS for kind in ("noise", "discrepancy"))

#: Quantities of which each specimen of a lot has a value of its own under partial pooling, and the lot one that they lie about:
#: what silicone and casting make of a sensor.
POOLED = ("young_modulus", "relative_permittivity", "sensor_thickness", "padding_thickness", "dielectric_thickness")

_SPREAD = "_spread"


def spread_of(quantity: str) -> str:
    """Name of the unknown that says how far specimens of a lot differ in a quantity, as a share of it.

    >>> spread_of("padding_thickness")
    'padding_thickness_spread'
    """
    return f"{quantity}{_SPREAD}"


#: The spreads of all quantities that are pooled.
SPREADS = tuple(spread_of(quantity) for quantity in POOLED)


# --- unknowns -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Setting:
    """The facts of a calibration that decide whether an unknown exists in it: what was measured, and what the experiment says.

    For example there is no parasitic capacitance to infer where no capacitance was measured.

    Attributes
    ----------
    channels : names of the channels measured: in all sweeps for an unknown of the material or the rig, in the sweeps of the
        specimen for one of a specimen, in the sweep for one of a sweep.
    ties : how the depth of these channels' readings is known: from "displacement", "force" or "clock".
    padding, law, discrepancy, pooling : as the experiment has them.
    given : whether the experiment names the unknown, with a prior or as a known number.
    """

    channels: frozenset[str]
    ties: frozenset[str]
    padding: str = "sensor"
    law: str = "neo-hookean"
    discrepancy: str = "on"
    pooling: str = "complete"
    given: Literal["", "prior", "fixed"] = ""


#: What an unknown belongs to: one value for all specimens (material, rig), for each specimen, or for each sweep.
Scope = Literal["material", "rig", "specimen", "sweep"]


@dataclass(frozen=True)
class Unknown:
    """One row of the catalogue: a quantity that a calibration can infer from the data.

    Attributes
    ----------
    quantity : name, symbol, unit and label.
    scope : whether there is one value for all specimens, one for each specimen, or one for each sweep.
    bounds : "positive", "not negative" or "any".
    default : prior that is used if the experiment names none, as one writes it in an experiment file; "" if a prior must be
        given, is derived, or comes from the data.
    reason : why that default, one sentence; "judgement" means that no citable figure was found.
    example : a sensible prior as one writes it, for advice.
    exists : whether a calibration with a given `Setting` has this unknown; `when` says the same in words.
    derived : what the model uses where the unknown does not exist; "" if it uses nothing in its place.
    """

    quantity: Parameter
    scope: Scope
    bounds: Literal["positive", "not negative", "any"]
    default: str
    reason: str
    example: str
    exists: Callable[[Setting], bool]
    when: str
    derived: str = ""

    @property
    def name(self) -> str:
        """Name of the quantity in code, in experiment files and in results."""
        return self.quantity.name

    @property
    def required(self) -> bool:
        """Whether an experiment must name a prior: a thickness, for which there is neither a default nor another quantity."""
        return self.scope == "specimen" and not self.default and not self.derived


def _always(_: Setting) -> bool:
    return True


def _electrical(s: Setting) -> bool:
    return "capacitance" in s.channels


def _pressed(s: Setting) -> bool:
    return "force" in s.channels


def _crosshead(s: Setting) -> bool:
    return bool(s.ties & {"displacement", "clock"})


def _named(s: Setting) -> bool:
    return s.given != ""


def _named_and_electrical(s: Setting) -> bool:
    return s.given == "fixed" or (s.given == "prior" and _electrical(s))


def _named_and_loaded(s: Setting) -> bool:
    return s.given == "fixed" or (s.given == "prior" and (_pressed(s) or "force" in s.ties))


def _named_and_travelled(s: Setting) -> bool:
    return s.given == "fixed" or (s.given == "prior" and _crosshead(s))


def _named_and_pressed(s: Setting) -> bool:
    return s.given == "fixed" or (s.given == "prior" and _pressed(s) and "force" not in s.ties)


_SILICONES = (
    "casting silicones of this kind: small-strain E = 3 mu of 0.58 MPa (Dragon Skin 30), 0.66 MPa (Elastosil 28), "
    "1.05 MPa (RTV 615), 2.0 MPa (Sylgard 184, 10:1); within-lab scatter is 3-5 %, but test methods and labs differ by a "
    "factor of 2 and more (Varner and Cohen, arXiv 2404.16960), hence the factor 1.8 (90 %: 0.3-2.1 MPa)"
)
_SCATTER = "wide around the scatter of the sweep's own readings: a factor of 3 either way"


def _spread(quantity: str, symbol: str, share: float, reason: str, exists: Callable[[Setting], bool] = _always) -> Unknown:
    """How far specimens of a lot differ in a quantity, about so much of it, twice or half as much within one sd."""
    prior = f"{{ lognormal = [{share:g}, 2] }}"
    of = PARAMETERS[quantity].label.removesuffix(" of the sensor")
    return Unknown(
        Parameter(spread_of(quantity), symbol, "", "%", 1e2, f"{of}, spread between specimens (sd)"),
        "material",
        "not negative",
        default=prior,
        reason=reason,
        example=prior,
        exists=lambda s: s.pooling == "partial" and exists(s),
        when='pooling = "partial"',
    )


_CAST = "judgement: hand-cast layers of one recipe come out alike to 2 to 5 %, as the gap of the blade or what was poured does"
_SPREADS = (
    _spread(
        "young_modulus",
        "τ_E",
        0.04,
        "judgement: batches and cures of one silicone scatter by 3 to 5 % within a lab, and never by nothing",
    ),
    _spread(
        "relative_permittivity",
        "τ_ε",
        0.01,
        "judgement: the permittivity of one silicone hardly depends on mix and cure, by 1 % or so",
        _electrical,
    ),
    _spread("sensor_thickness", "τ_s", 0.03, _CAST),
    _spread("padding_thickness", "τ_p", 0.03, _CAST),
    _spread(
        "dielectric_thickness",
        "τ_d",
        0.04,
        "judgement: the same gap or wetness of the film is a larger share of a thin layer",
        _electrical,
    ),
)

_ROWS: tuple[Unknown, ...] = (
    Unknown(
        PARAMETERS["young_modulus"],
        "material",
        "positive",
        default='{ lognormal = ["0.8 MPa", 1.8] }',
        reason=_SILICONES,
        example='{ lognormal = ["0.7 MPa", 1.6] }',
        exists=_always,
        when="always",
    ),
    Unknown(
        PARAMETERS["padding_young_modulus"],
        "material",
        "positive",
        default='{ lognormal = ["0.8 MPa", 1.8] }',
        reason=_SILICONES,
        example='{ lognormal = ["0.7 MPa", 1.6] }',
        exists=lambda s: s.padding in ("own", "foam"),
        when='material = "own" or "foam" in [padding]',
        derived="young_modulus",
    ),
    Unknown(
        PARAMETERS["padding_poisson_ratio"],
        "material",
        "not negative",
        default="{ uniform = [0, 0.5] }",
        reason="judgement: foams have 0 to 0.4, as their bubbles are; what keeps its volume has 0.5",
        example="{ uniform = [0.1, 0.4] }",
        exists=lambda s: s.padding == "foam",
        when='material = "foam" in [padding]',
        derived="0.5",
    ),
    Unknown(
        PARAMETERS["stiffening"],
        "material",
        "not negative",
        default="{ uniform = [0, 0.1] }",
        reason="judgement: casting silicones lock at J_m of 10 to 80, or not within reach (0: neo-Hookean)",
        example="{ uniform = [0, 0.1] }",
        exists=lambda s: s.law == "gent",
        when='law = "gent" in [sensor]',
        derived="0",
    ),
    Unknown(
        PARAMETERS["relative_permittivity"],
        "material",
        "positive",
        default="{ truncated_normal = [2.85, 0.25, 2, 12] }",
        reason=(
            "judgement: values around 2.5-3.2 are usual for unfilled silicones at 1 kHz (silicone fluid PMX-200: 2.7); give "
            "your own prior for a filled silicone or an acrylic (VHB: 4.7)"
        ),
        example="{ normal = [2.8, 0.2] }",
        exists=lambda s: _electrical(s) or s.given == "fixed",
        when="there is capacitance",
        derived="the median of its prior",
    ),
    Unknown(
        PARAMETERS["electrode_radius"],
        "rig",
        "positive",
        default="",
        reason="",
        example='{ fixed = "10 mm" }',
        exists=_named,
        when="the experiment names it",
        derived="sensor_radius",
    ),
    Unknown(
        Parameter("parasitic_capacitance", "C_p", "F", "pF", 1e12, "parasitic capacitance"),
        "rig",
        "any",
        default='{ normal = ["0 pF", "0.5 pF"] }',
        reason=(
            "judgement: what an open correction of the LCR meter leaves; without one leads add up to 5 pF, then give your own"
        ),
        example='{ normal = ["0 pF", "2 pF"] }',
        exists=_electrical,
        when="there is capacitance",
    ),
    Unknown(
        PARAMETERS["friction_coefficient"],
        "rig",
        "not negative",
        default="",
        reason="",
        example="{ uniform = [0, 0.6] }",
        exists=_named,
        when="the experiment names it among the priors, or as a number in [indenter]",
        derived='friction_coefficient in [indenter], 0 or "stick"',
    ),
    Unknown(
        PARAMETERS["base_friction_coefficient"],
        "rig",
        "not negative",
        default="",
        reason="",
        example="{ uniform = [0, 1] }",
        exists=_named,
        when='the experiment names it among the priors, with base = "slippery"',
        derived="0",
    ),
    Unknown(
        PARAMETERS["sensor_radius"],
        "rig",
        "positive",
        default="",
        reason="",
        example='{ normal = ["10 mm", "0.05 mm"] }',
        exists=_named,
        when="the experiment names it among the priors",
        derived="the radius in [sensor]",
    ),
    Unknown(
        PARAMETERS["indenter_radius"],
        "rig",
        "positive",
        default="",
        reason="",
        example='{ normal = ["5 mm", "0.02 mm"] }',
        exists=_named,
        when="the experiment names it among the priors (one ball for all presses)",
        derived="the radius in [indenter]",
    ),
    Unknown(
        Parameter("force_gain", "g_F", "", "", 1.0, "gain of the load cell (reading over true force)"),
        "rig",
        "positive",
        default="",
        reason="",
        example="{ normal = [1, 0.0025] }",
        exists=_named_and_loaded,
        when="the experiment names it, as by the class of the load cell: an error of up to 0.5 % is { normal = [1, 0.0025] }",
        derived="1",
    ),
    Unknown(
        Parameter("capacitance_gain", "g_C", "", "", 1.0, "gain of the LCR meter (reading over true capacitance)"),
        "rig",
        "positive",
        default="",
        reason="",
        example="{ normal = [1, 0.001] }",
        exists=_named_and_electrical,
        when="the experiment names it, as by the accuracy that the LCR meter's manual states at its range and frequency",
        derived="1",
    ),
    Unknown(
        Parameter("displacement_gain", "g_x", "", "", 1.0, "gain of the travel (reading over true travel)"),
        "rig",
        "positive",
        default="",
        reason="",
        example="{ normal = [1, 0.005] }",
        exists=_named_and_travelled,
        when="the experiment names it, as by its class: an error of up to 1 % is { normal = [1, 0.005] }",
        derived="1",
    ),
    Unknown(
        Parameter("machine_compliance", "c_m", "m/N", "µm/N", 1e6, "machine compliance"),
        "rig",
        "not negative",
        default='{ halfnormal = "2 um/N" }',
        reason="judgement: load string and fixtures of a table-top tester, 10 µm at 5 N",
        example='{ halfnormal = "5 um/N" }',
        exists=_crosshead,
        when="a crosshead tells the depth of some readings",
    ),
    Unknown(
        Parameter("force_noise", "s_F", "N", "mN", 1e3, "noise of one force reading (sd)"),
        "rig",
        "positive",
        default='{ lognormal = ["5 mN", 3] }',
        reason=_SCATTER,
        example='{ lognormal = ["5 mN", 3] }',
        exists=lambda s: _pressed(s) or "force" in s.ties,
        when="there is force",
    ),
    Unknown(
        Parameter("capacitance_noise", "s_C", "F", "fF", 1e15, "noise of one capacitance reading (sd)"),
        "rig",
        "positive",
        default='{ lognormal = ["20 fF", 3] }',
        reason=_SCATTER,
        example='{ lognormal = ["20 fF", 3] }',
        exists=_electrical,
        when="there is capacitance",
    ),
    Unknown(
        Parameter("force_discrepancy", "δ_F", "", "%", 1e2, "model discrepancy of the force (sd, share of the force)"),
        "rig",
        "not negative",
        default="{ halfnormal = 0.01 }",
        reason="judgement: neo-Hookean discs without rate effects or tilt describe a good specimen to about 1 %",
        example="{ halfnormal = 0.01 }",
        exists=lambda s: s.discrepancy == "on" and _pressed(s),
        when='there is force and discrepancy = "on"',
    ),
    Unknown(
        Parameter(
            "capacitance_discrepancy",
            "δ_C",
            "",
            "%",
            1e2,
            "model discrepancy of the capacitance change (sd, share of the change)",
        ),
        "rig",
        "not negative",
        default="{ halfnormal = 0.02 }",
        reason="judgement: stiff electrodes and fringe fields, both left out, are worth about 2 % of the change",
        example="{ halfnormal = 0.02 }",
        exists=lambda s: s.discrepancy == "on" and _electrical(s),
        when='there is capacitance and discrepancy = "on"',
    ),
    *_SPREADS,
    Unknown(
        PARAMETERS["sensor_thickness"],
        "specimen",
        "positive",
        default="",
        reason="",
        example='{ normal = ["0.74 mm", "0.02 mm"] }',
        exists=_always,
        when="always; must be measured",
    ),
    Unknown(
        PARAMETERS["padding_thickness"],
        "specimen",
        "not negative",
        default="",
        reason="",
        example='{ normal = ["1.10 mm", "0.03 mm"] }',
        exists=_always,
        when="always; must be measured",
    ),
    Unknown(
        PARAMETERS["dielectric_thickness"],
        "specimen",
        "positive",
        default="",
        reason="",
        example='{ normal = ["0.16 mm", "0.01 mm"] }',
        exists=_named,
        when="the experiment names it",
        derived="sensor_thickness / 2",
    ),
    Unknown(
        Parameter("contact_offset", "d_0", "m", "mm", 1e3, "crosshead reading at first touch"),
        "sweep",
        "any",
        default='{ uniform = ["-0.5 mm", "0.5 mm"] }',
        reason=(
            "judgement: the crosshead is zeroed by eye near first touch; already a trigger at 0.02 N sits 34 µm deep at 0.6 MPa"
        ),
        example='{ uniform = ["-0.5 mm", "0.5 mm"] }',
        exists=_crosshead,
        when="a crosshead tells the depth of its readings",
    ),
    Unknown(
        Parameter("load_zero", "F_0", "N", "N", 1.0, "load cell reading without contact"),
        "sweep",
        "any",
        default='{ truncated_normal = ["0 N", "1 N", "-5 N", "5 N"] }',
        reason="judgement: the cell is usually balanced before the test, but nothing here relies on it",
        example='{ normal = ["0 N", "1 N"] }',
        exists=lambda s: _pressed(s) or "force" in s.ties,
        when="there is force",
    ),
    Unknown(
        Parameter("load_step", "F_1", "N", "mN", 1e3, "load zero in contact less that before it"),
        "sweep",
        "any",
        default="",
        reason="",
        example='{ normal = ["0 N", "5 mN"] }',
        exists=_named_and_pressed,
        when="the experiment names it, as where the cell may be balanced anew at the touch, and force ties no capacitance",
        derived="0",
    ),
    Unknown(
        Parameter("clock_offset", "τ", "s", "s", 1.0, "clock of the tester minus clock of the LCR meter"),
        "sweep",
        "any",
        default="",
        reason="",
        example='{ normal = ["0 s", "5 s"] }',
        exists=lambda s: "clock" in s.ties,
        when="readings are tied to the crosshead by time",
        derived="found in the data",
    ),
)

#: The one table of unknowns, in the order in which a problem lists them.
UNKNOWNS: Mapping[str, Unknown] = MappingProxyType({row.name: row for row in _ROWS})

#: Symbol, unit and label of every quantity of a design or an experiment by name, unknown or not.
QUANTITIES: Mapping[str, Parameter] = MappingProxyType({**PARAMETERS, **{name: row.quantity for name, row in UNKNOWNS.items()}})


def responds(channel: str) -> bool:
    """Whether a channel changes as the ball presses: then its discrepancy, which is a share of that change, is an unknown.

    >>> responds("capacitance")
    True
    """
    return f"{channel}_discrepancy" in UNKNOWNS


def unknowns_of(*scopes: Scope) -> tuple[str, ...]:
    """Names of the unknowns that belong to one of these scopes, in the order of the catalogue.

    >>> unknowns_of("sweep")
    ('contact_offset', 'load_zero', 'load_step', 'clock_offset')
    """
    return tuple(name for name, row in UNKNOWNS.items() if row.scope in scopes)


def bounds_of(name: str) -> Literal["positive", "not negative", "any"]:
    """Find the sign that a quantity may have; all lengths and moduli that are no unknowns are positive.

    >>> bounds_of("padding_thickness"), bounds_of("indenter_radius")
    ('not negative', 'positive')
    """
    return UNKNOWNS[name].bounds if name in UNKNOWNS else "positive"


def display(name: str, value: float) -> str:
    """Write a value for people, in the unit that they use for this quantity.

    Parameters
    ----------
    name : of a quantity, a key of `QUANTITIES`.
    value : the number, SI.

    Examples
    --------
    >>> display("sensor_thickness", 0.74e-3), display("relative_permittivity", 2.8)
    ('0.74 mm', '2.8')
    """
    row = QUANTITIES[name]
    return f"{value * row.display_scale + 0.0:.6g} {row.display_unit}".rstrip()


# --- names --------------------------------------------------------------------------------------------------------------

_NAME = re.compile(r"([^\[\]]+)(?:\[([^\[\],]+)(?:, ([^\[\],]+))?\])?")


@dataclass(frozen=True, order=True)
class UnknownName:
    """Name of an unknown in results: the quantity, and the specimen and the sweep that it belongs to.

    `str` prints it, `parse` reads it: "young_modulus", "sensor_thickness[sensor 1]", "contact_offset[sensor 1, ball 2]".

    Attributes
    ----------
    parameter : a key of `UNKNOWNS`.
    specimen, sweep : empty for an unknown that all specimens share, or that all sweeps of the specimen share.
    """

    parameter: str
    specimen: str = ""
    sweep: str = ""

    def __str__(self) -> str:
        where = ", ".join(part for part in (self.specimen, self.sweep) if part)
        return f"{self.parameter}[{where}]" if where else self.parameter

    @classmethod
    def parse(cls, text: str) -> UnknownName:
        """Read a name as results print it.

        >>> UnknownName.parse("contact_offset[sensor 1, ball 2]")
        UnknownName(parameter='contact_offset', specimen='sensor 1', sweep='ball 2')

        Raises
        ------
        ValueError
            If the text is not the name of an unknown.
        """
        match = _NAME.fullmatch(text)
        if match is None:
            raise ValueError(f"{text!r} is not the name of an unknown, write for example sensor_thickness[sensor 1]")
        return cls(match[1], match[2] or "", match[3] or "")

    @property
    def wider(self) -> tuple[UnknownName, ...]:
        """Names under which a value for a sweep is looked up: of the sweep, then of its specimen, then of all specimens."""
        return tuple(dict.fromkeys((self, replace(self, sweep=""), UnknownName(self.parameter))))

    @property
    def label(self) -> str:
        """Words for people: the quantity, and the specimen and sweep that it belongs to."""
        where = ", ".join(part for part in (self.specimen, self.sweep) if part)
        return QUANTITIES[self.parameter].label + (f" ({where})" if where else "")


# --- documentation ------------------------------------------------------------------------------------------------------


def unknowns_in_words() -> str:
    """Describe every unknown: what it is, when it exists, its default prior and why; what `calib unknowns` prints."""
    entries = []
    for name, row in UNKNOWNS.items():
        q = row.quantity
        unit = f"in {q.display_unit}" if q.display_unit else "a plain number"
        bounds = "of any sign" if row.bounds == "any" else row.bounds
        default = row.default or ("none, must be given" if row.required else f"none: {row.derived}")
        when = f"{row.when}, else {row.derived}" if row.default and row.derived else row.when
        about = (f"{unit}, one per {row.scope}, {bounds}", f"exists: {when}", f"default prior: {default}")
        because = (f"because: {row.reason}",) if row.reason else ()
        lines = (fill(line, 116, initial_indent="    ", subsequent_indent="      ") for line in (*about, *because))
        entries.append("\n".join((f"{name} ({q.symbol}): {q.label}", *lines)))
    return "\n\n".join(entries) + "\n"
