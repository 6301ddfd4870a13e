"""Specimens and their lab files in, the text of an experiment file out: what must be measured or chosen is marked EDIT."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from calib.errors import Choice
from calib.experiment.edits import GUESSES, MARK
from calib.experiment.lab_files import Found, Looked, said
from calib.experiment.presses import Press, Pressed
from calib.lab import FIRST_LOADING, Reading, Use

#: Width of a comment.
_WIDTH = 120

#: Alternatives of a choice, and notes on a file, that are written out.
_MOST_ALTERNATIVES, _MOST_NOTES = 8, 12


def experiment_text(specimens: Sequence[Pressed], folder: Path, looked: Sequence[Looked] = ()) -> str:
    """Write the experiment file for a user to complete: filled in from the lab files, EDIT where something must be measured.

    Parameters
    ----------
    specimens : with their records.
    folder : of the experiment file, which lab files are named relative to.
    looked : every file that was come across; those that were left out are listed with the reason.

    Returns
    -------
    The text, TOML with comments.
    """
    presses = [press for specimen in specimens for press in specimen.presses]
    electrical = any(press.capacitance is not None for press in presses)
    guessed = {at: "\n".join(_guess(at)) for at, guess in GUESSES.items() if electrical or not guess.electrical}
    blocks = [_head(guessed), *(specimen_text(s, folder, electrical, first=s is specimens[0]) for s in specimens)]
    left_out = [f"  {relative_name(f.path, folder)}: {reason}" for f in looked for reason in f.left_out]
    if left_out:
        blocks.append("\n".join(_comments(["Left out (see `calib read FILE` for what to do):", *left_out])))
    return "\n\n".join(blocks) + "\n"


def _head(guessed: Mapping[tuple[str, ...], str]) -> str:
    def table(name: str) -> str:
        return "\n".join(text for at, text in guessed.items() if at[0] == name)

    return f"""\
# Experiment file for `calib calibrate`. Quantities carry units ("0.74 mm").
# A line marked EDIT holds a guess or is open: put in what you measured and remove the mark. `calib calibrate` says which
# are left. A line that is commented out holds once you remove its first #.

name = "Padded sensor"        # heading of the report
# model = "surrogate"         # "surrogate" (default), "fem" (slow) or "closed form" (rough)
# discrepancy = "on"          # "on" (default): the model may be a little wrong along a sweep; "off": noise only; "compare"
# candidates = ["own-padding"]  # other models that `calib compare` calibrates and averages; default all that there are
# pooling = "partial"         # "complete" (default): all specimens are of one material; "partial": they are of one lot, each
                              # with material and thicknesses of its own, and `calib recommend` is for the next one, which
                              # nobody has measured
# Who measured, and what with, for `calib certificate` (docs/certificate.md); none of it decides a number:
# laboratory = {{ name = "...", operator = "...", city = "...", country = "NZ", measured = "2026-03-17" }}
# instruments = [{{ kind = "load cell", maker = "...", serial = "...", calibrated = "2026-01-12", class = "0.5" }}]
{table("base")}

[indenter]
{table("indenter")}

[sensor]
{table("sensor")}
# law = "gent"                # "neo-hookean" (default); "gent": stiffens when stretched far, by an unknown of its own

[padding]
{table("padding")}

# What is known before the data, shared by all specimens. Forms: {{ normal = [mean, sd] }}, {{ lognormal = [median, factor] }},
# {{ halfnormal = scale }}, {{ uniform = [low, high] }}, {{ truncated_normal = [mean, sd, low, high] }}, {{ fixed = value }}.
# What is left out gets a documented default, shown in the report.
[priors]
{table("priors")}

# One block per specimen. A file may be told how it is to be read, see `calib read --help`:
#   force = {{ file = "press.csv", units = {{ force = "kN" }}, columns = {{ force = "Load 2" }}, specimen = 1 }}"""


def _guess(at: tuple[str, ...], *, why: bool = True) -> list[str]:
    guess = GUESSES[at]
    line = f"{at[-1]} = {guess.value}   {MARK} {guess.task}"
    return [*_comments([guess.why] if why and guess.why else []), line if guess.in_force else f"# {line}"]


