"""Commands on lab files: `init` makes an experiment file from them, `read` shows what was understood of one."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import err, out, refusing_bad_input, say, write_whole
from calib.errors import Fault, InputError

if TYPE_CHECKING:
    from calib.instruments import LabTable
    from calib.observations import Observations


def read(
    file: Annotated[Path, typer.Argument(help="A file of a testing machine or an LCR meter (CSV, TSV, TXT).")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write every row as CSV in SI, with branch, used and reason.")
    ] = None,
) -> None:
    """Show what is understood of one lab file, before anything is done with it.

    Prints instrument, columns with their units, ranges, signs, and which rows are used and why the others are not. Compression
    is positive; nothing is re-zeroed.

    Example: `calib read sensor1_instron.csv -o observations.csv`

    Writes, with -o: columns time_s, displacement_m, force_N, capacitance_F (those the file has), branch (loading, unloading,
    hold), used, reason.

    Exit codes: 0 understood; 2 not understood, the message says where and what to do.
    """
    with refusing_bad_input():
        from calib.instruments import read_lab_file
        from calib.observations import observations_frame, observe

        if output is not None and output.exists() and file.exists() and output.samefile(file):
            raise InputError(Fault("the output would overwrite the lab file itself", output, advice="Choose another -o"))
        observations = observe(read_lab_file(file))
        if output is not None:
            write_whole(output, observations_frame(observations).to_csv(index=False, lineterminator="\n"))
        _show(observations)
        if output is not None:
            say(f"Written: {output}")


def init(
    files: Annotated[
        list[Path], typer.Argument(help="Lab files: one or two per specimen, force and capacitance in any order.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="The experiment file to write; never overwritten.")] = Path(
        "experiment.toml"
    ),
) -> None:
    """Write a commented experiment file for a set of lab files.

    Force files and capacitance files are told apart by their columns and paired by their names. What the files cannot tell
    (ball, disc, thicknesses of each specimen) is written with wide guesses and marked EDIT: put your own measurements there,
    they matter.

    Example: `calib init sensor1_instron.csv sensor1_lcr.csv -o experiment.toml`

    Writes: the experiment file. Next: edit it, then `calib calibrate experiment.toml -o run1`.

    Exit codes: 0 written; 2 a file was not understood, or the experiment file exists.
    """
    with refusing_bad_input():
        from calib.instruments import read_lab_file

        if output.exists():
            raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
        tables: list[LabTable] = []
        faults: list[Fault] = []
        for file in dict.fromkeys(files):
            try:
                tables.append(read_lab_file(file))
            except InputError as error:
                faults += error.faults
        if faults:
            raise InputError(faults)
        specimens = pair(tables)
        write_whole(output, experiment_text(specimens, output.absolute().parent))
        for name, force, capacitance in specimens:
            parts = [f"force {force.path.name}"] if force else []
            parts += [f"capacitance {capacitance.path.name}"] if capacitance else []
            say(f"{name}: {', '.join(parts)}")
        say(f"Written: {output}. Edit the lines marked EDIT, then: calib calibrate {output} -o run1")


Pairing = tuple[str, "LabTable | None", "LabTable | None"]

# Words in file names that tell instruments apart, not specimens.
_INSTRUMENT_WORDS = re.compile(
    r"(?<![a-z])(instron|bluehill|zwick|tester|lcr|hioki|keysight|agilent|capacitance|capacity|cap|force|load|displacement|indentation|"
    r"specimen_?rawdata|raw_?data|data|log|fd|cf)(?![a-z])",
    re.IGNORECASE,
)


def pair(tables: Sequence[LabTable]) -> list[Pairing]:
    """Specimens as (name, force file, capacitance file) from what the files hold and how they are called.

    Raises
    ------
    InputError
        If a file holds neither force over displacement nor capacitance.
    """
    both = [t for t in tables if {"force", "displacement", "capacitance"} <= set(t.columns)]
    lcr = [t for t in tables if "capacitance" in t.columns and t not in both]
    tester = [t for t in tables if {"force", "displacement"} <= set(t.columns) and t not in both]
    faults = [
        Fault(
            f"has neither force over displacement nor capacitance (found {', '.join(t.columns) or 'no known column'})",
            t.path,
            advice="Leave it out, or name its columns so that they are recognised (see `calib read`)",
        )
        for t in tables
        if not any(t is other for other in (*both, *lcr, *tester))
    ]
    if faults:
        raise InputError(faults)
    found: list[tuple[LabTable | None, LabTable | None]] = [(t, t) for t in both]
    similar = sorted(
        (
            (difflib.SequenceMatcher(None, _key(a), _key(b)).ratio(), i, j)
            for i, a in enumerate(tester)
            for j, b in enumerate(lcr)
        ),
        key=lambda s: (-s[0], s[1], s[2]),
    )
    partner: dict[int, int] = {}
    for likeness, i, j in similar:
        # A single file of each kind belongs together whatever it is called; among several the names must agree.
        enough = likeness > 0.999 or (likeness > 0.6 and _digits(tester[i]) == _digits(lcr[j])) or len(tester) == len(lcr) == 1
        if enough and i not in partner and j not in partner.values():
            partner[i] = j
    found += [(t, lcr[partner[i]] if i in partner else None) for i, t in enumerate(tester)]
    found += [(None, c) for j, c in enumerate(lcr) if j not in partner.values()]
    names = [_name(a or b, n) for n, (a, b) in enumerate(found, 1)]
    unique = [n if names.count(n) == 1 else f"{n} {k}" for k, n in enumerate(names, 1)]
    return [(n, a, b) for n, (a, b) in zip(unique, found, strict=True)]


def experiment_text(specimens: Sequence[Pairing], folder: Path) -> str:
    """Text of an experiment file, with lab files relative to `folder`."""
    blocks = []
    for name, force, capacitance in specimens:
        lines = ["[[specimens]]", f"name = {_quoted(name)}"]
        if force is not None:
            lines.append(f"force = {_quoted(_relative(force.path, folder))}   # {force.recognised_as}")
        if capacitance is not None:
            lines.append(f"capacitance = {_quoted(_relative(capacitance.path, folder))}   # {capacitance.recognised_as}")
        if force is None and capacitance is not None and not {"force", "displacement"} & set(capacitance.columns):
            lines.append('# EDIT: nothing ties this capacitance file to force; add force = "..." of the same press')
        lines += [
            "[specimens.priors]",
            "# EDIT: your microscope's reading and its sd",
            'sensor_thickness = { lognormal = ["0.8 mm", 1.5] }    # e.g. { normal = ["0.74 mm", "0.02 mm"] }',
            'padding_thickness = { lognormal = ["1.1 mm", 1.5] }   # e.g. { normal = ["1.10 mm", "0.03 mm"] }',
        ]
        blocks.append("\n".join(lines))
    return _HEAD + "\n" + "\n\n".join(blocks) + "\n"


_HEAD = """\
# Experiment file for `calib calibrate`. Quantities carry units ("0.74 mm"). Lines marked EDIT hold guesses: put your values.

