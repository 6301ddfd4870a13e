"""A TOML file in, a `Bench` out: what a lab can measure, how well, and how long it takes; else usual values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from calib.catalogue import display
from calib.experiment.toml_file import Toml, read_toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import check_keys, get, quantity_at, quoted, raise_faults, table_at
from calib.quantity import parse_quantity

# Fewest minutes that anything takes, and factor from the usual sd beyond which only a slip of the unit explains one.
_SHORTEST, _SLIP = 0.1, 300.0
# Force [N] beyond which only a slip of the unit explains what a load cell is said to bear.
_LARGEST_CELL = 1e5


@dataclass(frozen=True)
class Usual:
    """What a measurement usually takes.

    Attributes
    ----------
    minutes : of somebody's time in the lab, waiting for a cure not counted.
    why : what they are spent on.
    sd : SI, how well a quantity is read by itself; nan for a press, whose readings say that.
    how : the measurement in words; {of} is where its specimen stands.
    """

    minutes: float
    why: str
    sd: float = math.nan
    how: str = ""


#: Presses that can be made, by their kinds.
PRESSES: Mapping[str, Usual] = MappingProxyType(
    {
        "repeat": Usual(10.0, "lift off, press again, both files saved"),
        "ball": Usual(20.0, "change the ball, find contact, press"),
        "force": Usual(12.0, "press again, and look at the sensor afterwards"),
        "capacitance": Usual(25.0, "connect the meter, open correction, press"),
        "specimen": Usual(150.0, "cast and electrode one more sensor on its padding, measure it under the microscope, press"),
        "padding": Usual(150.0, "the same on padding of another thickness"),
    }
)

#: Quantities that can be measured by themselves.
READINGS: Mapping[str, Usual] = MappingProxyType(
    {
        "sensor_thickness": Usual(20.0, "ten places", 8e-6, "measure the sensor thickness{of} by micrometer or microscope"),
        "padding_thickness": Usual(20.0, "ten places", 10e-6, "measure the padding thickness{of} by micrometer or microscope"),
        "dielectric_thickness": Usual(
            60.0, "a cut beside the electrode", 2e-6, "measure the dielectric's thickness{of} in a cut"
        ),
        "electrode_radius": Usual(15.0, "four diameters", 0.03e-3, "measure the electrode's radius under the microscope"),
        "sensor_radius": Usual(10.0, "four diameters", 0.03e-3, "measure the disc's radius under the microscope"),
        "indenter_radius": Usual(5.0, "three diameters by micrometer", 2e-6, "measure the ball's radius by micrometer"),
        "machine_compliance": Usual(15.0, "three slopes to full force", 0.1e-6, "press the ball onto bare steel"),
        "parasitic_capacitance": Usual(15.0, "leads and fixture without sensor", 0.1e-12, "measure the open fixture"),
        "displacement_gain": Usual(15.0, "three gauge blocks", 0.001, "hold the crosshead against gauge blocks"),
        "force_gain": Usual(20.0, "five dead weights", 0.0005, "check the load cell with dead weights"),
        "capacitance_gain": Usual(15.0, "one standard near the sensor's", 0.0002, "check the meter with a standard capacitor"),
    }
)

#: Radii of balls [m] that are at hand: bearing balls of 3, 6, 10 and 20 mm diameter.
BALLS = (1.5e-3, 3e-3, 5e-3, 10e-3)


@dataclass(frozen=True)
class Bench:
    """What a lab can measure next, how well, and how long it takes.

    Attributes
    ----------
    load_cell : [N], largest force that tester, load cell and sensor may see; None for twice the largest that was measured.
    balls : [m], radii at hand.
    paddings : [m], thicknesses that could be cast; None for none, half, twice and three times the measured one.
    minutes : kind of a press (`PRESSES`) or quantity (`READINGS`) -> minutes; what is not named takes its usual time.
    sds : quantity -> sd of reading it by itself, SI; what is not named its usual one.
    without : kinds and quantities that cannot be measured here.
    """

    load_cell: float | None = None
    balls: tuple[float, ...] = BALLS
    paddings: tuple[float, ...] | None = None
    minutes: Mapping[str, float] = field(default_factory=dict)
    sds: Mapping[str, float] = field(default_factory=dict)
    without: frozenset[str] = frozenset()

    def time(self, kind: str) -> float:
        """Minutes that a press of this kind, or the measurement of this quantity, takes here."""
        return self.minutes.get(kind, (PRESSES.get(kind) or READINGS[kind]).minutes)

    def sd(self, quantity: str) -> float:
        """How well a quantity is read by itself here, SI."""
        return self.sds.get(quantity, READINGS[quantity].sd)


def read_bench(path: Path | str) -> Bench:
    """Read what a lab can measure, and how long that takes.

    Parameters
    ----------
    path : TOML file in UTF-8, of which everything may be left out::

        load_cell = "10 N"                  # largest force for tester, load cell and sensor
        balls = ["1.5 mm", "5 mm"]          # radii
        paddings = ["0 mm", "3 mm"]
        without = ["dielectric_thickness"]  # what cannot be measured here
        [minutes]                           # of a kind of press, or of a quantity
        ball = 30
        sensor_thickness = 5
        [sd]                                # how well a quantity is read by itself
        sensor_thickness = "3 um"

    Raises
    ------
    InputError
        With every fault, each with line and column.
    """
    toml = read_toml(Path(path))
    check_keys(toml, (), ("load_cell", "balls", "paddings", "without", "minutes", "sd"))
    kinds = (*PRESSES, *READINGS)
    minutes, sds = {}, {}
    check_keys(toml, ("minutes",), kinds)
    for kind, value in table_at(toml, ("minutes",)).items():
        if isinstance(value, int | float) and not isinstance(value, bool) and _SHORTEST <= value < math.inf:
            minutes[kind] = float(value)
        else:
            toml.fault(("minutes", kind), f"minutes must be a number from {_SHORTEST:g} on, got {quoted(value)}")
    check_keys(toml, ("sd",), tuple(READINGS))
    for quantity in table_at(toml, ("sd",)):
        if quantity in READINGS:
            sds[quantity] = _positive(toml, ("sd", quantity), quantity)
            _not_a_slip(toml, quantity, sds[quantity])
    without = get(toml, ("without",)) or []
    if not isinstance(without, list) or any(kind not in kinds for kind in without):
        toml.fault(("without",), f"without must be a list of what cannot be measured, got {quoted(without)}", ", ".join(kinds))
        without = []
    paddings = _lengths(toml, "paddings", "padding_thickness")
    load_cell = _load(toml)
    balls = _lengths(toml, "balls", "indenter_radius")
    raise_faults(toml)
    return Bench(load_cell, BALLS if balls is None else balls, paddings, minutes, sds, frozenset(without))


def _load(toml: Toml) -> float | None:
    """What the load cell bears [N]; None where nothing is said, or nothing that can be."""
    at, given = ("load_cell",), get(toml, ("load_cell",))
    if given is None:
        return None
    try:
        force = parse_quantity(given, "N") if isinstance(given, str) else math.nan
    except ValueError as error:
        toml.fault(at, f"load_cell: {error}", 'Write load_cell = "10 N"')
        return None
    if not 0 < force <= _LARGEST_CELL:
        toml.fault(at, f"load_cell must be a force that a tester bears, got {quoted(given)}", 'Write load_cell = "10 N"')
        return None
    return force


def _positive(toml: Toml, at: KeyPath, quantity: str) -> float:
    value = quantity_at(toml, at, quantity)
    if value <= 0:
        toml.fault(at, f"{at[-1]} must be positive, got {quoted(get(toml, at))}")
    return value


def _not_a_slip(toml: Toml, quantity: str, sd: float) -> None:
    """Refuse a standard deviation that only a slip of the unit explains."""
    usual = READINGS[quantity].sd
    if sd > 0 and not 1 / _SLIP < sd / usual < _SLIP:
        at, given = ("sd", quantity), quoted(get(toml, ("sd", quantity)))
        far = f"{sd / usual:,.0f} times as little" if sd > usual else f"{usual / sd:,.0f} times as much"
        toml.fault(at, f"sd of {quantity} is {given}, and {display(quantity, usual)} is usual, {far}", "Check its unit")


def _lengths(toml: Toml, key: str, quantity: str) -> tuple[float, ...] | None:
    """Lengths in a list [m]; None where it is not given."""
    given = get(toml, (key,))
    if given is None:
        return None
    if not isinstance(given, list):
        toml.fault((key,), f"{key} must be a list of lengths, got {quoted(given)}", f'Write {key} = ["1.5 mm", "5 mm"]')
        return None
    return tuple(quantity_at(toml, (key, k), quantity) for k in range(len(given)))
