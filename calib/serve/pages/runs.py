"""The sixth step: runs are opened, looked at, compared, averaged, verified and taken along."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import Route

from calib.errors import Fault, InputError
from calib.report import any_letters, difference_figure, pair_rows, parameter_rows, status_in_words
from calib.runs import CERTIFICATES, RESULTS, changed_inputs, diff_runs, read_listing, run_state, verify
from calib.serve import jobs, viewing
from calib.serve.commands import BUDGET, after_cancel, resuming, typed
from calib.serve.looking import DRAWING
from calib.serve.packing import packed
from calib.serve.page import answered, elsewhere, keys_of, lists_of, part, query_of, shown, space_of, working
from calib.serve.security import POLICY_OF_REPORT
from calib.serve.workspace import Workspace

_KINDS = {
    "posterior.nc": "application/x-netcdf",
    "summary.json": "application/json",
    "summary.csv": "text/csv",
    "recommendation.json": "application/json",
    "specification.csv": "text/csv",
    "next.json": "application/json",
    "report.html": "text/html",
    "report.pdf": "application/pdf",
    "certificate.html": "text/html",
    "certificate.json": "application/json",
    "certificate.xml": "application/xml",
    "ro-crate-metadata.json": "application/json",
    "certificate.json.minisig": "text/plain",
}
_ABOUT = {
    "as_calibrated.toml": "the experiment, as it was calibrated",
    "posterior.nc": "draws, for ArviZ",
    "summary.json": "numbers",
    "summary.csv": "numbers, as a table",
    "recommendation.json": "advice",
    "specification.csv": "conformity, thickness by thickness",
    "next.json": "what to measure next",
    "report.html": "the report, one page that needs nothing else",
    "report.pdf": "the report, printed",
    "certificate.html": "the certificate, to print",
    "certificate.json": "the certificate, for programs",
    "certificate.xml": "the certificate, as a Digital Calibration Certificate",
    "ro-crate-metadata.json": "what the run is made of, as an RO-Crate",
    "certificate.json.minisig": "signature of the certificate",
}


@dataclass(frozen=True)
class Row:
    """A run in the list: what it is at, and its verdict, "" as long as there is none."""

    name: str
    condition: str
    colour: str
    command: str


async def runs(request: Request) -> Response:
    """All runs of the folder."""
    space = space_of(request)
    rows = await working(_rows, space)
    done = [row.name for row in rows if row.condition == "finished"]
    return shown(
        request,
        "runs.html.j2",
        rows=rows,
        done=done,
        average=await working(_free_average, space),
        compare=typed(["diff", *done[1::-1]]),
        averaged=_averaging((), _free_average(space)),
        left_out=await working(space.left_out),
    )


def _free_average(space: Workspace) -> str:
    """A name for an average that is not taken."""
    return "average" if not os.path.lexists(space.folder / "average") else space.free_name("average")


async def comparing(request: Request) -> Response:
    """The command of the form that compares two runs, as it is filled in."""
    query = query_of(request)
    return answered({"command": typed(["diff", query.get("first", ""), query.get("second", "")])})


async def averaging(request: Request) -> Response:
    """The command of the form that averages runs, as it is filled in."""
    query = request.query_params
    return answered({"command": _averaging(query.getlist("run"), query.get("name", ""))})


def _averaging(names: Sequence[str], average: str) -> str:
    """The command that averages runs; as long as there are fewer than two marked, with words for them."""
    return typed(["average", *(names if len(set(names)) > 1 else ["RUN", "RUN2"]), "-o", average.strip()])


async def run(request: Request) -> Response:
    """One run: how far it is, or what came of it, which the page loads by itself."""
    space, name = space_of(request), query_of(request).get("name", "")
    folder = space.run(name)
    state = await working(run_state, folder)
    job = await working(jobs.job_of, space, name)
    alive = state.condition == "running" or (job is not None and job.alive)
    there = [(n, _ABOUT[n]) for n in RESULTS if n in _ABOUT and (folder / n).is_file()]
    return shown(
        request,
        "run.html.j2",
        name=name,
        state=state,
        job=job,
        alive=alive,
        average=(folder / "members").is_dir(),
        files=there if state.condition == "finished" else [],
        command=job.command if job is not None and (job.alive or not state.command) else state.command,
        budget=BUDGET,
        resuming=typed(await working(resuming, space, {"name": name, "budget": BUDGET})) if state.condition != "none" else "",
        again="" if job is None else typed(after_cancel(job.words)),
        resumes=job is not None and "calibrate" in job.words[1:2],
        refused=job if job is not None and job.refused and state.condition == "finished" and not alive else None,
    )


async def found(request: Request) -> Response:
    """What came of a run."""
    space, name = space_of(request), query_of(request).get("name", "")
    folder = space.run(name)
    values = await working(_found, folder)
    return part("run_found.html.j2", name=name, has_report=(folder / "report.html").is_file(), **values)


def _found(folder: Path) -> dict[str, Any]:
    made = viewing.run_in(folder)
    rows = [(r.name, f"{r.value} {r.unit}", r.interval, r.learned) for r in parameter_rows(made.posterior)]
    return {
        "verdict": made.verdict,
        "status": status_in_words(made.verdict),
        "parameters": rows,
        "notes": (*made.notes, *made.gone),
    }


async def report(request: Request) -> Response:
    """The report of a run in a frame.

    Raises
    ------
    InputError
        If it has none.
    """
    space, name = space_of(request), query_of(request).get("name", "")
    folder = space.run(name)
    if not (folder / "report.html").is_file():
        raise InputError(Fault(f"{name} has no report", advice=f"Write it: {typed(['report', name])}"))
    return shown(request, "report.html.j2", name=name, command=typed(["report", name]))


async def page(request: Request) -> Response:
    """The report itself, which may run nothing."""
    space, name = space_of(request), query_of(request).get("name", "")
    path = space.result(name, "report.html")
    return HTMLResponse(await working(path.read_bytes), headers={"Content-Security-Policy": POLICY_OF_REPORT})


async def download(request: Request) -> Response:
    """One file of a run to take along.

    Raises
    ------
    InputError
        If there is no such file.
    """
    space, query = space_of(request), query_of(request)
    name, file = query.get("name", ""), query.get("file", "")
    if file not in _KINDS:
        raise InputError(Fault("there is no such file in this run", advice="Look at the list of its files"))
    path = space.result(name, file)
    return FileResponse(path, media_type=_KINDS[file], filename=f"{path.parent.name}-{file}")


async def bundle(request: Request) -> Response:
    """A whole run to take along: its folder in an archive, without what only going on with it needs."""
    space = space_of(request)
    folder = space.run(query_of(request).get("name", ""))
    path = await working(packed, space, folder)
    return FileResponse(
        path, media_type="application/zip", filename=f"{folder.name}.zip", background=BackgroundTask(path.unlink)
    )


async def verified(request: Request) -> Response:
    """Whether all files of a run are as they were."""
    space, query = space_of(request), query_of(request)
    folder, key = space.run(query.get("name", "")), query.get("key", "")
    public = keys_of(request).publics().get(key)
    findings = await working(verify, folder, public)
    wrong = [(f.state, f.name.replace(f"{space.folder}/", ""), f.note) for f in findings if f.wrong]
    told = [f for f in findings if not f.wrong and f.name in CERTIFICATES and f.note]
    return part("verified.html.j2", wrong=wrong, told=told, n=len(findings), key=key if public is not None else "")


async def difference(request: Request) -> Response:
    """Two runs side by side."""
    space, query = space_of(request), query_of(request)
    names = (query.get("first", ""), query.get("second", ""))
    found = await working(lambda: diff_runs(*(viewing.run_in(space.run(name)) for name in names)))
    return shown(
        request,
        "difference.html.j2",
        names=found.names,
        first=names[0],
        second=names[1],
        rows=pair_rows(found),
        said=found.in_words,
        changed=found.changed,
        colours=found.colours,
        void=[*(k for k, colour in enumerate(found.colours, 1) if colour == "red"), *([4] if "red" in found.colours else [])],
        command=typed(["diff", *names]),
    )


async def curves(request: Request) -> Response:
    """The picture of two runs side by side."""
    space, query = space_of(request), query_of(request)
    folders = [space.run(query.get(key, "")) for key in ("first", "second")]
    return Response(await working(_curves, *folders), media_type="image/png")


def _curves(first: Path, second: Path) -> bytes:
    found = diff_runs(viewing.run_in(first), viewing.run_in(second))
    buffer = io.BytesIO()
    with DRAWING, any_letters():
        difference_figure(found.loadings).savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return buffer.getvalue()


async def average(request: Request) -> Response:
    """Average runs of the same data, in a process of its own.

    Raises
    ------
    InputError
        If there are fewer than two, or the name is none.
    """
    space, form = space_of(request), await lists_of(request)
    names = form.get("run", [])
    name = form.get("name", [""])[-1].strip()
    if len(set(names)) < 2:
        raise InputError(Fault("an average is of two runs at least", advice="Mark them in the list"))
    for one in names:
        space.run(one)
    space.new_folder(name)
    await working(jobs.start, space, name, ["average", *names, "-o", name])
    return elsewhere("/run", name=name)


def _rows(space: Workspace) -> list[Row]:
    begun = [job.name for job in jobs.jobs(space)]
    return list(_each(space, list(dict.fromkeys([*begun, *space.runs()]))))


def _each(space: Workspace, names: list[str]) -> Iterator[Row]:
    for name in names:
        state = run_state(space.folder / name)
        job = jobs.job_of(space, name)
        condition = "running" if job is not None and job.alive else state.condition
        yield Row(name, condition, _colour(space.folder / name) if condition == "finished" else "", state.command)


def _colour(folder: Path) -> str:
    """Verdict on a run by its summary, amber where what it was made from has changed; it is loaded where it is looked at."""
    try:
        colour = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["verdict"]["colour"]
        listing = read_listing(folder) if colour == "green" else None
        colour = "amber" if listing is not None and changed_inputs(folder, listing) else colour
    except (InputError, OSError, ValueError, KeyError, TypeError):
        return ""
    return colour if colour in ("green", "amber", "red") else ""


ROUTES = (
    Route("/runs", runs),
    Route("/run", run),
    Route("/run/found", found),
    Route("/report", report),
    Route("/report/page", page),
    Route("/run/file", download),
    Route("/run/bundle.zip", bundle),
    Route("/run/verified", verified),
    Route("/runs/difference", difference),
    Route("/runs/curves.png", curves),
    Route("/runs/difference/command", comparing),
    Route("/runs/average/command", averaging),
    Route("/runs/average", average, methods=["POST"]),
)