def specimen_text(specimen: Pressed, folder: Path, electrical: bool, *, first: bool = False) -> str:
    """The block of one specimen in an experiment file, with guesses marked EDIT for what no file tells.

    Parameters
    ----------
    specimen : with its records.
    folder : of the experiment file, which lab files are named relative to.
    electrical : whether the experiment has capacitance.
    first : whether it is the first one, at which it is said why what is asked for matters.
    """
    lines = [*_comments(specimen.notes), "[[specimens]]", f"name = {quoted_text(specimen.name)}"]
    alone = len(specimen.presses) == 1
    if alone:
        lines += [*_press(specimen.presses[0], folder), *_ball_of_its_own(specimen.presses[0])]
    lines.append("[specimens.priors]")
    for at, guess in GUESSES.items():
        if at[0] == "specimens" and (electrical or not guess.electrical):
            lines += _guess(at, why=first)
    for press in () if alone else specimen.presses:
        lines += ["[[specimens.sweeps]]", f"name = {quoted_text(press.name)}", *_press(press, folder)]
        if press.ball:
            named = press.name.replace('"', "'")
            line = f"   {MARK} radius of this ball, half its diameter; the file's name says {named}"
            if press.radius:
                lines.append(f'indenter_radius = "{press.radius} mm"{line}')
            else:
                lines.append(f"# indenter_radius = {GUESSES['indenter', 'radius'].value}{line}")
    return "\n".join(lines)


def _ball_of_its_own(press: Press) -> list[str]:
    """The line to decide on where the name of the only press of a specimen may tell another ball than the other names."""
    if not press.perhaps:
        return []
    value = f'"{press.radius} mm"' if press.radius else GUESSES["indenter", "radius"].value
    named = press.perhaps.replace('"', "'")
    task = f"if '{named}' is this ball's radius, take out the first # and this mark; else the line"
    return [f"# indenter_radius = {value}   {MARK} {task}"]


def _press(press: Press, folder: Path) -> list[str]:
    """The lines of the files of one press, each below what was noted of it."""
    lines = _comments([press.in_words] if press.in_words else [])
    force, capacitance = press.force, press.capacitance
    same = force is capacitance
    if force is not None:
        lines += _file("force", force, folder)
    if capacitance is not None:
        lines += _entry("capacitance", capacitance, folder) if same else _file("capacitance", capacitance, folder)
        if press.asked and MARK not in lines[-1]:
            lines[-1] += f"   {MARK} {press.asked}"
    lines += _candidates(press, folder)
    if force is None and capacitance is not None and not {"force", "displacement"} & set(capacitance.table.columns):
        lines.append(f'# force = "..."   {MARK} the force file of the same press; nothing ties this capacitance to a depth')
    uses = [record.use for record in (force, capacitance) if record is not None and record.use != FIRST_LOADING]
    if uses:
        lines.append(f"use = {{ {', '.join(use_words(uses[0]))} }}")
    return lines


def _candidates(press: Press, folder: Path) -> list[str]:
    """The lines to decide on for records of capacitance that may be of a press, and of which none was taken."""
    task = "if this is of the same press, take out the first # and this mark, and its own block below; else the line"
    return [f"# capacitance = {_value(record, record.reading, folder)}   {MARK} {task}" for record in press.candidates]


def _file(key: str, record: Found, folder: Path) -> list[str]:
    """The line of a lab file below what was noted when it was read, or below the alternatives that it leaves."""
    notes = [*(f"  note: {note}" for note in record.notes), *(f"  not used: {unread}" for unread in record.table.unread)]
    if len(notes) > _MOST_NOTES:
        notes = [*notes[: _MOST_NOTES - 1], f"  and {len(notes) - _MOST_NOTES + 1} more: `calib read` lists them"]
    if record.open:
        notes = [f"  {said}" for said in (*record.notes, *(fault.message for fault in record.open))]
    lines = _comments([f"{record.shown}: {record.table.recognised_as}", *notes])
    return [*lines, *_alternatives(key, record, folder), *_entry(key, record, folder)]


