"""Presses of which a part is wanted, with the rows that are of that part."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Case, Col, Expected, Floats, Press, Written, make, press, renamed, sign, write

#: [N], [m]: how far from a limit a noisy row may be on either side of it.
NEAR_FORCE, NEAR_DEPTH = 0.03, 2e-6


def part(
    p: Press,
    cycles: Sequence[int] = (1,),
    branch: str = "loading",
    max_force: float = np.inf,
    max_depth: float = np.inf,
    open_force: tuple[float, float] | None = None,
    open_depth: tuple[float, float] | None = None,
) -> Mapping[str, Any]:
    """Rows that have to be used and rows that must not be.

    Parameters
    ----------
    p : the press.
    cycles, branch, max_force, max_depth : what is wanted, [N] and [m], from an unloaded cell and from contact.
    open_force, open_depth : true force [N] and depth [m] between which a limit lies that can be counted from two zeros.
    """
    low_f, high_f = open_force or (max_force - NEAR_FORCE, max_force + NEAR_FORCE)
    low_d, high_d = open_depth or (max_depth - NEAR_DEPTH, max_depth + NEAR_DEPTH)
    wanted = (p.branch == branch) & np.isin(p.cycle, cycles)
    inside = (p.depth > 0.15 * p.depth.max()) & ~p.edge
    within = (p.force < low_f) & (p.depth < low_d)
    beyond = (p.force > high_f) | (p.depth > high_d)
    return {"must_use": wanted & inside & within, "must_not_use": inside & (p.branch != "hold") & (~wanted | beyond)}


def _no_row(p: Press) -> Mapping[str, Any]:
    """Nothing of the press is of the wanted part: it is refused, or no row of it is used."""
    return {"must_not_use": (p.depth > 0.15 * p.depth.max()) & ~p.edge, "turned": {}}


def columns(p: Press, force: Floats | None = None, place: Floats | None = None, unit: str = "N") -> list[Col]:
    """Time, displacement, force with the file's signs."""
    return [
        Col("Time", p.time, "time", "s", 3),
        Col("Extension", p.depth if place is None else place, "displacement", "mm", 5),
        Col("Load", p.force if force is None else force, "force", unit, 4 if unit == "N" else 7),
    ]


def case(
    name: str, written: Written, use: Mapping[str, Any], rows: Mapping[str, Any], expected: Expected = "read", **more: Any
) -> Case:
    """A case of a part that is wanted."""
    turned = {q: 1 for q in ("force", "displacement") if q in written.truth}
    return make(f"use: {name}", "use", expected, written, use=use, **{"turned": turned, **rows, **more})


