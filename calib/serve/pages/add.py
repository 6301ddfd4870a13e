"""One more file for the experiment that there is, as another press or another specimen; what it cannot tell is asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.errors import Fault, InputError
from calib.serve import adding, looking
from calib.serve.commands import drafting, reading_command, typed
from calib.serve.offering import offer
from calib.serve.page import elsewhere, form_of, in_words, query_of, shown, space_of, working, writing


async def add(request: Request) -> Response:
    """The form for one file; without a file those that may be added."""
    query = query_of(request)
    return await working(_page, request, query, ())


async def put(request: Request) -> Response:
    """Put it into the experiment, or say everything that is not said yet."""
    space, form = space_of(request), await form_of(request)

    def added() -> None:
        space.write_experiment(adding.added(space, form))

    try:
        await writing(added)
    except InputError as error:
        return await working(_page, request, form, error.faults, 422)
    return elsewhere("/experiment")


def _page(request: Request, form: Mapping[str, str], faults: tuple[Fault, ...], status: int = 200) -> Response:
    space = space_of(request)
    offered = offer(space, form.get("name", ""), form.get("partner"))
    understood = offered.found.observations
    assert understood is not None
    files = [name for name in (offered.found.name, offered.partner) if name]
    chosen = f"{adding.OF}{offered.specimen}" if offered.specimen else ""
    usual = {"specimen": offered.name, "press": offered.press, "first": "press 1", "of": chosen}
    values: dict[str, Any] = {"form": {**usual, **form}, "wrong": in_words(faults, space)}
    return shown(
        request,
        "add.html.j2",
        status,
        offer=offered,
        o=understood,
        grades=[g for g in looking.grades(space, understood) if g[0] != "good"],
        tie_faults=in_words(offered.faults, space),
        columns=looking.columns_of(understood),
        experiment=space.experiment.name,
        commands=[
            reading_command(offered.found.name, offered.found.said),
            typed(drafting(space, files, space.free_name("more", ".toml"))),
            typed(["check", space.experiment.name]),
        ],
        new=adding.NEW,
        of=adding.OF,
        **values,
    )


ROUTES = (
    Route("/files/add", add),
    Route("/files/add/put", put, methods=["POST"]),
)