def _alternatives(key: str, record: Found, folder: Path) -> list[str]:
    """The lines that may stand in place of that of a file that leaves something open."""
    if not record.open:
        return []
    first, *others = (choice for fault in record.open if (choice := fault.choice) is not None)
    lines = ["# Put one of these lines in place of the next:"]
    for value in first.alternatives[:_MOST_ALTERNATIVES]:
        reading = said(record.reading, first, value)
        for other in others:
            reading = said(reading, other, other.alternatives[0])
        lines.append(f"#   {key} = {_value(record, reading, folder)}")
    if len(first.alternatives) > _MOST_ALTERNATIVES:
        more = first.alternatives[_MOST_ALTERNATIVES:]
        lines += _comments([f"  or with {_few(more)}"])
    for other in others:
        if other.alternatives[1:]:
            lines += _comments([f"  {_of(other)} may also be {_few(other.alternatives[1:])}"])
    return lines


def _few(values: Sequence[str]) -> str:
    return ", ".join(values[:30]) + (f" and {len(values) - 30} more" if len(values) > 30 else "")


def _of(choice: Choice) -> str:
    return f"{choice.option} of {choice.key}" if choice.key else choice.option


def _entry(key: str, record: Found, folder: Path) -> list[str]:
    line = f"{key} = {_value(record, record.reading, folder)}"
    choice = next((fault.choice for fault in record.open if fault.choice is not None), None)
    return [line if choice is None else f"{line}   {MARK} choose {choice.option}, one of the lines above"]


def _value(record: Found, reading: Reading, folder: Path) -> str:
    name = quoted_text(relative_name(record.table.path, folder))
    said_of_it = reading_words(reading)
    return f"{{ file = {name}, {', '.join(said_of_it)} }}" if said_of_it else name


def reading_words(reading: Reading) -> list[str]:
    """What is said of a file, as keys of its table in an experiment file."""
    words: list[str] = []
    for key in ("units", "columns", "where", "sign"):
        table: Mapping[str, str] = getattr(reading, key)
        if table:
            pairs = [f"{_key(name)} = {quoted_text(value)}" for name, value in table.items()]
            words.append(f"{key} = {{ {', '.join(pairs)} }}")
    if reading.specimen is not None:
        words.append(f"specimen = {reading.specimen}")
    texts = {"sheet": reading.sheet, "scale": reading.scale, "decimal": reading.decimal}
    return words + [f"{key} = {quoted_text(text)}" for key, text in texts.items() if text]


def use_words(use: Use) -> list[str]:
    """What is said of the part of a press that is used, as keys of its table in an experiment file."""
    words = {"max_force": ("N", 1.0), "max_depth": ("mm", 1e3)}
    said = []
    for field in fields(use):
        value = getattr(use, field.name)
        if value == field.default:
            continue
        if field.name in words:
            unit, scale = words[field.name]
            said.append(f'{field.name} = "{value * scale:.12g} {unit}"')
        else:
            said.append(f"{field.name} = {quoted_text(value) if isinstance(value, str) else list(value)}")
    return said


def _key(name: str) -> str:
    return name if name.isascii() and name.replace("_", "").replace("-", "").isalnum() else quoted_text(name)


def _comments(sentences: Iterable[str]) -> list[str]:
    """Sentences as comments: one line each, more where it is long; indents stay, and nothing passes for a mark."""
    lines = []
    for sentence in sentences:
        text = "".join(c if c.isprintable() else " " for c in sentence).replace(MARK, "EDIT")
        indent = " " * (len(text) - len(text.lstrip()))
        lines += [
            f"# {line}"
            for line in textwrap.wrap(
                text, _WIDTH - 2, subsequent_indent=f"{indent}  ", break_long_words=False, break_on_hyphens=False
            )
        ]
    return lines


def relative_name(path: Path, folder: Path) -> str:
    """A file as seen from a folder, with forward slashes; with its whole path where it is on another drive.

    Parameters
    ----------
    path : of the file.
    folder : absolute.
    """
    try:
        return Path(os.path.relpath(path.absolute(), folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()


def quoted_text(text: str) -> str:
    """A text as a TOML file has it."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() or c == "\u3000" else f"\\u{ord(c):04x}" for c in escaped) + '"'
