"""A calibrated lot and a folder of lab files of more specimens in, what each of them is and whether it passes, out.

Each specimen is inspected by itself, given the lot, and a line is kept of it as soon as it is: stopped, a batch goes on with
what there is. A line counts again as long as nothing it rests on has changed: the lot, the specification, its files.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from calib.checks import Reason, Verdict
from calib.decision import (
    DRIFTING,
    Batch,
    Inspected,
    Inspection,
    Presented,
    conditions_of_next,
    counted_already,
    expected_of,
    held_by_another,
    inspect,
    inspected_from_plain,
    inspected_to_plain,
    largest_force,
    presented,
    without_copies,
)
from calib.errors import Fault, InputError
from calib.experiment import (
    Held,
    Looked,
    Pressed,
    Specification,
    files_of_others,
    held_twice,
    look_through,
    pair,
    readings_in,
    readings_of_sweeps,
)
from calib.files import real_path, require_folder, sha256_of, write_text
from calib.problem import template_of
from calib.records import exact_record_from_text, record_from_text, record_to_text
from calib.runs.arrivals import keep_as_they_come
from calib.runs.certified import Finding
from calib.runs.export import NotUsableError
from calib.runs.folder import Run, fast_forward, require_own_forward
from calib.runs.ownership import owned, owner_of
from calib.sampling import Posterior, lot_of
from calib.workers import workers
from models.response import Forward

#: Names of the files of a batch: a line for each specimen as it comes, and what they say together.
LINES, TABLE, RECORD, PAGE = "inspected.jsonl", "batch.csv", "batch.json", "batch.html"

#: Raise it with every change that makes the numbers or the light of a specimen others.
BATCH_VERSION = 6

_LINE, _KIND, _OF = "inspected specimen", "batch", "batch of"
# Processor time that a specimen takes where none has been inspected yet [s].
_USUALLY = 1.5


def batch_in(
    run: Run,
    files: Path | str,
    folder: Path | str,
    executor: Executor | None = None,
    *,
    specification: Specification | None = None,
    like: str | None = None,
    seed: int = 1,
    chain_seconds: float = 300.0,
    planned: Callable[[int, int, float], None] = lambda *_: None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> Batch:
    """Inspect every specimen of a folder of lab files, given the calibration of the lot that they are of.

    The posterior of the lot is what is believed of each before its own files; the lot itself is not updated by them.

    Parameters
    ----------
    run : the calibration of the lot.
    files : folder of lab files, paired as by `calib init`.
    folder : for the batch; one of the same files and lot in it is gone on with.
    executor : any of `concurrent.futures`; None for this process.
    specification : that they are held against; None for none.
    like : name of the specimen of the lot that they were meant to be like; None if all of the lot were meant to be alike.
    seed : of all random numbers.
    chain_seconds : that chains may take for a specimen whose weighted draws cannot be trusted; 0 for no chains.
    planned : told how many are to be inspected, of how many, and the processor time [s] that each may take, before any is.
    progress : called with the specimens done and their number.

    Returns
    -------
    The batch, also written into the folder.

    Raises
    ------
    NotUsableError
        If the verdict on the calibration of the lot is red; nothing is written then.
    InputError
        If an input cannot be used, or the folder is that of something else, such as the batch of other files or another lot.
    """
    files, folder = Path(files), Path(folder)
    require_own_forward(run)
    if run.members:
        advice = "Give the run of one of its models, in the folder of `calib compare`"
        raise InputError(Fault("this run is an average of models, and a batch rests on one", run.folder, advice=advice))
    if run.verdict.colour == "red":
        raise NotUsableError(run.folder, run.verdict, "no batch is made of it")
    require_folder(folder, "Create it first")
    if folder.exists() and not folder.is_dir():
        raise InputError(Fault("a file of this name exists and is not overwritten", folder, advice="Choose another -o"))
    if not files.is_dir():
        raise InputError(Fault("there is no such folder of lab files", files, advice="Give the folder that holds them"))
    inspection = inspection_of(run.posterior, fast_forward(run), run.verdict, specification, like, seed, chain_seconds)
    with owned(folder, "calib batch"):
        _require_own(folder)
        ones, left_out = newcomers_in(files, inspection, folder)
        _require_of(folder, run, files, ones)
        parts = _parts(run, inspection)
        keys = [_key(parts, one) for one in ones]
        wanted = set(keys)
        made = {key: row for key, row in _kept(folder / LINES).items() if key in wanted and not _unsettled(row)}
        missing = [k for k, key in enumerate(keys) if key not in made]
        seconds = sum(row.seconds for row in made.values()) / len(made) if made else _USUALLY
        planned(len(missing), len(ones), seconds)
        progress(len(ones) - len(missing), len(ones))
        write_text(folder / LINES, _of(run, files) + "".join(_line(key, row) for key, row in made.items()))
        left = [(keys[k], ones[k]) for k in missing]
        with workers(0) if executor is None else nullcontext(executor) as crew:
            futures = {crew.submit(inspect, inspection, one): key for key, one in left}
            keep_as_they_come(futures, folder / LINES, _line, made, lambda n: progress(n, len(ones)))
        found = Batch(
            run.posterior.experiment.name,
            run.posterior.experiment.pooling,
            inspection.template.name,
            run.posterior_sha256,
            specification,
            inspection.force,
            without_copies(inspection, ones, [made[key] for key in keys]),
            expected_of(run.posterior, inspection.forward, inspection.force, seed),
            left_out,
            seed,
            inspection.reasons,
            conditions_of_next(run.posterior, inspection.forward, inspection.force, seed),
        )
        _write(folder, found, run, files)
    return found


def inspection_of(
    posterior: Posterior,
    forward: Forward,
    verdict: Verdict,
    specification: Specification | None,
    like: str | None,
    seed: int,
    chain_seconds: float,
) -> Inspection:
    """What newcomers of a calibrated lot are inspected by.

    Parameters
    ----------
    posterior : of the lot.
    forward : its model; the surrogate for one of the finite elements.
    verdict : on its calibration, which goes for every newcomer, too.
    specification, like, seed, chain_seconds : as in `batch_in`.

    Raises
    ------
    InputError
        As `template_of`.
    """
    lot = lot_of(posterior)
    against = [replace(reason, gate="lot") for reason in verdict.reasons]
    template = template_of(lot, like)
    force = specification.largest_force if specification is not None else _rounded(largest_force(posterior, template.name))
    return Inspection(lot, posterior.sweeps, template, forward, specification, force, tuple(against), seed, chain_seconds)


def _rounded(force: float) -> float:
    """A force [N] of two digits, not above another."""
    step = 10.0 ** (math.floor(math.log10(force)) - 1) if force > 0 else 1.0
    return float(f"{math.floor(force / step + 1e-9) * step:.6g}")


def _require_own(folder: Path) -> None:
    """Refuse a folder that holds other things than a batch."""
    others = [p.name for p in folder.iterdir() if not p.name.startswith(".") and p.name not in (LINES, TABLE, RECORD, PAGE)]
    if others:
        message = f"this folder holds other files ({', '.join(sorted(others)[:3])}), and a batch wants one of its own"
        raise InputError(Fault(message, folder, advice="Choose another -o"))


def _of(run: Run, files: Path) -> str:
    """The line of which lot and lab files a batch is."""
    lot = {"name": run.posterior.experiment.name, "run": str(run.folder.absolute()), "posterior": run.posterior_sha256}
    return record_to_text(_OF, BATCH_VERSION, {"lot": lot, "files": str(files.absolute())}, indent=None)


def _require_of(folder: Path, run: Run, files: Path, ones: Sequence[Presented]) -> None:
    """Refuse to put a batch in the place of one of other lab files or of another lot; one that only lies elsewhere is none."""
    there = [record for name in (RECORD, LINES) for record in _plain_records(folder / name)]
    of = next((record for record in there if "files" in record and isinstance(record.get("lot"), dict)), None)
    advice = "Choose another -o; or move that batch away, or delete it"
    if of is None:
        if any((folder / name).exists() and (folder / name).stat().st_size for name in (LINES, TABLE, RECORD, PAGE)):
            message = "this folder holds a batch that does not say of which lab files and which lot it is"
            raise InputError(Fault(message, folder, advice=advice))
        return
    found = [row for record in there for row in (record.get("row"), *(record.get("specimens") or ()))]
    rows = [row for row in found if isinstance(row, dict) and {"name", "files"} <= set(row)]
    if not rows and not (folder / RECORD).exists():
        return
    lot = of["lot"]
    same_lot = run.posterior_sha256 == lot.get("posterior") or real_path(run.folder) == real_path(Path(str(lot.get("run"))))
    kept = {digest for row in rows for _, digest in row["files"]}
    # A copy of all of it in another place is the same batch: nothing of it is lost.
    copied = bool(kept) and kept <= {digest for one in ones for _, digest in one.files}
    if not same_lot or not (copied or real_path(files) == real_path(Path(str(of["files"])))):
        n = len({row["name"] for row in rows})
        told = f"the batch of {of['files']} ({n} specimen{'' if n == 1 else 's'}), given the lot {lot.get('run')}"
        wanted = f"the batch of {files.absolute()}, given {run.folder.absolute()}"
        raise InputError(Fault(f"this folder holds {told}; {wanted}, would take its place", folder, advice=advice))


def _plain_records(path: Path) -> list[dict[str, Any]]:
    """What a file of records holds, of whatever version and whether it is as it was written or not."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    found = []
    for part in [text] if path.name == RECORD else text.splitlines():
        try:
            found.append(json.loads(part))
        except (ValueError, RecursionError):
            continue
    return [record for record in found if isinstance(record, dict)]


