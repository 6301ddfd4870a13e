"""A problem and where to look for its mode in, a look at it that is worth enough draws to judge by out."""

from __future__ import annotations

from collections.abc import Mapping

from calib.problem import Problem
from calib.sampling import Look, look_at

# Effective draws from which variances are taken for what they are, and below which there is none to speak of.
_ENOUGH, _LEAST = 50.0, 25.0


def look_near(problem: Problem, near: Mapping[str, float]) -> Look | None:
    """Look at a posterior near where a mode is believed to be, and anywhere if that is not worth enough draws.

    Parameters
    ----------
    problem : from `build_problem`, or one like it.
    near : values [SI] by name, see `calib.sampling.look_at`.

    Returns
    -------
    None where there is no first answer.
    """
    try:
        found = look_at(problem, near)
        if found.effective_draws < _ENOUGH:
            found = max(found, look_at(problem), key=lambda look: look.effective_draws)
    except ValueError:
        return None
    return found if found.effective_draws >= _LEAST else None
