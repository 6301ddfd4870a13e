"""From lab files to the text of an experiment file: specimens paired by name and time, what must be measured marked EDIT."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab import LabTable, Reading, SeveralSpecimens, read_lab_file

#: Endings of files that are looked at in a folder.
ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".log", ".asc", ".tra", ".xlsx", ".xlsm", ".xls", ".lvm", ".tdms", ".mat")

#: Two records of one press begin within this time [s] of each other.
TOGETHER = 600.0


@dataclass(frozen=True, eq=False)
class Found:
    """One record of a lab file, for which `calib init` looks for a partner.

    Attributes
    ----------
    table : what was read.
    specimen : which of several specimens in the file it is, from 1; None if it is the only one.
    """

    table: LabTable
    specimen: int | None

    @property
    def title(self) -> str:
        """Name of the record: that of its file without ending.

        It is "S7_1" for Bluehill's `S7.is_comp_RawData/Specimen_RawData_1.csv`.
        """
        path = self.table.path
        numbered = re.fullmatch(r"specimen_?rawdata_?(\d+)", path.stem, re.IGNORECASE)
        sample = re.fullmatch(r"(.+)\.is_\w+_rawdata", path.absolute().parent.name, re.IGNORECASE)
        return f"{sample[1]}_{numbered[1]}" if numbered and sample else path.stem

    @property
    def key(self) -> str:
        """The part of the title that names the specimen, in lower case, without words for the instrument."""
        key = re.sub(r"[^a-z0-9]+", " ", _INSTRUMENT_WORDS.sub(" ", self.title.lower())).strip()
        return key if self.specimen is None else f"{key} {self.specimen}".strip()


@dataclass(frozen=True, eq=False)
class Paired:
    """Records that belong to one specimen, and why they were put together.

    Attributes
    ----------
    name : of the specimen.
    force, capacitance : its records; may be of one file, and one may be missing.
    why : the reason, in words for the user.
    """

    name: str
    force: Found | None
    capacitance: Found | None
    why: str


def lab_files_in(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Find the lab files to draft an experiment from, in a list of files and folders.

    Raises
    ------
    InputError
        If a path is not there, or a folder holds no such file.

    Returns
    -------
    Files that were named, and files in the folders that were named (see `ENDINGS`), at any depth and in order.
    """
    named: list[Path] = []
    lying: list[Path] = []
    faults: list[Fault] = []
    for path in dict.fromkeys(paths):
        if not path.is_dir():
            named.append(path)
            continue
        inside = sorted(p for p in path.rglob("*") if p.suffix.lower() in ENDINGS and p.is_file())
        if not inside:
            faults.append(Fault(f"there is no {', '.join(ENDINGS)} file in this folder", path))
        lying += inside
    if faults:
        raise InputError(faults)
    return named, [p for p in lying if p not in named]


def read_all(path: Path) -> list[Found]:
    """Read every specimen of a lab file.

    Raises
    ------
    InputError
        As `read_lab_file`; and if a record holds neither force over displacement nor capacitance.
    """
    try:
        found = [Found(read_lab_file(path), None)]
    except SeveralSpecimens as several:
        found = [Found(read_lab_file(path, Reading(specimen=k)), k) for k in range(1, several.count + 1)]
    for record in found:
        there = set(record.table.columns)
        if not ({"force", "displacement"} <= there or "capacitance" in there):
            message = f"has neither force over displacement nor capacitance (found {', '.join(sorted(there))})"
            raise InputError(Fault(message, path, advice="Leave it out, or name its columns (see `calib read --help`)"))
    return found


# Words in file names that stand for instruments, not for specimens.
_INSTRUMENT_WORDS = re.compile(
    r"(?<![a-z])(instron|bluehill|zwick|testxpert|mts|mecmesin|tester|lcr|hioki|keysight|agilent|instek|capacitance|capacity|cap|"
    r"force|load|displacement|indentation|specimen_?rawdata|raw_?data|data|log|fd|cf)(?![a-z])",
    re.IGNORECASE,
)


def pair(records: Sequence[Found]) -> list[Paired]:
    """Put records of force and capacitance together that belong to one specimen.

    Names go first: a force file and a capacitance file belong together if their names agree but for words such as instron and
    lcr. Of those left over, two belong together if they began within `TOGETHER` of each other, and no other could be meant.
    """
    both = [r for r in records if {"force", "displacement", "capacitance"} <= set(r.table.columns)]
    lcr = [r for r in records if "capacitance" in r.table.columns and r not in both]
    tester = [r for r in records if r not in both and r not in lcr]
    partner = _by_name(tester, lcr)
    why = dict.fromkeys(partner, "paired by name")
    for i, j in _by_time(tester, lcr, partner).items():
        partner[i], why[i] = j, f"paired by time: the records began {_apart(tester[i], lcr[j]):.0f} s apart"
    for i, j in partner.items():
        apart = _apart(tester[i], lcr[j])
        if apart is not None and apart > TOGETHER:
            why[i] += f", but the records began {apart / 3600:.1f} h apart: check"
    found: list[tuple[Found | None, Found | None, str]] = [(r, r, "") for r in both]
    found += [(t, lcr[partner[i]] if i in partner else None, why.get(i, "")) for i, t in enumerate(tester)]
    found += [(None, c, "") for j, c in enumerate(lcr) if j not in partner.values()]
    names = [_name(a or b, n) for n, (a, b, _) in enumerate(found, 1)]
    unique = [n if names.count(n) == 1 else f"{n} {k}" for k, n in enumerate(names, 1)]
    return [Paired(n, *parts) for n, parts in zip(unique, found, strict=True)]


