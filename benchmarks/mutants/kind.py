"""What a kind of mutation is: its name, why its mutants may be read as they are said to be, and the change itself."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

from mutants.document import Document


@dataclass(frozen=True)
class Kind:
    """One kind of mutation.

    Attributes
    ----------
    name : a few words, for tables.
    why : what may come of it, and why, in one line.
    change : document and random numbers in, the mutant out; None where the kind does not apply.
    readable : labs have such files, and nothing in them is in doubt: a refusal is a needless one.
    last : no change can come after it.
    """

    name: str
    why: str
    change: Callable[[Document, random.Random], Document | None]
    readable: bool = False
    last: bool = False
