"""Numbers in, texts with as many digits as they deserve out."""

from __future__ import annotations

import math
import re

from models.sensor import FloatArray

#: What stands where a number could not be computed.
NOT_KNOWN = "not known"


def with_uncertainty(mean: float, sd: float) -> str:
    """Write a value with its standard deviation: two significant digits of that, and the value to the same place.

    Parameters
    ----------
    mean : in whatever unit it is shown in.
    sd : its standard deviation, in the same; 0 for none.

    Returns
    -------
    str
        Without the unit; "not known" if either is not finite.

    Examples
    --------
    >>> with_uncertainty(0.61234, 0.01432), with_uncertainty(1234.5, 321.0), with_uncertainty(2.0, 0.0)
    ('0.612 ± 0.014', '1230 ± 320', '2')
    """
    if not (math.isfinite(mean) and math.isfinite(sd)):
        return NOT_KNOWN
    if sd <= 0:
        return f"{mean:.6g}"
    places = 1 - math.floor(math.log10(sd))
    if places < 0 or round(sd, places) >= 10.0 ** (2 - places):
        places = 1 - math.floor(math.log10(round(sd, places)))
    if places > 7 or places < -7:
        return f"{mean:.6g} ± {sd:.2g}"
    return f"{round(mean, places) + 0.0:.{max(places, 0)}f} ± {round(sd, places):.{max(places, 0)}f}"


def places_of(width: float) -> int:
    """Decimal places of the ends of an interval: two significant digits of its width.

    Parameters
    ----------
    width : of the interval, in whatever unit its ends are shown in, positive.

    Returns
    -------
    int
        From 0 to 9.

    Examples
    --------
    >>> places_of(0.046), places_of(2.5), places_of(130.0)
    (3, 1, 0)
    """
    return min(max(1 - math.floor(math.log10(width)), 0), 9)


def interval_text(lo: float, hi: float) -> str:
    """Write an interval with as many digits as its width deserves.

    Parameters
    ----------
    lo, hi : its ends, in whatever unit they are shown in.

    Returns
    -------
    str
        Without the unit; "not known" if either is not finite.

    Examples
    --------
    >>> interval_text(0.58912, 0.63551), interval_text(-2.0, 11.0)
    ('0.589 to 0.636', '-2 to 11')
    """
    if not (math.isfinite(lo) and math.isfinite(hi)):
        return NOT_KNOWN
    places = places_of(hi - lo) if hi > lo else 6
    return f"{lo:.{places}f} to {hi:.{places}f}"


def two_digits(value: float) -> str:
    """Write a standard deviation, or a share that is known no better: two significant digits.

    Parameters
    ----------
    value : in whatever unit it is shown in, not negative.

    Returns
    -------
    str
        Without the unit; "not known" if it is not finite.

    Examples
    --------
    >>> two_digits(1.0689), two_digits(0.7731), two_digits(0.1), two_digits(23.4), two_digits(0.0)
    ('1.1', '0.77', '0.10', '23', '0')
    """
    if not math.isfinite(value):
        return NOT_KNOWN
    return f"{value:.{places_of(float(f'{value:.1e}'))}f}" if value > 0 else "0"


def range_text(lo: float, hi: float) -> str:
    """Write between what something holds, which is no interval of anything uncertain: to the same place, a hundredth of it.

    Parameters
    ----------
    lo, hi : its ends, in whatever unit they are shown in.

    Returns
    -------
    str
        Without the unit.

    Examples
    --------
    >>> range_text(97.5163, 103.762), range_text(0.0197, 5.4268)
    ('97.52 to 103.76', '0.02 to 5.43')
    """
    places = places_of(hi - lo) + 1 if hi > lo else 3
    return f"{lo:.{places}f} to {hi:.{places}f}"


def span_text(*ends: float) -> str:
    """Write ends that are not uncertain, such as those of what was asked for: all with as many decimals as one of them needs.

    Parameters
    ----------
    ends : in whatever unit they are shown in; decimals beyond the second are none that people ask for.

    Returns
    -------
    str
        Without the unit.

    Examples
    --------
    >>> span_text(4.0, 4.7), span_text(0.0, 9.0), span_text(2.504)
    ('4.0 to 4.7', '0 to 9', '2.5')
    """
    places = max(len(f"{end:.2f}".rstrip("0").partition(".")[2]) for end in ends)
    return " to ".join(f"{end:.{places}f}" for end in ends)


def median_and_interval(bands: FloatArray, unit: str) -> str:
    """Write the median of a quantity and, in brackets, its central 90 %, with as many digits as its width deserves.

    Parameters
    ----------
    bands : (5,), quantiles 5, 25, 50, 75 and 95 % in `unit`.
    unit : as it is shown.

    Returns
    -------
    str
        "not known" if one of the three is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> median_and_interval(np.array([3.52, 3.7, 3.81, 3.9, 4.13]), "mN")
    '3.81 mN (3.52 to 4.13)'
    """
    lo, middle, hi = (float(v) for v in bands[[0, 2, 4]])
    if not all(math.isfinite(v) for v in (lo, middle, hi)):
        return NOT_KNOWN
    places = min(max(2 - math.floor(math.log10(max(hi - lo, 1e-3 * abs(middle), 1e-9))), 0), 6) - 1
    return f"{middle:.{max(places, 0)}f} {unit} ({lo:.{max(places, 0)}f} to {hi:.{max(places, 0)}f})"


def number_or_unknown(value: float, form: str) -> str:
    """Write a number in a format such as ".3f".

    Parameters
    ----------
    value : the number.
    form : format specification of Python.

    Returns
    -------
    str
        "not known" if it is not finite.
    """
    return format(value, form) if math.isfinite(value) else NOT_KNOWN


def shortened(text: str) -> str:
    """Cut the long numbers in a text to four significant digits.

    >>> shortened("normal, mean 0.7400001 mm, sd 0.02 mm")
    'normal, mean 0.74 mm, sd 0.02 mm'
    """
    return re.sub(r"\d+\.\d{3,}", lambda found: f"{float(found[0]):.4g}", text)
