"""What a laboratory hands on of a run: its certificate is issued, signed with a key that stays here, shown and taken along."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from calib.errors import InputError
from calib.experiment import Experiment, keys_of, read_experiment
from calib.report import laboratory_gaps, lines_to_add, missed_in, status_in_words
from calib.runs import CERTIFICATES, certify_in
from calib.serve import page as serving
from calib.serve import viewing
from calib.serve.commands import typed
from calib.serve.keys import Keys
from calib.serve.page import answered, elsewhere, form_of, part, query_of, shown, space_of, working, writing
from calib.serve.security import POLICY_OF_REPORT
from calib.serve.workspace import Workspace
from calib.signature import read_signature

_PAGE, _JSON, _SIGNATURE = "certificate.html", "certificate.json", "certificate.json.minisig"
_ABOUT = {
    "certificate.html": "to print",
    "certificate.json": "for programs, all of it",
    "certificate.xml": "for other laboratories' programs, PTB's Digital Calibration Certificate",
    "ro-crate-metadata.json": "for archives, the folder as an RO-Crate",
    "certificate.json.minisig": "the signature",
}
_LABORATORY = {
    "name": "Laboratory",
    "operator": "Who measured",
    "email": "E-mail",
    "city": "City",
    "country": "Country",
    "customer": "Customer",
    "measured": "Measured on",
}
_INSTRUMENT = ("kind", "maker", "model", "serial", "calibrated", "class")


async def certificate(request: Request) -> Response:
    """The page of a run, which loads what it shows by itself."""
    name = query_of(request).get("name", "")
    space_of(request).run(name)
    return shown(request, "certificate.html.j2", name=name)


async def look(request: Request) -> Response:
    """Who measured with what, the keys that are here, and the certificate that there is."""
    space, name = space_of(request), query_of(request).get("name", "")
    folder = space.run(name)
    return part("certificate_look.html.j2", name=name, **await working(_look, space, serving.keys_of(request), folder, name))


def _look(space: Workspace, keys: Keys, folder: Path, name: str) -> dict[str, Any]:
    run = viewing.run_in(folder)
    experiment = run.posterior.experiment
    names, made = keys.names(), _made(keys, folder)
    signed = "" if made is None else made["key"].removesuffix(".pub")
    chosen = next((name for name in names if signed and name.removesuffix(".key") == signed), "")  # as it was signed before
    return {
        "verdict": run.verdict,
        "status": status_in_words(run.verdict),
        "laboratory": _laboratory(experiment),
        "instruments": _instruments(experiment),
        "columns": _INSTRUMENT,
        "gaps": laboratory_gaps(experiment.laboratory),
        "missed": missed_in(experiment.laboratory, experiment.instruments),
        "lines": lines_to_add(experiment.laboratory, experiment.instruments, run.posterior.sweeps),
        "changed": _changed(space, experiment),
        "members": [member.name for member in run.members],
        "resumed": typed(["calibrate", space.experiment.name, "-o", name, "--resume"]),
        "keys": [(one, keys.note(one)) for one in names],
        "new_key": space.free_name("lab", ".key").removesuffix(".key"),
        "chosen": chosen,
        "command": _command(name, chosen),
        "made": made,
        "files": [(one, _ABOUT[one]) for one in CERTIFICATES if (folder / one).is_file()],
    }


def _laboratory(experiment: Experiment) -> list[tuple[str, str]]:
    """What the experiment says of the laboratory, "" for what it does not."""
    said = experiment.laboratory
    rows = [(label, getattr(said, key)) for key, label in _LABORATORY.items() if key != "measured"]
    days = dict.fromkeys(day for day in (said.measured, said.measured_until) if day)
    return [*rows, (_LABORATORY["measured"], " to ".join(days))]


def _instruments(experiment: Experiment) -> list[list[str]]:
    return [[keys_of(one).get(key, "") for key in _INSTRUMENT] for one in experiment.instruments]


def _changed(space: Workspace, experiment: Experiment) -> bool:
    """Whether the experiment of the folder says something else of who measured, and with what, than the run does."""
    if experiment.path is None or experiment.path.name != space.experiment.name:
        return False
    try:
        now = read_experiment(space.experiment)
    except (InputError, OSError):
        return False
    return (now.laboratory, now.instruments) != (experiment.laboratory, experiment.instruments)


def _made(keys: Keys, folder: Path) -> dict[str, Any] | None:
    """The certificate that lies in a run, and by which key of ours it can be checked; None if there is none."""
    try:
        content = json.loads((folder / _JSON).read_text(encoding="utf-8"))
        told = {name: str(content[name]) for name in ("title", "number", "issued")}
        told |= {"colour": str(content["verdict"]["colour"])}
        unsaid = [str(what) for what in content["not_said"]]
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        told, unsaid = {"title": "A certificate that cannot be read", "number": "", "issued": "", "colour": "red"}, []
    key, signed = "", (folder / _SIGNATURE).is_file()
    if signed:
        try:
            number = read_signature(folder / _SIGNATURE).number
            key = next((name for name, public in keys.publics().items() if public.number == number), "")
        except InputError:
            key = ""
    return {**told, "unsaid": unsaid, "signed": signed, "key": key, "page": (folder / _PAGE).is_file()}


def _command(name: str, key: str) -> str:
    return typed(["certificate", name, *(["--key", key] if key else [])])


async def command(request: Request) -> Response:
    """The command of the form as it is filled in."""
    form = query_of(request)
    return answered({"command": _command(form.get("name", ""), form.get("key", ""))})


async def issue(request: Request) -> Response:
    """Issue the certificate of a run as `calib certificate` does; of a red one the statement that holds no results."""
    space, form = space_of(request), await form_of(request)
    name, key = form.get("name", ""), form.get("key", "")
    folder, keys = space.run(name), serving.keys_of(request)

    def issued() -> None:
        secret = keys.secret(key) if key else None
        certify_in(viewing.run_in(folder), key=secret, command=_command(name, key))

    await working(issued)
    return elsewhere("/certificate", name=name)


async def new_key(request: Request) -> Response:
    """Make a key pair in the folder as `calib key new` does, for who runs the page alone."""
    form, keys = await form_of(request), serving.keys_of(request)
    space_of(request).run(form.get("name", ""))
    await writing(keys.make, form.get("key_name", "").strip())
    return elsewhere("/certificate", name=form.get("name", ""))


async def page(request: Request) -> Response:
    """The certificate itself, which may run nothing."""
    path = space_of(request).result(query_of(request).get("name", ""), _PAGE)
    return HTMLResponse(await working(path.read_bytes), headers={"Content-Security-Policy": POLICY_OF_REPORT})


ROUTES = (
    Route("/certificate", certificate),
    Route("/certificate/look", look),
    Route("/certificate/command", command),
    Route("/certificate/page", page),
    Route("/certificate/issue", issue, methods=["POST"]),
    Route("/certificate/key", new_key, methods=["POST"]),
)
