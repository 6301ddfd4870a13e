"""A run turned round for a gripper: what force a reading means, as tables on a padding of one's choice, to be taken along."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from calib.decision import Gripper
from calib.digits import places_of, range_text
from calib.errors import Fault, InputError
from calib.regular import bytes_of
from calib.report import force_tables_from_json, status_in_words
from calib.runs import export_in, load_recommendation
from calib.sampling import FINGERPRINT
from calib.serve import viewing
from calib.serve.commands import typed
from calib.serve.packing import packed
from calib.serve.page import answered, elsewhere, form_of, part, query_of, shown, space_of, working
from calib.serve.workspace import Workspace
from calib.visible import visible

#: Files of an export, what each is for, and its kind.
_FILES = {
    "README.md": ("how to use them, and what they do not hold for", "text/markdown"),
    "force_tables.h": ("for firmware, C99", "text/x-c"),
    "force_tables.py": ("for Python", "text/x-python"),
    "force_tables.csv": ("for anything else", "text/csv"),
    "force_tables.json": ("with conditions and verdicts", "application/json"),
    "taxels.json": ("for robot simulators", "application/json"),
}
# Bytes of the largest file of tables: a hundred times that of a lot of fifty specimens.
_LARGEST = 50_000_000
# Of the form, beside the run and the folder, in the order of the command: field, option, unit.
_OPTIONS = (("padding", "--padding", "m"), ("force", "--force", "N"), ("noise", "--noise", "F"))
_TARE = 64


async def export(request: Request) -> Response:
    """The page of a run, which loads what it shows by itself."""
    name = query_of(request).get("name", "")
    space_of(request).run(name)
    return shown(request, "export.html.j2", name=name)


async def look(request: Request) -> Response:
    """The form, and the tables that there are of this run."""
    space, name = space_of(request), query_of(request).get("name", "")
    return part("export_look.html.j2", name=name, **await working(_look, space, space.run(name), name))


def _look(space: Workspace, folder: Path, name: str) -> dict[str, Any]:
    run = viewing.run_in(folder)
    known = _recommended(folder)
    usual = {"padding": "" if known is None else f"{known * 1e3:.3g} mm", "output": space.free_name(f"{folder.name}-gripper")}
    of = (run.posterior.attrs.get(FINGERPRINT, ""), run.posterior.draws_sha256)
    return {
        "verdict": run.verdict,
        "status": status_in_words(run.verdict),
        "usual": usual,
        "tare": _TARE,
        "command": _command({"name": name, **usual}),
        "made": [found for one in space.exports() if (found := _tables_made(space, one, of)) is not None],
    }


def _recommended(folder: Path) -> float | None:
    try:
        known = load_recommendation(folder)
    except InputError:
        return None
    return None if known is None else known.best


def _tables_made(space: Workspace, name: str, of: tuple[str, str]) -> dict[str, Any] | None:
    """What tables of a folder hold for, if they are of a run; what of them is damaged is said."""
    folder = space.export(name)
    path = folder / "force_tables.json"
    files = [(file, about) for file, (about, _) in _FILES.items() if (folder / file).is_file()]
    told: dict[str, Any] = {"name": name, "files": files, "wrong": "", "tables": [], "colour": "red", "reasons": []}
    try:
        content = force_tables_from_json(bytes_of(path, _LARGEST, "tables").decode("utf-8"), path)
        if (content.get("fingerprint"), content.get("draws_sha256")) != of:
            return None
        verdict = content["verdict"]
        told |= {
            "colour": verdict["colour"],
            "reasons": [f"{r['gate']}: {r['finding']}. {r['action']}" for r in verdict["reasons"]],
        }
        told["tables"] = [_range(table) for table in content["tables"]]
    except (InputError, OSError, UnicodeDecodeError, KeyError, TypeError, ValueError, IndexError) as error:
        told["wrong"] = error.faults[0].message if isinstance(error, InputError) else "it is not as it was written"
    return told


def _range(table: dict[str, Any]) -> dict[str, str]:
    """Of one sensor what readings are valid, what forces they mean, and how well half the largest is told."""
    force, lower, upper = (np.array(table[f"{key}_N"], dtype=float) for key in ("force", "lower", "upper"))
    half = int(np.abs(force - 0.5 * force[-1]).argmin())
    places = places_of(float(upper[half] - lower[half])) if upper[half] > lower[half] else 3
    touch = float(np.interp(table["touch"], table["ratio"], force))
    return {
        "name": str(table["name"]),
        "padding": f"{table['padding_thickness_m'] * 1e3:.2f} mm",
        "readings": f"{table['touch'] * 1e6:.0f} to {table['ratio'][-1] * 1e6:.0f} ppm",
        "forces": f"{range_text(touch, float(force[-1]))} N",
        "half": f"{force[half]:.{places}f} N ({lower[half]:.{places}f} to {upper[half]:.{places}f})",
        "colour": str(table["verdict"]["colour"]),
        "conditions": "; ".join(map(str, table["conditions"])),
    }


def _command(form: dict[str, str]) -> str:
    words = ["export", form.get("name", "")]
    words += [word for key, option, _ in _OPTIONS if form.get(key, "").strip() for word in (option, form[key].strip())]
    leads = [form.get(key, "").strip() for key in ("leads", "leads_sd")]
    words += ["--parasitic", ", ".join(leads)] if any(leads) else []
    tare = form.get("tare", "").strip()
    words += ["--tare-readings", tare] if tare not in ("", str(_TARE)) else []
    return typed([*words, "-o", form.get("output", "").strip()])


async def command(request: Request) -> Response:
    """The command of the form as it is filled in."""
    return answered({"command": _command(query_of(request))})


async def make(request: Request) -> Response:
    """Write the tables into a new folder, all of them or none, as `calib export` does."""
    space, form = space_of(request), await form_of(request)
    folder = space.run(form.get("name", ""))
    output = space.new_folder(form.get("output", "").strip())
    gripper = _gripper(form)
    await working(lambda: export_in(viewing.run_in(folder), gripper, output))
    return elsewhere("/export", name=form.get("name", ""))


def _gripper(form: dict[str, str]) -> Gripper:
    """What reads the sensor, as a form says it.

    Raises
    ------
    InputError
        With every field that is wrong.
    """
    faults: list[Fault] = []

    def read(key: str, unit: str) -> float | None:
        if not form.get(key, "").strip():
            return None
        try:
            return viewing.quantity(form, key, unit, 0.0)
        except InputError as error:
            faults.extend(error.faults)
            return None

    found = {key: read(key, unit) for key, _, unit in _OPTIONS}
    leads = tuple(read(key, "F") for key in ("leads", "leads_sd"))
    if (leads[0] is None) != (leads[1] is None) and not faults:
        faults.append(Fault("the leads have a mean and a standard deviation", advice="Give both, or neither"))
    tare = form.get("tare", "").strip() or str(_TARE)
    if not (tare.isascii() and tare.isdecimal() and 1 <= int(tare[:9]) <= 1_000_000):
        faults.append(Fault(f'readings of the tare must be a whole number from 1, got "{visible(tare[:40])}"'))
    if faults:
        raise InputError(faults)
    parasitic = None if leads[0] is None or leads[1] is None else (leads[0], leads[1])
    return Gripper(padding=found["padding"], force=found["force"], noise=found["noise"], parasitic=parasitic, n_tare=int(tare))


async def download(request: Request) -> Response:
    """One file of tables to take along.

    Raises
    ------
    InputError
        If there is no such file.
    """
    space, query = space_of(request), query_of(request)
    folder, file = space.export(query.get("name", "")), query.get("file", "")
    if file not in _FILES:
        raise InputError(Fault("there is no such file among these tables", advice="Look at the list of their files"))
    return FileResponse(space.result(query["name"], file), media_type=_FILES[file][1], filename=f"{folder.name}-{file}")


async def bundle(request: Request) -> Response:
    """All files of tables in an archive."""
    space = space_of(request)
    folder = space.export(query_of(request).get("name", ""))
    path = await working(packed, space, folder)
    return FileResponse(
        path, media_type="application/zip", filename=f"{folder.name}.zip", background=BackgroundTask(path.unlink)
    )


ROUTES = (
    Route("/export", export),
    Route("/export/look", look),
    Route("/export/command", command),
    Route("/export/make", make, methods=["POST"]),
    Route("/export/file", download),
    Route("/export/bundle.zip", bundle),
)
