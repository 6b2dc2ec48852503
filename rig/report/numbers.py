"""Numbers as a report prints them."""

import math

UNKNOWN = "–"
"""A number in a table."""
NOT_KNOWN = "not known"
"""Anything else."""


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    return f"{_rounded(value, decimals):.{decimals}f}"


def signed(value: float | None, decimals: int) -> str:
    """Return a number with its sign; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    return f"{_rounded(value, decimals):+.{decimals}f}"


def digits(value: float | None, count: int = 2) -> str:
    """Return a number with so many significant digits or more, never as a power of ten."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    return f"{value:.{_decimals(value, count)}f}"


def with_sigma(value: float, sigma: float) -> str:
    """Return a number as far as its expanded uncertainty (k = 2, two digits) lets it mean."""
    expanded = 2.0 * sigma
    if not (math.isfinite(value) and math.isfinite(expanded)):
        return UNKNOWN
    decimals = _decimals(expanded, 2)
    return f"{value:.{decimals}f} ± {expanded:.{decimals}f}"


def _rounded(value: float, decimals: int) -> float:
    """Round, and let no zero be negative."""
    return round(value, decimals) + 0.0


def _decimals(value: float, count: int) -> int:
    """Decimals that show `count` significant digits of a number."""
    if value == 0.0:
        return count
    # Rounded first: 0.0999 with one digit is 0.1.
    exponent = int(f"{abs(value):.{count - 1}e}".partition("e")[2])
    return max(0, count - 1 - exponent)
