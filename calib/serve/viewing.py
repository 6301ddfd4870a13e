"""A run in, what its sensors do on any padding out, tabulated once and looked at many times; and a specification as a file."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from calib.decision import PLACE, Landscape, View, force_exceeded, landscape, largest_force, spans_in_words
from calib.errors import Fault, InputError
from calib.experiment import Limit, Limited, Side, Specification, quoted_text
from calib.files import sha256_of
from calib.quantity import parse_quantity
from calib.runs import Run, load_run, read_listing
from calib.serve.looking import Kept
from models.sensor import FloatArray

# A run is loaded in seconds and takes tens of megabytes.
_RUNS, _LANDSCAPES = Kept(3), Kept(4)
_ONE = threading.Lock()

# How often the range of the slider may be doubled.
_DOUBLED = 5

_T = TypeVar("_T")

#: Fields of the form of limits -> quantity, side, unit, and an example.
LIMITS: Mapping[str, tuple[Limited, Side, str, str]] = {
    "signal": ("signal", "at_least", "", "12 %"),
    "stroke": ("stroke", "at_most", "m", "1.9 mm"),
    "resolution": ("force_resolution", "at_most", "N", "20 mN"),
    "height": ("height", "at_most", "m", "7 mm"),
}

# How a value of each is written into a file: in which unit.
_WRITTEN: Mapping[Limited, tuple[float, str]] = {
    "signal": (1.0, ""),
    "stroke": (1e3, " mm"),
    "force_resolution": (1e3, " mN"),
    "height": (1e3, " mm"),
}


def run_in(folder: Path) -> Run:
    """Load a finished run, or remember it if neither its files nor those it was made from have changed.

    Parameters
    ----------
    folder : of the run.

    Raises
    ------
    InputError
        If there is no finished run that can be trusted.
    """
    names = ("posterior.nc", "run.json")
    listing = read_listing(folder)
    inputs = [] if listing is None else [path for entry in listing.inputs if (path := entry.found(folder)) is not None]
    marks = [(path, path.stat()) for path in (*(folder / name for name in names), *inputs) if path.is_file()]
    key = (str(folder), *((path, mark.st_mtime_ns, mark.st_size) for path, mark in marks))
    return _one_at_a_time(_RUNS, key, lambda: load_run(folder))


def landscape_of(run: Run, force: float, lower: float, upper: float) -> Landscape:
    """Table what the sensors of a run do up to a load, or remember it.

    Parameters
    ----------
    run : as loaded.
    force : [N], the largest load.
    lower, upper : [m], range of paddings.

    Raises
    ------
    InputError
        If the request makes no sense, or the model is not that of the calibration.
    """
    if run.another_forward:
        raise InputError(Fault(run.another_forward.rstrip("."), run.folder, advice="Calibrate again"))
    key = (run.posterior_sha256 or sha256_of(run.folder / "posterior.nc"), run.notes, force, lower, upper)

    def made() -> Landscape:
        return landscape(
            run.posterior, run.forward, force=force, lower=lower, upper=upper, verdict=run.verdict, members=run.members
        )

    return _one_at_a_time(_LANDSCAPES, key, made)


def _one_at_a_time(kept: Kept, key: Hashable, make: Callable[[], _T]) -> _T:
    """What a key stands for: made by one at a time, while who asks for what there is has it at once."""

    def made() -> _T:
        with _ONE:
            return kept.get(key, make)  # somebody may have made it meanwhile

    return kept.get(key, made)


def largest_load(run: Run) -> float:
    """Twice the largest load [N] that was measured, rounded up to what one says: as far as the slider goes by itself."""
    measured = 2 * largest_force(run.posterior)
    step = 10.0 ** (np.floor(np.log10(measured)) - 1)
    return round(float(np.ceil(measured / step) * step), 9)


def reaching(run: Run, force: float) -> float:
    """How far a slider goes [N] on which a load stands: as far as by itself, or doubled as often as it takes.

    Parameters
    ----------
    run : as loaded.
    force : [N], the load.

    Raises
    ------
    InputError
        If the load is none, or so far beyond what was measured that nothing is to be seen there.
    """
    most, measured = largest_load(run), largest_force(run.posterior)
    if not 0 < force <= most * 2**_DOUBLED:
        times = f", {force / measured:.3g} times what was measured ({measured:.2g} N)" if force > 0 else ""
        advice = f"Give one of {most / 100:.2g} to {most * 2**_DOUBLED:.4g} N, or press a sensor that far and calibrate with it"
        raise InputError(Fault(f"there is nothing to be seen at a load of {force:.6g} N{times}", advice=advice))
    while most < force:
        most *= 2
    return most


def beyond_in_words(run: Run, force: float) -> str:
    """How far a load is beyond what was measured, as on the console; "" within it.

    Parameters
    ----------
    run : as loaded.
    force : [N], the load.
    """
    return force_exceeded(force, largest_force(run.posterior))


def limits_from(form: Mapping[str, str]) -> list[Limit]:
    """Limits as a form gives them; empty fields are none.

    Parameters
    ----------
    form : name of a field of `LIMITS` -> text with its unit.

    Raises
    ------
    InputError
        With every field that is no quantity.
    """
    found: list[Limit] = []
    faults: list[Fault] = []
    for name, (quantity, side, unit, example) in LIMITS.items():
        if text := form.get(name, "").strip():
            try:
                value = _share(text) if not unit else parse_quantity(text, unit)
            except ValueError as error:
                faults.append(Fault(f"{name}: {error}", advice=f"Write for example {example}"))
                continue
            if value > 0:
                found.append(Limit(quantity, side, value))
            else:
                faults.append(Fault(f"{name} must be positive, got {text}", advice=f"Write for example {example}"))
    if faults:
        raise InputError(faults)
    return found


def form_of_asked(force: float, specification: Specification | None) -> dict[str, str]:
    """Fields of a form that asks for the same, as far as it has fields for that.

    Parameters
    ----------
    force : [N], the load.
    specification : that holds at it; None for the largest signal.
    """
    found = {"force": f"{force:.6g} N"}
    if specification is None:
        return found
    for limit in specification.limits:
        for name, (quantity, side, unit, _) in LIMITS.items():
            if (limit.quantity, limit.side) == (quantity, side) and limit.at in (None, force):
                scale, shown = _WRITTEN[quantity]
                found[name] = f"{limit.value * scale:.9g}{shown}" if unit else f"{limit.value * 100:.9g} %"
    tolerance = specification.padding_tolerance
    if tolerance is not None and tolerance.kind == "uniform":
        found["tolerance"] = f"{tolerance.size * 1e3:.9g} mm"
    return found


def _share(text: str) -> float:
    """A share such as "12 %" or "0.12"."""
    return parse_quantity(text.removesuffix("%").strip(), "") / 100 if text.endswith("%") else parse_quantity(text, "")


def quantity(form: Mapping[str, str], name: str, unit: str, otherwise: float) -> float:
    """A quantity of a form.

    Parameters
    ----------
    form : name -> text.
    name : of the field.
    unit : SI.
    otherwise : if it is empty.

    Raises
    ------
    InputError
        If it is none.
    """
    text = form.get(name, "").strip()
    if not text:
        return otherwise
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(Fault(f"{name}: {error}")) from None


def view_plain(land: Landscape, view: View, limits: Sequence[Limit]) -> dict[str, Any]:
    """What a page draws of a view, in units of display; what is not covered is null.

    Parameters
    ----------
    land : that it is of.
    view : that is seen.
    limits : that it was asked with.
    """

    def plain(values: FloatArray, scale: float) -> Any:
        shown = np.where(np.isfinite(values), values * scale, np.nan)
        return [[None if x != x else round(x, 6) for x in row] for row in shown.tolist()]

    first, last = float(view.thickness[0]), float(view.thickness[-1])
    # At every place of the slider: what is said of a padding is said of that very one.
    each = land.verdicts(view, np.linspace(first, last, round((last - first) / PLACE) + 1))
    one = [None if x != x else round(x, 4) for x in view.conforming.tolist()]
    return {
        "force": view.force,
        "thickness": [round(x, 6) for x in (view.thickness * 1e3).tolist()],
        "covered": view.covered.tolist(),
        "spans": spans_in_words(view.thickness, view.covered) if view.covered.any() else "",
        "signal": plain(view.change, 1e2),
        "stroke": plain(view.depth, 1e3),
        "resolution": plain(view.resolution, 1e3),
        "height": plain(view.height, 1e3),
        "conforming": one,
        "limits": [limit.in_words for limit in limits],
        "fails": plain(view.fails, 1.0),
        "colour": [verdict.colour for verdict in view.verdict],
        "step": PLACE * 1e3,
        "light": [verdict.colour for verdict in each],
        "reason": [next((r.in_words for r in verdict.reasons), "") for verdict in each],
    }


def specification_text(
    force: float, limits: Sequence[Limit], lower: float, upper: float, tolerance: float, probability: float
) -> str:
    """A specification file that asks for what the sliders stand at.

    Parameters
    ----------
    force : [N], the load.
    limits : that hold at it.
    lower, upper : [m], paddings to choose from.
    tolerance : [m], of pads, anywhere within plus or minus; 0 for none.
    probability : of conforming that is asked for.

    Raises
    ------
    InputError
        If nothing is limited.
    """
    if not limits:
        raise InputError(Fault("a specification limits something", advice="Give a least signal, or another limit"))
    lines = ["# Written by the padding page of `calib serve`.", 'name = "From the page"', f"probability = {probability:.6g}"]
    lines += ["[loads]", f'force = ["{force:.6g} N"]', "[limits]"]
    for limit in limits:
        scale, unit = _WRITTEN[limit.quantity]
        value = f"{limit.value * scale:.9g}{unit}"
        lines.append(f"{limit.quantity} = {{ {limit.side} = {quoted_text(value) if unit else value} }}")
    lines += ["[padding]", f'thickness = ["{lower * 1e3:.6g} mm", "{upper * 1e3:.6g} mm"]']
    lines += [f'tolerance = {{ uniform = "{tolerance * 1e3:.6g} mm" }}'] if tolerance > 0 else []
    return "\n".join(lines) + "\n"
