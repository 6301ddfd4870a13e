"""A batch of newcomers in, one self-contained page with their lights, risks and drift out."""

from __future__ import annotations

from calib.catalogue import POOLED, QUANTITIES
from calib.decision import DRIFTING, Batch, Inspected, percent
from calib.digits import with_uncertainty
from calib.report.environment import templates
from calib.report.figures.batch import batch_figure, scaled
from calib.report.pictures import figure_address

# Files that are left out and listed by name.
_MOST = 30


def batch_page(batch: Batch) -> str:
    """Lay out a batch as one HTML page that needs nothing beside itself.

    Parameters
    ----------
    batch : the newcomers, inspected.

    Returns
    -------
    The page; the same batch gives the same bytes.
    """
    shown = [name for name in (*POOLED, "signal", "stroke") if any(name in row.estimates for row in batch.rows)]
    risks = batch.risks
    passed = sum(row.decision == "pass" for row in batch.rows)
    failed = sum(row.decision == "fail" for row in batch.rows)
    cards = [(_LIGHT_WORDS[light], f"{batch.count(light)}", f"of {len(batch.rows)}") for light in ("green", "amber", "red")]
    if batch.specification is not None:
        none = len(batch.rows) - passed - failed
        more = f"{failed} fail" + (f", {none} neither" if none else "")
        cards.append(("pass the specification", f"{passed}", more))
    if risks is not None:
        of = risks_of_which(batch)
        cards.append(("consumer's risk", percent(risks.consumers), f"passes and does not conform, {of}"))
        cards.append(("producer's risk", percent(risks.producers), f"fails and would conform, {of}"))
    return (
        templates()
        .get_template("batch.html.j2")
        .render(
            name=batch.lot,
            n=len(batch.rows),
            status=batch_status(batch),
            colour=batch.verdict.colour,
            verdict=batch.of_specimens,
            of_lot_status=lot_status(batch),
            of_lot_verdict=batch.of_lot,
            cards=cards,
            picture=figure_address(batch_figure(batch)) if shown else "",
            trends=[(trend.in_words(DRIFTING[trend.quantity]), trend.drifts, trend.ordered_by) for trend in batch.trends],
            columns=[_heading(name, batch) for name in shown],
            lot=[_range(batch, name) for name in shown],
            rows=[_row(batch, row, shown) for row in batch.rows],
            specification=None
            if batch.specification is None
            else {
                "limits": [limit.in_words for limit in batch.specification.limits],
                "probability": percent(batch.specification.probability),
            },
            of_lot=batch.pooling == "partial",
            like=batch.like,
            conditions=batch.conditions,
            left_out=batch.left_out[:_MOST],
            more_left_out=max(len(batch.left_out) - _MOST, 0),
            run=batch.posterior_sha256[:16],
        )
    )


_LIGHT_WORDS = {"green": "green", "amber": "amber", "red": "red"}


def batch_status(batch: Batch) -> str:
    """Say in a sentence what the lights of a batch are, the colour of the worst first.

    Parameters
    ----------
    batch : the newcomers, inspected.
    """
    n, red, verdict = len(batch.rows), batch.count("red"), batch.of_specimens
    if batch.verdict.colour == "green":
        return f"Green: all {n} specimens can be used." if n > 1 else "Green: the specimen can be used."
    if verdict.colour == "green":
        which = f"any of the {n} specimens" if n > 1 else "the specimen"
        return f"Amber: nothing speaks against {which} but what speaks against the lot."
    if verdict.colour == "amber":
        return "Amber: no specimen is red; see the reasons below."
    return f"Red: {red} of {n} specimens {'is' if red == 1 else 'are'} red." if n > 1 else "Red: the specimen is red."


def risks_of_which(batch: Batch) -> str:
    """Say of which specimens the risks of a batch are.

    Parameters
    ----------
    batch : the newcomers, inspected.
    """
    return "of all judged" if len(batch.counted) == len(batch.judged) else "of those judged that do not lie outside of the lot"


def lot_status(batch: Batch) -> str:
    """Say in a sentence what the light of the lot means for its specimens.

    Parameters
    ----------
    batch : the newcomers, inspected.
    """
    if batch.of_lot.colour == "green":
        return "Lot: green."
    return f"Lot: {batch.of_lot.colour}, and no specimen is better than the lot it rests on."


def _heading(name: str, batch: Batch) -> str:
    unit = scaled(name)[1]
    label = {"signal": f"signal at {batch.force:g} N", "stroke": f"stroke at {batch.force:g} N"}.get(name, "")
    label = label or QUANTITIES[name].label
    return f"{label} ({unit})" if unit else label


def _range(batch: Batch, name: str) -> str:
    if name not in batch.expected:
        return ""
    scale = scaled(name)[0]
    low, _, high = (value * scale for value in batch.expected[name])
    return f"{low:.3g} to {high:.3g}"


def _row(batch: Batch, row: Inspected, shown: list[str]) -> dict[str, object]:
    cells = []
    for name in shown:
        if name not in row.estimates:
            cells.append("")
            continue
        scale = scaled(name)[0]
        mean, sd = (value * scale for value in row.estimates[name][:2])
        cells.append(with_uncertainty(mean, sd))
    conformity = row.conformity if row.decision != "none" else None
    by = {"weighted draws": "", "chains": "by chains", "none": "not computed"}[row.how]
    return {
        "name": row.name,
        "light": row.light,
        "decision": {"pass": "pass", "fail": "fail", "none": ""}[row.decision],
        "probability": "" if conformity is None else percent(conformity.probability),
        "fails": []
        if conformity is None
        else [f"{limit}: {percent(share)} outside" for limit, share in conformity.fails.items() if share > 0],
        "cells": cells,
        "reasons": [(r.level, r.in_words) for r in row.own],
        "belongs": row.belongs,
        "by": by,
        "usable": row.verdict.colour != "red",
        "started": row.started.replace("T", " "),
    }
