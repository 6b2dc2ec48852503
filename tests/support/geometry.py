"""The truth of a simulated rig as a calibration: what a perfect `rig calibrate` would find."""

import numpy as np
from rig_sim.optics import TrueCamera
from rig_sim.world import Moment

from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry
from rig.profile import Profile, SerialStageConfig


def true_geometry(profile: Profile, moment: Moment) -> RigGeometry:
    """Return all true cameras of a moment, and the stage of the profile's world, in one frame."""
    poses = [_cam_from_world(camera) for camera in moment.cameras]
    reference = poses[profile.reference]
    return RigGeometry(
        names=tuple(view.name for view in profile.views),
        reference=profile.reference,
        cameras=tuple(_model(camera) for camera in moment.cameras),
        cam_from_reference=tuple(
            Pose.identity() if view == profile.reference else pose @ reference.inverse()
            for view, pose in enumerate(poses)
        ),
        stage=_stage(profile, reference),
    )


def _cam_from_world(camera: TrueCamera) -> Pose:
    rotation = camera.rotation.T
    return Pose(rotation, -rotation @ np.asarray(camera.position_mm))


def _model(camera: TrueCamera) -> CameraModel:
    return CameraModel(
        camera.width_px,
        camera.height_px,
        camera.focal_px,
        camera.focal_px,
        *camera.centre_px,
        "brown5" if camera.distorts else "none",
        camera.distortion if camera.distorts else (),
    )


def _stage(profile: Profile, reference: Pose) -> StageGeometry | None:
    world, stage = profile.world, profile.stage
    if world is None or not isinstance(stage, SerialStageConfig):
        return None
    right, down = np.tan(np.radians(world.carriage.axis_deg))
    axis = np.array([right, down, 1.0]) / np.linalg.norm([right, down, 1.0])
    at_machine_zero_mm = np.array([*world.board_offset_mm, world.carriage.board_at_machine_zero_mm])
    scale = world.carriage.scale
    # The driver's positions are distances: it adds its own idea of where machine zero is.
    start_mm = at_machine_zero_mm - scale * stage.distance_at_machine_zero_mm * axis
    return StageGeometry(
        axis=reference.rotation @ axis,
        scale=scale,
        zero_mm=float(reference.apply(start_mm)[2]),
        covariance=np.zeros((4, 4)),
    )
