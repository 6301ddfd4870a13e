"""A folder and who is let in, in, the application that serves its pages out."""

from __future__ import annotations

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route

from calib.errors import InputError
from calib.runs import NotUsableError, PageError
from calib.serve import page
from calib.serve.keys import Keys
from calib.serve.pages import add, calibrate, certificate, check, experiment, export, files, measure, padding, runs
from calib.serve.security import Door, Guarded
from calib.serve.workspace import Workspace
from models.response import ConvergenceError, OutOfRangeError

_STATIC = {"serve.css": "text/css", "serve.js": "text/javascript"}


def app_of(space: Workspace, door: Door, keys: Keys | None = None) -> Starlette:
    """The application that serves the pages of a folder.

    Parameters
    ----------
    space : the folder.
    door : who is let in.
    keys : that it may sign with; None for those that lie in the folder.
    """
    app = Starlette(
        routes=[
            Route("/", _begin),
            Route("/static/{name}", _static),
            *files.ROUTES,
            *add.ROUTES,
            *experiment.ROUTES,
            *check.ROUTES,
            *calibrate.ROUTES,
            *padding.ROUTES,
            *runs.ROUTES,
            *certificate.ROUTES,
            *export.ROUTES,
            *measure.ROUTES,
        ],
        middleware=[Middleware(Guarded, door=door)],
        exception_handlers={
            InputError: page.not_understood,
            page.TooLargeError: page.too_large,
            OSError: page.no_place,
            **dict.fromkeys((OutOfRangeError, ConvergenceError, PageError, NotUsableError, MemoryError), page.not_computed),
            HTTPException: page.no_page,
            ClientDisconnect: page.gone,
            Exception: page.defect,
        },
    )
    app.state.space = space
    app.state.keys = Keys(space) if keys is None else keys
    return app


async def _begin(request: Request) -> Response:
    space = page.space_of(request)
    return page.elsewhere("/run", name=space.opened) if space.opened in space.runs() else page.elsewhere("/files")


async def _static(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in _STATIC:
        raise HTTPException(404)
    return Response(page.static(name), media_type=_STATIC[name])
