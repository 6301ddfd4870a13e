"""A calibration, who made it and how in, its certificate out: one frozen value, and that as certificate.json."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from calib.catalogue import CHANNELS, QUANTITIES, UnknownName
from calib.checks import (
    AMBER_ALLOWS,
    GREEN,
    Colour,
    Light,
    Reason,
    Verdict,
    lights_of,
    passed_gates,
    verdict_from_plain,
    verdict_of,
)
from calib.decision import open_models_of
from calib.digits import interval_text, with_uncertainty
from calib.experiment import Instrument, Laboratory, instrument_of, keys_of, model_in_words
from calib.lab import Sweep
from calib.records import record_from_text, record_to_text
from calib.report.rows import SENSOR_PARAMETERS, parameter_rows
from calib.sampling import FINGERPRINT, Posterior, coverage_intervals

#: Probability of the intervals [1].
COVERAGE = 0.95

#: Layout of certificate.json, and what it is by the colour of its verdict: the first thing that it says.
CERTIFICATE_FORMAT = 5
CERTIFICATE_KINDS: Mapping[Colour, str] = {
    "green": "certificate",
    "amber": "certificate with reservations",
    "red": "no certificate: do not use the numbers of this calibration",
}

_TITLES: Mapping[Colour, str] = {
    "green": "Certificate of calibration",
    "amber": "Certificate of calibration, with reservations",
    "red": "NOT A CERTIFICATE: do not use the numbers of this calibration",
}
_STATEMENTS: Mapping[Colour, str] = {
    "green": "Nothing that was looked at speaks against these results.",
    "amber": f"These results {AMBER_ALLOWS}.",
    "red": "The verdict on this calibration is red. This says how it came about, without its numbers, which must not be used.",
}

#: Gate of a day that is stated and was still to come when the certificate was issued: of a certificate, not of its run.
DAY_GATE = "day"
# It is already tomorrow elsewhere: so much earlier than in UTC a day begins in the east.
_EARLIEST = timedelta(hours=14)

#: What no certificate of this program is.
NOT_ACCREDITED = (
    "Issued by the laboratory named here, on its own responsibility. This is no certificate of an accredited calibration "
    "laboratory (ISO/IEC 17025), and no statement on traceability beyond that of the instruments named here."
)
#: How results are meant.
MEANT = (
    "Value: mean of the posterior. Standard uncertainty: its standard deviation. Interval: holds the value with a probability "
    "of 95 %, as likely below as above (JCGM 101:2008). All within the model that is named, given what was taken as known."
)


# What is looked for of a laboratory and of an instrument, by key of the experiment file; and what stands there until it is
# filled in, which no reader of such a file takes.
_WHO: Mapping[str, str] = {
    "name": "which laboratory",
    "country": "where it is",
    "operator": "who measured",
    "measured": "when it was measured",
}
_WHAT_WITH: Mapping[str, str] = {"serial": "the serial number", "calibrated": "the day of the last calibration"}
_BLANKS = {
    **dict.fromkeys((*_WHO, *_WHAT_WITH), '"..."'),
    "country": '".."',
    "measured": '"YYYY-MM-DD"',
    "calibrated": '"YYYY-MM-DD"',
}


@dataclass(frozen=True)
class CertifiedValue:
    """One result, SI.

    Attributes
    ----------
    name : as in summary.json.
    label : what it is called.
    of : the specimen; "" if it is of all.
    unit : SI; "1" for a plain number.
    value : mean.
    standard_uncertainty : standard deviation.
    interval_95 : between what it lies with 95 %.
    learned : what the data had to do with it, in words.
    """

    name: str
    label: str
    of: str
    unit: str
    value: float
    standard_uncertainty: float
    interval_95: tuple[float, float]
    learned: str

    @property
    def shown(self) -> tuple[str, str, str]:
        """Value with standard uncertainty, interval, and the unit in which both are shown, rounded by the uncertainty."""
        q = QUANTITIES[UnknownName.parse(self.name).parameter]
        k = q.display_scale
        lower, upper = self.interval_95
        return (
            with_uncertainty(self.value * k, self.standard_uncertainty * k),
            interval_text(lower * k, upper * k),
            q.display_unit,
        )


@dataclass(frozen=True)
class KnownValue:
    """One quantity that was taken as known, SI."""

    name: str
    label: str
    unit: str
    value: float

    @property
    def shown(self) -> str:
        """Name and value, in the unit of display."""
        q = QUANTITIES[UnknownName.parse(self.name).parameter]
        return f"{self.label} {self.value * q.display_scale:.6g} {q.display_unit}".rstrip()


@dataclass(frozen=True)
class Origin:
    """How a calibration came about, as its folder and its files tell.

    Attributes
    ----------
    forward : name and hash of the forward model, one for each model of an average.
    commands : that what is certified comes of, and the one that certified it: command, when, and of which version.
    inputs : the files that it was made from: what each is, its name and its SHA-256.
    text : of the experiment file, as it was; None if that is not there any more.
    software : name -> version of what this certificate is made with.
    """

    forward: tuple[str, ...]
    commands: tuple[Mapping[str, str], ...]
    inputs: tuple[Mapping[str, str], ...]
    text: str | None
    software: Mapping[str, str]


@dataclass(frozen=True)
class Certificate:
    """What a laboratory hands on of a calibration.

    Attributes
    ----------
    number : of the certificate, from its content.
    issued : when, UTC, ISO 8601.
    name : of the experiment.
    verdict : on the calibration.
    gates : all that it was held against, each with its light: what speaks against it first, and what is green.
    converged : whether its chains have.
    results : of the sensor; none where the verdict is red.
    known : quantities that a prior fixed.
    model : what was calibrated, in words.
    open_models : models that the data do not rule out beside it, in words, each with what it would make of the modulus; none
        where the verdict is red.
    specimens : names of the sensors that were measured.
    laboratory, instruments : who measured, and what with.
    origin : how the calibration came about.
    calibrated_with : name -> version, platform and commit at the time of sampling.
    experiment : name of the experiment's file, and its SHA-256.
    seed : of the run.
    fingerprint : of the run.
    started, ended : when it was sampled, UTC, ISO 8601.
    unsaid : what a reader may look for and does not find, in words.
    to_add : lines of the experiment file that say what is missed, to be filled in.
    """

    number: str
    issued: str
    name: str
    verdict: Verdict
    gates: tuple[Light, ...]
    converged: bool
    results: tuple[CertifiedValue, ...]
    known: tuple[KnownValue, ...]
    model: str
    open_models: tuple[str, ...]
    specimens: tuple[str, ...]
    laboratory: Laboratory
    instruments: tuple[Instrument, ...]
    origin: Origin
    calibrated_with: Mapping[str, str]
    experiment: tuple[str, str]
    seed: int
    fingerprint: str
    started: str
    ended: str
    unsaid: tuple[str, ...]
    to_add: tuple[str, ...]

    @property
    def title(self) -> str:
        """What it is, the first line of it."""
        return _TITLES[self.verdict.colour]

    @property
    def statement(self) -> str:
        """What its verdict means, in a few sentences."""
        return _statement(self.verdict.colour, len(self.open_models), missed_in(self.laboratory, self.instruments))

    @property
    def missed(self) -> tuple[str, ...]:
        """What a customer looks for and does not find: who measured, where, when, and with what."""
        return missed_in(self.laboratory, self.instruments)

    @property
    def usable(self) -> bool:
        """Whether its numbers may be used."""
        return self.verdict.colour != "red"


def certify(posterior: Posterior, verdict: Verdict, origin: Origin, issued: str) -> Certificate:
    """Make the certificate of a calibration.

    Parameters
    ----------
    posterior : the calibration.
    verdict : on it; where it is red no result is certified. Days that are stated and later than `issued` are reasons besides.
    origin : how it came about.
    issued : when, UTC, ISO 8601.
    """
    e, attrs = posterior.experiment, posterior.attrs
    verdict = verdict_of([*verdict.reasons, *_still_to_come(e.laboratory, e.instruments, issued)])
    known = tuple(
        KnownValue(name, _name(name), QUANTITIES[UnknownName.parse(name).parameter].unit or "1", float(value))
        for name, value in posterior.fixed.items()
    )
    certificate = Certificate(
        number="",
        issued=issued,
        name=e.name,
        verdict=verdict,
        gates=lights_of(verdict, passed_gates(posterior, verdict)),
        converged=posterior.diagnostics.converged,
        results=results_of(posterior) if verdict.colour != "red" else (),
        known=known if verdict.colour != "red" else (),
        model=model_in_words(e) if not posterior.diagnostics.models else _models(posterior),
        open_models=certified_models(posterior, verdict.colour),
        specimens=tuple(dict.fromkeys(sweep.specimen for sweep in posterior.sweeps)),
        laboratory=e.laboratory,
        instruments=e.instruments,
        origin=origin,
        calibrated_with={
            key.removeprefix("version of "): value
            for key, value in attrs.items()
            if key.startswith("version of ") or key in ("platform", "commit")
        },
        experiment=(e.file_name, e.sha256),
        seed=posterior.seed,
        fingerprint=attrs.get(FINGERPRINT, ""),
        started=attrs.get("started", ""),
        ended=attrs.get("ended", ""),
        unsaid=_unsaid(e.laboratory, e.instruments, (e.sha256, origin.text), origin.inputs, commit="commit" in attrs),
        to_add=lines_to_add(e.laboratory, e.instruments, posterior.sweeps),
    )
    return replace(certificate, number=certificate_number(certified_content(certificate)))


def certificate_number(content: Mapping[str, Any]) -> str:
    """The number of a certificate, which is of its content.

    Parameters
    ----------
    content : of certificate.json, without kind, format and checksum.
    """
    numbered = {key: value for key, value in content.items() if key not in ("number", "files")}
    digest = hashlib.sha256(json.dumps(numbered, sort_keys=True).encode()).hexdigest()[:16].upper()
    return "-".join(digest[k : k + 4] for k in range(0, len(digest), 4))


def certified_models(posterior: Posterior, colour: Colour) -> tuple[str, ...]:
    """The models that a certificate says the data do not rule out: their numbers are none to be used where the verdict is red.

    Parameters
    ----------
    posterior : the calibration.
    colour : of the verdict that is certified.
    """
    return open_models_of(posterior) if colour != "red" else ()


def results_of(posterior: Posterior) -> tuple[CertifiedValue, ...]:
    """What a certificate says of the sensor: every unknown of it, those of the rig and of noises left out.

    Parameters
    ----------
    posterior : the calibration.
    """
    intervals = coverage_intervals(posterior, COVERAGE)
    return tuple(
        CertifiedValue(
            row.name,
            row.label,
            row.where,
            QUANTITIES[row.parameter].unit or "1",
            float(posterior.diagnostics.parameters[row.name].mean),
            float(posterior.diagnostics.parameters[row.name].sd),
            intervals[row.name],
            row.learned,
        )
        for row in parameter_rows(posterior)
        if row.parameter in SENSOR_PARAMETERS
    )


def certificate_json(certificate: Certificate, files: Mapping[str, str]) -> str:
    """Write the content of certificate.json: all of a certificate, SI, with the hashes of the files that it is of.

    Its first key, `kind`, says whether it is one: "certificate", "certificate with reservations", or "no certificate: ...",
    which holds no results. `files` has the SHA-256 of every file of the run and of the other files of the certificate as they
    were when it was issued; a signature of certificate.json so is one of all of them.

    Parameters
    ----------
    certificate : as made.
    files : name in the folder of the run -> SHA-256.
    """
    content = {**_content(certificate), "number": certificate.number, "files": dict(files)}
    order = ("title", "statement", "number", "verdict", "gates", "open_models")
    content = {key: content[key] for key in order} | content
    return record_to_text(CERTIFICATE_KINDS[certificate.verdict.colour], CERTIFICATE_FORMAT, content)


def _content(c: Certificate) -> dict[str, Any]:
    return {
        "title": c.title,
        "statement": c.statement,
        "issued": c.issued,
        "name": c.name,
        "verdict": c.verdict.to_plain(),
        "gates": [asdict(light) for light in c.gates],
        "open_models": list(c.open_models),
        "converged": c.converged,
        "results": [asdict(value) for value in c.results] if c.usable else None,
        "coverage_probability": COVERAGE,
        "meant": MEANT,
        "taken_as_known": [asdict(value) for value in c.known],
        "model": c.model,
        "specimens": list(c.specimens),
        "laboratory": asdict(c.laboratory),
        "instruments": [keys_of(instrument) for instrument in c.instruments],
        "forward_model": list(c.origin.forward),
        "commands": [dict(command) for command in c.origin.commands],
        "calibrated_with": dict(c.calibrated_with),
        "certified_with": dict(c.origin.software),
        "started": c.started,
        "ended": c.ended,
        "seed": c.seed,
        "fingerprint": c.fingerprint,
        "experiment": {"file": c.experiment[0], "sha256": c.experiment[1], "text": c.origin.text},
        "inputs": [dict(entry) for entry in c.origin.inputs],
        "not_said": list(c.unsaid),
        "lines_to_add": list(c.to_add),
        "accreditation": NOT_ACCREDITED,
    }


def certified_content(certificate: Certificate) -> dict[str, Any]:
    """All that certificate.json says of a calibration, plain values, without the hashes of files.

    Parameters
    ----------
    certificate : as made.
    """
    kind = CERTIFICATE_KINDS[certificate.verdict.colour]
    text = record_to_text(kind, CERTIFICATE_FORMAT, {**_content(certificate), "number": certificate.number})
    return record_from_text(kind, CERTIFICATE_FORMAT, text)


def follows_from_itself(content: Mapping[str, Any]) -> dict[str, Any]:
    """What of a certificate follows from the rest of it, by name: title, statement, what results mean, what it does not say.

    Parameters
    ----------
    content : of certificate.json.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is none.
    """
    colour: Colour = content["verdict"]["colour"]
    laboratory = Laboratory(**content["laboratory"])
    instruments = tuple(instrument_of(plain) for plain in content["instruments"])
    reasons = [reason for reason in verdict_from_plain(content["verdict"]).reasons if reason.gate != DAY_GATE]
    verdict = verdict_of([*reasons, *_still_to_come(laboratory, instruments, content["issued"])])
    green = {light["gate"] for light in content["gates"] if light["light"] == "green"}
    return {
        "verdict": verdict.to_plain(),
        "gates": [asdict(light) for light in lights_of(verdict, {gate: said for gate, said in GREEN.items() if gate in green})],
        "title": _TITLES[colour],
        "statement": _statement(colour, len(content["open_models"]), missed_in(laboratory, instruments)),
        "coverage_probability": COVERAGE,
        "meant": MEANT,
        "accreditation": NOT_ACCREDITED,
        "not_said": list(
            _unsaid(
                laboratory,
                instruments,
                (content["experiment"]["sha256"], content["experiment"]["text"]),
                content["inputs"],
                commit="commit" in content["calibrated_with"],
            )
        ),
    }


def _still_to_come(laboratory: Laboratory, instruments: Sequence[Instrument], issued: str) -> Iterator[Reason]:
    """A reason for each day that is stated and later than the clock by which a certificate was issued, wherever on earth.

    Nothing tells whether the day or the clock is wrong: both are said, and nothing is refused.
    """
    stated = [("as the day of measurement", "measured in [laboratory]", laboratory.measured_until)]
    named = [
        (f"as the last calibration of the {one.kind}", "calibrated in [[instruments]]", one.calibrated) for one in instruments
    ]
    latest = (datetime.fromisoformat(issued) + _EARLIEST).date().isoformat()
    for what, key, day in [*stated, *named]:
        if day > latest:
            finding = f"{day} is stated {what}, and the clock of the computer that issued this stood at {issued[:10]} (UTC)"
            yield Reason(DAY_GATE, "amber", finding, f"Put right the one that is wrong, {key} or the clock, and issue it again")


def missed_in(laboratory: Laboratory, instruments: Sequence[Instrument]) -> tuple[str, ...]:
    """What a customer looks for in a certificate and does not find: who measured, where, when, and with what; in words.

    Parameters
    ----------
    laboratory, instruments : as the experiment file says them.
    """
    said = _said(laboratory)
    missed = [what for key, what in _WHO.items() if not said[key]]
    if not instruments:
        missed.append("with which instruments, their serial numbers and last calibrations")
    for instrument in instruments:
        missed += [f"{what} of the {instrument.kind}" for key, what in _WHAT_WITH.items() if not getattr(instrument, key)]
        if instrument.calibrated and laboratory.measured and instrument.calibrated > laboratory.measured:
            missed.append(f"whether the {instrument.kind} was right when it measured: it was calibrated afterwards")
    return tuple(missed)


def _said(laboratory: Laboratory) -> dict[str, str]:
    """What is said of a laboratory; a city says where it is as well as a country."""
    return {**asdict(laboratory), "country": laboratory.country or laboratory.city}


# The head of a table that must stand once.
_ONCE = "[laboratory]  # or, if that table is there already, these lines into it"


def lines_to_add(laboratory: Laboratory, instruments: Sequence[Instrument], sweeps: Sequence[Sweep]) -> tuple[str, ...]:
    """The lines of an experiment file that say what is missed, to be filled in; what is left as it is here is refused there.

    Parameters
    ----------
    laboratory, instruments : as the experiment file says them.
    sweeps : that were measured: where no instrument is named, those that measured their channels are asked for.
    """
    said = _said(laboratory)
    lines = [f"{key} = {_BLANKS[key]}  # {what}" for key, what in _WHO.items() if not said[key]]
    if lines:
        lines.insert(0, "# into the table [laboratory] that is there:" if any(said.values()) else _ONCE)
    for instrument in instruments:
        own = [f"{key} = {_BLANKS[key]}" for key in _WHAT_WITH if not getattr(instrument, key)]
        lines += [f"# into the table [[instruments]] of the {instrument.kind}:", *own] if own else []
    if not instruments:
        for kind in _measured_with(sweeps):
            lines += ["[[instruments]]", f'kind = "{kind}"', *(f"{key} = {_BLANKS[key]}" for key in _WHAT_WITH)]
        lines.append("# and likewise the testing machine, and what ball, disc and thicknesses were measured with")
    return tuple(lines)


def _measured_with(sweeps: Sequence[Sweep]) -> list[str]:
    """The instruments that measured the channels of sweeps, in the order of the catalogue."""
    measured = {name for sweep in sweeps for name in sweep.channels}
    if any(points.force is not None for sweep in sweeps for points in sweep.channels.values()):
        measured.add("force")  # read beside another channel, and no channel of its own
    return list(dict.fromkeys(channel.instrument for name, channel in CHANNELS.items() if name in measured))


def _statement(colour: Colour, n_open: int, missed: Sequence[str]) -> str:
    """What a verdict means, and what it does not hold for."""
    statement = _STATEMENTS[colour]
    if n_open:
        told = "one other model" if n_open == 1 else f"{n_open} other models"
        statement += f" They hold under the model that is named, and the data do not rule out {told}: see below."
    if missed:
        statement += " This is of the numbers alone: who measured, where, when or with what is not said in full, see below."
    return statement


def _models(posterior: Posterior) -> str:
    return "average of " + "; ".join(f"{m.name} ({m.model}), weight {m.weight:.2f}" for m in posterior.diagnostics.models)


def _name(name: str) -> str:
    return UnknownName.parse(name).label


def _unsaid(
    laboratory: Laboratory,
    instruments: Sequence[Instrument],
    experiment: tuple[str, str | None],
    inputs: Sequence[Mapping[str, str]],
    *,
    commit: bool,
) -> tuple[str, ...]:
    """What a reader of a certificate may look for and does not find; of the experiment file are told its hash and text."""
    unsaid = list(missed_in(laboratory, instruments))
    sha256, text = experiment
    if text is None:
        unsaid.append("the text of the experiment file, which is not there any more as it was")
    if any(entry["what"] == "experiment" and entry["sha256"] != sha256 for entry in inputs):
        unsaid.append("the experiment files of the other models that are averaged, whose hashes stand among the inputs")
    if not commit:
        unsaid.append("the commit of the program, which ran from no clone or before commits were kept")
    return tuple(unsaid)