# --- what is in the folder of lab files ---------------------------------------------------------------------------------


def newcomers_in(files: Path, inspection: Inspection, folder: Path) -> tuple[list[Presented], tuple[tuple[str, str], ...]]:
    """The newcomers whose lab files lie in a folder, each with what speaks against its files already.

    Parameters
    ----------
    files : the folder.
    inspection : what they will be inspected by.
    folder : of the batch, which may lie within and is not looked into.

    Returns
    -------
    The newcomers, and files that are no lab files, each with the reason.

    Raises
    ------
    InputError
        If there is no lab file.
    """
    looked, own = look_through([files])
    looked = [file for file in looked if not _within(file.path, folder)]
    records = [record for file in looked for record in file.records]
    endings = {record.table.path.suffix.lower() for record in records}
    # What looks like a lab file and cannot be read, be it a link that leads nowhere, is no file to be passed over.
    unread = [f for f in looked if not f.records and _is_one(f, endings)]
    parted = [f for f in looked if f.records and f.left_out]
    left_out = [(f.shown, "; ".join(f.left_out)) for f in looked if not f.records and f not in unread]
    left_out += [(path.relative_to(files).as_posix(), "written by calib") for path in own if not _within(path, folder)]
    if not records and not unread:
        names = ", ".join(name for name, _ in left_out[:3])
        raise InputError(Fault(f"there is no lab file in this folder{f', only {names}' if names else ''}", files))
    order = {id(record): k for k, record in enumerate(records)}
    specimens = sorted(pair(records), key=lambda s: min(order[id(r)] for r in _records(s)))
    against = _copies(specimens, inspection)
    experiment = inspection.lot.experiment
    ones = [presented(s, inspection.template, experiment, against.get(k, ())) for k, s in enumerate(specimens)]
    ones = _with_names_of_others(ones, inspection)
    for file in unread:
        advice = file.faults[0].advice if file.faults and file.faults[0].advice else "Look at it"
        action = f"{advice}; or move it out of the folder, if it is no lab file"
        ones.append(_not_read(file, Reason("files", "red", f"{file.shown} cannot be read: {file.left_out[0]}", action)))
    for file in parted:
        for why in file.left_out:
            ones.append(_not_read(file, Reason("files", "red", f"a part of {file.shown} cannot be read: {why}", "Look at it")))
    return _uniquely_named(ones), tuple(left_out)


