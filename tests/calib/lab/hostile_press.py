"""A press of a ball into soft silicone, as the texts that an instrument writes, and what these texts are worth in SI."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

Texts = tuple[str, ...]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Press:
    """One press as plain texts with a decimal point, one of each per row.

    Attributes
    ----------
    t : time in s.
    d : displacement in mm, positive downwards, from above the touch.
    f : force in N, positive in compression.
    c : capacitance in pF.
    loss : dissipation factor.
    """

    t: Texts
    d: Texts
    f: Texts
    c: Texts
    loss: Texts

    @property
    def rows(self) -> int:
        """Number of readings."""
        return len(self.t)


def texts(values: Iterable[float], decimals: int) -> Texts:
    """Numbers as an instrument prints them, with a fixed number of decimals.

    Parameters
    ----------
    values : what is printed.
    decimals : digits after the point.

    Returns
    -------
    One text per value, never "-0.00".
    """
    return tuple(f"{float(v) + 0.0:.{decimals}f}" if round(float(v), decimals) else f"{0:.{decimals}f}" for v in values)


def press(
    rows: int = 120,
    *,
    seed: int = 1,
    step: float = 0.1,
    unloading: bool = True,
    depth: float = 1.4,
    top: float = 7.5,
    decimals: tuple[int, int, int, int] = (2, 4, 3, 3),
    zero: float = 0.0,
) -> Press:
    """Press a ball into a soft layer: force as depth^1.7, a capacitance that rises by some per cent.

    Parameters
    ----------
    rows : number of readings.
    seed : of the noise.
    step : time between two readings [s].
    unloading : whether the second two fifths of the record go back up.
    depth : largest crosshead reading [mm]; the touch is at 0.15 mm.
    top : force at the largest depth [N].
    decimals : of time, displacement, force and capacitance.
    zero : force before the touch [N].

    Returns
    -------
    The texts of the record.
    """
    rng = np.random.default_rng(seed)
    down = rows * 3 // 5 if unloading else rows
    d = np.concatenate([np.linspace(0, depth, down), np.linspace(depth, 0.02, rows - down + 1)[1:]])
    f = top * (np.clip(d - 0.15, 0, None) / (depth - 0.15)) ** 1.7
    f[down:] *= 0.88
    c = 97.4 + 3.1 * (f / 5) ** 0.8
    noise = rng.normal(size=(3, rows))
    return Press(
        texts(step * np.arange(rows), decimals[0]),
        texts(d + 0.0001 * noise[0], decimals[1]),
        texts(f + zero + 0.003 * noise[1], decimals[2]),
        texts(c + 0.004 * noise[2], decimals[3]),
        texts(0.0121 + 0.00004 * noise[0], 5),
    )


def minus(column: Sequence[str]) -> Texts:
    """The same numbers with the other sign, as a tester writes compression."""
    return tuple(text if not text.strip("0.,") else (text[1:] if text.startswith("-") else f"-{text}") for text in column)


def times(column: Sequence[str], factor: str, decimals: int) -> Texts:
    """The same readings in a unit that is smaller by `factor`, with fixed decimals.

    Parameters
    ----------
    column : numbers as texts.
    factor : what they are multiplied by, as a text.
    decimals : digits after the point of the result.

    Returns
    -------
    Texts in the other unit.
    """
    return tuple(f"{Decimal(text) * Decimal(factor):.{decimals}f}" for text in column)


def comma(column: Sequence[str]) -> Texts:
    """The same texts with a decimal comma."""
    return tuple(text.replace(".", ",") for text in column)


def si(column: Sequence[str], factor: str = "1") -> FloatArray:
    """What texts with a decimal point are worth, computed in decimals and rounded once.

    Parameters
    ----------
    column : numbers as texts, "" where there is no reading.
    factor : the unit in SI as a text, such as "1e-3" for millimetres.

    Returns
    -------
    Values in SI, nan for "".
    """
    return np.array([float(Decimal(text) * Decimal(factor)) if text else np.nan for text in column], dtype=np.float64)


def lines_of(
    names: Sequence[str],
    columns: Sequence[Sequence[str]],
    *,
    above: Sequence[str] = (),
    units: Sequence[str] = (),
    below: Sequence[str] = (),
    sep: str = ",",
) -> tuple[list[str], tuple[int, ...]]:
    """A file as its lines, and the number of the line of each reading.

    Parameters
    ----------
    names : cells of the header; none, if the file has no header.
    columns : texts of each column, of equal length.
    above : lines before the header, as they stand.
    units : cells of a row of units, if there is one.
    below : lines after the readings, as they stand.
    sep : what stands between two cells.

    Returns
    -------
    lines, and the 1-based line of each row of `columns`.
    """
    head = [*above, *([sep.join(names)] if names else []), *([sep.join(units)] if units else [])]
    rows = [sep.join(cells) for cells in zip(*columns, strict=True)]
    return [*head, *rows, *below], tuple(range(len(head) + 1, len(head) + 1 + len(rows)))


def content(lines: Sequence[str], *, end: str = "\n", encoding: str = "utf-8") -> bytes:
    """Lines as the bytes of a file.

    Parameters
    ----------
    lines : without their ends.
    end : what ends each of them.
    encoding : of the text.

    Returns
    -------
    The bytes.
    """
    return "".join(line + end for line in lines).encode(encoding)
