"""Records whose sign and zero a glance at a few rows gets wrong, with the sign that they were written with."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import (
    POSITIVE,
    Bools,
    Case,
    Col,
    Expected,
    Floats,
    Press,
    Written,
    branches,
    make,
    press,
    renamed,
    sign,
    write,
)

BLUEHILL_NAMES = ("Time", "Extension", "Load")
BLUEHILL = ('Text Inputs : Specimen label,"pad 7"', "General : Start Date,21/03/2024 10:14 AM", "")
#: The words of a note that says that a sign could not be told, or was chosen.
DOUBT = r"doubt|unclear|not clear|cannot be told|cannot tell|weak|no evidence|assum|noise|ambiguous|undecided|not told|open"


def machine(
    p: Press,
    force: Floats | None,
    place: Floats | None,
    labels: Sequence[str] = BLUEHILL_NAMES,
    **how: Any,
) -> Written:
    """Time, displacement, force of a testing machine, those that are not None, with the signs that they come with."""
    columns = [Col(labels[0], p.time, "time", "s", 3)]
    if place is not None:
        columns.append(Col(labels[1], place, "displacement", "mm", 5))
    if force is not None:
        columns.append(Col(labels[2], force, "force", "N", 4))
    return write(columns, **how)


def meter(p: Press, force: Floats) -> Written:
    """Time, force, capacitance of a log that has no place of its own."""
    time = Col("Time", p.time, "time", "s", 3)
    return write([time, Col("Load", force, "force", "N"), Col("Cp", p.capacitance, "capacitance", "pF", 4)])


def case(
    name: str,
    p: Press,
    written: Written,
    force: int | None = None,
    displacement: int | None = None,
    expected: Expected = "either",
    cycles: Sequence[int] = (1,),
    rows: bool = True,
    **more: Any,
) -> Case:
    """A case whose way out is to say the signs; `rows` asks for the loading branch of the first cycle, too."""
    turned = {q: s for q, s in (("force", force), ("displacement", displacement)) if s is not None}
    picked: Mapping[str, Any] = branches(p, cycles) if rows else {}
    given = {"turned": turned, "way_out": sign(force, displacement), **picked, **more}
    return make(f"sign: {name}", "sign", expected, written, **given)


def spiked(values: Floats, rows: Sequence[int], by: float) -> Floats:
    """Values with spikes in some rows."""
    out = values.copy()
    out[list(rows)] = by
    return out


def at(p: Press, rows: Sequence[int]) -> Bools:
    """The mask of some rows, negative ones from the end."""
    mask = np.zeros(p.n_row, bool)
    mask[list(rows)] = True
    return mask


def _pull_off() -> list[Case]:
    """The ball sticks: more tension at the retreat than force at the press."""
    p = press(peak=5.0, pull_off=8.0)
    far = press(((2.0, 80), (-6.0, 240)), peak=5.0, pull_off=9.0, snap=1.0)
    brief = press(((2.0, 150), (-0.3, 60)), peak=3.0, pull_off=7.0, snap=0.1)
    slow = press(((1.0, 40), (-0.5, 300)), peak=10.0, pull_off=6.0, snap=0.5)
    twice = press(((2.0, 60), (-0.4, 60), (2.0, 60), (-0.4, 60)), peak=4.0, pull_off=6.5)
    jump = press(((2.0, 110), (-0.3, 110)), peak=6.0, pull_off=7.0)
    jump = replace(jump, force=jump.force - 0.6 * ((jump.depth > -5e-5) & (jump.depth < 1e-4) & (jump.branch == "loading")))
    german = {"labels": ("Zeit", "Weg", "Kraft"), "delimiter": ";", "decimal": ",", "encoding": "latin-1"}
    return [
        case("pull-off above the press, compression negative", p, machine(p, -p.force, -p.depth, above=BLUEHILL), -1, -1),
        case("pull-off above the press, compression positive", p, machine(p, p.force, p.depth), 1, 1),
        case("pull-off above the press, force negative only", p, machine(p, -p.force, p.depth), -1, 1),
        case("pull-off above the press, displacement negative only", p, machine(p, p.force, -p.depth), 1, -1),
        case(
            "pull-off, withdrawn three times as far as pressed",
            far,
            machine(far, -far.force, -far.depth, above=BLUEHILL),
            -1,
            -1,
        ),
        case("pull-off, withdrawn further, compression positive", far, machine(far, far.force, far.depth), 1, 1),
        case("pull-off of a few rows", brief, machine(brief, -brief.force, -brief.depth, above=BLUEHILL), -1, -1),
        case("pull-off slow, most rows in tension", slow, machine(slow, slow.force, slow.depth), 1, 1),
        case("pull-off slow, compression negative, German", slow, machine(slow, -slow.force, -slow.depth, **german), -1, -1),
        case("pull-off in both of two cycles", twice, machine(twice, -twice.force, -twice.depth), -1, -1),
        case("jump into contact before the press", jump, machine(jump, jump.force, jump.depth), 1, 1),
        case("pull-off above the press, force and capacitance", p, meter(p, -p.force), -1),
        case("pull-off above the press, force and capacitance, positive", p, meter(p, p.force), 1),
    ]


def _reset() -> list[Case]:
    """The zero of a column changes while it is recorded."""
    p = press(((2.0, 110), (-3.0, 150)), start=-5.0)
    touch = int(np.argmax(p.depth > 0))
    before = np.arange(p.n_row) < touch
    after: Mapping[str, Any] = {
        "way_out": None,
        "refusal": "line|reset|jump|zero|sign",
        "must_not_use": before & (p.depth < -5e-4),
    }
    place = np.where(before, p.depth - p.depth[0], p.depth)  # 0 to 5 mm, then again from 0
    tare = press(((2.0, 100), (2.0, 20), (-0.3, 100)))
    tared = np.where(np.arange(tare.n_row) < 110, tare.force, tare.force - tare.force[110])
    offset = press()
    moved = press(((2.0, 100), (-0.3, 100), (2.0, 100), (-0.3, 100)))
    zero = np.where(moved.cycle == 2, moved.force - 12.0, moved.force)
    return [
        case("extension reset at touch", p, machine(p, p.force, place), 1, 1, **after),
        case("extension reset at touch, both negative", p, machine(p, -p.force, -place, above=BLUEHILL), -1, -1, **after),
        case("extension reset at touch, force negative", p, machine(p, -p.force, place), -1, 1, **after),
        case("load tared while pressed", tare, machine(tare, tared, tare.depth), 1, 1),
        case("load tared while pressed, compression negative", tare, machine(tare, -tared, -tare.depth), -1, -1),
        case("load tared while pressed, force and capacitance", tare, meter(tare, tared), 1, rows=False),
        case("load zero moves between cycles", moved, machine(moved, -zero, -moved.depth), -1, -1),
        case("a weight of 30 N hangs on the cell", offset, machine(offset, offset.force - 30.0, offset.depth), 1, 1),
        case(
            "a weight of 30 N hangs on the cell, negative", offset, machine(offset, 30.0 - offset.force, -offset.depth), -1, -1
        ),
        case(
            "load of 4 N not zeroed, compression negative", offset, machine(offset, 4.0 - offset.force, -offset.depth), -1, -1
        ),
    ]


def _pressed() -> list[Case]:
    """The first row is no zero: the ball presses already."""
    p = press(((-0.2, 60), (2.0, 100), (-0.3, 60)), start=1.8)
    once = press(((-0.3, 120),), start=2.0)
    pre = press(((1.8, 40), (0.8, 40), (1.8, 40), (0.8, 40), (1.8, 40), (0.8, 40)), start=0.8)
    sine = np.sin(np.linspace(0, 40 * np.pi, 400))
    dynamic = press(((1.0, 200), (1.0, 199)), start=1.0, peak=10)
    dynamic = replace(dynamic, depth=(1.0 + 0.3 * sine) * 1e-3, force=10 * ((1.0 + 0.3 * sine) / 2) ** 1.7)
    return [
        case("starts pressed, then lifted and pressed", p, machine(p, p.force, p.depth), 1, 1, cycles=(2,)),
        case("starts pressed, compression negative", p, machine(p, -p.force, -p.depth, above=BLUEHILL), -1, -1, cycles=(2,)),
        case(
            "starts pressed, place counted from the first row",
            p,
            machine(p, -p.force, -(p.depth - p.depth[0])),
            -1,
            -1,
            cycles=(2,),
        ),
        case("starts pressed and zeroed there", p, machine(p, p.force - p.force[0], p.depth - p.depth[0]), 1, 1, cycles=(2,)),
        case("starts pressed, force and capacitance", p, meter(p, -p.force), -1, cycles=(2,)),
        case(
            "only the retreat",
            once,
            machine(once, -once.force, -once.depth),
            -1,
            -1,
            rows=False,
            way_out=None,
            refusal="load|branch|retreat|unload|sign",
        ),
        case("cyclic with prestress", pre, machine(pre, pre.force, pre.depth), 1, 1),
        case("cyclic with prestress, compression negative", pre, machine(pre, -pre.force, -pre.depth, above=BLUEHILL), -1, -1),
        case(
            "cyclic with prestress, zeroed there, negative",
            pre,
            machine(pre, -(pre.force - pre.force[0]), -(pre.depth - pre.depth[0])),
            -1,
            -1,
        ),
        case("cyclic with prestress, force and capacitance, negative", pre, meter(pre, -pre.force), -1),
        case(
            "vibration about a static press, negative",
            dynamic,
            machine(dynamic, -dynamic.force, -dynamic.depth),
            -1,
            -1,
            rows=False,
        ),
    ]


def _spikes() -> list[Case]:
    """Readings that are none, at the ends and inside."""
    p = press()
    first, last, inside = [0, 1], [-1], [60]
    falling = 5.0 - p.depth * 1e3
    return [
        case(
            "spike of force in the first rows", p, machine(p, spiked(p.force, first, -60.0), p.depth), 1, 1, free=at(p, first)
        ),
        case(
            "spike of force in the first row, negative",
            p,
            machine(p, spiked(-p.force, [0], 45.0), -p.depth, above=BLUEHILL),
            -1,
            -1,
            free=at(p, [0]),
        ),
        case("spike of force in the last row", p, machine(p, spiked(p.force, last, -80.0), p.depth), 1, 1, free=at(p, last)),
        case("spike of force inside", p, machine(p, spiked(-p.force, inside, 70.0), -p.depth), -1, -1, free=at(p, inside)),
        case(
            "spike of displacement in the last row",
            p,
            machine(p, p.force, spiked(p.depth, last, -0.05)),
            1,
            1,
            free=at(p, last),
        ),
        case(
            "spike of displacement in the first row, position falls",
            p,
            machine(p, p.force, spiked(falling * 1e-3, [0], 0.08)),
            1,
            -1,
            free=at(p, [0]),
        ),
        case(
            "spikes of both signs",
            p,
            machine(p, spiked(spiked(-p.force, [3], 90.0), [150], -90.0), -p.depth),
            -1,
            -1,
            free=at(p, [3, 150]),
        ),
        case("spike of force, force and capacitance", p, meter(p, spiked(-p.force, [0], 45.0)), -1, free=at(p, [0])),
        case(
            "first rows ring after the start",
            p,
            machine(p, -p.force + 2.0 * np.exp(-np.arange(p.n_row) / 4) * np.cos(np.arange(p.n_row)), -p.depth),
            -1,
            -1,
        ),
    ]


def _drift() -> list[Case]:
    """What is not the press is larger than the press."""
    p = press(peak=3.0)
    run = p.time / p.time[-1]
    two = press(((2.0, 60), (-0.3, 60), (2.0, 60), (-0.3, 60)), peak=3.0)
    along = two.time / two.time[-1]
    clipped = press(peak=10.0, pull_off=7.0)
    rng = np.random.default_rng(5)
    off = press(((-0.5, 100), (-3.0, 100)), start=-3.0)
    silent = replace(off, force=rng.normal(0, 0.01, off.n_row))
    late = press(((-0.1, 300), (0.9, 14), (-0.3, 30)), start=-6.0, peak=20.0)
    return [
        case("drift of 20 N at a press of 3 N", p, machine(p, p.force - 20 * run, p.depth), 1, 1),
        case("drift of 20 N at a press of 3 N, negative", p, machine(p, -p.force + 20 * run, -p.depth, above=BLUEHILL), -1, -1),
        case("drift with the press, negative", p, machine(p, -p.force - 9 * run, -p.depth), -1, -1),
        case("drift over two cycles", two, machine(two, two.force - 12 * along, two.depth), 1, 1),
        case("drift of 20 N, force and capacitance", p, meter(p, p.force - 20 * run), 1, rows=False),
        case(
            "load cell saturated at 4 N, pull-off not",
            clipped,
            machine(clipped, np.minimum(clipped.force, 4.0), clipped.depth),
            1,
            1,
        ),
        case(
            "load cell saturated at 4 N, negative",
            clipped,
            machine(clipped, -np.minimum(clipped.force, 4.0), -clipped.depth, above=BLUEHILL),
            -1,
            -1,
        ),
        case(
            "load cell saturated, force and capacitance",
            clipped,
            meter(clipped, -np.minimum(clipped.force, 4.0)),
            -1,
            rows=False,
        ),
        case(
            "noise alone",
            off,
            machine(off, silent.force, off.depth),
            1,
            1,
            rows=False,
            choice=DOUBT,
            turned={"displacement": 1},
        ),
        case(
            "noise alone, compression negative",
            off,
            machine(off, -silent.force, -off.depth),
            -1,
            -1,
            rows=False,
            choice=DOUBT,
            turned={"displacement": -1},
        ),
        case("noise alone, force and capacitance", off, meter(off, -silent.force), -1, rows=False, choice=DOUBT, turned={}),
        case("press of fourteen rows at the end", late, machine(late, -late.force, -late.depth, above=BLUEHILL), -1, -1),
    ]


def _directions() -> list[Case]:
    """Every pairing of signs that testers have."""
    p = press()
    z = ("Timestamp", "Z_Position", "Force")
    up = press(((-3.0, 60), (2.0, 120), (-0.3, 60)), start=-0.2)
    lift = press(((-1.0, 60), (2.0, 120), (-0.3, 60)), start=0.0)
    lift = replace(lift, force=lift.force - 6.0 * np.exp(-(((np.arange(lift.n_row) - 12) / 6.0) ** 2)))
    only = press(((2.0, 120),))
    steps = press((*(leg for d in (0.4, 0.8, 1.2, 1.6, 2.0) for leg in ((d, 20), (d, 25))), (-0.3, 60)))
    french = {"labels": ("Temps", "Déplacement", "Force"), "delimiter": ";", "decimal": ",", "encoding": "latin-1"}
    italian = {"labels": ("Tempo", "Spostamento", "Forza"), "delimiter": ";", "decimal": ","}
    japanese = {"labels": ("時間", "変位", "荷重"), "encoding": "shift-jis"}
    chinese = {"labels": ("时间", "位移", "力"), "encoding": "gbk"}
    zwick = {"labels": ("Prüfzeit", "Standardweg", "Standardkraft"), "delimiter": ";", "decimal": ",", "encoding": "latin-1"}
    both = -1, -1
    no_place: Mapping[str, Any] = {"rows": False, "way_out": None, "refusal": "displacement"}
    return [
        case(
            "tension positive, one way only",
            only,
            machine(only, -only.force, -only.depth, above=BLUEHILL),
            *both,
            expected="read",
        ),
        case("tension positive, both ways", p, machine(p, -p.force, -p.depth, **zwick), *both, expected="read"),
        case("position falls from 50 mm, force positive", p, machine(p, p.force, 0.05 - p.depth), 1, -1, expected="read"),
        case("position rises from -80 mm, force negative", p, machine(p, -p.force, -0.08 + p.depth), -1, 1, expected="read"),
        case(
            "position falls below -74 mm, both negative",
            p,
            machine(p, -p.force, -0.074 - p.depth, labels=z),
            *both,
            expected="read",
        ),
        case("gap falls from 12 mm, French", p, machine(p, p.force, 0.012 - p.depth, **french), 1, -1, expected="read"),
        case(
            "moves up 3 mm before it comes down",
            up,
            machine(up, -up.force, -up.depth, above=BLUEHILL),
            *both,
            cycles=(2,),
        ),
        case(
            "moves up 3 mm first, positive, Italian",
            up,
            machine(up, up.force, up.depth, **italian),
            1,
            1,
            cycles=(2,),
        ),
        case(
            "is torn off with 6 N before it presses",
            lift,
            machine(lift, -lift.force, -lift.depth, above=BLUEHILL),
            *both,
            cycles=(2,),
        ),
        case(
            "steps with holds, negative, Japanese",
            steps,
            machine(steps, -steps.force, -steps.depth, **japanese),
            *both,
            rows=False,
            expected="read",
        ),
        case(
            "force negative, displacement positive, Chinese",
            p,
            machine(p, -p.force, p.depth, **chinese),
            -1,
            1,
            expected="read",
        ),
        case(
            "compressive names, load negative for all that",
            p,
            machine(p, -p.force, p.depth, labels=("Time", "Compressive extension", "Compressive load")),
            -1,
            1,
        ),
        case(
            "compressive names, pull-off above the press",
            press(peak=5.0, pull_off=8.0),
            machine(
                q := press(peak=5.0, pull_off=8.0),
                q.force,
                q.depth,
                labels=("Time", "Compressive extension", "Compressive load"),
            ),
            1,
            1,
        ),
        case("force alone, negative", p, machine(p, -p.force, None, above=BLUEHILL), -1, **no_place),
        case("force alone, positive", p, machine(p, p.force, None), 1, **no_place),
        case("force alone, one way only, negative", only, machine(only, -only.force, None), -1, **no_place),
    ]


def _capacitance() -> list[Case]:
    """A meter's record: a capacitance rises with the depth whatever the sign of the place."""
    p = press()
    far = press(((2.0, 80), (-6.0, 240)))
    time = Col("Time", p.time, "time", "s", 3)
    c = Col("Cp", p.capacitance, "capacitance", "pF", 4)
    d = Col("D", p.dissipation, "dissipation", "", 5)
    far_columns = [
        Col("Time", far.time, "time", "s", 3),
        Col("Z", -far.depth, "displacement", "mm", 5),
        Col("Cp", far.capacitance, "capacitance", "pF", 4),
    ]
    noisy = np.random.default_rng(3).normal(0, 0.004, p.n_row)
    return [
        case("capacitance over time alone", p, write([time, c, d]), expected="read", rows=False, way_out=None),
        case(
            "capacitance and a force negative",
            p,
            write([time, Col("Load", -p.force, "force", "N"), c]),
            -1,
            expected="read",
            rows=False,
        ),
        case(
            "capacitance and a position that falls",
            p,
            write([time, Col("Position", 0.05 - p.depth, "displacement", "mm", 5), c]),
            displacement=-1,
            expected="either",
        ),
        case("capacitance, withdrawn three times as far as pressed", far, write(far_columns), displacement=-1),
        case(
            "capacitance, force that is noise, position falls",
            p,
            write([time, Col("Position", 0.05 - p.depth, "displacement", "mm", 5), Col("Load", noisy, "force", "N"), c]),
            1,
            -1,
            rows=False,
            choice=DOUBT,
        ),
        case(
            "capacitance and force with pull-off above the press",
            press(peak=5.0, pull_off=8.0),
            write(
                [
                    Col("Time", (q := press(peak=5.0, pull_off=8.0)).time, "time", "s", 3),
                    Col("Load", -q.force, "force", "N"),
                    Col("Cp", q.capacitance, "capacitance", "pF", 4),
                ]
            ),
            -1,
            rows=False,
        ),
    ]


