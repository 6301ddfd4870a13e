"""Work under way and a file in, its results as they come in out: each in memory at once, and as a line of the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, as_completed
from pathlib import Path
from typing import TypeVar

from calib.files import naming

_Key = TypeVar("_Key")
_Result = TypeVar("_Result")


def keep_as_they_come(
    futures: Mapping[Future[_Result], _Key],
    path: Path,
    line: Callable[[_Key, _Result], str],
    made: dict[_Key, _Result],
    told: Callable[[int], None],
) -> None:
    """Keep results as they come in, so that what is done is not lost when the rest is stopped, which is then given up.

    Parameters
    ----------
    futures : work under way -> the key of its result.
    path : of the file that the lines are added to.
    line : of a key and its result, with its line end.
    made : key -> result of what there is already; those that come are added.
    told : called with how many results there are, after each.

    Raises
    ------
    OSError
        If a line cannot be written, with the name of the file.
    """
    first = 1 + len(made)
    try:
        with path.open("a", encoding="utf-8") as file:
            for done, future in enumerate(as_completed(futures), first):
                key, result = futures[future], future.result()
                made[key] = result
                with naming(path):
                    file.write(line(key, result))
                    file.flush()
                told(done)
    except BaseException:
        for future in futures:
            future.cancel()
        raise
