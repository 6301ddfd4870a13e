"""The fifth step: what a sensor on any padding does, seen while one moves, and the advice of `calib recommend`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.decision import PLACE, Recommendation, Requirement, largest_force
from calib.errors import Fault, InputError
from calib.experiment import Specification, read_specification
from calib.files import write_text
from calib.report import status_in_words
from calib.runs import load_recommendation, read_listing, recommend_in, run_state
from calib.serve import viewing
from calib.serve.commands import typed
from calib.serve.page import address, answered, elsewhere, form_of, part, query_of, shown, space_of, working, writing
from calib.serve.workspace import Workspace

#: Range of paddings [m] that is looked at, and draws of a specification, as on the command line.
_LOWER, _UPPER, _DRAWS = 0.0, 9e-3, 1000
#: What the page asks for, which stands in its address.
_FIELDS = ("force", *viewing.LIMITS, "tolerance")


async def padding(request: Request) -> Response:
    """The page of a run, which loads its sliders by itself; without a finished run it says so."""
    space, query = space_of(request), query_of(request)
    finished = await working(_finished, space)
    name = query.get("name", finished[0] if finished else "")
    if name:
        space.run(name)
    sliders = address("/padding/look", name=name, **_asked(query))
    return shown(request, "padding.html.j2", name=name, finished=finished, sliders=sliders)


def _asked(form: Mapping[str, str]) -> dict[str, str]:
    """What a form, or an address, asks for: load and limits, as they are written there."""
    return {key: text.strip() for key in _FIELDS if (text := form.get(key, "")).strip()}


async def look(request: Request) -> Response:
    """The sliders, and the advice that is kept with a run."""
    space, query = space_of(request), query_of(request)
    name = query.get("name", "")
    return part("look.html.j2", name=name, **await working(_look, space.run(name), name, _asked(query)))


def _look(folder: Path, name: str, asked: dict[str, str]) -> dict[str, Any]:
    run = viewing.run_in(folder)
    known = _known(folder)
    own = f"{largest_force(run.posterior):.4g} N"
    kept = not asked and known is not None
    if not asked and known is not None:
        asked = _asked_for(known)
    try:
        force = viewing.quantity(asked, "force", "N", largest_force(run.posterior))
        most = viewing.reaching(run, force)
    except InputError:  # what is typed is none, which is said beside it; or advice for a load that is far beyond
        force = most = viewing.largest_load(run)
        if kept:
            asked["force"] = f"{force:.4g} N"
    force = max(force, most / 100)
    step = 10.0 ** (math.floor(math.log10(most)) - 2)
    return {
        "most": most,
        "least": round(math.ceil(most / 100 / step) * step, 9),
        "step": step,
        "force": force,
        "upper": _UPPER * 1e3,
        "padding_step": PLACE * 1e3,
        "at": 5.0 if known is None else round(known.best * 1e3, 2),
        "measured": largest_force(run.posterior),
        "verdict": run.verdict,
        "status": status_in_words(run.verdict),
        "limits": {key: (side.replace("_", " "), example) for key, (_, side, _, example) in viewing.LIMITS.items()},
        "asked": {"force": own, **asked},
        "known": known,
        "gave": _gave(folder),
        "said": "" if known is None else _said(known),
        "known_status": "" if known is None else status_in_words(known.verdict, "the advice"),
        "command": _command(name, force, limited=any(key in asked for key in viewing.LIMITS)),
    }


def _command(name: str, force: float, *, limited: bool) -> str:
    """The command that gives the advice that is asked for."""
    if limited:
        return typed(["recommend", name, "--spec", _spec_name(name)])
    return typed(["recommend", name, "--force", f"{force:.6g} N", "--padding", f"{_LOWER * 1e3:g} mm:{_UPPER * 1e3:g} mm"])


async def view(request: Request) -> Response:
    """What is seen at one load, with the limits of the form."""
    space, form = space_of(request), query_of(request)
    folder = space.run(form.get("name", ""))
    return answered(await working(_view, folder, form))


def _view(folder: Path, form: dict[str, str]) -> dict[str, object]:
    run = viewing.run_in(folder)
    limits = viewing.limits_from(form)
    force = viewing.quantity(form, "force", "N", viewing.largest_load(run))
    most = viewing.reaching(run, force)
    land = viewing.landscape_of(run, most, _LOWER, _UPPER)
    tolerance = viewing.quantity(form, "tolerance", "m", 0.0)
    name = form.get("name", "")
    found = viewing.view_plain(land, land.view(force, limits, tolerance), limits)
    return {
        **found,
        "most": most,
        "beyond": viewing.beyond_in_words(run, force),
        "command": _command(name, force, limited=bool(limits)),
    }


async def advise(request: Request) -> Response:
    """Make the advice, and keep it with the run, as `calib recommend` does."""
    space, form = space_of(request), await form_of(request)
    name = form.get("name", "")
    folder = space.run(name)
    await writing(_advise, space, name, folder, form)
    return elsewhere("/padding", name=name, **_asked(form), made="yes")


def _advise(space: Workspace, name: str, folder: Path, form: dict[str, str]) -> None:
    run = viewing.run_in(folder)
    force = viewing.quantity(form, "force", "N", 0.0)
    if not force > 0:
        raise InputError(Fault("nothing says at which load the signal counts", advice='Give a load such as "10 N"'))
    wanted: Requirement | Specification = Requirement(force=force, lower=_LOWER, upper=_UPPER)
    limits, tolerance = viewing.limits_from(form), viewing.quantity(form, "tolerance", "m", 0.0)
    # What is refused to be shown is not advised, either.
    viewing.landscape_of(run, viewing.reaching(run, force), _LOWER, _UPPER).view(force, limits, tolerance)
    if limits:
        probability = viewing.quantity(form, "probability", "", 0.95)
        path = space.folder / _spec_name(name)
        write_text(path, viewing.specification_text(force, limits, _LOWER, _UPPER, tolerance, probability))
        wanted = read_specification(path, _DRAWS)
    recommend_in(run, wanted, seed=1, command=_command(name, force, limited=bool(limits)))


def _spec_name(name: str) -> str:
    return f"{name.replace('/', '-')}-specification.toml"


def _finished(space: Workspace) -> list[str]:
    return [name for name in space.runs() if run_state(space.folder / name).condition == "finished"]


def _known(folder: Path) -> Recommendation | None:
    try:
        return load_recommendation(folder)
    except InputError:
        return None


def _asked_for(known: Recommendation) -> dict[str, str]:
    """What a kept advice was asked for, as the fields of the form; a specification of several loads has more than they say."""
    wanted = None if known.conformity is None else known.conformity.specification
    if wanted is not None and not (isinstance(wanted.force, tuple) and len(wanted.force) == 1):
        wanted = None
    return viewing.form_of_asked(known.requirement.force, wanted)


def _gave(folder: Path) -> str:
    """The command that gave the advice of a run, the last one that asked for any; "" where that is not known."""
    with suppress(InputError):
        listing = read_listing(folder)
        asked = [] if listing is None else [one.text for one in listing.commands if one.text.startswith("calib recommend")]
        return asked[-1] if asked and asked[-1] != "calib recommend" else ""
    return ""


def _said(known: Recommendation) -> str:
    return known.in_words if known.conformity is None else known.conformity.in_words


ROUTES = (
    Route("/padding", padding),
    Route("/padding/look", look),
    Route("/padding/view", view),
    Route("/padding/advise", advise, methods=["POST"]),
)
