"""The shares of accepted steps of a run in, a plain sentence on each kind of move out."""

from __future__ import annotations

from calib.sampling import Diagnostics

# Kind of move -> what it is, and shares: from the first on it does well, below the second badly.
_KINDS = {
    "proposal": ("jumps to fresh draws of a density that was fitted to the posterior", 0.3, 0.15),
    "nearby": ("steps to places nearby that this density does not mind", 0.4, 0.2),
    "differential evolution": ("steps along the difference of two other walkers, which need no shape", 0.15, 0.05),
    "specimens": ("each specimen by itself to a fresh draw of a density that was fitted to the posterior", 0.3, 0.15),
    "specimens nearby": ("each specimen by itself to a place nearby that this density does not mind", 0.4, 0.2),
    "shared": ("what all specimens share, afresh, the specimens going along", 0.05, 0.02),
    "shared nearby": ("what all specimens share, to a place nearby, the specimens going along", 0.15, 0.05),
    "shared differential evolution": ("the same along the difference of two other walkers", 0.15, 0.05),
    "scales": ("a noise or discrepancy along the difference of two other walkers, the specimens going along", 0.15, 0.05),
    "scales alone": ("a noise or discrepancy along the difference of two other walkers, all else held", 0.15, 0.05),
    "specimens together": ("all specimens by the same along the difference of two other walkers", 0.15, 0.05),
    "jump": ("whole differences of two walkers, from mode to mode, which are rarely accepted", 0.0, 0.0),
}


def moves_in_words(diagnostics: Diagnostics) -> tuple[str, ...]:
    """Say of each kind of move of a run what it is, how many of its steps were accepted, and what that means.

    Nothing for a posterior of an earlier version, which does not tell.
    """
    shares = diagnostics.acceptance_by_move
    said = [_in_words(kind, share) for kind, share in shares.items()]
    if shares and not {"proposal", "specimens"} & set(shares):
        said.append(
            "No density was found that fits the posterior, so that walkers moved by differences alone, which takes longer."
        )
    return tuple(said)


def _in_words(kind: str, share: float) -> str:
    what, good, bad = _KINDS.get(kind, ("steps", 0.0, 0.0))
    meaning = "as it should be" if share >= good else "few: sampling takes longer" if share >= bad else "too few to help"
    return f"{kind[:1].upper()}{kind[1:]} ({what}): {100 * share:.1f} % accepted" + (f", {meaning}." if good else ".")
