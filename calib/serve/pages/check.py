"""The third step: what files, geometry and priors promise, before anything is sampled."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.checks import expected_in_words, measured_in_words
from calib.report import check_status_in_words, duration_in_words, outlook_rows
from calib.runs import Check
from calib.serve.checking import check_of
from calib.serve.commands import typed
from calib.serve.page import part, shown, space_of, working


async def check(request: Request) -> Response:
    """The page, which loads what was found by itself, as that takes seconds."""
    space = space_of(request)
    command = typed(["check", space.experiment.name])
    return shown(request, "check.html.j2", command=command, exists=space.experiment.exists())


async def found(request: Request) -> Response:
    """What was found."""
    made = await working(check_of, space_of(request))
    return part("check_found.html.j2", **_words(made))


async def light(request: Request) -> Response:
    """The same in one line, for the page of the experiment."""
    made = await working(check_of, space_of(request))
    return part("check_light.html.j2", **_words(made))


def _words(made: Check) -> dict[str, object]:
    outlook = made.outlook
    return {
        "verdict": made.verdict,
        "status": check_status_in_words(made.verdict),
        "ranges": [(r.sweep, r.seen, measured_in_words(r), expected_in_words(r)) for r in made.ranges],
        "unknowns": [] if outlook is None else outlook_rows(outlook),
        "ridges": [] if outlook is None else [ridge.in_words for ridge in outlook.ridges],
        "unseen": [] if outlook is None else [one.in_words for one in outlook.unseen],
        "takes": "" if made.seconds is None else " to ".join(map(duration_in_words, made.seconds)),
    }


ROUTES = (
    Route("/check", check),
    Route("/check/found", found),
    Route("/check/light", light),
)
