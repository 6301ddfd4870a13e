"""What to measure next after a run: which press or reading tells most for an hour in the lab, and an experiment with it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from calib.decision import NextMeasurements, Requirement
from calib.errors import Fault, InputError
from calib.experiment import MARK, Bench, read_bench
from calib.files import write_text
from calib.report import status_in_words
from calib.runs import Run, next_for, next_in
from calib.serve import viewing
from calib.serve.commands import typed
from calib.serve.looking import Kept
from calib.serve.page import answered, elsewhere, form_of, part, query_of, shown, space_of, working, writing
from calib.serve.workspace import Workspace

#: What a lab can measure stands in the folder under this name, if it is said.
_BENCH = "bench.toml"
_LOWER, _UPPER, _SEED = 0.0, 9e-3, 1
_MODULUS, _PADDING = "modulus", "padding"
# What was answered lately: it takes a second or two, and a draft is made of it.
_ANSWERED = Kept(16)


async def measure(request: Request) -> Response:
    """The page of a run: what is to be known better, and once that is said the answer, which it loads by itself."""
    space, form = space_of(request), query_of(request)
    name = form.get("name", "")
    space.run(name)
    return shown(
        request,
        "measure.html.j2",
        name=name,
        form={"for": _MODULUS, "force": "", **form},
        asked={key: form[key] for key in ("name", "for", "force") if key in form} if "for" in form else {},
        bench=_BENCH if (space.folder / _BENCH).is_file() else "",
        command=_command(space, {"name": name, "for": _MODULUS, **form}),
    )


async def found(request: Request) -> Response:
    """The answer, which is not written anywhere."""
    space, form = space_of(request), query_of(request)
    folder = space.run(form.get("name", ""))
    result = await working(lambda: _answer(space, viewing.run_in(folder), form))
    return part(
        "measure_found.html.j2",
        name=form["name"],
        form={"for": _MODULUS, "force": "", **form},
        result=result,
        of="modulus" if result.asked == _MODULUS else "signal",
        status=status_in_words(result.verdict, "the ranking"),
        rows=[_row(result, number) for number in range(1, len(result.ranked) + 1)],
        now=f"±{result.relative(result.sd)}",
        draft=space.free_name("next", ".toml"),
    )


def _row(result: NextMeasurements, number: int) -> dict[str, str]:
    one = result.ranked[number - 1]
    return {
        "number": str(number),
        "what": one.what,
        "sd": f"±{result.relative(one.sd)}",
        "less": f"{100 * one.reduction:.0f} %" if one.tells else "nothing",
        "minutes": f"{one.minutes:.0f}",
        "rate": f"{100 * one.per_hour:.0f} %" if one.tells else "",
        "settles": result.settled_in_words(one),
    }


async def command(request: Request) -> Response:
    """The command of the form as it is filled in."""
    return answered({"command": _command(space_of(request), query_of(request))})


async def ask(request: Request) -> Response:
    """Ask, and keep the answer with the run as `calib next` does."""
    space, form = space_of(request), await form_of(request)
    folder = space.run(form.get("name", ""))

    def asked() -> None:
        run = viewing.run_in(folder)
        wanted, bench = _requirement(form), _bench(space)
        result = next_in(run, wanted, bench, seed=_SEED, command=_command(space, form))
        _ANSWERED.get(_key(run, wanted, bench), lambda: result)

    await working(asked)
    return elsewhere("/next", **{key: form[key] for key in ("name", "for", "force") if form.get(key)})


async def draft(request: Request) -> Response:
    """Write an experiment file with one of the measurements in it, beside the one that there is."""
    space, form = space_of(request), await form_of(request)
    folder = space.run(form.get("name", ""))
    number = int(form["number"]) if form.get("number", "").isdecimal() and len(form["number"]) < 4 else 0

    def drafted(text: str) -> str:
        name = space.free_name("next", ".toml")
        write_text(space.folder / name, text)
        return name

    text = await working(lambda: _answer(space, viewing.run_in(folder), form).draft(number, space.folder))
    name = await writing(drafted, text)
    words = typed([*_words(space, form), "--draft", name, "--number", str(number)])
    back = {key: form[key] for key in ("name", "for", "force") if form.get(key)}
    return shown(
        request,
        "measure_draft.html.j2",
        name=name,
        text=text,
        marks=text.count(MARK),
        command=words,
        check=typed(["check", name]),
        back=back,
    )


def _answer(space: Workspace, run: Run, form: Mapping[str, str]) -> NextMeasurements:
    wanted, bench = _requirement(form), _bench(space)
    return _ANSWERED.get(_key(run, wanted, bench), lambda: next_for(run, wanted, bench, seed=_SEED))


def _key(run: Run, wanted: Requirement | None, bench: Bench | None) -> str:
    return repr((str(run.folder), run.posterior_sha256, run.another_forward, run.notes, wanted, bench))


def _requirement(form: Mapping[str, str]) -> Requirement | None:
    """What is to be known better: None for the modulus.

    Raises
    ------
    InputError
        If that is not said, or a load is missing.
    """
    what = form.get("for", "")
    if what == _MODULUS:
        return None
    if what != _PADDING:
        raise InputError(Fault("what is to be known better?", advice="Choose the modulus, or the signal on the padding"))
    force = viewing.quantity(dict(form), "force", "N", 0.0)
    if not force > 0:
        raise InputError(Fault("nothing says at which load the signal counts", advice='Give a load such as "10 N"'))
    return Requirement(force, _LOWER, _UPPER)


def _bench(space: Workspace) -> Bench | None:
    path: Path = space.folder / _BENCH
    return read_bench(path) if path.is_file() else None


def _words(space: Workspace, form: Mapping[str, str]) -> list[str]:
    words = ["next", form.get("name", "")]
    if form.get("for") == _PADDING:
        words += ["--for", _PADDING, "--force", form.get("force", "").strip()]
    return [*words, *(["--bench", _BENCH] if (space.folder / _BENCH).is_file() else [])]


def _command(space: Workspace, form: Mapping[str, str]) -> str:
    return typed(_words(space, form))


ROUTES = (
    Route("/next", measure),
    Route("/next/found", found),
    Route("/next/command", command),
    Route("/next/ask", ask, methods=["POST"]),
    Route("/next/draft", draft, methods=["POST"]),
)