def _limits() -> list[Case]:
    """A largest force, a largest depth."""
    p = press(start=0.0)
    w = write(columns(p))
    away = press(start=-0.5)
    held = press(((2.0, 110), (2.0, 40), (-0.3, 110)), start=0.0)
    sticky = press(start=0.0, peak=5.0, pull_off=8.0)
    offset = press(start=0.0)
    both: Mapping[str, Any] = {"turned": {"force": -1, "displacement": -1}}
    falls: Mapping[str, Any] = {"turned": {"force": 1, "displacement": -1}}
    preload = press(((2.0, 80), (1.6, 80)), start=1.6)
    return [
        case("5 N at most", w, {"max_force": 5.0}, part(p, max_force=5.0)),
        case("2 N at most", w, {"max_force": 2.0}, part(p, max_force=2.0)),
        case("0.8 mm at most", w, {"max_depth": 0.8e-3}, part(p, max_depth=0.8e-3)),
        case(
            "1.5 mm and 3 N at most, force decides",
            w,
            {"max_depth": 1.5e-3, "max_force": 3.0},
            part(p, max_force=3.0, max_depth=1.5e-3),
        ),
        case(
            "0.8 mm and 9 N at most, depth decides",
            w,
            {"max_depth": 0.8e-3, "max_force": 9.0},
            part(p, max_force=9.0, max_depth=0.8e-3),
        ),
        case("more than there is", w, {"max_force": 50.0, "max_depth": 9e-3}, part(p)),
        case(
            "5 N at most, compression negative",
            write(columns(p, -p.force, -p.depth)),
            {"max_force": 5.0},
            part(p, max_force=5.0),
            **both,
        ),
        case(
            "0.8 mm at most, compression negative",
            write(columns(p, -p.force, -p.depth)),
            {"max_depth": 0.8e-3},
            part(p, max_depth=0.8e-3),
            **both,
        ),
        case("5 N at most of a file in kN", write(columns(p, unit="kN")), {"max_force": 5.0}, part(p, max_force=5.0)),
        case(
            "5 N at most, position falls from 50 mm",
            write(columns(p, place=0.05 - p.depth)),
            {"max_force": 5.0},
            part(p, max_force=5.0),
            **falls,
        ),
        case(
            "0.8 mm at most, position falls from 50 mm",
            write(columns(p, place=0.05 - p.depth)),
            {"max_depth": 0.8e-3},
            part(p, max_depth=0.8e-3, open_depth=(0.6e-3, 1.0e-3)),
            **falls,
        ),
        case(
            "1.2 mm at most, record begins 0.5 mm above contact",
            write(columns(away)),
            {"max_depth": 1.2e-3},
            part(away, max_depth=1.2e-3, open_depth=(0.69e-3, 1.21e-3)),
        ),
        case("5 N at most, approach of 0.5 mm", write(columns(away)), {"max_force": 5.0}, part(away, max_force=5.0)),
        case("5 N at most, hold at the top", write(columns(held)), {"max_force": 5.0}, part(held, max_force=5.0)),
        case(
            "3 N at most, pull-off above the press",
            write(columns(sticky, -sticky.force, -sticky.depth)),
            {"max_force": 3.0},
            part(sticky, max_force=3.0),
            expected="either",
            way_out=sign(-1, -1),
            **both,
        ),
        case(
            "3 N at most, pull-off, sign said",
            write(columns(sticky, -sticky.force, -sticky.depth)),
            {"max_force": 3.0},
            part(sticky, max_force=3.0),
            reading=sign(-1, -1),
            **both,
        ),
        case(
            "5 N at most of a load of 4 N that was not zeroed",
            write(columns(offset, offset.force + 4.0)),
            {"max_force": 5.0},
            part(offset, max_force=5.0, open_force=(0.9, 5.1)),
        ),
        case(
            "5 N at most, preload above it",
            write(columns(preload)),
            {"max_force": 5.0},
            _no_row(preload),
            "either",
            refusal="5|max.force|sign",
        ),
        case("no force at most", w, {"max_force": 0.0}, _no_row(p), "either", refusal="max.force|positive|0"),
    ]


