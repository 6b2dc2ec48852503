"""How sure a geometric calibration is that comes without a covariance, by where it comes from.

Stated, not measured: docs/reference/calibration.md tells the origin of every number. Errors of
different views are taken to have nothing in common.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from rig.arrays import Float
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.rig_geometry import RigGeometry
from rig.profile.models import PriorSigmaConfig

FACTORY = "factory"
_DEVICE = PriorSigmaConfig(focal_pct=0.3, baseline_pct=0.3, turn_deg=0.02)
_TOOL = PriorSigmaConfig(focal_pct=0.1, baseline_pct=0.1, turn_deg=0.01)
PRIOR_SIGMAS: Mapping[str, PriorSigmaConfig] = MappingProxyType(
    {
        FACTORY: _DEVICE,
        "depthai": _DEVICE,
        "ros": _TOOL,
        "kalibr": _TOOL,
        "opencv": _TOOL,
        "mrcal": _TOOL,
        "anipose": _TOOL,
        "caliscope": _TOOL,
        "zed": _DEVICE,
        "colmap": PriorSigmaConfig(focal_pct=0.3, baseline_pct=1.0, turn_deg=0.02),
    }
)
"""By format of the import; the scale of pictures alone is known only as well as what told it."""
UNKNOWN_SOURCE = PriorSigmaConfig(focal_pct=0.5, baseline_pct=1.0, turn_deg=0.05)
"""Of a calibration of which nobody says where it comes from."""


def prior_covariance(geometry: RigGeometry, sigma: PriorSigmaConfig) -> Float:
    """(P, P) covariance of a geometry that is known to some sigmas, in the order of its numbers.

    Both focal lengths of a view err together; orientations and places err alike about and along
    all axes.
    """
    turns = np.zeros((geometry.parameter_count, geometry.parameter_count))
    at = 0
    for camera in geometry.cameras:
        focal_px = np.array([camera.fx_px, camera.fy_px]) * (sigma.focal_pct / 100.0)
        turns[at : at + 2, at : at + 2] = np.outer(focal_px, focal_px)
        at += 4 + len(camera.coefficients)
    for view, place in enumerate(geometry.cam_from_reference):
        if view == geometry.reference:
            continue
        baseline_mm = float(np.linalg.norm(place.translation_mm))
        of_turn = np.full(3, np.radians(sigma.turn_deg))
        of_place = np.full(3, sigma.baseline_pct / 100.0 * baseline_mm)
        turns[range(at, at + 6), range(at, at + 6)] = np.concatenate([of_turn, of_place]) ** 2
        at += 6
    to_numbers = rodrigues_by_shared(geometry)
    return to_numbers @ turns @ to_numbers.T
