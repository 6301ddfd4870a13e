"""Results in, what errors of the rig would do to them that no check can see out, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from calib.catalogue import QUANTITIES
from calib.checks import UNSEEN, Unseen, unseen_from_text
from calib.report.section import Results
from calib.sampling import Posterior

# A balance at the touch that moves a modulus by no more than this, in its standard deviations, is left to the check; so is an
# error of what is taken as exact.
_BALANCE, _EXACT = 1.0, 0.1
# What is taken as exact, and how an error of it is told.
_TAKEN = {
    "force_gain": "an exact load cell: one that reads {} too high",
    "displacement_gain": "an exact travel: one that reads {} too large",
    "indenter_radius": "an exact ball radius: a ball that is {} larger",
    "sensor_thickness": "exact sensor thicknesses: sensors that are {} thicker",
    "padding_thickness": "exact padding thicknesses: paddings that are {} thicker",
    "dielectric_thickness": "exact dielectric thicknesses: dielectrics that are {} thicker",
    "padding_young_modulus": "an exact modulus of the padding: one that is {} larger",
    "machine_compliance": "an exact machine compliance: a machine that gives {} more",
    "padding_poisson_ratio": "an exact Poisson's ratio of the padding: one that is {} larger",
    "friction_coefficient": "an exact friction of the ball: one that is {} larger",
    "base_friction_coefficient": "an exact friction of the base: one that is {} larger",
}


def not_seen(results: Results) -> str:
    """What a load cell that is balanced at the touch would do, with what would show it; "" where that is little.

    Parameters
    ----------
    results : of a calibration; of an average, where it does most. Nothing is said where there are no results.
    """
    most = _most(results).get("load_step")
    if most is None or abs(most.shift) <= _BALANCE:
        return ""
    return (
        f"a load cell balanced anew at the touch of every press, by the noise of one reading ({most.size * 1e3:.2g} mN), would "
        f"shift {QUANTITIES[most.name.parameter].label} by {abs(most.shift):.1f} of its standard deviations, and nothing shows "
        "it. Compare the load at rest before and after a press."
    )


def exact_conditions(results: Results) -> list[str]:
    """What an error of each thing that is taken as exact makes of a modulus, in a line each; nothing where that is little."""
    return _exact_in_words(_most(results))


def taken_as_exact(posterior: Posterior) -> list[str]:
    """The same of one posterior."""
    return _exact_in_words(_most_of([posterior]))


def _exact_in_words(most: Mapping[str, Unseen]) -> list[str]:
    said = []
    for cause, one in most.items():
        if cause != "load_step" and abs(one.shift) >= _EXACT:
            what, label = _TAKEN[cause].format(one.size_in_words), QUANTITIES[one.name.parameter].label
            moved = f"{abs(one.share) * 100:.2g} % too {'large' if one.share < 0 else 'small'}"
            said.append(f"{what} makes {label} {moved} ({abs(one.shift):.1f} of its standard deviations)")
    return said


def _most(results: Results) -> dict[str, Unseen]:
    """By cause what it does, in the model in which it does most; nothing where there are no results."""
    return {} if results.void else _most_of([m.posterior for m in results.members] or [results.posterior])


def _most_of(posteriors: Sequence[Posterior]) -> dict[str, Unseen]:
    found: dict[str, Unseen] = {}
    for posterior in posteriors:
        for one in unseen_from_text(posterior.attrs.get(UNSEEN, "[]")):
            if one.cause not in found or abs(one.shift) > abs(found[one.cause].shift):
                found[one.cause] = one
    return found
