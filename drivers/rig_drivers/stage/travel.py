"""Distances of the board and a controller's own coordinates, and whether they fit together."""

import math

from rig.errors import ConfigError, StageLimitError, StagePositionError
from rig.profile import SerialStageConfig

SLACK_MM = 1e-6
"""Sums of decimal fractions are not exact."""


def distance_mm(config: SerialStageConfig, machine_mm: float) -> float:
    """Return the distance of the board at a machine coordinate."""
    return config.distance_at_machine_zero_mm + config.direction * machine_mm


def machine_mm(config: SerialStageConfig, distance_mm: float) -> float:
    """Return the machine coordinate for a distance of the board."""
    return (distance_mm - config.distance_at_machine_zero_mm) * config.direction


def check_speed(config: SerialStageConfig, rate_mm_s: float, *, setting: str, device: str) -> None:
    """See that the controller moves as fast as the profile says.

    Args:
        config: the profile's stage.
        rate_mm_s: fastest motion that the controller makes.
        setting: the controller's name for it.
        device: name used in errors.

    Raises:
        ConfigError: it does not.
    """
    if config.speed_mm_s > rate_mm_s * (1.0 + 1e-6):
        raise ConfigError(
            f"{device}: speed_mm_s is {config.speed_mm_s:.1f}, the controller's "
            f"{setting} allows {rate_mm_s:.1f} mm/s",
            advice="lower the one or raise the other",
        )


def check_travel(
    config: SerialStageConfig, range_mm: tuple[float, float], *, setting: str, device: str
) -> None:
    """See that the controller lets the stage go everywhere that the profile says.

    Args:
        config: the profile's stage.
        range_mm: machine coordinates that the controller allows.
        setting: the controller's name for it.
        device: name used in errors.

    Raises:
        ConfigError: it does not.
    """
    near_mm, far_mm = config.travel_mm
    start_mm = near_mm - config.approach_mm
    ends_mm = sorted(distance_mm(config, end_mm) for end_mm in range_mm)
    if not (ends_mm[0] - SLACK_MM <= start_mm and far_mm <= ends_mm[1] + SLACK_MM):
        raise ConfigError(
            f"{device}: travel_mm {near_mm:.1f}..{far_mm:.1f} with approach_mm "
            f"{config.approach_mm:.1f} needs {start_mm:.1f}..{far_mm:.1f} mm, the controller's "
            f"{setting} allows {ends_mm[0]:.1f}..{ends_mm[1]:.1f} mm",
            advice="shorten the travel or correct distance_at_machine_zero_mm",
        )


def check_inside(travel_mm: tuple[float, float], wanted_mm: float, *, device: str) -> None:
    """Refuse a distance outside the travel, before anything moves.

    Raises:
        StageLimitError: it is outside.
    """
    if not travel_mm[0] <= wanted_mm <= travel_mm[1]:
        raise StageLimitError(device, wanted_mm=wanted_mm, travel_mm=travel_mm)


def check_reached(
    config: SerialStageConfig, wanted_mm: float, reached_mm: float, *, device: str
) -> None:
    """See that a move or homing has ended where it should.

    Raises:
        StagePositionError: it has not.
    """
    tolerance_mm = config.tolerance_mm
    if not math.isclose(wanted_mm, reached_mm, rel_tol=0.0, abs_tol=tolerance_mm):
        raise StagePositionError(
            device, wanted_mm=wanted_mm, reached_mm=reached_mm, tolerance_mm=tolerance_mm
        )
