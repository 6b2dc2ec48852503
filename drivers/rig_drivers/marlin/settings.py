"""A Marlin controller's own settings of one axis, from the lines of M503 and M211."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from rig.errors import ConfigError


@dataclass(frozen=True, slots=True)
class MarlinAxis:
    """What the controller is set to on the axis that carries the board."""

    rate_mm_s: float
    """Fastest motion (M203); a faster wish is silently slowed down to it."""
    acceleration_mm_s2: float
    """The smaller one of the axis' (M201) and of travel moves (M204 T)."""
    steps_per_mm: float
    """M92."""
    range_mm: tuple[float, float]
    """Soft end stops (M211); a target beyond is silently clamped to them."""


def read_axis(lines: Iterable[str], axis: str, *, device: str) -> MarlinAxis:
    """Return what the settings say about an axis.

    Args:
        lines: the answers to M503 and M211.
        axis: its letter.
        device: name used in errors.

    Raises:
        ConfigError: a setting is missing, or the soft end stops are off.
    """
    text = "\n".join(lines)
    if not re.search(r"M211 S1|Soft endstops: O[Nn]", text):
        raise ConfigError(
            f"{device}: the controller's soft end stops are off or absent (M211), so it would go "
            "anywhere",
            advice="send M211 S1 and M500",
        )
    wanted = {
        "rate": rf"M203\b.*?\b{axis}(\d+\.\d+)",
        "axis acceleration": rf"M201\b.*?\b{axis}(\d+\.\d+)",
        "travel acceleration": r"M204\b.*?\bT(\d+\.\d+)",
        "steps": rf"M92\b.*?\b{axis}(\d+\.\d+)",
        "low": rf"Min:.*?{axis}(-?\d+\.\d+)",
        "high": rf"Max:.*?{axis}(-?\d+\.\d+)",
    }
    found = {name: re.search(pattern, text) for name, pattern in wanted.items()}
    values = {name: float(match[1]) for name, match in found.items() if match is not None}
    missing = sorted(set(wanted) - set(values))
    if missing:
        raise ConfigError(
            f"{device}: the controller tells no {', '.join(missing)} of axis {axis} (M503, M211)",
            advice="this driver needs Marlin 2 with M503",
        )
    acceleration = min(values["axis acceleration"], values["travel acceleration"])
    if acceleration <= 0.0 or values["steps"] <= 0.0:
        raise ConfigError(
            f"{device}: the controller has {acceleration:.1f} mm/s2 and {values['steps']:.1f} "
            f"steps/mm on axis {axis}",
            advice="set M201, M204 T and M92 above 0",
        )
    return MarlinAxis(
        values["rate"], acceleration, values["steps"], (values["low"], values["high"])
    )


def travel_time_s(way_mm: float, speed_mm_s: float, acceleration_mm_s2: float) -> float:
    """Return how long a move from rest to rest takes at constant acceleration."""
    ramp_s = speed_mm_s / acceleration_mm_s2
    if way_mm >= speed_mm_s * ramp_s:
        return way_mm / speed_mm_s + ramp_s
    return 2.0 * (way_mm / acceleration_mm_s2) ** 0.5
