"""A run in, which advice that is kept in its folder was made from other draws than it has now out."""

from __future__ import annotations

from contextlib import suppress

from calib.decision import next_from_json
from calib.errors import InputError, in_shell_path
from calib.runs.folder import Run, load_recommendation
from calib.runs.listing import NEXT, RECOMMENDATION, read_listing


def of_other_draws(run: Run) -> dict[str, str]:
    """Say which advice in the folder of a run does not follow from its draws, and by which command it is made anew.

    An advice belongs to the draws that it was made from, whatever has been added to the experiment file since. One that is
    damaged, or of another run, is no advice at all.

    Parameters
    ----------
    run : as loaded.

    Returns
    -------
    Name of a file -> what is to be said of it.
    """
    found = {}
    with suppress(InputError):
        kept = load_recommendation(run.folder)
        if kept is not None and kept.draws_sha256 != run.posterior.draws_sha256:
            found[RECOMMENDATION] = _made_by(run, "recommend")
    path = run.folder / NEXT
    if path.is_file():
        with suppress(InputError):
            text = path.read_bytes().decode("utf-8", errors="replace")
            if next_from_json(text, path, run.posterior.draws_sha256) is None:
                found[NEXT] = _made_by(run, "next")
    return found


def _made_by(run: Run, name: str) -> str:
    """That an advice is of other draws, and the command that made it last, as it was given."""
    listing = read_listing(run.folder)
    given = [] if listing is None else [c.text for c in listing.commands if c.text.startswith(f"calib {name} ")]
    command = given[-1] if given else f"calib {name} {in_shell_path(run.folder)}"
    return f"made from other draws than those of this run: run it again, `{command}`"
