"""What is known of the cameras before the scene is asked.

Pictures of a scene tell neither lengths nor, of parallel cameras, focal lengths; the rest they tell
the better the wider the lens. What they leave open stays as sure as it was.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.arrays import Float
from rig.epipolar.scene.numbers import lens_slice, pose_slice
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.lens import COEFFICIENTS
from rig.geometry.rig_geometry import RigGeometry

_SQUARE = 1e-4
"""Pixels are square to this, 1 sigma."""
_APART = 0.5
"""Focal lengths of the views differ by this part of what is not known of all of them."""
_BROWN_SIGMAS = (0.05, 0.05, 2e-3, 2e-3, 0.02)
"""k1, k2, p1, p2, k3 of lenses that are nearly free of distortion, or were rectified."""


@dataclass(frozen=True, slots=True)
class Sureness:
    """How sure a start is, 1 sigma."""

    focal_pct: float
    """Focal length of all views, per cent."""
    centre_px: float
    """Principal points."""
    turn_deg: float
    """Orientation of each view against the reference, about each axis."""
    length_pct: float
    """Baselines, per cent."""
    direction_deg: float
    """Their directions in the frame of the reference."""


def prior_of(geometry: RigGeometry, sure: Sureness) -> Float:
    """(P, P) covariance of a start; a start that has one of its own keeps it for its lenses.

    Numbers of no variance are kept as they are: lens coefficients, until `with_lens_terms`.
    """
    count = geometry.parameter_count
    cameras = geometry.cameras
    lenses = sum(4 + len(camera.coefficients) for camera in cameras)
    turns = np.zeros((count, count))
    if geometry.covariance is None:
        turns[:lenses, :lenses] = _of_lenses(geometry, sure)[:lenses, :lenses]
    else:
        turns[:lenses, :lenses] = geometry.covariance[:lenses, :lenses]
    for view, place in enumerate(geometry.cam_from_reference):
        if view == geometry.reference:
            continue
        own = pose_slice(geometry, view)
        length_mm = float(np.linalg.norm(place.translation_mm))
        along = place.translation_mm / length_mm
        across_mm2 = (np.radians(sure.direction_deg) * length_mm) ** 2
        along_mm2 = (sure.length_pct / 100.0 * length_mm) ** 2
        turns[own, own][:3, :3] = np.eye(3) * np.radians(sure.turn_deg) ** 2
        turns[own, own][3:, 3:] = across_mm2 * np.eye(3) + (along_mm2 - across_mm2) * np.outer(
            along, along
        )
    to_numbers = rodrigues_by_shared(geometry)
    return to_numbers @ turns @ to_numbers.T


def _of_lenses(geometry: RigGeometry, sure: Sureness) -> Float:
    """(P, P) of focal lengths, which err together and a little apart, and principal points."""
    count = geometry.parameter_count
    found, all_px = np.zeros((count, count)), np.zeros(count)
    common, apart = sure.focal_pct / 100.0, _APART * sure.focal_pct / 100.0
    for view, camera in enumerate(geometry.cameras):
        first = lens_slice(geometry, view).start
        focal_px = np.array([camera.fx_px, camera.fy_px])
        all_px[first : first + 2] = focal_px
        found[first : first + 2, first : first + 2] = (
            apart**2 * np.outer(focal_px, focal_px) + np.diag(_SQUARE * focal_px) ** 2
        )
        found[range(first + 2, first + 4), range(first + 2, first + 4)] = sure.centre_px**2
    return found + common**2 * np.outer(all_px, all_px)


def with_lens_terms(geometry: RigGeometry, prior: Float) -> tuple[RigGeometry, Float]:
    """Free the lens of every view; one without a lens model gets `brown5`.

    Returns:
        The geometry, and its prior.
    """
    cameras = tuple(
        replace(camera, lens="brown5", coefficients=(0.0,) * COEFFICIENTS["brown5"])
        if camera.lens == "none"
        else camera
        for camera in geometry.cameras
    )
    freed = replace(geometry, cameras=cameras, covariance=None)
    wider = np.zeros((freed.parameter_count,) * 2)
    kept = np.concatenate(
        [
            *(
                lens_slice(freed, view).start + np.arange(4 + len(camera.coefficients))
                for view, camera in enumerate(geometry.cameras)
            ),
            *(
                np.arange(freed.parameter_count)[pose_slice(freed, view)]
                for view in range(len(cameras))
            ),
        ]
    ).astype(np.intp)
    wider[np.ix_(kept, kept)] = prior
    for view in range(len(cameras)):
        own = lens_slice(freed, view)
        for place, sigma in zip(range(own.start + 4, own.stop), _BROWN_SIGMAS, strict=False):
            wider[place, place] += sigma**2
    return freed, wider
