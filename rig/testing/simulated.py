"""A simulated rig that brings its curve: depth without a device, a database or a renderer."""

from collections.abc import Sequence
from pathlib import Path

from rig.live.camera import DepthCamera
from rig.live.curves import load_curve
from rig.live.opening import open_depth_camera

_HERE = Path(__file__).resolve().parent
PROFILE = _HERE / "simulated_rig.toml"
CURVE = _HERE / "simulated_rig_curve.json"
BOARD_MM = 550.0
"""True distance of the board, from the optical centre of the reference camera along its axis."""


def open_simulated_rig(overrides: Sequence[str] = ()) -> DepthCamera:
    """Return the camera of the fixture `rig_camera`; `with` opens it.

    Args:
        overrides: of its profile, `key.path=value` each; the curve fits as long as pitch, views,
            focal length and focus distance stay.

    Raises:
        ConfigError: the overrides make no profile.
    """
    return open_depth_camera(
        PROFILE, curve=load_curve(CURVE), calibration="none", overrides=overrides
    )