def _given(made: Sequence[Case]) -> list[Case]:
    """The same files with the sign said: they must be read, and as it was said."""
    wanted = (
        "sign: pull-off above the press, compression negative",
        "sign: pull-off above the press, force and capacitance",
        "sign: load tared while pressed",
        "sign: drift of 20 N at a press of 3 N",
        "sign: noise alone, compression negative",
        "sign: noise alone, force and capacitance",
        "sign: starts pressed and zeroed there",
        "sign: cyclic with prestress, zeroed there, negative",
        "sign: load cell saturated, force and capacitance",
        "sign: capacitance, withdrawn three times as far as pressed",
    )
    by_name = {c.name: c for c in made}
    return [
        renamed(
            by_name[n],
            f"{n}, sign said",
            expected="read",
            reading=by_name[n].way_out,
            turned={q: 1 if given == POSITIVE else -1 for q, given in (by_name[n].way_out or {})["sign"].items()},
            way_out=None,
            choice="",
        )
        for n in wanted
    ]


def _half_given() -> list[Case]:
    """The sign of one quantity is said, the other is the file's matter."""
    p = press(peak=5.0, pull_off=8.0)
    good = press()
    return [
        case(
            "sign of force said, that of displacement open",
            p,
            machine(p, -p.force, -p.depth),
            -1,
            -1,
            reading=sign(force=-1),
            way_out=sign(displacement=-1),
        ),
        case(
            "sign of displacement said, that of force open",
            p,
            machine(p, -p.force, 0.05 - p.depth),
            -1,
            -1,
            reading=sign(displacement=-1),
            way_out=sign(force=-1),
        ),
        case(
            "sign of a force said that the file does not have",
            good,
            write([Col("Time", good.time, "time", "s", 3), Col("Cp", good.capacitance, "capacitance", "pF")]),
            reading=sign(force=-1),
            way_out=None,
            rows=False,
            choice="sign",
            refusal="force",
        ),
    ]