def _branches() -> list[Case]:
    """The retreat, and chosen cycles."""
    p = press(start=0.0)
    w = write(columns(p))
    only = press(((2.0, 120),), start=0.0)
    rising = press(((1.4, 50), (-0.2, 50), (1.6, 50), (-0.2, 50), (1.8, 50), (-0.2, 50), (2.0, 50), (-0.2, 50)), start=0.0)
    r = write(columns(rising))
    touched = press(((0.2, 20), (-0.2, 20), (2.0, 80), (-0.2, 80), (2.0, 80), (-0.2, 80)), start=-0.2)
    # What is a touch is no cycle: the second loading leg of the press is the first cycle.
    tw = write(columns(touched))
    negative = write(columns(rising, -rising.force, -rising.depth))
    both: Mapping[str, Any] = {"turned": {"force": -1, "displacement": -1}}
    up = {"branch": "unloading"}
    return [
        case("the retreat", w, up, part(p, branch="unloading")),
        case("the retreat below 5 N", w, {**up, "max_force": 5.0}, part(p, branch="unloading", max_force=5.0)),
        case("the retreat below 1 mm", w, {**up, "max_depth": 1e-3}, part(p, branch="unloading", max_depth=1e-3)),
        case("the press, said", w, {"branch": "loading"}, part(p)),
        case(
            "the retreat of a record without one", write(columns(only)), up, _no_row(only), "either", refusal="unload|retreat"
        ),
        case("cycle 2", r, {"cycles": (2,)}, part(rising, (2,))),
        case("cycles 2 and 3", r, {"cycles": (2, 3)}, part(rising, (2, 3))),
        case("cycles 3 and 2", r, {"cycles": (3, 2)}, part(rising, (2, 3))),
        case("cycles 1 and 4", r, {"cycles": (1, 4)}, part(rising, (1, 4))),
        case("all four cycles", r, {"cycles": (1, 2, 3, 4)}, part(rising, (1, 2, 3, 4))),
        case("cycles 2 and 3 below 4 N", r, {"cycles": (2, 3), "max_force": 4.0}, part(rising, (2, 3), max_force=4.0)),
        case(
            "cycles 2 and 3 below 1 mm, compression negative",
            negative,
            {"cycles": (2, 3), "max_depth": 1e-3},
            part(rising, (2, 3), max_depth=1e-3),
            **both,
        ),
        case("the retreat of cycle 3", r, {**up, "cycles": (3,)}, part(rising, (3,), "unloading")),
        case(
            "the retreats of cycles 2 and 4 below 4 N",
            r,
            {**up, "cycles": (2, 4), "max_force": 4.0},
            part(rising, (2, 4), "unloading", 4.0),
        ),
        case(
            "cycle 9 of four",
            r,
            {"cycles": (9,)},
            part(rising, (2,)),
            "refuse",
            refusal="cycle.*4|4.*cycle",
            way_out={},
            way_use={"cycles": (2,)},
        ),
        case(
            "cycles 2 and 9 of four",
            r,
            {"cycles": (2, 9)},
            part(rising, (2,)),
            "refuse",
            refusal="9",
            way_out={},
            way_use={"cycles": (2,)},
        ),
        case("cycle 0", r, {"cycles": (0,)}, part(rising, (1,)), "refuse", refusal="0", way_out={}, way_use={"cycles": (1,)}),
        case("cycle 2 after a touch", tw, {"cycles": (2,)}, part(touched, (3,))),
        case("cycle 1 after a touch, below 5 N", tw, {"cycles": (1,), "max_force": 5.0}, part(touched, (2,), max_force=5.0)),
    ]


def _meters() -> list[Case]:
    """Parts of a meter's record."""
    p = press(((2.0, 60), (-0.3, 60), (2.0, 60), (-0.3, 60)), start=0.0)
    t = Col("Time", p.time, "time", "s", 3)
    c = Col("Cp", p.capacitance, "capacitance", "pF", 4)
    f = Col("Load", p.force, "force", "N", 4)
    x = Col("Extension", p.depth, "displacement", "mm", 5)
    plain: Mapping[str, Any] = {"turned": {}}
    return [
        case("5 N at most of force and capacitance", write([t, f, c]), {"max_force": 5.0}, part(p, max_force=5.0)),
        case("cycle 2 of force and capacitance", write([t, f, c]), {"cycles": (2,)}, part(p, (2,))),
        case("0.8 mm at most of place and capacitance", write([t, x, c]), {"max_depth": 0.8e-3}, part(p, max_depth=0.8e-3)),
        case("5 N at most without a force", write([t, x, c]), {"max_force": 5.0}, {}, "refuse", refusal="force"),
        case(
            "0.8 mm at most without a place",
            write([t, f, c]),
            {"max_depth": 0.8e-3},
            {},
            "refuse",
            refusal="displacement|depth",
        ),
        case(
            "5 N at most of a capacitance over time", write([t, c]), {"max_force": 5.0}, {}, "refuse", refusal="force", **plain
        ),
        renamed(
            case(
                "all",
                write([t, x, f, c]),
                {"cycles": (2,), "branch": "unloading", "max_force": 5.0, "max_depth": 1.2e-3},
                part(p, (2,), "unloading", 5.0, 1.2e-3),
            ),
            "use: everything said at once",
        ),
    ]


def use_cases() -> tuple[Case, ...]:
    """All cases of a part."""
    return (*_limits(), *_branches(), *_meters())