def _is_one(file: Looked, endings: Collection[str]) -> bool:
    """Whether a file without records would be a lab file, by its ending and those of the files that are."""
    if file.path.name.startswith((".", "~$")):
        return False
    return file.path.suffix.lower() in endings if endings else bool(file.faults)


def _within(path: Path, folder: Path) -> bool:
    return real_path(path).is_relative_to(real_path(folder))


def _records(specimen: Pressed) -> Iterator[Any]:
    for press in specimen.presses:
        yield from (record for record in (press.force, press.capacitance) if record is not None)


def _copies(specimens: Sequence[Pressed], inspection: Inspection) -> dict[int, tuple[Reason, ...]]:
    """What speaks against specimens with the same readings as another, or as the lot itself, whole or in part."""
    of_lot = {sha256: sweep.specimen for sweep in inspection.sweeps for _, sha256 in sweep.files}
    lot = readings_of_sweeps(inspection.lot.experiment, inspection.sweeps)
    readings: dict[str | int, Sequence[Held]] = dict(lot.items())
    readings.update({k: readings_in(list(_records(s))) for k, s in enumerate(specimens)})
    bytes_of = [{(r.table.sha256, r.reading.specimen) for r in _records(s)} for s in specimens]
    same = {frozenset(pair) for pair in held_twice(readings)}
    found: dict[int, tuple[Reason, ...]] = {}
    for k in range(len(specimens)):
        reasons = []
        mine = sorted({of_lot[sha256] for sha256, _ in bytes_of[k] if sha256 in of_lot})
        mine += [name for name in lot if frozenset({name, k}) in same and name not in mine]
        if mine:
            reasons.append(counted_already(mine[0]))
        others = [j for j in range(len(specimens)) if j != k]
        copies = [j for j in others if bytes_of[j] & bytes_of[k]]
        parts = [j for j in others if frozenset({j, k}) in same and j not in copies]
        for alike, what in ((copies, "its files have the same bytes as those"), (parts, "its readings, or a part, are those")):
            if alike:
                names = ", ".join(specimens[j].name for j in alike[:3])
                reasons.append(held_by_another(f"{what} of {names}"))
        if reasons:
            found[k] = tuple(reasons)
    return found


