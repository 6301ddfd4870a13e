"""What a page shows in, its answer out; and a request's form, read up to a limit; and what is wrong with a request in words."""

from __future__ import annotations

import json
import threading
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from functools import cache, partial
from http import HTTPStatus
from importlib import resources
from typing import Any, TypeVar
from urllib.parse import parse_qs, quote

import jinja2
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response

from calib.errors import Fault, InputError, in_shell
from calib.hypertext import sentence
from calib.report import template_text
from calib.runs import PageError
from calib.serve.fields import by_fields, in_fields
from calib.serve.keys import Keys
from calib.serve.workspace import Workspace
from calib.visible import visible

#: Bytes of the largest form: an experiment file has at most a million.
LARGEST_FORM = 3_000_000

#: What a page is called, and where it is, in the order in which one works.
STEPS = (
    ("Files", "/files"),
    ("Experiment", "/experiment"),
    ("Check", "/check"),
    ("Calibrate", "/calibrate"),
    ("Padding", "/padding"),
    ("Runs", "/runs"),
)

_T = TypeVar("_T")
_WRITING = threading.Lock()


class TooLargeError(Exception):
    """A request has more bytes than it may have."""


def space_of(request: Request) -> Workspace:
    """The folder that a page works on."""
    found: Workspace = request.app.state.space
    return found


def keys_of(request: Request) -> Keys:
    """The keys that a page may sign and check with."""
    found: Keys = request.app.state.keys
    return found


async def working(work: Callable[..., _T], *given: Any) -> _T:
    """Do work that takes time beside all else that is asked for.

    Parameters
    ----------
    work : what is done.
    *given : of what.
    """
    return await run_in_threadpool(work, *given)


async def writing(work: Callable[..., _T], *given: Any) -> _T:
    """Do work that reads files of the folder and writes them anew, one after the other.

    Parameters
    ----------
    work : what is done.
    *given : of what.
    """

    def one_at_a_time() -> _T:
        with _WRITING:
            return work(*given)

    return await run_in_threadpool(one_at_a_time)


async def limited(request: Request, most: int) -> AsyncIterator[bytes]:
    """The bytes of a request as they come, no more than it may have.

    Parameters
    ----------
    request : that was sent.
    most : bytes.

    Raises
    ------
    TooLargeError
        If there are more, before they come where their number is said.
    """
    said = request.headers.get("content-length", "0")
    if not said.isdecimal() or int(said) > most:
        raise TooLargeError
    size = 0
    async for chunk in request.stream():
        size += len(chunk)
        if size > most:
            raise TooLargeError
        yield chunk


async def form_of(request: Request) -> dict[str, str]:
    """Fields of the form that a request sends; of several of one name the last.

    Parameters
    ----------
    request : that was sent.

    Raises
    ------
    InputError
        If it is no form.
    TooLargeError
        If it is too large.
    """
    return {name: values[-1] for name, values in (await lists_of(request)).items()}


async def lists_of(request: Request) -> dict[str, list[str]]:
    """Fields of the form that a request sends, each with all its values.

    Parameters
    ----------
    request : that was sent.

    Raises
    ------
    InputError
        If it is no form.
    TooLargeError
        If it is too large.
    """
    content = b"".join([chunk async for chunk in limited(request, LARGEST_FORM)])
    try:
        text = content.decode("utf-8")
        return parse_qs(text, keep_blank_values=True, strict_parsing=bool(text), errors="strict", max_num_fields=2000)
    except ValueError:
        raise InputError(Fault("this is no form of the page", advice="Reload the page")) from None


def query_of(request: Request) -> dict[str, str]:
    """What stands in the address of a request behind its question mark."""
    return dict(request.query_params)


# --- answers ------------------------------------------------------------------------------------------------------------


def shown(request: Request, template: str, code: int = 200, **values: Any) -> Response:
    """Lay out a page.

    Parameters
    ----------
    request : that it answers.
    template : its name.
    code : status of the answer.
    **values : what the page shows.
    """
    space = space_of(request)
    frame = {"steps": STEPS, "path": request.url.path, "folder": str(space.folder)}
    return HTMLResponse(rendered(template, **frame, **values), code)


def elsewhere(path: str, **query: str) -> Response:
    """Lead on to another page, which a reload then loads.

    Parameters
    ----------
    path : of the page.
    **query : what stands in its address.
    """
    return RedirectResponse(address(path, **query), 303)


def address(path: str, **query: str) -> str:
    """Address of a page with what stands in it.

    >>> address("/run", name="a b")
    '/run?name=a%20b'

    Parameters
    ----------
    path : of the page.
    **query : name -> text.
    """
    words = "&".join(f"{name}={quote(value, safe='')}" for name, value in query.items())
    return f"{path}?{words}" if words else path


