"""Cameras and frames of a rig as robots name them.

REP 103 and 105 of ROS: the base frame `rig_link` (x forward, y left, z up) stands in the optical
centre of the reference camera and looks as the rectified views do; each view has an optical frame
(x right, y down, z forward). Frames are those of the rectified cameras: projection matrices and
depth are told in them; `CameraInfo.rectification` leads from the raw camera into its frame.
"""

import re
from collections.abc import Iterable
from typing import Final

import numpy as np

from rig.arrays import Float
from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pinhole import Pinhole
from rig.geometry.rectification import Rectification
from rig.live.measure import pinhole_of
from rig.optics.calibrated import CalibratedOptics
from rig.recording import CameraInfo, FrameTransform, Scene
from rig.stored import Run

BASE: Final = "rig_link"
_OPTICAL: Final = (-0.5, 0.5, -0.5, 0.5)
"""Quaternion (x, y, z, w) that turns x right, y down, z forward into x forward, y left, z up."""
_MM: Final = 1000.0


def robot_name(view: str) -> str:
    """Return the name of a view as topics and frames of ROS may hold it."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", view)
    return name if name[0].isalpha() else f"view_{name}"


def optical_frame(view: str) -> str:
    """Return the name of the optical frame of a view."""
    return f"{robot_name(view)}_optical_frame"


def scene_of(run: Run, picture_shape: tuple[int, ...], pinhole: Pinhole | None) -> Scene:
    """Return cameras, frames and places of a rig.

    Args:
        run: the rig; without a calibration views stand where the profile has them.
        picture_shape: (H, W) of its pictures; depth maps may be smaller.
        pinhole: that its depth maps are seen by; None where nothing tells the focal length, and
            then there are no cameras.

    Raises:
        ConfigError: two views have the same name once characters that topics cannot hold are
            replaced.
    """
    views = [view.name for view in run.profile.views]
    frame_of = {view: optical_frame(view) for view in views}
    if len(set(frame_of.values())) < len(views):
        raise ConfigError(
            f"views {', '.join(views)} have the same name in topics of robots",
            advice="give them names of letters, digits and _ in the profile",
        )
    optics = run.optics
    if isinstance(optics, CalibratedOptics):
        places_mm = optics.rectification.places_mm
        infos = [_calibrated(optics.rectification, view) for view in range(len(views))]
    else:
        steps = np.column_stack([optics.x_steps, optics.y_steps, np.zeros(len(views))])
        places_mm = steps * run.profile.pitch_mm
        whole = None if pinhole is None else pinhole_of(run, picture_shape)
        infos = [] if whole is None else [_nominal(run, whole, place) for place in steps]
    return Scene(
        frame_of=frame_of,
        reference=views[run.profile.reference],
        transforms=tuple(
            optical_transform(frame_of[view], place)
            for view, place in zip(views, places_mm, strict=True)
        ),
        cameras=dict(zip(views, infos, strict=False)),
        depth_camera=None if pinhole is None else depth_camera_info(pinhole),
    )


def depth_camera_info(pinhole: Pinhole) -> CameraInfo:
    """Return the camera of depth maps; they have no lens and are rectified."""
    return _pinhole_info((pinhole.width_px, pinhole.height_px), pinhole.matrix, place_m=np.zeros(2))


def rectified_info(size_px: tuple[int, int], projection: Float) -> CameraInfo:
    """Return the camera of a rectified picture by its projection (3, 4), m: no lens, no turn."""
    return CameraInfo(*size_px, "none", (), projection[:, :3], np.eye(3), projection)


def optical_transform(child: str, place_mm: Iterable[float]) -> FrameTransform:
    """Return where an optical frame stands in the base frame.

    Args:
        child: name of the optical frame.
        place_mm: (3,) right, down and forward of the reference camera, in the common frame.
    """
    right_m, down_m, forward_m = (float(along) / _MM for along in place_mm)
    return FrameTransform(BASE, child, (forward_m, 0.0 - right_m, 0.0 - down_m), _OPTICAL)


def _calibrated(rectification: Rectification, view: int) -> CameraInfo:
    camera: CameraModel = rectification.geometry.cameras[view]
    return CameraInfo(
        width_px=camera.width_px,
        height_px=camera.height_px,
        lens=camera.lens,
        coefficients=camera.coefficients,
        matrix=camera.matrix,
        rectification=rectification.camera_from_common(view).T,
        projection=rectification.projection_m(view),
    )


def _nominal(run: Run, pinhole: Pinhole, steps: Float) -> CameraInfo:
    """A view without a calibration: infinity lies where the curve says."""
    params = {} if run.curve is None else run.curve.curve.params
    matrix = pinhole.matrix
    matrix[:2, 2] -= params.get("m_inf_px", 0.0) * steps[:2]
    place_m = steps[:2] * run.profile.pitch_mm / _MM
    return _pinhole_info((pinhole.width_px, pinhole.height_px), matrix, place_m)


def _pinhole_info(size_px: tuple[int, int], matrix: Float, place_m: Float) -> CameraInfo:
    projection = np.zeros((3, 4))
    projection[:, :3] = matrix
    projection[:2, 3] = 0.0 - matrix[0, 0] * place_m
    return rectified_info(size_px, projection)
