"""Lengths of a file whose unit nobody tells: checked against the profile, and set right on demand.

A slip from m to mm puts every depth out by a thousand, and a model made of pictures alone has no
unit at all.
"""

import numpy as np

from rig.errors import FormatError
from rig.export.length_choice import BY_PROFILE, MM_PER
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.profile import Profile

_MOST_TIMES = 3.0
"""Profiles round, and say where cameras should stand; cm against in is 2.5, all others are 10."""


def in_unit(
    geometry: RigGeometry, profile: Profile, read_as_mm: float | None, unit: str
) -> RigGeometry:
    """Return a geometry with its lengths in another unit than its file's format has.

    Args:
        geometry: with the views of the profile, in their order.
        profile: of the rig.
        read_as_mm: mm of one unit of the file, as it was read; None where the file itself tells.
        unit: one of `rig.export.length_choice.CHOICES`.

    Raises:
        FormatError: the file tells its unit itself, or all views stand at one place.
    """
    if read_as_mm is None:
        raise FormatError(
            f"--lengths {unit} asked for, the file tells its unit itself", advice="leave it out"
        )
    if unit != BY_PROFILE:
        return _times(geometry, MM_PER[unit] / read_as_mm)
    times = _times_of_profile(geometry, profile)
    if times is None or not times > 0.0:
        raise FormatError(
            f"--lengths {unit}: the views of the file, or of {profile.name}, stand at one place",
            advice="give the unit of the file",
        )
    return _times(geometry, 1.0 / times)


def require_plausible(geometry: RigGeometry, profile: Profile) -> None:
    """Refuse views that stand many times as far apart as the profile says, or as near.

    Raises:
        FormatError: naming both, and the choice to make.
    """
    times = _times_of_profile(geometry, profile)
    if times is None or 1.0 / _MOST_TIMES < times < _MOST_TIMES:
        return
    there_mm, here_mm = _spread_mm(geometry), _profile_spread_mm(profile)
    raise FormatError(
        f"the views of the file stand {there_mm:.4g} mm apart, those of {profile.name} "
        f"{here_mm:.4g} mm: the lengths of the file are in another unit",
        advice=f"say which it is with --lengths {'|'.join(MM_PER)}, or --lengths {BY_PROFILE} "
        "where the file has none; or correct pitch_mm and views of the profile",
    )


def _times_of_profile(geometry: RigGeometry, profile: Profile) -> float | None:
    here_mm = _profile_spread_mm(profile)
    return None if here_mm == 0.0 else _spread_mm(geometry) / here_mm


def _spread_mm(geometry: RigGeometry) -> float:
    return float(np.linalg.norm(geometry.centres_mm(), axis=1).max())


def _profile_spread_mm(profile: Profile) -> float:
    places = [(view.x_steps, view.y_steps) for view in profile.views]
    x, y = places[profile.reference]
    return max(float(np.hypot(a - x, b - y)) for a, b in places) * profile.pitch_mm


def _times(geometry: RigGeometry, times: float) -> RigGeometry:
    return RigGeometry(
        geometry.names,
        geometry.reference,
        geometry.cameras,
        tuple(
            Pose(pose.rotation, times * pose.translation_mm) for pose in geometry.cam_from_reference
        ),
    )