def in_words(faults: Sequence[Fault], space: Workspace) -> list[str]:
    """What is wrong, one sentence or two each; files of the folder by their names.

    Parameters
    ----------
    faults : what was found.
    space : the folder.
    """
    found = []
    for fault in faults:
        text = visible(str(fault)).replace(f"{space.folder}/", "")
        if (asked := in_fields(text)) != text and (name := _lab_file_of(fault, space)):
            text = f"{asked.rstrip('.')}: on the page of {name}"
        if fault.path is None and text.split(" ", 1)[0].isalpha():  # no key of a file
            text = f"{text[0].upper()}{text[1:]}"
        found.append(text if text.endswith((".", "?", ")", "`", '"')) else f"{text}.")
    return found


def _lab_file_of(fault: Fault, space: Workspace) -> str:
    """Name of the lab file of the folder that a fault is in; "" for none."""
    if fault.path is None or not fault.path.is_relative_to(space.folder):
        return ""
    name = fault.path.relative_to(space.folder).as_posix()
    return name if name in space.lab_files() else ""


def asked_by_script(request: Request) -> bool:
    """Whether a script of the page waits for an answer, not the browser for the next page."""
    return "application/json" in request.headers.get("accept", "")


async def not_understood(request: Request, error: Exception) -> Response:
    """Answer a request that cannot be served as it is, with everything that is wrong with it.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    assert isinstance(error, InputError)
    return _refused(request, 422, in_words(error.faults, space_of(request)))


async def too_large(request: Request, error: Exception) -> Response:
    """Answer a request with more bytes than it may have; the rest of them is not read.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    answer = _refused(request, 413, ["This is larger than what the page takes. Copy a large file into the folder yourself."])
    answer.headers["Connection"] = "close"
    return answer


async def no_place(request: Request, error: Exception) -> Response:
    """Answer a request that the system cannot serve: no room, no permission, a file that has gone.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    assert isinstance(error, OSError)
    why = error.strerror or str(error)
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        name = str(error.filename or "A file").replace(f"{space_of(request).folder}/", "")
        said = f"{name} is not there any more: something else has moved or removed it. Reload the page."
        return _refused(request, 409, [visible(said)])
    advice = "Make room on the disk, or give permission, then try again; nothing was half written."
    return _refused(request, 507, [visible(f"{error.filename or 'The folder'}: {why}. {advice}")])


async def not_computed(request: Request, error: Exception) -> Response:
    """Answer a request whose numbers cannot be had, or must not be used, or whose page could not be drawn.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    said = str(error) or "There is not enough memory: close other programs, or ask for less at once"
    plain = visible(f"{said.rstrip('.')}.").replace(f"{space_of(request).folder}/", "")
    return _refused(request, 422, [plain], unchanged=not isinstance(error, PageError))


async def gone(request: Request, error: Exception) -> Response:
    """Answer nobody: who asked has gone before all of it had come, as by closing a tab.

    Parameters
    ----------
    request : that it would answer.
    error : that says so.
    """
    return Response(status_code=400)


async def no_page(request: Request, error: Exception) -> Response:
    """Answer a request for what there is not.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    status = getattr(error, "status_code", 404)
    return _refused(request, status, [f"{HTTPStatus(status).phrase}: look at the pages above."])


async def defect(request: Request, error: Exception) -> Response:
    """Answer a request that a defect of the program stands in the way of; its trace is in the terminal.

    Parameters
    ----------
    request : that it answers.
    error : what is wrong.
    """
    said = visible(f"{type(error).__name__}: {error}")
    return _refused(request, 500, [f"This is a defect of calib, not of your files. The terminal shows where: {said[:500]}"])


def _refused(request: Request, status: int, said: Sequence[str], *, unchanged: bool = True) -> Response:
    if asked_by_script(request):
        return JSONResponse({"faults": list(said)}, status)
    if request.headers.get("x-part") == "1":
        return HTMLResponse(rendered("faults.html.j2", faults=said), status)
    return shown(request, "refused.html.j2", status, faults=said, unchanged=unchanged)


def part(template: str, **values: Any) -> Response:
    """Lay out a part of a page, that the page loads by itself.

    Parameters
    ----------
    template : its name.
    **values : what it shows.
    """
    return HTMLResponse(rendered(template, **values))


def rendered(template: str, **values: Any) -> str:
    """Lay out a part of a page, to be answered with beside numbers and texts.

    Parameters
    ----------
    template : its name.
    **values : what it shows.
    """
    return _templates().get_template(template).render(**values)


def answered(content: Mapping[str, Any]) -> Response:
    """Answer with numbers and texts for the script."""
    return JSONResponse(dict(content))


@cache
def _templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("calib.serve"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["plainly"] = visible
    environment.filters["sentence"] = sentence
    environment.filters["by_fields"] = by_fields
    environment.filters["json"] = partial(json.dumps, default=str)
    environment.filters["word"] = in_shell
    environment.globals["address"] = address
    return environment


@cache
def static(name: str) -> bytes:
    """The page's own style and script, by name; tables that are too wide move in their boxes as in the report."""
    own = (resources.files("calib.serve") / "static" / name).read_bytes()
    return template_text("scroll.css").encode() + own if name == "serve.css" else own