def _with_names_of_others(ones: Sequence[Presented], inspection: Inspection) -> list[Presented]:
    """Newcomers, with an amber reason where a file says that it is of another of them."""
    specimens = tuple(replace(inspection.template, name=one.name, sweeps=one.sweeps) for one in ones)
    against: dict[str, list[Reason]] = {}
    for other in files_of_others(replace(inspection.lot.experiment, specimens=specimens)):
        finding = f"its file {other.file} {other.says} like one of {other.other}"
        advice = "Make sure that it is of this specimen; if it is, mend the name or the label"
        against.setdefault(other.specimen, []).append(Reason("names", "amber", finding, advice))
    return [replace(one, reasons=(*one.reasons, *against.get(one.name, ()))) for one in ones]


def _not_read(file: Looked, reason: Reason) -> Presented:
    return Presented(file.shown, (), ((file.shown, _hash_of(file.path)),), "", (reason,))


def _hash_of(path: Path) -> str:
    """Hash of a file, "" of one that cannot be opened at all."""
    try:
        return sha256_of(path)
    except OSError:
        return ""


def _uniquely_named(ones: Sequence[Presented]) -> list[Presented]:
    counts = Counter(one.name for one in ones)
    seen: Counter[str] = Counter()
    found = []
    for one in ones:
        seen[one.name] += 1
        found.append(one if counts[one.name] == 1 else replace(one, name=f"{one.name} ({seen[one.name]})"))
    return found


