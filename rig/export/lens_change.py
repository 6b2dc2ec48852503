"""From our lens models to those that another tool has: exactly, or by a fit that says its error."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.errors import FormatError
from rig.geometry.camera_model import CameraModel
from rig.geometry.lens import COEFFICIENTS, LensModel, distort

Narrow = Literal["brown4", "brown5", "brown8", "fisheye", "none"]
"""What a format can hold; `brown4` is k1, k2, p1, p2."""

_HELD: dict[Narrow, tuple[LensModel, tuple[int, ...]]] = {
    "none": ("none", ()),
    "brown4": ("brown5", (0, 1, 2, 3)),
    "brown5": ("brown5", (0, 1, 2, 3, 4)),
    "brown8": ("brown8", (0, 1, 2, 3, 4, 5, 6, 7)),
    "fisheye": ("fisheye", (0, 1, 2, 3)),
}
_GRID = (33, 25)
_STEPS = 20


@dataclass(frozen=True, slots=True)
class Refit:
    """A camera with another lens model, and how far it is from the original."""

    camera: CameraModel
    largest_px: float
    """Largest distance of a pixel from where the original camera puts it."""
    rms_px: float


def exact_lens(camera: CameraModel, held: Narrow, *, view: str, tool: str) -> tuple[float, ...]:
    """Coefficients of the lens in a narrower model that holds it without any loss.

    Raises:
        FormatError: the lens has terms that the model does not.
    """
    lens, taken = _HELD[held]
    given = np.array(camera.coefficients)
    if camera.lens == "none":
        return (0.0,) * len(taken)
    brown = ("brown5", "brown8")
    if lens == camera.lens or (lens in brown and camera.lens in brown):
        wanted = np.zeros(max(8, len(given)))
        wanted[: len(given)] = given
        rest = np.delete(wanted, taken)
        if not np.any(rest):
            return tuple(wanted[list(taken)].tolist())
    raise FormatError(
        f"view {view}: {tool} cannot hold its lens {camera.lens} "
        f"({', '.join(f'{k:g}' for k in given)})",
        advice="fit the nearest lens it knows with --refit, which tells the error in px",
    )


def refit(camera: CameraModel, held: Narrow) -> Refit:
    """Fit the narrower lens model, focal lengths and principal point to all of the picture.

    Gauss-Newton least squares over a grid of pixels, with the analytic derivatives of the lens.
    """
    lens, taken = _HELD[held]
    pixels = np.stack(
        np.meshgrid(
            np.linspace(0.0, camera.width_px - 1.0, _GRID[0]),
            np.linspace(0.0, camera.height_px - 1.0, _GRID[1]),
        ),
        axis=-1,
    ).reshape(-1, 2)
    rays = camera.unproject(pixels)
    seen = np.isfinite(rays).all(axis=1)
    pixels, rays = pixels[seen], rays[seen]
    coefficients = np.zeros(COEFFICIENTS[lens])
    if camera.lens == lens or (camera.lens, lens) in {("brown8", "brown5"), ("brown5", "brown8")}:
        shared = [k for k in taken if k < len(camera.coefficients)]
        coefficients[shared] = np.array(camera.coefficients)[shared]
    focal = np.array([camera.fx_px, camera.fy_px])
    centre = np.array([camera.cx_px, camera.cy_px])
    for _ in range(_STEPS):
        bent = distort(lens, coefficients, rays)
        miss = pixels - (bent.xy * focal + centre)
        jacobian = np.zeros((len(pixels), 2, 4 + len(taken)))
        jacobian[:, 0, 0], jacobian[:, 1, 1] = bent.xy[:, 0], bent.xy[:, 1]
        jacobian[:, 0, 2] = jacobian[:, 1, 3] = 1.0
        jacobian[:, :, 4:] = bent.by_coefficients[:, :, list(taken)] * focal[:, None]
        step, *_ = np.linalg.lstsq(jacobian.reshape(-1, 4 + len(taken)), miss.ravel(), rcond=None)
        focal, centre = focal + step[:2], centre + step[2:4]
        coefficients[list(taken)] += step[4:]
    (fx_px, fy_px), (cx_px, cy_px) = focal.tolist(), centre.tolist()
    fitted = CameraModel(
        camera.width_px, camera.height_px, fx_px, fy_px, cx_px, cy_px, lens,
        tuple(coefficients.tolist()),
    )  # fmt: skip
    points = np.column_stack([rays, np.ones(len(rays))])
    apart = np.linalg.norm(fitted.project(points) - pixels, axis=1)
    return Refit(fitted, float(apart.max()), float(np.sqrt(np.mean(apart**2))))
