"""Commands on lab files: `init` makes an experiment file from them, `read` shows what was understood of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from calib.cli.common import out, refusing_bad_input, say
from calib.errors import Fault, InputError
from calib.files import require_writable, write_text

if TYPE_CHECKING:
    from calib.experiment import Looked, Pressed
    from calib.lab import Observations, Use


def read(
    file: Annotated[Path, typer.Argument(help="A file of a testing machine or an LCR meter: text, workbook, LVM, TDMS, MAT.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write every row as CSV in SI, with branch, cycle, used and reason.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw what was understood (.png, .svg, .pdf).")] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(metavar="QUANTITY=UNIT", help="Unit to use instead of what the file says: --units force=kN. Repeatable."),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY=COLUMN",
            help='Column that holds a quantity, by its header or number from 1: --columns "force=Load 2". Repeatable.',
        ),
    ] = None,
    specimen: Annotated[int | None, typer.Option(min=1, help="Which of several specimens in the file.")] = None,
    where: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN=VALUE",
            help='Read only rows that hold this value in a column: --where "Frequency (Hz)=1000". Repeatable.',
        ),
    ] = None,
    sheet: Annotated[
        str,
        typer.Option(
            help="Which sheet of a workbook, group of a TDMS file or variable of a MAT file [default: the one that fits]."
        ),
    ] = "",
    sign: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[QUANTITY=]SENSE",
            help='Which way compression is in force and displacement: --sign "compression negative" for both, or --sign '
            '"force=compression positive" for one. Repeatable.',
        ),
    ] = None,
    scale: Annotated[
        str, typer.Option(help="micro, for instruments of nanometres and micronewtons, whose readings are too small otherwise.")
    ] = "",
    decimal: Annotated[str, typer.Option(help='The decimal mark, "." or ",", where the file leaves it open.')] = "",
    max_force: Annotated[
        str | None,
        typer.Option(metavar="QUANTITY", help='Use rows up to this force, its zero not taken off: --max-force "5 N".'),
    ] = None,
    max_depth: Annotated[
        str | None,
        typer.Option(
            metavar="QUANTITY",
            help='Use rows up to this depth, counted from where contact is estimated to begin: --max-depth "0.8 mm".',
        ),
    ] = None,
    branch: Annotated[
        str | None, typer.Option(help="The branch that is used: loading or unloading [default: loading].")
    ] = None,
    cycles: Annotated[
        str | None,
        typer.Option(metavar="NUMBERS", help="The cycles that are used together: --cycles 2,3 [default: the first]."),
    ] = None,
) -> None:
    """Show what is understood of one lab file, before anything is done with it.

    Prints what the file was recognised as and why, encoding, delimiter and decimal mark, columns with their units and ranges,
    signs and what they rest on, branches and cycles, which rows are used and why the others are not, what of the file is not
    read, noise and resolution of each channel, and grades on the quality of the data. Compression is positive; nothing is
    re-zeroed.

    What is said here of a file and of the part that is used is said with the same words in an experiment file:
    force = { file = "press.csv", sign = "compression negative" } and use = { max_force = "5 N", cycles = [2, 3] }.

    Example: `calib read sensor1_instron.csv -o observations.csv --picture sensor1.png`

    Example: `calib read press.csv --sign "compression negative" --max-depth "0.8 mm" --cycles 2,3`

    Writes, with -o: columns time_s, displacement_m, force_N, capacitance_F (those the file has), branch (loading, unloading,
    hold), cycle, used, reason.

    Exit codes: 0 understood; 2 not understood, or without a row that can be used; the message says where and what to do.
    """
    with refusing_bad_input():
        from calib.files import whole_file
        from calib.lab import Reading, nothing_used, observe, read_lab_file

        for target, option in ((output, "-o"), (picture, "--picture")):
            if target is None:
                continue
            if target.exists() and file.exists() and target.samefile(file):
                raise InputError(
                    Fault("the output would overwrite the lab file itself", target, advice=f"Choose another {option}")
                )
            require_writable(target, f"Create it, or choose another {option}")
        if picture is not None and picture.suffix.lower() not in (".png", ".svg", ".pdf"):
            raise InputError(Fault("a picture ends in .png, .svg or .pdf", picture))
        use = _use({"max_force": max_force, "max_depth": max_depth, "branch": branch, "cycles": cycles})
        reading = Reading(
            _assignments(units, "--units"),
            _assignments(columns, "--columns"),
            specimen,
            _where(where),
            sheet,
            _sign(sign),
            _one_of(scale, "--scale", ("micro",)),
            _one_of(decimal, "--decimal", (".", ",")),
        )
        observations = observe(read_lab_file(file, reading), use)
        if not observations.used.any():
            _show(observations)
            raise InputError(nothing_used(observations))
        if picture is not None:
            from calib.report import any_letters, file_figure

            with whole_file(picture, advice="Create it, or choose another --picture") as whole, any_letters():
                file_figure(observations).savefig(whole, dpi=150, format=picture.suffix[1:].lower())
        if output is not None:
            write_text(output, observations.to_dataframe().to_csv(index=False, lineterminator="\n"))
        _show(observations)
        for written in (output, picture):
            if written is not None:
                say(f"Written: {written}")


def init(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="FILES...", help="Lab files, or folders of them: force and capacitance in any order."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="The experiment file to write; never overwritten.")] = Path(
        "experiment.toml"
    ),
    said: Annotated[
        Path | None,
        typer.Option(help='TOML file of how files are to be read: [files."press.csv"] with the keys that an experiment has.'),
    ] = None,
) -> None:
    """Write a commented experiment file for a set of lab files.

    Every file of a folder is listed, with what it was recognised as or the reason why it is left out. Force files and
    capacitance files are told apart by their columns and paired by their names (s1_press.csv with s1_cap.csv), or by the time
    at which they began; where several could be meant none is taken. What the reader noted stands above each file's line.

    What the files cannot tell (ball, disc, thicknesses, stray capacitance, the machine's compliance, ...) is written with
    guesses and marked EDIT: put your own measurements there, they decide the result. So is what a file leaves open, such as one
    of several frequencies, with the lines to choose from.

    Example: `calib init measurements/ -o experiment.toml`

    Writes: the experiment file. Next: edit it, then `calib check experiment.toml`.

    Exit codes: 0 written; 2 a file that was named was not understood, no file was, or the experiment file exists.
    """
    with refusing_bad_input():
        from calib.experiment import MARK, experiment_text, look_through, pair, read_said

        if output.exists():
            raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
        require_writable(output, "Create it, or choose another -o")
        of_files = {} if said is None else {p: (s.reading, s.use) for p, s in read_said(said).items()}
        looked, own = look_through(paths, of_files)
        faults = [fault for file in looked if file.named for fault in file.faults]
        records = [record for file in looked for record in file.records]
        if faults or not records:
            raise InputError(faults or [Fault(reason, file.path) for file in looked for reason in file.left_out])
        specimens = pair(records)
        text = experiment_text(specimens, output.absolute().parent, looked)
        write_text(output, text)
        _show_files(looked, own)
        for specimen in specimens:
            _show_specimen(specimen)
        say(f"Written: {output}, with {text.count(MARK)} lines marked EDIT. Put your values there, then:")
        say(f"  calib check {output}")


def _show_files(looked: Sequence[Looked], own: Sequence[Path]) -> None:
    width = min(48, max(len(file.shown) for file in looked))
    for file in looked:
        kinds = list(dict.fromkeys(record.table.recognised_as for record in file.records))
        words = [f"{', '.join(kinds)}" + (f", {len(file.records)} specimens" if len(file.records) > 1 else "")] if kinds else []
        words += list(dict.fromkeys(f"open: {fault.message}" for record in file.records for fault in record.open))
        words += [f"note: {file.note}"] if file.note else []
        words += [f"left out: {reason}" for reason in file.left_out]
        for first, word in zip([file.shown, *[""] * len(words)], words, strict=False):
            say(f"{first:<{width}}  {word}")
    if own:
        say(f"not looked at, as calib wrote it: {', '.join(path.name for path in own)}")
    say("")


def _show_specimen(specimen: Pressed) -> None:
    for press in specimen.presses:
        parts = [f"force {press.force.shown}"] if press.force else []
        parts += [f"capacitance {press.capacitance.shown}"] if press.capacitance else []
        name = f"{specimen.name}, {press.name}" if press.name else specimen.name
        say(f"{name}: {', '.join(parts)}" + (f" ({press.in_words})" if press.in_words else ""))
    for note in specimen.notes:
        say(f"  {note}")


def unknowns() -> None:
    """List everything that a calibration can infer: what it is, when it exists, its default prior and why.

    The names are the keys of `[priors]` and `[specimens.priors]` in an experiment file.

    Example: `calib unknowns | less`
    """
    with refusing_bad_input():
        from calib.catalogue import unknowns_in_words

        say(unknowns_in_words().rstrip())


def _assignments(given: Sequence[str] | None, option: str) -> Mapping[str, str]:
    """Options such as force=kN as a mapping.

    Raises
    ------
    InputError
        If one is of another form, or names a quantity twice or one that there is not.
    """
    from calib.lab import QUANTITIES, no_such_quantity

    found: dict[str, str] = {}
    for text in given or ():
        quantity, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not quantity or not value:
            message = f'{option} "{text}" is not of the form quantity=value'
            raise InputError(Fault(message, advice=f"The quantities are {', '.join(QUANTITIES)}"))
        if quantity not in QUANTITIES:
            raise InputError(Fault(f'{option} "{text}": {no_such_quantity(quantity)}'))
        if quantity in found:
            raise InputError(Fault(f"{option} is given twice for {quantity}"))
        found[quantity] = value
    return found


def _where(given: Sequence[str] | None) -> Mapping[str, str]:
    """Options such as "Frequency (Hz)=1000" as a mapping; the last equals sign parts them, as a name may hold one.

    Raises
    ------
    InputError
        If one is of another form, or names a column twice.
    """
    found: dict[str, str] = {}
    for text in given or ():
        column, equals, value = (part.strip() for part in text.rpartition("="))
        if not equals or not column or not value:
            message = f'--where "{text}" is not of the form column=value'
            raise InputError(Fault(message, advice='Write for example --where "Frequency (Hz)=1000"'))
        if column in found:
            raise InputError(Fault(f'--where is given twice for "{column}"', advice="Keep one of the two"))
        found[column] = value
    return found


def _sign(given: Sequence[str] | None) -> Mapping[str, str]:
    """Options such as "compression negative" (of both) or "force=compression negative" as a mapping.

    Raises
    ------
    InputError
        If one is of another form, or a quantity is named twice.
    """
    from calib.lab import SIGNED, SIGNS

    found: dict[str, str] = {}
    for text in given or ():
        quantity, equals, sense = (part.strip() for part in text.rpartition("="))
        if sense not in SIGNS or (equals and quantity not in SIGNED):
            senses = " or ".join(f'--sign "{s}"' for s in SIGNS)
            advice = f'Write {senses}, or of one alone --sign "force=compression negative"'
            raise InputError(Fault(f'--sign "{text}" is not understood', advice=advice))
        for q in [quantity] if equals else list(SIGNED):
            if q in found:
                raise InputError(Fault(f"--sign is given twice for {q}", advice="Keep one of the two"))
            found[q] = sense
    return found


def _one_of(given: str, option: str, choices: Sequence[str]) -> str:
    """The value of an option that may be left out.

    Raises
    ------
    InputError
        If it is none of the choices.
    """
    if given and given not in choices:
        said = " or ".join(f'{option} "{choice}"' for choice in choices)
        raise InputError(Fault(f'{option} "{given}" is not understood', advice=f"Write {said}"))
    return given


def _use(given: Mapping[str, str | None]) -> Use:
    """Options on the part that is used, by the key of an experiment file; None for those that are left out.

    Raises
    ------
    InputError
        With every fault in them.
    """
    from calib.lab import Use, use_value

    found: dict[str, Any] = {}
    faults: list[Fault] = []
    for key, text in given.items():
        if text is None:
            continue
        numbers = [part.strip() for part in text.split(",")]
        whole = key == "cycles" and all(part.isdecimal() for part in numbers)
        try:
            found[key] = use_value(key, [int(part) for part in numbers] if whole else text)
        except InputError as error:
            option = f"--{key.replace('_', '-')}"
            example = f"Write {option} {_EXAMPLES[key]}"
            faults += [replace(fault, message=f"{option}: {fault.message}", advice=example) for fault in error.faults]
    if faults:
        raise InputError(faults)
    return Use(**found)


_EXAMPLES = {"max_force": '"5 N"', "max_depth": '"0.8 mm"', "branch": "loading or --branch unloading", "cycles": "2,3"}
_DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}


def _show(o: Observations) -> None:
    from rich.markup import escape
    from rich.table import Table

    from calib.catalogue import CHANNELS
    from calib.experiment import compliance_said
    from calib.lab import grade_rows, judge, readings_of, use_in_words, why_left_out

    table, console = o.table, out()
    say(f"{table.path.name}: {table.recognised_as} ({table.reason})")
    mark = {",": "comma", ".": "point"}.get(table.decimal, table.decimal)
    delimiter = _DELIMITERS.get(table.delimiter, table.delimiter)
    say(
        f"encoding {table.encoding}, delimiter {delimiter}, decimal {mark}"
        + (f", begun {table.started}" if table.started else "")
    )
    shown = Table("quantity", "column in the file", "smallest", "largest", "unit", "noise", "resolution", "correlated over")
    estimates = readings_of(o)
    rows = (
        ("time", o.time, 1.0, "s"),
        ("displacement", o.displacement, 1e3, "mm"),
        *((name, values, CHANNELS[name].display_scale, CHANNELS[name].display_unit) for name, values in o.channels.items()),
        *(
            (name, table.columns.get(name), 1.0, unit)
            for name, unit in (("dissipation", ""), ("frequency", "Hz"), ("cycle", ""))
        ),
    )
    for name, values, scale, unit in rows:
        if values is None:
            continue
        finite = values[values == values] * scale + 0.0  # no minus zero
        ends = (f"{finite.min():.6g}", f"{finite.max():.6g}") if finite.size else ("-", "-")
        e = estimates.get(name)
        of = (
            ("", "", "")
            if e is None
            else (
                f"{e.noise * scale:.2g}",
                f"{e.resolution * scale:.2g}",
                f"{e.correlation:.2g} row{'' if e.correlation < 1.05 else 's'}",
            )
        )
        shown.add_row(name, escape(table.sources.get(name, "")), *ends, unit, *of)
    console.print(shown)
    n_used = int(o.used.sum())
    branches = [f"{b or 'unknown'} {o.branch.count(b)}" for b in dict.fromkeys(o.branch)]
    which = use_in_words(o.use, o.used_cycles) if o.n_cycle > 1 or o.use.branch != "loading" else ""
    cycles = f"; {o.n_cycle} cycles, {which}" if o.n_cycle > 1 else f"; {which}" if which else ""
    say(f"{len(o.used)} rows, {n_used} used" + (f"; by branch: {', '.join(branches)}{cycles}" if any(o.branch) else ""))
    for reason, count in why_left_out(o).most_common(12):
        say(f"not used: {count} rows, {reason}")
    for part in table.unread:
        say(f"not read: {part}")
    for note in (*(decision.note for decision in o.signs.values()), *o.use_notes, *table.notes):
        if note:
            say(f"note: {note}")
    judged = grade_rows(judge(o, **compliance_said({})))
    objections = [row for row in judged if row[0] != "good"]
    if objections:
        quality = Table("quality", "check", "number", "finding", "advice")
        for level, *cells in objections:
            quality.add_row(level, *map(escape, cells), style={"bad": "red", "warning": "yellow"}.get(level, ""))
        console.print(quality)
    good = [f"{check} ({number})" for level, check, number, *_ in judged if level == "good"]
    if good:
        say(f"good: {', '.join(good)}")