def _by_name(tester: Sequence[Found], lcr: Sequence[Found]) -> dict[int, int]:
    similar = sorted(
        ((difflib.SequenceMatcher(None, a.key, b.key).ratio(), i, j) for i, a in enumerate(tester) for j, b in enumerate(lcr)),
        key=lambda s: (-s[0], s[1], s[2]),
    )
    partner: dict[int, int] = {}
    for likeness, i, j in similar:
        # A single file of each kind belongs together whatever it is called; among several the names must agree.
        numbers = [re.findall(r"\d+", r.key) for r in (tester[i], lcr[j])]
        enough = likeness > 0.999 or (likeness > 0.6 and numbers[0] == numbers[1]) or len(tester) == len(lcr) == 1
        if enough and i not in partner and j not in partner.values():
            partner[i] = j
    return partner


def _by_time(tester: Sequence[Found], lcr: Sequence[Found], taken: dict[int, int]) -> dict[int, int]:
    near = {
        (i, j)
        for i, a in enumerate(tester)
        for j, b in enumerate(lcr)
        if i not in taken and j not in taken.values() and (apart := _apart(a, b)) is not None and apart <= TOGETHER
    }
    return {i: j for i, j in near if sum(p == i for p, _ in near) == sum(q == j for _, q in near) == 1}


def _apart(a: Found, b: Found) -> float | None:
    """Time [s] between the starts of two records; None if one of them does not state its start."""
    if a.table.started is None or b.table.started is None:
        return None
    return abs((a.table.started - b.table.started).total_seconds())


def _name(record: Found | None, number: int) -> str:
    if record is None:
        return f"specimen {number}"
    kept = re.sub(r"[ _-]*\s[ _-]*", " ", _INSTRUMENT_WORDS.sub(" ", record.title)).strip(" _-")
    kept = re.sub(r"[\[\],\r\n]", " ", kept).strip() or "specimen"
    if record.specimen is not None:
        return f"{kept} {record.specimen}"
    return kept if kept != "specimen" else f"specimen {number}"


# ---------------------------------------------------------------------------------------------------------------- the text


def experiment_text(specimens: Sequence[Paired], folder: Path, left_out: Sequence[tuple[Path, str]] = ()) -> str:
    """Write the experiment file for a user to complete: filled in from the lab files, EDIT where something must be measured.

    Parameters
    ----------
    specimens : with their records.
    folder : of the experiment file, which lab files are named relative to.
    left_out : files that were not understood, each with its reason; they are listed in a comment.

    Returns
    -------
    The text, TOML with comments.
    """
    blocks = []
    for paired in specimens:
        force, capacitance = paired.force, paired.capacitance
        lines = ["[[specimens]]", f"name = {_quoted(paired.name)}"]
        if paired.why:
            lines[0] += f"   # {paired.why}"
        if force is not None:
            lines.append(f"force = {_file(force, folder)}   # {force.table.recognised_as}")
        if capacitance is not None:
            lines.append(f"capacitance = {_file(capacitance, folder)}   # {capacitance.table.recognised_as}")
        if force is None and capacitance is not None and not {"force", "displacement"} & set(capacitance.table.columns):
            lines.append('# EDIT: nothing ties this capacitance file to force; add force = "..." of the same press')
        lines += [
            "[specimens.priors]",
            "# EDIT: your microscope's reading and its sd",
            'sensor_thickness = { lognormal = ["0.8 mm", 1.5] }    # e.g. { normal = ["0.74 mm", "0.02 mm"] }',
            'padding_thickness = { lognormal = ["1.1 mm", 1.5] }   # e.g. { normal = ["1.10 mm", "0.03 mm"] }',
        ]
        blocks.append("\n".join(lines))
    if left_out:
        why = [f"#   {_relative(path, folder)}: {reason}" for path, reason in left_out]
        blocks.append("\n".join(["# Left out, as they were not understood (see `calib read FILE`):", *why]))
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

# One block per specimen. Thicknesses matter more than anything else here: measure them. A file may be told how to be read:
#   force = { file = "press.csv", units = { force = "kN" }, columns = { force = "Load 2" }, specimen = 1, cycle = 2 }
"""


def _file(record: Found, folder: Path) -> str:
    name = _quoted(_relative(record.table.path, folder))
    return name if record.specimen is None else f"{{ file = {name}, specimen = {record.specimen} }}"


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path.absolute(), folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
