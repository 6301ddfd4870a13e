"""Words in, the part of a sentence that lists them out."""

from __future__ import annotations

from collections.abc import Sequence

#: More words than this are not all listed where `first_of` does.
MOST = 4


def all_of(words: Sequence[str]) -> str:
    """List words, all of them; "" for none.

    >>> all_of(["a"]), all_of(["a", "b"]), all_of(list("abcdef"))
    ('a', 'a and b', 'a, b, c, d, e and f')
    """
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} and {words[-1]}"


def first_of(words: Sequence[str]) -> str:
    """List words, of more than four the first three and how many more there are; "" for none.

    >>> first_of(["a", "b"]), first_of(list("abcdef"))
    ('a and b', 'a, b, c and 3 more')
    """
    if len(words) <= MOST:
        return all_of(words)
    return all_of([*words[: MOST - 1], f"{len(words) - MOST + 1} more"])