def _drawn(n: int = 60) -> list[Case]:
    """Presses drawn at random, several mishaps at once: adhesion, drift, offset, spikes, retreat, cycles, any signs."""
    out = []
    for k in range(n):
        rng = np.random.default_rng(1000 + k)
        top = float(rng.uniform(1.2, 2.0))
        retreat = -float(rng.choice([0.2, 0.5, 3.0, 8.0]))
        begin = -float(rng.choice([0.0, 0.1, 0.4, 2.0]))
        rows = int(rng.integers(40, 120))
        hold = [(top, int(rng.integers(10, 30)))] if rng.random() < 0.3 else []
        once: list[tuple[float, int]] = [(top, rows), *hold, (retreat, int(rng.integers(40, 120)))]
        legs = once * int(rng.choice([1, 1, 2]))
        first = rng.random() < 0.2
        if first:  # it is lifted off before it is pressed
            legs = [(begin - 1.0, 40), *legs]
        peak = float(rng.uniform(2.0, 20.0))
        p = press(
            tuple(legs),
            start=begin,
            peak=peak,
            pull_off=peak * float(rng.choice([0.0, 0.3, 1.2, 2.0])),
            snap=float(rng.uniform(0.05, 0.19)),
            noise=peak * float(rng.choice([3e-4, 2e-3])),
            seed=k,
        )
        mishaps = ["pressed once" if len(legs) < 4 else "several legs"]
        force, free = p.force, np.zeros(p.n_row, bool)
        if rng.random() < 0.4:
            force = force + peak * rng.uniform(-1, 1)
            mishaps.append("offset")
        if rng.random() < 0.3:
            force = force + peak * rng.uniform(-1.5, 1.5) * p.time / p.time[-1]
            mishaps.append("drift")
        if rng.random() < 0.3:
            where = [int(rng.choice([0, 1, p.n_row // 3, p.n_row - 1]))]
            force, free = spiked(force, where, peak * float(rng.choice([-8.0, 8.0]))), at(p, where)
            mishaps.append("spike")
        f, d = (int(s) for s in rng.choice([-1, 1], 2))
        zero = float(rng.choice([0.0, 0.0, 0.05, -0.08]))
        name = f"drawn {k}, {', '.join(mishaps)}"
        out.append(case(name, p, machine(p, f * force, zero + d * p.depth), f, d, cycles=(2,) if first else (1,), free=free))
    return out


def sign_cases() -> tuple[Case, ...]:
    """All cases of sign and zero."""
    made = [*_pull_off(), *_reset(), *_pressed(), *_spikes(), *_drift(), *_directions(), *_capacitance()]
    return (*made, *_given(made), *_half_given(), *_drawn())
