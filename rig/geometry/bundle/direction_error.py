"""How sure the directions are in which one camera alone sees: its covariance, in px.

A calibration of one camera says nothing of depth. What it says is from where light comes to a
pixel, and that only up to a turn of the camera, which its pictures do not tell from a turn of all
boards. So the error is that of projected directions after the turn that takes most of it away; as
the projection uncertainty of mrcal (D. Kogan, 2020), but in closed form.
"""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.geometry.bundle.part import Part, nodes_px, part_of_sightings
from rig.geometry.bundle.result import Calibration
from rig.geometry.bundle.rotations import cross_matrix
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import distort
from rig.geometry.rig_geometry import RigGeometry


@dataclass(frozen=True, slots=True)
class DirectionError:
    """Error of where one camera shows things that lie in known directions, k = 2, px.

    Per coordinate; for things far beyond the size of the lens.
    """

    seen_px: float
    """Root mean square over the part of the picture in which boards were seen."""
    picture_px: float
    """Over the whole picture."""
    worst_px: float
    """At the worst place of that, mostly a corner."""


def direction_error_of(calibration: Calibration) -> DirectionError:
    """Tell the headline of a calibration of one camera.

    Raises:
        CalibrationError: it has more views, or no covariance.
    """
    geometry = calibration.geometry
    camera = geometry.cameras[geometry.reference]
    used = [r.xy_px[~r.outlier] for r in calibration.residuals]
    seen = part_of_sightings(used, (camera.width_px, camera.height_px))
    return direction_error(geometry, seen)


def direction_error(geometry: RigGeometry, seen: Part) -> DirectionError:
    """Tell the headline of the geometry of one camera.

    Args:
        geometry: one view, with its covariance.
        seen: where boards were seen.

    Raises:
        CalibrationError: it has more views, or no covariance.
    """
    camera = geometry.cameras[geometry.reference]
    nodes = nodes_px((camera.width_px, camera.height_px))
    twice_px = 2.0 * direction_sigma_px(geometry, nodes.reshape(-1, 2), seen.ravel())
    known = twice_px[np.isfinite(twice_px)]
    inside = twice_px[seen.ravel() & np.isfinite(twice_px)]
    if not inside.size:
        return DirectionError(float("nan"), float("nan"), float("nan"))
    return DirectionError(_rms(inside), _rms(known), float(known.max()))


def direction_sigma_px(geometry: RigGeometry, pixels: Float, seen: np.ndarray) -> Float:
    """1 sigma (G,), px per coordinate, of where directions appear that pixels (G, 2) show now.

    Args:
        geometry: one view, with its covariance.
        pixels: places in the picture.
        seen: (G,) which of them the turn of the camera is to fit.

    Returns:
        (G,); NaN where the lens shows nothing.

    Raises:
        CalibrationError: it has more views, or no covariance.
    """
    if len(geometry.names) != 1 or geometry.covariance is None:
        raise CalibrationError(
            f"error of directions asked for of a geometry of {len(geometry.names)} views "
            f"{'without' if geometry.covariance is None else 'with'} covariance",
            advice="ask for it of one camera that was calibrated by itself",
        )
    by_numbers, by_turn = _derivatives(geometry.cameras[0], pixels)
    known = np.isfinite(by_numbers).all(axis=(1, 2)) & np.isfinite(by_turn).all(axis=(1, 2))
    fitted = known & seen
    normal = np.einsum("gai,gaj->ij", by_turn[fitted], by_turn[fitted])
    mixed = np.einsum("gai,gap->ip", by_turn[fitted], by_numbers[fitted])
    turn = np.linalg.lstsq(normal, mixed, rcond=None)[0]
    left = by_numbers - by_turn @ turn
    sigma_px = np.full(len(pixels), np.nan)
    variance = np.einsum("gap,pq,gaq->g", left[known], geometry.covariance, left[known]) / 2.0
    sigma_px[known] = np.sqrt(np.maximum(variance, 0.0))
    return sigma_px


def _derivatives(camera: CameraModel, pixels: Float) -> tuple[Float, Float]:
    """Pixels of fixed directions by the numbers of the camera (G, 2, P), by its turn (G, 2, 3)."""
    xy = camera.unproject(pixels)
    bent = distort(camera.lens, np.array(camera.coefficients), xy)
    focal = np.array([camera.fx_px, camera.fy_px])
    by_numbers = np.zeros((len(xy), 2, 4 + len(camera.coefficients)))
    by_numbers[:, 0, 0], by_numbers[:, 1, 1] = bent.xy.T
    by_numbers[:, 0, 2] = by_numbers[:, 1, 3] = 1.0
    by_numbers[:, :, 4:] = bent.by_coefficients * focal[:, None]
    rays = np.concatenate([xy, np.ones((len(xy), 1))], axis=1)
    # A turn w moves a ray by w x ray; what that does to (x / z, y / z) at z = 1.
    moved = -cross_matrix(rays)
    by_turn = focal[:, None] * (bent.by_xy @ (moved[:, :2] - xy[:, :, None] * moved[:, 2:]))
    return by_numbers, by_turn


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2)))
