"""A ball pressed into soft silicone as numbers in, a lab file of it with the truth of what it says out; knows no reader.

The truth of a cell is the number that was written, times the factor of its unit; the truth of a sign and of a branch is that of
the press that was written down. Nothing is computed by what is tested.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: read: a lab has such files, so that refusing is needless; refuse: must not be read; either: right, or refused with a way out.
Expected = Literal["read", "refuse", "either"]

#: Unit as written -> factor to SI. "" is a number without a unit.
FACTORS: Mapping[str, float] = {
    "s": 1.0, "sec": 1.0, "Sec": 1.0, "Seconds": 1.0, "ms": 1e-3, "min": 60.0, "us": 1e-6, "秒": 1.0,
    "m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9, "in": 0.0254, "inch": 0.0254,
    "毫米": 1e-3,
    "N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6, "μN": 1e-6, "nN": 1e-9, "gf": 9.80665e-3, "kgf": 9.80665,
    "g": 9.80665e-3, "lbf": 4.4482216152605, "牛": 1.0,
    "pF": 1e-12, "nF": 1e-9, "uF": 1e-6, "µF": 1e-6, "F": 1.0,
    "Hz": 1.0, "kHz": 1e3, "": 1.0, "-": 1.0, "%": 1e-2, "‰": 1e-3,
    "x1e-3": 1e-3, "10^-3": 1e-3, "H": 1.0, "ohm": 1.0, "Ω": 1.0, "kΩ": 1e3, "deg": 1.0, "S": 1.0, "°C": 1.0, "kPa": 1e3,
    "MPa": 1e6, "mJ": 1e-3, "N/mm": 1e3, "V": 1.0, "pC": 1e-12, "N·m": 1.0, "mm/min": 1.0, "mm/s": 1e-3, "%RH": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class Press:
    """What happened: SI, compression positive, depth counted from the first contact; arrays of shape (n_row,).

    Attributes
    ----------
    time, depth, force, capacitance, dissipation : [s], [m], [N], [F], [1].
    branch : per row "loading", "unloading" or "hold".
    cycle : per row the loading it belongs to or follows, from 1.
    edge : rows at a turning point, which either branch may claim.
    """

    time: Floats
    depth: Floats
    force: Floats
    capacitance: Floats
    dissipation: Floats
    branch: NDArray[np.str_]
    cycle: NDArray[np.int_]
    edge: Bools

    @property
    def n_row(self) -> int:
        return len(self.time)


def press(
    path: Sequence[tuple[float, int]] = ((2.0, 110), (-0.3, 110)),
    start: float = -0.2,
    peak: float = 10.0,
    pull_off: float = 0.0,
    snap: float = 0.3,
    step: float = 0.1,
    noise: float = 0.004,
    jitter: float = 0.2,
    seed: int = 1,
) -> Press:
    """Press a ball along a path, with hysteresis and, where asked for, adhesion.

    Parameters
    ----------
    path : legs as (depth at the end [mm], rows); a leg to where the ball is already is a hold.
    start : [mm], depth at the first row, negative above the silicone.
    peak : [N], force at a depth of 2 mm.
    pull_off : [N], the largest tension before the ball comes off.
    snap : [mm], how far above the silicone it comes off.
    step : [s] between rows.
    noise, jitter : standard deviation of force [N] and depth [µm].
    seed : of the noise.
    """
    rng = np.random.default_rng(seed)
    depth, branch, cycle, edge = [np.array([start])], ["loading" if path[0][0] > start else "unloading"], [1], [True]
    at, count, before = start, 1, ""
    for to, rows in path:
        kind = "hold" if to == at else "loading" if to > at else "unloading"
        count += before == "unloading" and kind == "loading"
        before = before if kind == "hold" else kind
        depth.append(np.linspace(at, to, rows + 1)[1:])
        branch += [kind] * rows
        cycle += [count] * rows
        edge += [i < 3 or i >= rows - 3 for i in range(rows)]
        at = to
    x = np.concatenate(depth)
    names = np.array(branch)
    force = np.zeros(len(x))
    stuck = False
    for i, (d, kind) in enumerate(zip(x, names, strict=True)):
        force[i] = peak * (max(d, 0.0) / 2.0) ** 1.7
        stuck = stuck or d > 0
        if kind == "unloading":
            top = max(x[max(0, i - 400) : i + 1].max(), 1e-9)
            if d >= -snap and stuck:
                force[i] = 0.92 * force[i] - pull_off * min(1.0, (top - d) / (0.6 * (top + snap)))
            else:
                stuck = False
    force += rng.normal(0, noise, len(x))
    capacitance = (95.0 + 9.0 * np.clip(x, 0, None) + rng.normal(0, 0.003, len(x))) * 1e-12
    return Press(
        time=np.arange(len(x), dtype=np.float64) * step,
        depth=(x + rng.normal(0, jitter, len(x)) * 1e-3) * 1e-3,
        force=force,
        capacitance=capacitance,
        dissipation=0.0021 + rng.normal(0, 2e-5, len(x)),
        branch=names,
        cycle=np.array(cycle),
        edge=np.array(edge),
    )


@dataclass(frozen=True)
class Col:
    """One column to be written: SI values or texts, its name, and the quantity it is, "" if it is none that is read."""

    name: str
    values: Floats | Sequence[str] | float
    quantity: str = ""
    unit: str = ""
    digits: int | None = 4


@dataclass(frozen=True)
class Written:
    """A file and what it says: bytes, the line of each row from 1, SI values per quantity, columns that nothing is read of."""

    data: bytes
    lines: tuple[int, ...]
    truth: Mapping[str, Floats]
    left: tuple[str, ...]


def cells(column: Col, n_row: int, decimal: str) -> tuple[list[str], Floats | None]:
    """The texts of a column and the SI values that these texts are; None for a column of words."""
    values = column.values
    if isinstance(values, float | int):
        values = np.full(n_row, float(values))
    if not isinstance(values, np.ndarray):
        return list(values), None
    factor = FACTORS[column.unit]
    texts = [
        "" if np.isnan(v) else f"{v / factor:.5E}" if column.digits is None else f"{v / factor:.{column.digits}f}"
        for v in values
    ]
    exact = np.array([float(t) * factor if t else np.nan for t in texts])
    return [t.replace(".", decimal) for t in texts], exact


def write(
    columns: Sequence[Col],
    above: Sequence[str] = (),
    below: Sequence[str] = (),
    style: str = "{name} ({unit})",
    units: str = "",
    header: Sequence[str] | None = None,
    delimiter: str = ",",
    decimal: str = ".",
    eol: str = "\n",
    encoding: str = "utf-8",
    quote: bool = False,
    tail: str = "",
    end: bool = True,
) -> Written:
    """Write columns as a lab file.

    Parameters
    ----------
    columns : in the order of the file.
    above, below : lines before the header and after the rows.
    style : a header cell of a column with a unit; one without a unit is its name alone.
    units : "" or how a cell of a row of units below the header is written, such as "({unit})"; then `style` is often "{name}".
    header : the lines of the header instead, as they are.
    delimiter, decimal, eol, encoding, quote : of the text; `quote` puts every cell into quotes.
    tail : what follows each row before its end, such as a delimiter too many.
    end : whether the last line ends.
    """
    n_row = next(len(c.values) for c in columns if not isinstance(c.values, float | int))

    def line(row: Sequence[str]) -> str:
        return delimiter.join(f'"{c}"' for c in row) if quote else delimiter.join(row)

    if header is None:
        header = [line([style.format(name=c.name, unit=c.unit) if c.unit else c.name for c in columns])]
        if units:
            header.append(line([units.format(unit=c.unit) if c.unit else "" for c in columns]))
    made = [cells(c, n_row, decimal) for c in columns]
    rows = [line(row) + tail for row in zip(*(texts for texts, _ in made), strict=True)]
    lines = [*above, *header, *rows, *below]
    truth = {c.quantity: values for c, (_, values) in zip(columns, made, strict=True) if c.quantity and values is not None}
    first = len(above) + len(header) + 1
    text = eol.join(lines) + (eol if end else "")
    left = tuple(c.name for c in columns if not c.quantity and c.name)
    return Written(text.encode(encoding), tuple(range(first, first + n_row)), truth, left)


def said(**words: Any) -> Mapping[str, Any]:
    """What a user says of the file, as fields of a `Reading`."""
    return words


#: What may be said of a sign.
POSITIVE, NEGATIVE = "compression positive", "compression negative"


def sign(force: int | None = None, displacement: int | None = None) -> Mapping[str, Any]:
    """The saying that makes these signs: +1 where the file counts compression positive, -1 where negative."""
    given = {"force": force, "displacement": displacement}
    return said(sign={q: POSITIVE if s > 0 else NEGATIVE for q, s in given.items() if s is not None})


@dataclass(frozen=True)
class Case:
    """A hostile file, what it holds, and what a reader may do with it.

    Attributes
    ----------
    name, kind : what is hostile in it; "sign", "column", "benign" or "use".
    data, suffix : the file.
    expected : whether it must be read, must be refused, or may be refused if the way out is right.
    lines : line of the file of each row.
    truth : quantity -> SI values with the file's signs, each of shape (n_row,). What is not here must not be read of the file.
    or_else : quantity -> other values that are as good, if `choice` is told.
    optional : quantities of `truth` that need not be read, but have to be right if they are.
    turned : quantity -> +1 or -1, by which the file's values become compression positive.
    must_use, must_not_use : rows of the branch that is calibrated, rows that are certainly not of it; None where left open.
    free : rows of which nothing is demanded, such as a spike.
    reading, use : what the user says of the file, and which part of it is wanted, as fields of `Reading` and `Use`.
    way_out, way_truth : fields of a `Reading` that lead out of a refusal, and what is then true where it differs.
    left : columns that must be named as not used, or as used, anywhere.
    choice : what must be told where the file is read, a regular expression; "" if there is nothing to choose.
    refusal : what must stand in a refusal, a regular expression.
    """

    name: str
    kind: str
    data: bytes
    expected: Expected
    lines: tuple[int, ...]
    truth: Mapping[str, Floats]
    suffix: str = ".csv"
    or_else: Mapping[str, tuple[Floats, ...]] = field(default_factory=dict)
    optional: tuple[str, ...] = ("dissipation", "frequency", "cycle", "status")
    turned: Mapping[str, int] = field(default_factory=dict)
    must_use: Bools | None = None
    must_not_use: Bools | None = None
    free: Bools | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)
    use: Mapping[str, Any] = field(default_factory=dict)
    way_out: Mapping[str, Any] | None = None
    way_use: Mapping[str, Any] | None = None
    way_truth: Mapping[str, Floats] = field(default_factory=dict)
    left: tuple[str, ...] = ()
    choice: str = ""
    refusal: str = ""


def make(name: str, kind: str, expected: Expected, written: Written, **more: Any) -> Case:
    """A case of a written file; what `more` says goes before what the file says."""
    given = {"truth": written.truth, "left": written.left, **more}
    return Case(name=name, kind=kind, expected=expected, data=written.data, lines=written.lines, **given)


def branches(p: Press, cycles: Sequence[int] = (1,), branch: str = "loading") -> Mapping[str, Any]:
    """Which rows of a press have to be used, and which must not, where a branch of some cycles is calibrated.

    The approach may be used or not, so may the rows at a turning point; the middle of the branch and of the others is certain.
    """
    wanted = (p.branch == branch) & np.isin(p.cycle, cycles)
    inside = (p.depth > 0.15 * p.depth.max()) & ~p.edge
    return {"must_use": wanted & inside, "must_not_use": ~wanted & inside & (p.branch != "hold")}


def renamed(case: Case, name: str, **changes: Any) -> Case:
    """The same file under another name, with another saying or another truth."""
    return replace(case, name=name, **changes)
