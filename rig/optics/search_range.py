"""Which slopes a run searches: as the profile has them, or those of its distances."""

import numpy as np

from rig.arrays import Float
from rig.curve import Curve
from rig.curve.physical import Physical
from rig.epipolar.search.window import LABEL_SHIFT_PX
from rig.errors import ConfigError
from rig.optics.optics import Optics
from rig.profile import Profile

_ROOM, _ROOM_LABELS = 0.02, 1.5
"""Slopes at an end of the range get no answer, so the range is wider than the distances are: by
this part of it, and by so many slope labels."""
_K = 2.0


def search_range_px(
    profile: Profile, optics: Optics, curve: Curve | None = None
) -> tuple[float, float]:
    """Return the smallest and largest slope to look for in the whole picture.

    Distances become slopes by the curve, without one by the calibration. Beyond what the curve is
    valid for they follow its law of triangulation, where it has one: no depth comes of that, but
    what stands there is found to be there.

    Raises:
        ConfigError: distances are given, and neither curve nor calibration is known.
    """
    if profile.slopes.range_px is not None:
        return profile.slopes.range_px
    near_mm, far_mm = profile.slopes.range_mm or (np.nan, np.nan)
    ends_mm = np.array([far_mm, near_mm])
    room_px = np.zeros(2)
    if curve is not None:
        ends_px = _along(curve, ends_mm)
        sigma_px = curve.curve_sigma_px(np.clip(ends_mm, *curve.valid_mm))
        room_px = _K * np.asarray(sigma_px, np.float64)
    elif (law := optics.axis_law) is not None:
        ends_px = law.slope_px(ends_mm)
    else:
        raise ConfigError(
            f"slopes.range_mm = [{near_mm:g}, {far_mm:g}] asked for, and rig {profile.name} has no "
            "calibration and no curve that would tell which slopes these are",
            advice=f"run `rig calibrate {profile.name}` or `rig import {profile.name} FILE`, or "
            "give slopes.range_px instead",
        )
    low_px, high_px = optics.everywhere_px((float(ends_px[0]), float(ends_px[1])))
    label_px = LABEL_SHIFT_PX / float(np.hypot(optics.x_steps, optics.y_steps).max())
    room_px = room_px + _ROOM * (high_px - low_px) + _ROOM_LABELS * label_px
    return low_px - float(room_px[0]), high_px + float(room_px[1])


def _along(curve: Curve, distances_mm: Float) -> Float:
    """Slopes (N,) of the curve; beyond its ends those of its law of triangulation."""
    inside_mm = np.clip(distances_mm, *curve.valid_mm)
    slopes_px = curve.law.slope_px(inside_mm)
    known = curve.params
    if "a_px_mm" not in known:
        return slopes_px
    bare = Physical(known["z0_mm"], known["a_px_mm"], known["m_inf_px"])
    ahead = distances_mm > bare.z0_mm
    beyond_px = bare.slope_px(np.where(ahead, distances_mm, inside_mm)) - bare.slope_px(inside_mm)
    return slopes_px + beyond_px
