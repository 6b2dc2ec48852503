"""Distances that matter to a check: the plan, its part within the travel, and its middle."""

import statistics

from rig.errors import ConfigError
from rig.profile import Profile


def plan_mm(profile: Profile) -> tuple[float, float]:
    """Return the nearest and farthest distance of the profile's sweep.

    Raises:
        ConfigError: the profile has no `[sweep]`.
    """
    config = profile.sweep
    if config is None:
        raise ConfigError(f"profile {profile.name}: has no [sweep]", advice="add it to the file")
    return min(config.from_mm, config.to_mm), max(config.from_mm, config.to_mm)


def ends_mm(profile: Profile) -> tuple[float, float]:
    """Return the ends of what plan and travel have in common; of the travel, where nothing is.

    Raises:
        ConfigError: the profile has no `[sweep]`.
    """
    near_mm, far_mm = plan_mm(profile)
    if profile.stage is None:
        return near_mm, far_mm
    low_mm, high_mm = profile.stage.travel_mm
    common_mm = max(near_mm, low_mm), min(far_mm, high_mm)
    return common_mm if common_mm[0] < common_mm[1] else (low_mm, high_mm)


def middle_mm(profile: Profile) -> float:
    """Return the middle between those ends.

    Raises:
        ConfigError: the profile has no `[sweep]`.
    """
    return statistics.fmean(ends_mm(profile))
