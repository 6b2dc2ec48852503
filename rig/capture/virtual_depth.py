"""Virtual depth of what a lenslet camera sees, where a rig has one."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.lenslet.array import ARRAY_JSON
from rig.lenslet.virtual_depth import virtual_depth
from rig.profile import LensletCameraConfig, Profile


def virtual_depth_of(
    profile: Profile,
) -> Callable[[NDArray[np.float32]], NDArray[np.float32]] | None:
    """Return what turns slopes (H, W) into virtual depth; None for a rig without lenslets.

    Args:
        profile: the rig, with its calibrated array as runs put it there.

    Raises:
        CalibrationError: the array cannot be read.
    """
    camera = profile.camera
    if not isinstance(camera, LensletCameraConfig) or camera.lenslets is None:
        return None
    lattice = ARRAY_JSON.from_json(camera.lenslets).lattice
    return partial(virtual_depth, lattice=lattice, step_px=camera.step_px)
