"""Pictures of a made-up scene: textured cards, near and far, before a textured wall."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from rig_sim.optics import TrueCamera
from rig_sim.render_analytic import seen
from rig_sim.scenes.place import rectangle
from rig_sim.surface import Surface

from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry

Vector = tuple[float, float, float]
_FINE = 2
"""Rays per pixel, each way."""
_BLUR_PX = 0.7
_TEXEL_MM = 4.0


def cards(seed: int, near_mm: float = 600.0, far_mm: float = 3000.0) -> tuple[Surface, ...]:
    """Return a wall, and cards at distances between, each tilted its own way."""
    random = np.random.default_rng(seed)
    found = [_card(random, (0.0, 0.0, far_mm), 2.4 * far_mm, 0.05)]
    for distance_mm in np.geomspace(near_mm, 0.8 * far_mm, 14):
        x, y = random.uniform(-0.55, 0.55) * distance_mm, random.uniform(-0.38, 0.38) * distance_mm
        found.append(_card(random, (x, y, distance_mm), 0.28 * distance_mm, 0.4))
    return tuple(found)


def photographs(
    cameras: Sequence[TrueCamera], surfaces: tuple[Surface, ...], seed: int
) -> list[NDArray[np.uint8]]:
    """Return one noisy picture of every camera."""
    random = np.random.default_rng(seed)
    return [_photograph(camera, surfaces, random) for camera in cameras]


def true_camera(
    view: str,
    position_mm: Vector,
    rotation_deg: Vector = (0.0, 0.0, 0.0),
    *,
    size_px: tuple[int, int] = (320, 240),
    focal_px: float = 260.0,
) -> TrueCamera:
    """Return a camera without distortion whose axis goes through its picture's middle."""
    width_px, height_px = size_px
    centre_px = (width_px - 1) / 2.0, (height_px - 1) / 2.0
    none = (0.0, 0.0, 0.0, 0.0, 0.0)
    return TrueCamera(
        view, width_px, height_px, focal_px, centre_px, position_mm, rotation_deg, none
    )


def geometry_of(cameras: Sequence[TrueCamera], *, turned: bool = True) -> RigGeometry:
    """Return cameras as a geometry about the first; without `turned` all look straight ahead."""
    poses = [
        Pose(camera.rotation.T, -camera.rotation.T @ np.asarray(camera.position_mm))
        for camera in (cameras if turned else [replace(c, rotation_deg=(0, 0, 0)) for c in cameras])
    ]
    models = tuple(
        CameraModel(
            c.width_px, c.height_px, c.focal_px, c.focal_px, *c.centre_px,
            "brown5" if c.distorts else "none", c.distortion if c.distorts else (),
        )
        for c in cameras
    )  # fmt: skip
    places = tuple(pose @ poses[0].inverse() for pose in poses)
    return RigGeometry(tuple(c.view for c in cameras), 0, models, (Pose.identity(), *places[1:]))


def _card(random: np.random.Generator, centre_mm: Vector, side_mm: float, tilt: float) -> Surface:
    right = np.array([1.0, 0.0, random.uniform(-tilt, tilt)]) * side_mm / 2.0
    down = np.array([0.0, 1.0, random.uniform(-tilt, tilt)]) * side_mm / 2.0
    # Texels as seen from the middle: about two to a pixel, whatever the distance.
    count = int(np.clip(side_mm / (_TEXEL_MM * centre_mm[2] / 1000.0), 64, 1400))
    rough = random.standard_normal((count, count)).astype(np.float32)
    grain = cv2.GaussianBlur(rough, (0, 0), 1.2)
    patches = cv2.GaussianBlur(rough, (0, 0), 9.0)
    texture = 0.5 + 0.16 * grain / grain.std() + 0.12 * patches / patches.std()
    return Surface(rectangle(centre_mm, right, down), np.clip(texture, 0.02, 0.98))


def _photograph(
    camera: TrueCamera, surfaces: tuple[Surface, ...], random: np.random.Generator
) -> NDArray[np.uint8]:
    inside = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    x = (np.arange(camera.width_px)[:, None] + inside).ravel()
    y = (np.arange(camera.height_px)[:, None] + inside).ravel()
    directions = camera.directions(*np.meshgrid(x, y)) @ camera.rotation.T
    light = seen(surfaces, np.asarray(camera.position_mm), directions)
    light = light.reshape(camera.height_px, _FINE, camera.width_px, _FINE).mean(axis=(1, 3))
    levels = 255.0 * cv2.GaussianBlur(light, (0, 0), _BLUR_PX)
    levels += random.standard_normal(levels.shape)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)
