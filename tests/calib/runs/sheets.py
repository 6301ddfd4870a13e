"""A print as a browser writes it in, how far down each of its sheets goes out."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Mapping

import numpy as np

from models.sensor import FloatArray

# Where what is printed begins and ends on a sheet of A4, from its top [pt]: the margins of the style sheet.
_TOP, _BOTTOM = 14 * 72 / 25.4, (297 - 18) * 72 / 25.4
_TOKEN = re.compile(rb"<<|>>|\[.*?\]|<[0-9A-Fa-f\s]*>|\((?:\\.|[^\\()])*\)|/[^\s/\[\]<>()]+|[^\s/\[\]<>()]+", re.DOTALL)


def filled(printed: bytes) -> list[float]:
    """Share of each sheet down to which there are letters or pictures, its number aside.

    Parameters
    ----------
    printed : PDF as Chromium writes it: one object after the other, streams compressed by zlib.
    """
    objects = {int(n): body for n, body in re.findall(rb"\n(\d+) 0 obj\s(.*?)\nendobj", printed, re.DOTALL)}
    (root,) = re.findall(rb"/Type /Catalog\b.*?/Pages (\d+) 0 R", printed, re.DOTALL)
    return [_filled(objects, objects[n]) for n in _sheets(objects, int(root))]


def _sheets(objects: Mapping[int, bytes], n: int) -> Iterator[int]:
    """Numbers of the sheets below an object, in order."""
    kids = re.search(rb"/Kids \[(.*?)\]", objects[n], re.DOTALL)
    if kids is None:
        yield n
        return
    for kid in re.findall(rb"(\d+) 0 R", kids[1]):
        yield from _sheets(objects, int(kid))


def _filled(objects: Mapping[int, bytes], sheet: bytes) -> float:
    (height,) = re.findall(rb"/MediaBox \[0 0 [\d.]+ ([\d.]+)\]", sheet)
    (content,) = re.findall(rb"/Contents (\d+) 0 R", sheet)
    (stream,) = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", objects[int(content)], re.DOTALL)
    down = [float(height) - up for up in _ups(zlib.decompress(stream))]
    return (max(y for y in down if y < _BOTTOM + 1) - _TOP) / (_BOTTOM - _TOP)


def _ups(content: bytes) -> Iterator[float]:
    """Lowest place of every text and picture [pt], from the bottom of the sheet."""
    now, kept, given = np.eye(3), list[FloatArray](), list[bytes]()
    for token in _TOKEN.findall(content):
        if token == b"q":
            kept.append(now)
        elif token == b"Q":
            now = kept.pop()
        elif token == b"cm":
            now = _matrix(given) @ now
        elif token == b"Tm":
            yield float((_matrix(given) @ now)[2, 1])
        elif token == b"Do":  # a picture is a square of one by one
            yield min(float((np.array([x, y, 1]) @ now)[1]) for x in (0, 1) for y in (0, 1))
        given = [] if token.isalpha() else [*given[-5:], token]


def _matrix(given: list[bytes]) -> FloatArray:
    a, b, c, d, e, f = map(float, given)
    return np.array([[a, b, 0], [c, d, 0], [e, f, 1]])
