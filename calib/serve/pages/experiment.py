"""The second step: the experiment as a form and as the text that it writes, each with what is wrong beside it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from calib.errors import Fault, InputError
from calib.experiment import KeyPath
from calib.priors import FORMS
from calib.serve.commands import typed
from calib.serve.forms import Form, as_json, changed_by, decided_by, form_of_experiment
from calib.serve.looking import experiment_tables
from calib.serve.page import (
    answered,
    asked_by_script,
    elsewhere,
    form_of,
    in_words,
    rendered,
    shown,
    space_of,
    working,
    writing,
)
from calib.serve.toml_text import value_at, with_entry
from calib.serve.workspace import Workspace


async def experiment(request: Request) -> Response:
    """The form and the text."""
    space = space_of(request)
    text = await working(lambda: space.text)
    form = await working(form_of_experiment, space) if text else Form((), (), ())
    return shown(
        request,
        "experiment.html.j2",
        text=text,
        seen=_mark(text),
        form=form,
        faults=in_words(form.faults, space) if text else [],
        forms={kind: list(names) for kind, names in FORMS.items()},
        exists=space.experiment.exists(),
        command=typed(["check", space.experiment.name]),
    )


async def state(request: Request) -> Response:
    """What the file holds now, what is wrong with it, and the form of it."""
    return answered(await working(_state, space_of(request)))


class _ChangedError(Exception):
    """What is to be changed is not what was shown any more."""


def _require_as_shown(space: Workspace, at: KeyPath, given: Mapping[str, str]) -> None:
    """Refuse to change a field that is not what was shown any more."""
    now = as_json(value_at(experiment_tables(space), at))
    if "was" in given and now != given["was"]:
        raise _ChangedError(f"it was changed elsewhere meanwhile, to {now}: the page now shows that. Yours was not put in")


async def put(request: Request) -> Response:
    """Put one field's value into the file; refused if it was changed elsewhere since it was shown."""
    space, given = space_of(request), await form_of(request)
    at = _path(given.get("at", ""))

    def changed() -> None:
        _require_as_shown(space, at, given)
        space.write_experiment(changed_by(space, at, given))

    return await _answer(request, space, changed)


async def decide(request: Request) -> Response:
    """Say how a quantity is known: measured, or not and its guess stands, or undecided again; refused as `put`."""
    space, given = space_of(request), await form_of(request)
    at = _path(given.get("at", ""))

    def changed() -> None:
        _require_as_shown(space, at, given)
        space.write_experiment(decided_by(space, at, given))

    return await _answer(request, space, changed)


async def instrument(request: Request) -> Response:
    """Put one more instrument into the file, by what it is; all else of it is then filled in.

    Raises
    ------
    InputError
        If it is not said what it is.
    """
    space, given = space_of(request), await form_of(request)
    kind = given.get("kind", "").strip()
    if not kind:
        raise InputError(Fault("what is the instrument?", advice="Say for example load cell"))
    await writing(lambda: space.write_experiment(with_entry(space.text, ("instruments",), {"kind": kind})))
    return elsewhere("/experiment")


async def write(request: Request) -> Response:
    """Write the text; refused if the file was changed elsewhere since it was shown.

    Raises
    ------
    InputError
        If there is no text.
    """
    space, given = space_of(request), await form_of(request)
    if not given.get("text", "").strip():
        raise InputError(Fault("an experiment without a word is not written", advice="Reload the page to have it back"))
    text = given["text"].replace("\r\n", "\n")

    def written() -> None:
        now = space.text
        if given.get("seen") != _mark(now) and text != now:
            raise _ChangedError(
                "the file was changed elsewhere meanwhile: yours was not written. Copy it, then reload the page"
            )
        space.write_experiment(text)

    return await _answer(request, space, written)


async def _answer(request: Request, space: Workspace, change: Callable[[], None]) -> Response:
    """Make a change, and say what the file then holds."""
    plain = asked_by_script(request)
    try:
        await writing(change)
    except _ChangedError as changed:
        if not plain:
            raise InputError(Fault(str(changed))) from None
        return JSONResponse({**await working(_state, space), "refused": str(changed)}, 409)
    return answered(await working(_state, space)) if plain else elsewhere("/experiment")


def _state(space: Workspace) -> dict[str, Any]:
    text = space.text
    form = form_of_experiment(space)
    faults = in_words(form.faults, space)
    return {
        "text": text,
        "seen": _mark(text),
        "marked": len(form.marked),
        "faults": faults,
        "fields": {
            field.name: {
                "value": json.loads(as_json(field.value), parse_constant=str),
                "was": as_json(field.value),
                "wrong": field.wrong,
                "read": field.read,
                "task": field.task,
                "usual": bool(field.default),
                "marked": field.marked,
                "known": field.known,
                "by": field.by,
            }
            for field in form.fields
        },
        "drawn": rendered("fields.html.j2", form=form, faults=faults),
    }


def _path(text: str) -> KeyPath:
    try:
        found = json.loads(text)
    except ValueError:
        found = None
    if not isinstance(found, list) or not found or not all(isinstance(k, str | int) and not isinstance(k, bool) for k in found):
        raise InputError(Fault("this is no field of the experiment", advice="Reload the page"))
    return tuple(found)


def _mark(text: str) -> str:
    """By which one tells whether a text is still what was shown."""
    return hashlib.sha256(text.encode()).hexdigest()


ROUTES = (
    Route("/experiment", experiment),
    Route("/experiment/state", state),
    Route("/experiment/put", put, methods=["POST"]),
    Route("/experiment/decide", decide, methods=["POST"]),
    Route("/experiment/instrument", instrument, methods=["POST"]),
    Route("/experiment/write", write, methods=["POST"]),
)
