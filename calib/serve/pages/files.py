"""The first step: lab files are dropped, what was understood of each is shown, and corrected."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.errors import Fault, InputError
from calib.experiment import Said, experiment_text, look_through, pair
from calib.lab import QUANTITIES, SIGNED, SIGNS
from calib.serve import looking
from calib.serve.beginning import experiments_in, put_example, use_experiment
from calib.serve.commands import drafting, reading_command, typed
from calib.serve.fields import answers_to
from calib.serve.page import (
    address,
    answered,
    asked_by_script,
    elsewhere,
    form_of,
    limited,
    part,
    query_of,
    shown,
    space_of,
    working,
    writing,
)
from calib.serve.workspace import LARGEST_UPLOAD, Workspace

# Files that are listed on one page: a browser is slow with many thousands.
_SHOWN = 500


async def files(request: Request) -> Response:
    """All lab files of the folder; what was understood of each is loaded by the page."""
    space, begin = space_of(request), query_of(request).get("from", "")
    names = await working(space.lab_files)
    first = min(int(begin), len(names)) if begin.isascii() and begin.isdecimal() and len(begin) < 9 else 0
    tables = await working(looking.experiment_tables, space)
    return shown(
        request,
        "files.html.j2",
        names=names[first : first + _SHOWN],
        first=first,
        n=len(names),
        further=first + _SHOWN if first + _SHOWN < len(names) else 0,
        others=(await working(space.other_files))[:_SHOWN],
        experiment=space.experiment.exists(),
        offered=await working(experiments_in, space),
        specimens=len(tables.get("specimens", [])) if isinstance(tables.get("specimens"), list) else 0,
        most=LARGEST_UPLOAD // 1_000_000,
        command=typed(drafting(space, _tops(space.lab_files()), space.experiment.name)),
    )


async def row(request: Request) -> Response:
    """One file in a line."""
    space, name = space_of(request), query_of(request).get("name", "")
    found = await working(looking.understand, space, name)
    o = found.observations
    judged = [] if o is None else await working(looking.grades, space, o)
    return part(
        "file_row.html.j2",
        found=found,
        o=o,
        worst=judged[0][0] if judged else "good",
        used=0 if o is None else int(o.used.sum()),
        addable=_addable(space, found),
    )


def _addable(space: Workspace, found: looking.Understood) -> bool:
    """Whether a file may be added to an experiment that is there."""
    return found.observations is not None and not found.entries and space.experiment.exists()


async def file(request: Request) -> Response:
    """One file: what was understood, and a form to correct it."""
    space, name = space_of(request), query_of(request).get("name", "")
    found = await working(looking.understand, space, name)
    return await working(_file_page, request, found, looking.form_of(found.said), ())


def _file_page(
    request: Request, found: looking.Understood, form: dict[str, str], wrong: tuple[Fault, ...], status: int = 200
) -> Response:
    o = found.observations
    heads, rows = ([], []) if o is None else looking.first_rows(o)
    choices = [fault.choice for fault in found.faults if fault.choice is not None]
    return shown(
        request,
        "file.html.j2",
        status,
        found=found,
        o=o,
        columns=[] if o is None else looking.columns_of(o),
        heads=heads,
        rows=rows,
        notes=[] if o is None else looking.notes_of(o),
        left_out=[] if o is None else looking.left_out(o),
        grades=[] if o is None else looking.grades(space_of(request), o),
        used=0 if o is None else int(o.used.sum()),
        addable=_addable(space_of(request), found),
        form=form,
        wrong=[str(fault) for fault in wrong],
        quantities=[q for q in QUANTITIES if q in looking.UNITS],
        further=(further := [q for q in QUANTITIES if q not in looking.UNITS]),
        further_said=any(form.get(f"{key}_{q}") for key in ("units", "columns") for q in further),
        wheres=looking.WHERES,
        units=looking.UNITS,
        signed=tuple(SIGNED),
        signs=tuple(SIGNS),
        choices=[(choice, answers_to(choice)) for choice in choices],
        command=reading_command(found.name, found.said),
    )


async def picture(request: Request) -> Response:
    """The picture of what was understood of a file.

    Raises
    ------
    InputError
        If it is not understood.
    """
    space, name = space_of(request), query_of(request).get("name", "")
    found = await working(looking.understand, space, name)
    if found.observations is None:
        raise InputError(found.faults)
    return Response(await working(looking.picture, found.observations), media_type="image/png")


async def correct(request: Request) -> Response:
    """Keep what a form says of a file, and read it again.

    Raises
    ------
    InputError
        If it makes no sense, and a script asks; else the page says so.
    """
    space, form = space_of(request), await form_of(request)
    name = form.pop("name", "")
    try:
        said = looking.said_from(form)
    except InputError as error:
        if asked_by_script(request):
            raise
        found = await working(looking.understand, space, name)
        return await working(_file_page, request, found, form, error.faults, 422)
    await writing(looking.correct, space, name, said)
    return elsewhere("/file", name=name)


async def upload(request: Request) -> Response:
    """Take a file that was dropped, as it comes."""
    space, name = space_of(request), query_of(request).get("name", "")
    kept = await space.receive(name, limited(request, LARGEST_UPLOAD))
    return answered({"name": kept, "address": address("/file", name=kept)})


async def remove(request: Request) -> Response:
    """Put a file out of the way.

    Raises
    ------
    InputError
        If the experiment names it.
    """
    space, form = space_of(request), await form_of(request)
    name = form.get("name", "")
    found = await working(looking.understand, space, name)
    if found.entries:
        said = f"the experiment names {name} ({', '.join(entry.title for entry in found.entries)})"
        raise InputError(Fault(said, advice="Take it out of the experiment first, in its text"))
    await writing(space.say, space.folder / name, Said())
    await writing(space.remove_lab_file, name)
    return elsewhere("/files")


async def use(request: Request) -> Response:
    """Use an experiment file that came along with dropped files."""
    space, form = space_of(request), await form_of(request)
    await writing(use_experiment, space, form.get("name", ""))
    return elsewhere("/experiment")


async def example(request: Request) -> Response:
    """Put the shipped example into the folder, to try everything on."""
    space = space_of(request)
    await form_of(request)
    await writing(put_example, space)
    return elsewhere("/experiment")


async def draft(request: Request) -> Response:
    """Write a first experiment file from the lab files of the folder."""
    space = space_of(request)
    await form_of(request)
    await writing(_draft, space)
    return elsewhere("/experiment")


def _draft(space: Workspace) -> None:
    if space.experiment.exists():
        advice = "Add a specimen to it in its text, or move it elsewhere to begin anew"
        raise InputError(Fault("there is an experiment in this folder, which is not overwritten", advice=advice))
    names = space.lab_files()
    if not names:
        raise InputError(Fault("there is no lab file in this folder", advice="Drop the files of a press first"))
    said_of = {path: (said.reading, said.use) for path, said in space.said().items()}
    looked, _ = look_through([space.folder / top for top in _tops(names)], said_of)
    records = [record for file in looked for record in file.records]
    if not records:
        raise InputError([Fault(reason, file.path) for file in looked for reason in file.left_out])
    space.write_experiment(experiment_text(pair(records), space.folder, looked))


def _tops(names: list[str]) -> list[str]:
    """What stands for all lab files on a command line: the folders that hold them, and files beside these."""
    return list(dict.fromkeys(name.split("/")[0] for name in names))


ROUTES = (
    Route("/files", files),
    Route("/files/row", row),
    Route("/file", file),
    Route("/file/picture.png", picture),
    Route("/file/correct", correct, methods=["POST"]),
    Route("/file/remove", remove, methods=["POST"]),
    Route("/files/upload", upload, methods=["PUT"]),
    Route("/files/draft", draft, methods=["POST"]),
    Route("/files/use", use, methods=["POST"]),
    Route("/files/example", example, methods=["POST"]),
)
