"""A reference view that stands on its side or upside down: places count in its own picture."""

from collections.abc import Sequence

import numpy as np

from rig.arrays import Float
from rig.geometry.rig_geometry import RigGeometry

_ALIKE = 0.97
"""Cosine between places from which they are the same but for their unit."""
_QUARTER_DEG = 90.0
_WORDS = {1: "on its side", 2: "upside down", 3: "on its side"}


def turned_reference(geometry: RigGeometry, steps: Float) -> str | None:
    """Tell in words how the reference view stands against the other views and the profile.

    Args:
        geometry: what was found.
        steps: (V, 2) where the profile has the views, right and down, in any unit.

    Returns:
        What is so and what to do, if the places fit the profile after turning it by quarter turns
        and most other views are turned against the reference as well; None otherwise.
    """
    found = geometry.centres_mm()[:, :2]
    found = found - found[geometry.reference]
    wanted = np.asarray(steps, np.float64) - np.asarray(steps, np.float64)[geometry.reference]
    size = float(np.sqrt(np.sum(found**2) * np.sum(wanted**2)))
    if size == 0.0:
        return None
    for quarters in (1, 2, 3):
        turned = wanted
        for _ in range(quarters):
            turned = np.stack([turned[:, 1], -turned[:, 0]], axis=1)
        if float(np.sum(found * turned)) > _ALIKE * size and _others_are_turned(geometry, quarters):
            name = geometry.names[geometry.reference]
            return (
                f"the reference view {name} stands {_WORDS[quarters]}, and places count right and "
                f"down in its picture: turn the camera, or set x_steps and y_steps to "
                f"{_listed(geometry.names, turned)}"
            )
    return None


def _others_are_turned(geometry: RigGeometry, quarters: int) -> bool:
    rolls_deg = [
        float(np.degrees(np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])))
        for view, pose in enumerate(geometry.cam_from_reference)
        if view != geometry.reference
    ]
    near = [round(roll_deg / _QUARTER_DEG) % 4 == quarters for roll_deg in rolls_deg]
    return 2 * sum(near) > len(near)


def _listed(names: Sequence[str], steps: Float) -> str:
    places = zip(names, (steps + 0.0).tolist(), strict=True)
    return ", ".join(f"{name} ({x:g}, {y:g})" for name, (x, y) in places)