name = "Padded sensor"        # EDIT: heading of the report
# model = "surrogate"         # "surrogate" (default), "fem" (slow) or "closed form" (rough)
# discrepancy = "on"          # "on" (default): the model may be a little wrong along a sweep; "off": noise only

[indenter]
radius = "5 mm"               # EDIT: radius of the ball, half its diameter
# friction_coefficient = "stick"     # 0 (default): the ball slides freely; "stick": the sensor sticks to it

[sensor]
radius = "10 mm"              # EDIT: radius of the disc
# law = "gent"                # "neo-hookean" (default); "gent": stiffens when stretched far, by an unknown of its own
# electrode_radius = "9 mm"   # if the electrodes are smaller than the disc; the capacitance change depends on it
# dielectric_thickness = "0.16 mm"   # of each of the two, if it is not half the sensor

[padding]
material = "sensor"           # "sensor": padding of the same silicone; "own": another one, with a modulus of its own

# What is known before the data, shared by all specimens. Forms: { normal = [mean, sd] }, { lognormal = [median, factor] },
# { halfnormal = scale }, { uniform = [low, high] }, { truncated_normal = [mean, sd, low, high] }, { fixed = value }.
# What is left out gets a documented default, shown in the report.
[priors]
young_modulus = { lognormal = ["0.8 MPa", 1.8] }         # EDIT if the datasheet says more
relative_permittivity = { normal = [2.8, 0.2] }          # unfilled silicone at 1 kHz
# machine_compliance = { halfnormal = "2 um/N" }         # crosshead travel per force with nothing soft in between
# parasitic_capacitance = { normal = ["0 pF", "0.5 pF"] }  # what is left after the open correction of the LCR meter

# One block per specimen. Thicknesses matter more than anything else here: measure them.
"""


def _show(o: Observations) -> None:
    from rich.table import Table

    table, console = o.table, out()
    say(f"{table.path.name}: {table.recognised_as} ({table.reason})")
    n_used = int(o.used.sum())
    mark = {",": "comma", ".": "point"}.get(table.decimal, table.decimal)
    say(f"{len(o.used)} rows, {n_used} used; encoding {table.encoding}, decimal {mark}")
    shown = Table("quantity", "column in the file", "smallest", "largest", "unit")
    rows = (
        ("time", o.time, 1.0, "s"),
        ("displacement", o.displacement, 1e3, "mm"),
        ("force", o.force, 1.0, "N"),
        ("capacitance", o.capacitance, 1e12, "pF"),
    )
    for name, values, scale, unit in rows:
        if values is not None:
            finite = values[values == values] * scale
            ends = (f"{finite.min():.6g}", f"{finite.max():.6g}") if finite.size else ("-", "-")
            shown.add_row(name, table.sources.get(name, ""), *ends, unit)
    console.print(shown)
    branches = [f"{b or 'unknown'} {o.branch.count(b)}" for b in dict.fromkeys(o.branch)]
    if any(o.branch):
        say(f"rows by branch: {', '.join(branches)}")
    reasons = [r for r in o.reason if r]
    for reason in dict.fromkeys(reasons):
        say(f"not used: {reasons.count(reason)} rows, {reason}")
    for note in (o.sign_note, *table.notes):
        if note:
            say(f"note: {note}")
    if n_used == 0:
        err().print("No row can be used for a calibration.", style="yellow")


def _key(table: LabTable) -> str:
    return re.sub(r"[^a-z0-9]+", " ", _INSTRUMENT_WORDS.sub(" ", table.path.stem.lower())).strip()


def _digits(table: LabTable) -> list[str]:
    return re.findall(r"\d+", _key(table))


def _name(table: LabTable | None, number: int) -> str:
    kept = _INSTRUMENT_WORDS.sub(" ", table.path.stem) if table is not None else ""
    return re.sub(r"[ _-]*\s[ _-]*", " ", kept).strip(" _-") or f"specimen {number}"


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path.absolute(), folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
