"""Tables of a gripper in, the texts of the files that its firmware, its robot and its simulator need out."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from calib.decision import LEVEL, N_ROW, WIDTH_IN_SD, ForceTable, GripperTables, Status
from calib.digits import places_of, range_text
from calib.errors import Fault, InputError, in_shell
from calib.provenance import PROGRAM
from calib.records import record_from_text, record_to_text
from calib.report.environment import template_text
from calib.report.status import status_in_words
from calib.visible import visible
from models.sensor import FloatArray

_KIND, _FORMAT = "force tables", 1
# Most letters of an identifier; C99 tells 63 apart.
_LONGEST = 40
# Bytes of a number in a table, and numbers of it beside its rows.
_BYTES, _COLUMNS, _LIMITS = 4, 4, 4
# Numbers in a line of a file.
_IN_LINE = 8
_PPB, _MICRO, _PICO, _FEMTO = 1e9, 1e6, 1e12, 1e15
_LARGEST_INTEGER = 2**31 - 1


def gripper_files(made: GripperTables) -> dict[str, str]:
    """Write what a gripper needs of a calibration, ready to be compiled, imported or read.

    Parameters
    ----------
    made : from `calib.decision.invert`; its verdict must not be red.

    Returns
    -------
    Name of a file -> its text: tables as C99 header, Python, CSV and JSON, simulated taxels as JSON, and how to use them.

    Raises
    ------
    InputError
        If the verdict is red: firmware does not read warnings; or if forces are too large for the integers of the header.
    """
    if "red" in (made.verdict.colour, *(table.verdict.colour for table in made.tables)):
        advice = "Settle what is red first"
        raise InputError(Fault("a verdict on these tables is red: their numbers must not be used", advice=advice))
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(template_text),
        autoescape=False,  # none of these is a page
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    about = tuple(_about(made))
    whose = next((k for k, table in enumerate(made.tables) if table.sensor == "design"), 0)
    tables = [_laid_out(table, name) for table, name in zip(made.tables, _identifiers(made.tables), strict=True)]
    size = _BYTES * (_COLUMNS * N_ROW + _LIMITS)
    context = {
        "n_tare": made.gripper.n_tare,
        "percent": f"{LEVEL * 100:g} %",
        "width": f"{WIDTH_IN_SD:g}",
        "width_thousandths": round(1000 * WIDTH_IN_SD),
        "n_row": N_ROW,
        "bytes_float": size,
        "bytes_integer": size,
        "options": _options(made, made.tables[whose]),
    }

    def rendered(template: str, write: Callable[[str], str] = str) -> str:
        shown = {**context, "about": [write(line) for line in about], "title": write(_line(made.experiment))}
        of = {"quoted": tables[whose].quoted, "identifier": tables[whose].identifier}
        return environment.get_template(template).render(shown, of=of, tables=[_written(table, write) for table in tables])

    return {
        "force_tables.h": rendered("force_tables.h.j2", _in_comment),
        "force_tables.py": rendered("force_tables.py.j2"),
        "force_tables.csv": _csv(made, about),
        "force_tables.json": _json(made, tables),
        "taxels.json": _taxels(made, tables),
        "README.md": rendered("gripper.md.j2", _in_markdown),
    }


def _options(made: GripperTables, table: ForceTable) -> str:
    """The options of `calib force` with which it reads this table."""
    asked = made.gripper
    leads = None if asked.parasitic is None else ", ".join(f"{c * 1e12:.10g} pF" for c in asked.parasitic)
    said = {
        "--padding": None if asked.padding is None else f"{asked.padding * 1e3:.10g} mm",
        "--sensor": None if table.sensor == "design" else table.name,
        "--force": None if asked.force is None else f"{asked.force:.10g} N",
        "--parasitic": leads,
        "--noise": None if asked.noise is None else f"{asked.noise * 1e15:.10g} fF",
    }
    return "".join(f" {option} {in_shell(value)}" for option, value in said.items() if value is not None)


def force_tables_from_json(text: str, path: Path) -> dict[str, Any]:
    """Read the content of a force_tables.json again, plain values in SI, to show what it is of.

    Parameters
    ----------
    text : of the file.
    path : of it, for the refusal.

    Raises
    ------
    InputError
        If it is not as it was written.
    """
    try:
        return record_from_text(_KIND, _FORMAT, text)
    except ValueError as error:
        raise InputError(Fault(f"cannot be read: {error}", path, advice="Export the run again")) from None


def reading_in_words(table: ForceTable, reading: tuple[str, float], tare: tuple[str, float]) -> str:
    """Say what force one reading of one sensor means, with its bounds, or why it means none.

    Parameters
    ----------
    table : of the sensor.
    reading, tare : as somebody wrote them, and in [F].
    """
    found = table.force_at(reading[1], tare[1])
    force, lower, upper = float(found.force), float(found.lower), float(found.upper)
    places = places_of(upper - lower) if upper > lower else 3
    low, middle, high, last = (f"{x:.{places}f}" for x in (lower, force, upper, table.largest))
    meant = {
        Status.VALID: f"{middle} N ({LEVEL * 100:g} %: {low} to {high} N)",
        Status.NO_CONTACT: f"no contact that noise would not explain as well; at most {high} N",
        Status.BEYOND_RANGE: f"at least {low} N, and how much more is not known: the table ends at {last} N",
        Status.BELOW_REST: "nothing, as it is farther below rest than noise explains: tared under load, or drifted; tare again",
    }
    words = meant.get(Status(int(found.status)), "nothing: reading and tare must be positive")
    return f"{table.name}, {reading[0]} with a tare of {tare[0]}: {words}."


def range_in_words(table: ForceTable, tare: float) -> str:
    """Say between what a reading of one sensor means a force, at a tare.

    Parameters
    ----------
    table : of the sensor.
    tare : [F], c0.
    """
    first, last = (tare * (1 + r) * 1e12 for r in (table.touch, float(table.ratio[-1])))
    return f"{range_text(first, last)} pF at this tare, which are {_forces(table)} N"


def _forces(table: ForceTable) -> str:
    return range_text(float(np.interp(table.touch, table.ratio, table.force)), table.largest)


@dataclass(frozen=True)
class _LaidOut:
    """A table as the templates take it: everything is text."""

    title: str
    quoted: str
    identifier: str
    about: tuple[str, ...]
    conditions: tuple[str, ...]
    reasons: tuple[str, ...]
    colour: str
    range_ppm: str
    range_force: str
    floats: tuple[tuple[str, ...], ...]
    limits: tuple[str, ...]
    integers: tuple[tuple[str, ...], ...]
    integer_limits: tuple[str, ...]
    numbers: tuple[tuple[str, ...], ...]
    number_limits: tuple[str, ...]


def _written(table: _LaidOut, write: Callable[[str], str]) -> _LaidOut:
    """A table with its texts written as a format takes them."""
    about, conditions, reasons = (tuple(map(write, lines)) for lines in (table.about, table.conditions, table.reasons))
    return replace(table, title=write(table.title), about=about, conditions=conditions, reasons=reasons)


def _laid_out(table: ForceTable, identifier: str) -> _LaidOut:
    columns = (table.ratio, table.force, table.lower, table.upper)
    limits = (table.below, table.touch)
    of_tare = [c * _PICO for c in table.tare_limits]
    scales = (_PPB, _MICRO, _MICRO, _MICRO)
    if table.end * _MICRO > _LARGEST_INTEGER or table.ratio[-1] * _PPB > _LARGEST_INTEGER:
        message = f"{table.name}: {table.end:.6g} N at {table.ratio[-1]:.3g} times the tare is more than a table holds"
        raise InputError(Fault(message, advice="Ask for a smaller --force"))
    conditions = tuple(_line(text) for text in table.conditions)
    reasons = tuple(_line(f"{r.level}, {r.gate}: {r.in_words}") for r in table.verdict.reasons)
    title = _line(table.name)
    ppm = f"{table.touch * 1e6:.0f} to {table.ratio[-1] * 1e6:.0f}"
    forces = _forces(table)
    range_ = f"valid: readings of {ppm} ppm above the tare, forces of {forces} N"
    expected = f"tare to be expected: {table.tare_in_words}"
    return _LaidOut(
        title=title,
        quoted=ascii(table.name),
        identifier=identifier,
        about=(title, *conditions, range_, expected, status_in_words(table.verdict, "the table"), *reasons),
        conditions=(*conditions, range_, expected),
        reasons=reasons,
        colour=table.verdict.colour,
        range_ppm=ppm,
        range_force=forces,
        floats=tuple(_lines([f"{x:.8e}f" for x in column]) for column in columns),
        limits=tuple(f"{x:.8e}f" for x in (*limits, *of_tare)),
        integers=tuple(
            _lines([str(n) for n in _integers(column, scale)]) for column, scale in zip(columns, scales, strict=True)
        ),
        integer_limits=tuple(str(n) for n in (*_integers(limits, _PPB), *_integers(table.tare_limits, _FEMTO))),
        numbers=tuple(_lines([f"{x:.12g}" for x in column]) for column in columns),
        number_limits=tuple(f"{x:.12g}" for x in (*limits, *of_tare)),
    )


def _integers(column: FloatArray | Sequence[float], scale: float) -> list[int]:
    return [round(float(x) * scale) for x in column]


def _lines(numbers: Sequence[str]) -> tuple[str, ...]:
    """Numbers, so many in a line."""
    return tuple(", ".join(numbers[k : k + _IN_LINE]) for k in range(0, len(numbers), _IN_LINE))


def _about(made: GripperTables) -> Iterator[str]:
    """What every file says of itself: whether it may be used, and where it comes from."""
    yield _line(status_in_words(made.verdict, "the tables"))
    for reason in made.verdict.reasons:
        yield _line(f"{reason.level}, {reason.gate}: {reason.in_words}")
    versions = dict(made.versions)
    package = versions.get(PROGRAM, "unknown")
    yield f"Made by calib export (calib {package}) from the run {made.fingerprint or 'without a fingerprint'}"
    yield f"(posterior.nc: SHA-256 {made.posterior_sha256 or 'not kept'}; {_line(made.forward_name)}; seed {made.seed})."


def _csv(made: GripperTables, about: Sequence[str]) -> str:
    """All tables, row by row, below lines that begin with #."""
    lines = [f"# {line}" for line in about]
    for table in made.tables:
        lines += [f"# {_line(table.name)}: {line}" for line in (*map(_line, table.conditions), table.verdict.colour)]
        lines += [f"# {_line(table.name)}: {_line(f'{r.level}, {r.gate}: {r.in_words}')}" for r in table.verdict.reasons]
    lines.append("sensor,ratio,force_N,lower_N,upper_N,sigma_N")
    for table in made.tables:
        name = '"' + _line(table.name).replace('"', '""') + '"'
        columns = (table.ratio, table.force, table.lower, table.upper, table.sigma)
        lines += [f"{name},{','.join(f'{x:.9g}' for x in row)}" for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"


def _origin(made: GripperTables) -> dict[str, Any]:
    return {
        "verdict": made.verdict.to_plain(),
        "experiment": made.experiment,
        "fingerprint": made.fingerprint,
        "posterior_sha256": made.posterior_sha256,
        "draws_sha256": made.draws_sha256,
        "versions": dict(made.versions),
        "forward_name": made.forward_name,
        "seed": made.seed,
        "gripper": asdict(made.gripper),
    }


def _of_table(table: ForceTable, laid_out: _LaidOut) -> dict[str, Any]:
    return {
        "name": table.name,
        "identifier": laid_out.identifier,
        "sensor": table.sensor,
        "verdict": table.verdict.to_plain(),
        "conditions": table.conditions,
        "padding_thickness_m": table.padding_thickness,
        "indenter_radius_m": table.indenter_radius,
    }


def _json(made: GripperTables, laid_out: Sequence[_LaidOut]) -> str:
    tables = [
        {
            **_of_table(table, as_text),
            "below": table.below,
            "touch": table.touch,
            "rated_N": table.rated,
            "end_N": table.end,
            "looked_N": table.looked,
            "turn_N": table.turn,
            "rest_capacitance_F": table.rest_capacitance,
            "tare_F": table.tare,
            "tare_limits_F": table.tare_limits,
            "parasitic_F": table.parasitic,
            "noise_F": table.noise,
            "ratio": table.ratio,
            "force_N": table.force,
            "lower_N": table.lower,
            "upper_N": table.upper,
            "sigma_N": table.sigma,
            "unloading": _retreat(table),
        }
        for table, as_text in zip(made.tables, laid_out, strict=True)
    ]
    status = {"valid": 0, "no contact": 1, "beyond range": 2, "below rest": 3, "bad input": 4}
    input_ = "capacitance over the tare, the mean of readings without contact, minus 1"
    content = {**_origin(made), "input": input_, "level": LEVEL, "interpolation": "linear", "status": status, "tables": tables}
    return record_to_text(_KIND, _FORMAT, content)


def _taxels(made: GripperTables, laid_out: Sequence[_LaidOut]) -> str:
    """What a simulator needs of a sensor: a contact stiffness, a gain and a noise; what is not known of it is null."""
    taxels = []
    for table, as_text in zip(made.tables, laid_out, strict=True):
        points = [
            {
                "force_N": p.force,
                "depth_m": p.depth,
                "stiffness_N_per_m": p.stiffness[0],
                "stiffness_interval_90": p.stiffness[1:],
                "ratio": p.ratio,
                "gain_per_N": p.gain[0],
                "gain_interval_90": p.gain[1:],
                "capacitance_gain_F_per_N": p.capacitance_gain,
                "noise_sd_N": p.noise,
                "force_sd_N": p.sigma,
            }
            for p in table.points
        ]
        taxels.append(
            {
                **_of_table(table, as_text),
                "rest_capacitance_F": table.rest_capacitance[1],
                "noise_sd_F": table.noise,
                "threshold_N": float(np.interp(table.touch, table.ratio, table.force)),
                "saturation_N": table.largest,
                "working_points": points,
                "hysteresis": _retreat(table),
                "relaxation": None,
                "temperature": None,
            }
        )
    return record_to_text("simulated taxels", _FORMAT, {**_origin(made), "taxels": taxels})


def _retreat(table: ForceTable) -> dict[str, Any] | None:
    """Force on unloading less that on loading at the same reading, as shares of the largest; None where it was not measured."""
    band = table.retreat
    if band is None:
        return None
    return {
        "share_of_largest": band.share,
        "low": band.low,
        "high": band.high,
        "from_N": band.peak,
        "hold_s": band.hold,
        "measured_on": band.of,
    }


def _identifiers(tables: Sequence[ForceTable]) -> list[str]:
    """Names of C for tables, none twice."""
    found: list[str] = []
    for table in tables:
        plain = unicodedata.normalize("NFKD", table.name).encode("ascii", "ignore").decode()
        words = re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_")[:_LONGEST].strip("_")
        name, n = f"force_of_{words or 'sensor'}", 2
        while name in found or any(f"{other}_int" == name or other == f"{name}_int" for other in found):
            name, n = f"force_of_{words or 'sensor'}_{n}", n + 1
        found.append(name)
    return found


def _line(text: str) -> str:
    """A text as a part of one line that any editor shows as it is."""
    return " ".join(visible(text).split())


def _in_comment(text: str) -> str:
    """A line that a comment of C can hold: it neither ends it, nor begins another, nor is a trigraph."""
    plain = text.encode("ascii", "backslashreplace").decode("ascii")
    return plain.replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?").rstrip("\\")


def _in_markdown(text: str) -> str:
    """A line that Markdown shows as it is."""
    return re.sub(r"([\\`*_{}\[\]<>|#])", r"\\\1", text)