# --- what is kept -------------------------------------------------------------------------------------------------------


def _parts(run: Run, inspection: Inspection) -> dict[str, Any]:
    """All that the numbers of a specimen rest on, but its own files."""
    s = inspection.specification
    return {
        "version": BATCH_VERSION,
        "posterior": run.posterior_sha256,
        "forward": inspection.forward.identity,
        "specification": None if s is None else s.to_plain(),
        "force": inspection.force,
        "like": inspection.template.name,
        "seed": inspection.seed,
        "chains": inspection.chain_seconds > 0,
        "against": [reason.in_words for reason in inspection.reasons],
    }


def _unsettled(row: Inspected) -> bool:
    """Whether a specimen is red for want of time for its chains: with more of it they may converge."""
    return any(reason.gate == "weights" for reason in row.verdict.reasons)


def _key(parts: Mapping[str, Any], one: Presented) -> str:
    """What tells a specimen, and all that its numbers rest on, from others."""
    own = {"name": one.name, "files": one.files, "started": one.started, "against": [r.in_words for r in one.reasons]}
    presses = [[s.name, s.force is None, s.capacitance is None, s.force_reading.specimen] for s in one.sweeps]
    return hashlib.sha256(json.dumps([parts, own, presses], sort_keys=True).encode("utf-8", "surrogateescape")).hexdigest()


def _line(key: str, row: Inspected) -> str:
    return record_to_text(_LINE, BATCH_VERSION, {"key": key, "row": inspected_to_plain(row)}, indent=None, exact=True)


def _kept(path: Path) -> dict[str, Inspected]:
    """Specimens that a folder holds, by their keys; a line that is not as it was written counts for nothing."""
    if not path.exists():
        return {}
    found = {}
    for line in path.read_bytes().decode("utf-8", errors="replace").splitlines():
        try:
            record = record_from_text(_LINE, BATCH_VERSION, line)
            found[record["key"]] = inspected_from_plain(record["row"])
        except (ValueError, KeyError, TypeError):
            continue
    return found


# --- what is written ----------------------------------------------------------------------------------------------------

_COLUMNS = (
    *("young_modulus", "relative_permittivity", "sensor_thickness", "padding_thickness", "dielectric_thickness"),
    *("signal", "stroke"),
)


def _write(folder: Path, found: Batch, run: Run, files: Path) -> None:
    """Write the table, the page, and last the record, which has the hashes of both."""
    from calib.report import batch_page

    for name in (TABLE, PAGE, RECORD):
        (folder / name).unlink(missing_ok=True)
    write_text(folder / TABLE, batch_csv(found))
    write_text(folder / PAGE, batch_page(found))
    risks = found.risks
    content = {
        "lot": {
            "name": found.lot,
            "run": str(run.folder.absolute()),
            "posterior": found.posterior_sha256,
            "pooling": found.pooling,
            "like": found.like,
            "updated": False,
            "verdict": found.of_lot.to_plain(),
        },
        "files": str(files.absolute()),
        "specification": None if found.specification is None else found.specification.to_plain(),
        "force": found.force,
        "seed": found.seed,
        "verdict": found.verdict.to_plain(),
        "lights": {light: found.count(light) for light in ("green", "amber", "red")},
        "risks": None if risks is None else {"consumers": risks.consumers, "producers": risks.producers},
        "trends": [{**asdict(t), "drifts": t.drifts, "in_words": t.in_words(DRIFTING[t.quantity])} for t in found.trends],
        "expected": {name: list(values) for name, values in found.expected.items()},
        "left_out": [{"file": file, "why": why} for file, why in found.left_out],
        "conditions": list(found.conditions),
        "specimens": [
            {**inspected_to_plain(row), "light": row.light, "belongs": row.belongs, "decision": row.decision}
            for row in found.rows
        ],
        "written": {name: sha256_of(folder / name) for name in (TABLE, PAGE)},
    }
    write_text(folder / RECORD, record_to_text(_KIND, BATCH_VERSION, content))


