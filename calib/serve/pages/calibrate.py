"""The fourth step: a calibration is begun, watched, cancelled and gone on with; it is a process of its own."""

from __future__ import annotations

import math
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.errors import Fault, InputError
from calib.report import duration_in_words
from calib.runs import STAGES, run_state
from calib.serve import jobs
from calib.serve.commands import BUDGET, calibrating, resuming, typed
from calib.serve.page import answered, elsewhere, form_of, part, query_of, shown, space_of, working
from calib.serve.workspace import Workspace

_WIDTH, _HEIGHT = 260, 70


async def calibrate(request: Request) -> Response:
    """The form to begin one, and those that go on."""
    space = space_of(request)
    name = await working(space.free_name, "run")
    return shown(
        request,
        "calibrate.html.j2",
        name=name,
        budget=BUDGET,
        going=await working(_going, space),
        command=typed(calibrating(space, {"name": name, "budget": BUDGET})),
        exists=space.experiment.exists(),
    )


async def command(request: Request) -> Response:
    """The command of a form as it is filled in."""
    form = query_of(request)
    return answered({"command": typed(calibrating(space_of(request), {**form, "name": form.get("name", "").strip()}))})


async def begin(request: Request) -> Response:
    """Begin a calibration.

    Raises
    ------
    InputError
        If there is one of this name, or the form is not right.
    """
    space, form = space_of(request), await form_of(request)
    name = form.get("name", "").strip()
    if any(name == going for going in await working(_going, space)):
        raise InputError(Fault(f'"{name}" is being computed already', advice="Wait until it has ended, or choose another name"))
    space.new_folder(name)
    words = calibrating(space, {**form, "name": name})
    await working(jobs.start, space, name, words)
    return elsewhere("/run", name=name)


async def resumed(request: Request) -> Response:
    """The command that goes on with a run, as its form is filled in."""
    space, form = space_of(request), query_of(request)
    return answered({"command": typed(await working(resuming, space, form))})


async def resume(request: Request) -> Response:
    """Go on with a calibration that was stopped, or has not converged."""
    space, form = space_of(request), await form_of(request)
    name = form.get("name", "")
    await working(jobs.start, space, name, await working(resuming, space, form))
    return elsewhere("/run", name=name)


async def cancel(request: Request) -> Response:
    """Stop a calibration, which keeps what it has computed."""
    space, form = space_of(request), await form_of(request)
    await working(jobs.cancel, space, form.get("name", ""))
    return elsewhere("/run", name=form.get("name", ""))


async def progress(request: Request) -> Response:
    """How far a calibration is, which a page asks for again and again."""
    space, name = space_of(request), query_of(request).get("name", "")
    folder = space.run(name)
    state = await working(run_state, folder)
    job = await working(jobs.job_of, space, name)
    alive = state.condition == "running" or (job is not None and job.alive)
    # A command that has not come to the run yet tells nothing; what another told there that was killed is not its own.
    told = state.last if state.condition == "running" or not alive else None
    answer = part(
        "progress.html.j2",
        name=name,
        state=state,
        job=job,
        alive=alive,
        told=told,
        ending=told is None and state.condition == "finished" and job is not None and await working(_wrote, job, folder),
        stage=0 if told is None or told.stage not in STAGES else STAGES.index(told.stage) + 1,
        n_stage=len(STAGES),
        left="" if told is None or told.seconds_left is None else duration_in_words(told.seconds_left),
        chart=None if told is None else _chart([(look.steps, look.ess) for look in told.looks], told.target),
        width=_WIDTH,
        height=_HEIGHT,
    )
    answer.headers["X-Alive"] = "yes" if alive else "no"
    return answer


def _wrote(job: jobs.Job, folder: Path) -> bool:
    """Whether a finished run was written by a command that goes on, and not before that began."""
    with suppress(OSError):
        written = datetime.fromtimestamp((folder / "run.json").stat().st_mtime)
        return f"{written:%Y-%m-%d %H:%M:%S}" >= job.begun
    return False


def _chart(looks: list[tuple[int, float]], target: float) -> dict[str, object] | None:
    """Places of a small chart of effective draws over steps, and of the line that they have to reach."""
    known = [(steps, ess) for steps, ess in looks if math.isfinite(ess)]
    if not known or not target > 0:
        return None
    most, last = max([target, *(ess for _, ess in known)]) * 1.1, known[-1][0]

    def down(ess: float) -> float:
        return round(_HEIGHT - ess / most * _HEIGHT, 1)

    points = [(0.0, float(_HEIGHT)), *((round(steps / last * _WIDTH, 1), down(ess)) for steps, ess in known)]
    return {"points": " ".join(f"{x},{y}" for x, y in points), "target": down(target)}


def _going(space: Workspace) -> list[str]:
    """Names of the calibrations that go on, whoever began them."""
    begun = [job.name for job in jobs.jobs(space)]
    return list(
        dict.fromkeys([*begun, *(name for name in space.runs() if run_state(space.folder / name).condition == "running")])
    )


ROUTES = (
    Route("/calibrate", calibrate),
    Route("/calibrate/command", command),
    Route("/calibrate/begin", begin, methods=["POST"]),
    Route("/calibrate/resumed", resumed),
    Route("/calibrate/resume", resume, methods=["POST"]),
    Route("/calibrate/cancel", cancel, methods=["POST"]),
    Route("/run/progress", progress),
)
