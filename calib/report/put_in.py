"""Results in, what an error of thicknesses or permittivity that were put in does to them out, in words."""

from __future__ import annotations

from calib.catalogue import QUANTITIES
from calib.checks import PUT_IN_ERROR, put_in_shifts
from calib.report.section import Results

# What is put in with one error in all of it: words for it and for the error, its quantities, and what to do about it.
_PUT_IN = (
    (
        "thicknesses",
        "all of them {error} too small make",
        ("sensor_thickness", "padding_thickness", "dielectric_thickness"),
        "Each prior errs for itself, so what one gauge does to all of them, such as a micrometer that presses into soft "
        "silicone, is in no interval. Hold the gauge against a cut under the microscope.",
    ),
    (
        "permittivity",
        "{error} too small makes",
        ("relative_permittivity",),
        "The data tell it only together with the thickness of the dielectrics. Where it is from a data sheet, or of another "
        "batch, let its sd say so.",
    ),
)
# What moves a headline by less than this, in its standard deviations, is not said.
_SAID = 0.1


def put_in_conditions(results: Results) -> list[str]:
    """What an error of all that was put in of one kind does to the numbers, in a line each; nothing where there are none."""
    return [f"{words} as put in: {effect}" for words, effect, _ in put_in_effects(results)]


def put_in_effects(results: Results) -> list[tuple[str, str, str]]:
    """Of each kind of what was put in: words for it, what its error does, what to do; of an average, where it does most."""
    found = []
    for words, said, quantities, why in _PUT_IN if not results.void else ():
        each = [put_in_shifts(p, quantities) for p in [m.posterior for m in results.members] or [results.posterior]]
        shifts = max(each, key=lambda of: max((abs(shift.in_sd) for shift in of.values()), default=0.0))
        effects = [
            f"{QUANTITIES[name].label} {abs(shift.share) * 100:.2g} % too {'small' if shift.share < 0 else 'large'} "
            f"({abs(shift.in_sd):.1f} of its standard deviations)"
            for name, shift in shifts.items()
            if abs(shift.in_sd) >= _SAID
        ]
        if effects:
            found.append((words, f"{said.format(error=f'{PUT_IN_ERROR * 100:g} %')} {' and '.join(effects)}", why))
    return found