def batch_csv(found: Batch) -> str:
    """A batch as a table, a row for each specimen, SI.

    Parameters
    ----------
    found : the batch.
    """
    limits = [] if found.specification is None else [limit.in_words for limit in found.specification.limits]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    estimates = [f"{name}{end}" for name in _COLUMNS for end in ("", "_sd", "_05", "_95")]
    judged = ["probability_of_conformity", "probability_error", "consumers_risk", "producers_risk"]
    lights = ["specimen", "light", "lot_light", "belongs", "decision"]
    heads = [*lights, *judged, *(f"outside: {limit}" for limit in limits), *estimates, "signal_at_N"]
    strays = [f"{name}_z" for name in _COLUMNS[:5]]
    rest = ["fit_force_p", "fit_capacitance_p", "how", "k_hat", "effective_draws", "started", "reasons", "files"]
    writer.writerow([*heads, *strays, *rest])
    for row in found.rows:
        c = row.conformity if row.decision != "none" else None
        values: list[object] = [_cell(row.name), row.light, found.of_lot.colour, row.belongs, row.decision]
        values += [None] * 4 if c is None else [c.probability, c.error, c.consumers_risk, c.producers_risk]
        values += [None if c is None else c.fails.get(limit) for limit in limits]
        values += [n for name in _COLUMNS for n in row.estimates.get(name, (None,) * 4)]
        z = {s.quantity: s.z for s in row.strangers}
        values += [row.force, *(z.get(name) for name in _COLUMNS[:5])]
        values += [row.fits.get("force"), row.fits.get("capacitance"), row.how, row.k_hat, row.effective, row.started]
        values += [_cell("; ".join(f"{r.level}, {r.gate}: {r.finding}" for r in row.own))]
        values += [_cell(" ".join(name for name, _ in row.files))]
        writer.writerow([_number(value) for value in values])
    return text.getvalue()


def _number(value: object) -> object:
    if isinstance(value, float):
        return f"{value:.6g}" if value == value and abs(value) != float("inf") else ""
    return "" if value is None else value


def _cell(text: str) -> str:
    """A text that no spreadsheet takes for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t") else text


def is_batch(folder: Path) -> bool:
    """Whether a folder is that of a batch, finished or not."""
    return (folder / RECORD).is_file() or (folder / LINES).is_file()


def verify_batch(folder: Path) -> tuple[Finding, ...]:
    """Hold the files of a batch against the hashes in its record, and those that it was made from against what was read.

    Parameters
    ----------
    folder : of the batch.

    Raises
    ------
    InputError
        If there is none, or another process is writing into it.
    """
    if said := owner_of(folder):
        raise InputError(Fault(f"this folder is in use by {said}", folder, advice="Wait until it has ended"))
    path = folder / RECORD
    try:
        record = exact_record_from_text(_KIND, BATCH_VERSION, path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return (Finding(RECORD, "not finished", "run `calib batch` again: it goes on with what there is"),)
    except (OSError, ValueError) as error:
        return (Finding(RECORD, "changed", str(error)),)
    found = [Finding(RECORD, "fine")]
    for name, digest in record["written"].items():
        found.append(_compared(folder / name, name, digest))
    found.append(_compared(Path(record["lot"]["run"]) / "posterior.nc", "posterior of the lot", record["lot"]["posterior"]))
    for row in record["specimens"]:
        for name, digest in row["files"]:
            if digest:
                found.append(_compared(Path(record["files"]) / name, f"lab file {name}", digest))
    return tuple(found)


def _compared(path: Path, name: str, digest: str) -> Finding:
    try:
        return Finding(name, "fine" if sha256_of(path) == digest else "changed")
    except OSError as error:
        return Finding(name, "missing", error.strerror or "")
