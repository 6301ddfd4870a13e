"""A folder and who is let in, in, the application that serves its pages out."""

from __future__ import annotations

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.errors import InputError
from calib.serve import page
from calib.serve.pages import calibrate, check, experiment, files, padding, runs
from calib.serve.security import Door, Guarded
from calib.serve.workspace import Workspace

_STATIC = {"serve.css": "text/css", "serve.js": "text/javascript"}


def app_of(space: Workspace, door: Door) -> Starlette:
    """The application that serves the pages of a folder.

    Parameters
    ----------
    space : the folder.
    door : who is let in.
    """
    app = Starlette(
        routes=[
            Route("/", _begin),
            Route("/static/{name}", _static),
            *files.ROUTES,
            *experiment.ROUTES,
            *check.ROUTES,
            *calibrate.ROUTES,
            *padding.ROUTES,
            *runs.ROUTES,
        ],
        middleware=[Middleware(Guarded, door=door)],
        exception_handlers={
            InputError: page.not_understood,
            page.TooLargeError: page.too_large,
            OSError: page.no_place,
            HTTPException: page.no_page,
            Exception: page.defect,
        },
    )
    app.state.space = space
    return app


async def _begin(request: Request) -> Response:
    return page.elsewhere("/files")


async def _static(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in _STATIC:
        raise HTTPException(404)
    return Response(page.static(name), media_type=_STATIC[name])
