"""An experiment in, lab files out whose name, or what they say of their specimen, is that of another specimen of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from calib.experiment.naming import key_of, split_repeat, tokens_of
from calib.experiment.plan import Experiment, SweepFiles

# So much of a file is looked at for what it says of its specimen [bytes].
_HEAD = 4096
# 'Text Inputs : Specimen label,"sensor 1"', "Sample ID;S2", "# Probe: 3".
_LABEL = re.compile(
    r"(?<![^\W\d_])(?:specimen|sample|sensor|dut|test ?piece|proben?|muster|prüfling|prüfkörper|éprouvette|échantillon|probeta)"
    r"(?:[ _-]*(?:label|name|id|no\.?|nr\.?|number|bezeichnung|nummer|kennung))?"
    r"[ \t]*[:=,;\t][ \t]*[\"']?(?P<label>[^\"',;\t\r\n]{1,60})",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class OfAnother:
    """A lab file that speaks of another specimen than the one that it was entered for.

    Attributes
    ----------
    specimen : it was entered for.
    file : its name.
    says : how it speaks of the other, by its name or what it says, in words that "like one of" may follow.
    other : name of the other specimen.
    """

    specimen: str
    file: str
    says: str
    other: str


def files_of_others(experiment: Experiment) -> tuple[OfAnother, ...]:
    """Find lab files that were entered for one specimen and speak, by name or label, of one other and not of their own.

    Names are compared by their words and numbers, those that say nothing left out: "press_s02.csv" speaks of "sensor 2", and so
    does the label "S2", which has to be no more than that. One that all labelled files have, by their method, says nothing.
    Where all others have a label of their own, one that two of them have speaks of the other in both.

    Parameters
    ----------
    experiment : whose files they are; those that cannot be read say nothing but their names.

    Returns
    -------
    Each file once, in the order of the experiment.
    """
    keys = {s.name: key_of(tokens_of(s.name, ""), stamps=False, specimen_words=False) for s in experiment.specimens}
    if len(keys) < 2 or not all(keys.values()) or len(set(keys.values())) < len(keys):
        return ()
    entered = [(s.name, *file) for s in experiment.specimens for entry in s.sweeps for file in _files(entry)]
    labels = _that_differ({path: _labels(path) for _, path, _ in entered})
    with_label: dict[str, set[str]] = {}
    for specimen, path, _ in entered:
        for label in labels[path]:
            with_label.setdefault(label, set()).add(specimen)
    shared = [several for several in with_label.values() if len(several) > 1]
    of_two = shared[0] if len(with_label) > 2 and len(shared) == 1 and len(shared[0]) == 2 else set[str]()
    found: dict[tuple[str, Path], OfAnother] = {}
    for specimen, path, kind in entered:
        stem = key_of(split_repeat(tokens_of(path.stem, kind))[0], stamps=False, specimen_words=False)
        spoken_of = []
        for label in sorted(labels[path]):
            said = key_of(tokens_of(label, ""), stamps=False, specimen_words=False)
            named = [name for name, own in keys.items() if own == said]
            if not named and with_label[label] == of_two:
                named = [name for name in of_two if name != specimen]
            spoken_of.append((named, f'says "{label}"'))
        spoken_of.append(([name for name, own in keys.items() if _holds(stem, own)], "is named"))
        for names, words in spoken_of:
            if len(names) == 1 and names[0] != specimen:
                found.setdefault((specimen, path), OfAnother(specimen, path.name, words, names[0]))
    return tuple(found.values())


def _that_differ(labels: dict[Path, frozenset[str]]) -> dict[Path, frozenset[str]]:
    """Labels without those that all labelled files have."""
    labelled = [said for said in labels.values() if said]
    of_all = frozenset.intersection(*labelled) if labelled else frozenset[str]()
    return {path: said - of_all for path, said in labels.items()}


def _files(entry: SweepFiles) -> Iterator[tuple[Path, Literal["force", "capacitance", ""]]]:
    if entry.force is not None and entry.force == entry.capacitance:
        yield entry.force, ""
        return
    if entry.force is not None:
        yield entry.force, "force"
    if entry.capacitance is not None:
        yield entry.capacitance, "capacitance"


def _holds(key: tuple[str, ...], part: tuple[str, ...]) -> bool:
    """Whether the words of one name stand in another, in their order."""
    return any(key[k : k + len(part)] == part for k in range(len(key) - len(part) + 1))


def _labels(path: Path) -> frozenset[str]:
    """What the head of a text file says of its specimen, in one line or several; nothing if it cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return frozenset()
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = head.decode("utf-16", errors="replace")
    else:
        try:
            text = head[: head.rfind(b"\n") + 1].decode("utf-8")
        except UnicodeDecodeError:
            text = head.decode("cp1252", errors="replace")
    return frozenset(label for found in _LABEL.finditer(text) if (label := found["label"].strip()))
