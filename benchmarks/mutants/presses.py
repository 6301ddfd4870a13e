"""A document in, whether its rows show a press out: without one nothing shows which way compression is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mutants.document import Document, Row


def pressed(doc: Document) -> bool:
    """Whether the record has a press: a force that leaves its start for compression by many times its steps from row to row."""
    at = doc.index("force")
    if at is None or "force" not in doc.turned:
        return False
    values = doc.turned["force"] * np.array([doc.row(i).values[at] for i in doc.rows()])
    values = values[np.isfinite(values)]
    if len(values) < 20:
        return False
    return bool(values.max() - values[0] > max(15.0 * float(np.median(np.abs(np.diff(values)))), 0.5 * float(np.ptp(values))))


def still_pressed(doc: Document, plain: Document) -> bool:
    """Whether the rows that a mutant has left of its file still hold a press, be it without its beginning.

    Parameters
    ----------
    doc : the mutant.
    plain : the document before it was changed.

    Returns
    -------
    False where it was cut before the force left its noise: nothing shows then which way compression is.
    """
    left = {doc.row(i).origin for i in doc.rows()}
    body = tuple(v for v in plain.body if isinstance(v, Row) and v.origin in left)
    return pressed(plain) and any(pressed(replace(plain, body=way)) for way in (body, body[::-1]))
