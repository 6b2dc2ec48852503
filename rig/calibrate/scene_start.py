"""What a calibration from scenes starts from: focal lengths somebody else knows, places nominal.

In this order: a calibration that is named, `[intrinsics]` of the profile, the newest calibration of
the rig that was not itself made from scenes, and what the device's maker has written into it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.epipolar.scene.prior import Sureness
from rig.errors import ConfigError
from rig.factory import FactoryCalibrated
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.optics.factory import factory_geometry
from rig.optics.prior import FACTORY, PRIOR_SIGMAS, UNKNOWN_SOURCE
from rig.profile import Profile
from rig.records import StoredCalibration
from rig.run import FROM_SCENE
from rig.stored import LENSLETS

_NOMINAL_DEG, _KNOWN_DEG = 2.0, 1.0
"""How far views are turned, and baselines point elsewhere, than a profile has them, and than an
earlier calibration found: pictures tell, and a module that was dropped is no rare thing."""
_STATED_CENTRE, _MIDDLE = 0.005, 0.02
"""How sure principal points are, over the width of the picture: stated, and its middle."""
_LENGTH_PCT = 0.5
"""Of the pitch in a profile."""


@dataclass(frozen=True, slots=True)
class SceneStart:
    """A geometry, how sure it is, and where it is from."""

    geometry: RigGeometry
    sure: Sureness
    source: str
    """In words."""


def scene_start(
    profile: Profile,
    sizes_px: Sequence[tuple[int, int]],
    chosen: StoredCalibration | None,
    stored: StoredCalibration | None,
    device: object,
) -> SceneStart:
    """Return what a calibration from scenes starts from.

    Args:
        profile: the rig.
        sizes_px: width and height of the pictures of each view.
        chosen: a calibration that the user names; None for none.
        stored: the newest good one of the rig; None for none.
        device: the opened camera.

    Raises:
        ConfigError: nobody knows a focal length, or it is of pictures of another size.
    """
    if chosen is not None:
        return _of_calibration(profile, sizes_px, chosen)
    if profile.intrinsics is not None:
        return _stated(profile, sizes_px)
    if stored is not None and LENSLETS not in stored.geometry and FROM_SCENE not in stored.quality:
        return _of_calibration(profile, sizes_px, stored)
    cameras = device.factory_calibration if isinstance(device, FactoryCalibrated) else None
    if cameras is not None:
        known = factory_geometry(profile, cameras)
        return _known(profile, sizes_px, known, FACTORY, "the factory's calibration")
    raise ConfigError(
        f"calibration of {profile.name} from a scene asked for, and nothing tells its focal length",
        advice="write [intrinsics] focal_px = ... into the profile, or `rig import "
        f"{profile.name} FILE`, or show a board to `rig calibrate {profile.name}`",
    )


def _of_calibration(
    profile: Profile, sizes_px: Sequence[tuple[int, int]], stored: StoredCalibration
) -> SceneStart:
    source = str(stored.quality.get("imported"))
    geometry = geometry_from_json(stored.geometry)
    return _known(profile, sizes_px, geometry, source, f"calibration {stored.id}")


def _known(
    profile: Profile,
    sizes_px: Sequence[tuple[int, int]],
    geometry: RigGeometry,
    source: str,
    words: str,
) -> SceneStart:
    found = tuple((camera.width_px, camera.height_px) for camera in geometry.cameras)
    names = tuple(view.name for view in profile.views)
    if geometry.names != names or geometry.reference != profile.reference:
        raise ConfigError(
            f"{words} is of the views {', '.join(geometry.names)}, rig {profile.name} has "
            f"{', '.join(names)}",
            advice="start from another one with --start",
        )
    if found != tuple(sizes_px):
        raise ConfigError(
            f"{words} is of pictures of {_in_words(found)} px, these are of {_in_words(sizes_px)}",
            advice="calibrate at the size that is captured, or state [intrinsics] in the profile",
        )
    sigma = profile.prior_sigma or PRIOR_SIGMAS.get(source, UNKNOWN_SOURCE)
    sure = Sureness(
        sigma.focal_pct,
        _STATED_CENTRE * sizes_px[profile.reference][0],
        _KNOWN_DEG,
        sigma.baseline_pct,
        _KNOWN_DEG,
    )
    return SceneStart(geometry, sure, words)


def _stated(profile: Profile, sizes_px: Sequence[tuple[int, int]]) -> SceneStart:
    stated = profile.intrinsics
    if stated is None:
        raise AssertionError("asked for intrinsics that are not stated")
    cameras: list[CameraModel] = []
    places: list[Pose] = []
    for view, (width_px, height_px) in zip(profile.views, sizes_px, strict=True):
        focal_px = stated.focal_of(view.name)
        middle_px = (width_px - 1) / 2.0, (height_px - 1) / 2.0
        cx_px, cy_px = stated.centre_px or middle_px
        cameras.append(CameraModel(width_px, height_px, focal_px, focal_px, cx_px, cy_px))
        steps = np.array([view.x_steps, view.y_steps, 0.0])
        places.append(Pose(np.eye(3), -profile.pitch_mm * steps))
    places[profile.reference] = Pose.identity()
    centre = _MIDDLE if stated.centre_px is None else _STATED_CENTRE
    prior = profile.prior_sigma
    sure = Sureness(
        stated.focal_sigma_pct,
        centre * sizes_px[profile.reference][0],
        _NOMINAL_DEG,
        _LENGTH_PCT if prior is None else prior.baseline_pct,
        _NOMINAL_DEG,
    )
    geometry = RigGeometry(
        tuple(view.name for view in profile.views), profile.reference, tuple(cameras), tuple(places)
    )
    focal_px = cameras[profile.reference].fx_px
    return SceneStart(geometry, sure, f"{focal_px:.1f} px as the profile states")


def _in_words(sizes_px: Sequence[tuple[int, int]]) -> str:
    return ", ".join(f"{width} x {height}" for width, height in sizes_px)
