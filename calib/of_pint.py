"""From the name of any unit to its factor to the SI, by pint."""

from __future__ import annotations

import pint

_REGISTRY: pint.UnitRegistry[float] = pint.UnitRegistry()


def factor_of_pint(name: str, si_unit: str) -> float:
    """By what values in a unit are multiplied to have them in SI.

    Parameters
    ----------
    name : of the unit, as pint spells it; "" for a plain number.
    si_unit : "" for a plain number.

    Raises
    ------
    TypeError
        If the unit is of another dimension.
    ValueError
        If there is no such unit.
    """
    try:
        quantity = _REGISTRY.Quantity(1.0, name if name else "dimensionless")
        return float(quantity.to(si_unit if si_unit else "dimensionless").magnitude)
    except pint.DimensionalityError as error:
        raise TypeError(str(error)) from None
    except Exception as error:  # pint raises many kinds, even tokenizer errors, for text that is not a unit
        raise ValueError(str(error)) from None
