"""Views that stand still and are alike, for changes to one or all of them."""

from dataclasses import replace

import numpy as np

from rig.check.stills import Exposure, ViewStills
from rig.profile.load import load_profile
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import Corners

PROFILE = load_profile("sim")
BOARD = Checkerboard(9, 6, 25.0)


def board(blur_px: float = 0.8) -> Corners:
    return Corners(BOARD, np.zeros((6, 9, 2)), np.full((6, 9), 0.02), blur_px, 150.0)


STILL = ViewStills(
    view="left",
    board=board(),
    motion_px=None,
    exposure=Exposure(255.0, 190.0, 20.0, 0.0, 0.0),
    noise=None,
    exposures_s=(0.008,),
    brightness_change=0.001,
)


def named(**changes: object) -> dict[str, ViewStills]:
    """Three views that are alike, for changes by view."""
    return {
        name: replace(STILL, view=name, **changes)  # pyright: ignore[reportArgumentType]
        for name in ("left", "centre", "right")
    }
