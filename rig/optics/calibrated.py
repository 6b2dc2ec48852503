"""The cameras as a calibration found them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.curve.physical import Physical
from rig.epipolar import Label, RectifiedViews, SlopeMap
from rig.epipolar.board.lines import BoardViews
from rig.epipolar.noise.model import NoiseModel, estimate_noise
from rig.epipolar.resample import Resampler
from rig.errors import ConfigError
from rig.frames import GreyImage, Pictures
from rig.geometry.pinhole import Pinhole
from rig.geometry.rectification import Rectification, rectify
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.way_up import turned_reference
from rig.optics.calibrated_views import CalibratedViews
from rig.optics.nominal import noise_of
from rig.optics.optics import Pixels
from rig.optics.softening import noise_left, softening_px
from rig.profile import Profile

_MISPLACED = 0.25
"""A calibrated view farther than this part of its baseline from where the profile has it is another
view, or another rig."""


class CalibratedOptics:
    """Optics of a calibrated rig.

    Boards are measured in the raw pictures, dense slopes in rectified ones.

    Args:
        rectification: of the calibration's geometry.
        calibration_id: number of the calibration; None for one that is not stored.
        noise: of the pictures; None estimates it from each of them.
    """

    def __init__(
        self,
        rectification: Rectification,
        calibration_id: int | None,
        noise: NoiseModel | None = None,
    ) -> None:
        self.rectification = rectification
        self.calibration_id = calibration_id
        self.noise = noise
        self._reference = rectification.geometry.reference

    @property
    def x_steps(self) -> Float:
        """(V,) places of the views, as the calibration found them."""
        return self.rectification.x_steps

    @property
    def y_steps(self) -> Float:
        """(V,)."""
        return self.rectification.y_steps

    def board_views(self, images: Pictures) -> BoardViews:
        """Return raw pictures and the way into them.

        Raises:
            SlopeError: the images do not fit the calibration.
        """
        return CalibratedViews(images, self.rectification)

    def views(self, images: Pictures) -> RectifiedViews:
        """Return rectified views, float32.

        Raises:
            SlopeError: the images do not fit the calibration.
        """
        reference = images[self._reference]
        known = self.noise if reference.ndim == 2 else None  # it was measured in grey values
        return RectifiedViews(
            images=self._resampled(list(images)),
            x_steps=self.rectification.x_steps,
            y_steps=self.rectification.y_steps,
            reference=self._reference,
            noise=self._noise_left(known or _estimated_noise(reference)),
        )

    def pictures(self, images: Pictures) -> Pictures:
        """Return pictures (V, H, W) for people, rectified and of the reference view's type."""
        kind = images[self._reference].dtype
        rounded = np.clip(np.rint(self.views(images).images), 0, np.iinfo(kind).max)
        return cast("GreyImage", rounded.astype(kind))

    def reference_picture(self, image: Pixels) -> Pixels:
        """Return the reference view's picture in the common frame, as sharp as it is.

        Raises:
            SlopeError: it does not fit the calibration.
        """
        channels = [image] if image.ndim == 2 else list(np.moveaxis(image, -1, 0))
        top = np.iinfo(image.dtype).max
        moved = np.empty((*self.rectification.shape, len(channels)), image.dtype)
        for number, channel in enumerate(channels):
            exact = self._reference_resampler([channel])[0]
            moved[..., number] = np.clip(np.rint(exact, out=exact), 0, top, out=exact)
        return cast("Pixels", moved.reshape(*self.rectification.shape, *image.shape[2:]))

    def answered(self, slopes: SlopeMap) -> SlopeMap:
        """Take the answer from every pixel of the reference view that no camera shows."""
        shown = self._resampler.valid[self._reference]
        if shown.all():
            return slopes
        none = np.float32(np.nan)
        return replace(
            slopes,
            slope_px=np.where(shown, slopes.slope_px, none),
            sigma_px=np.where(shown, slopes.sigma_px, none),
            label=np.where(shown, slopes.label, np.uint8(Label.NONE)),
        )

    def axis_slopes_px(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Slopes (H, W) as points of the same depth have them on the reference camera's axis."""
        m0 = np.float32(self.rectification.infinity_px)
        return (slope_px + m0) * self._per_depth_ratio - m0

    @property
    def axis_law(self) -> Physical:
        """Slope against depth on the axis: triangulation by the calibration."""
        rectification = self.rectification
        return Physical(0.0, rectification.inverse_law_px_mm, -rectification.infinity_px)

    def everywhere_px(self, axis_px: tuple[float, float]) -> tuple[float, float]:
        """Lowest and highest slope in the whole picture, whose pixels may look across the axis."""
        height, width = self.rectification.shape
        corners_px = np.array(
            [[0.0, width - 1.0, 0.0, width - 1.0], [0.0, 0.0, *2 * [height - 1.0]]]
        )
        ratio, m0 = self.rectification.depth_ratio(corners_px), self.rectification.infinity_px
        slopes_px = np.outer(np.array(axis_px) + m0, ratio) - m0
        return float(slopes_px[0].min()), float(slopes_px[1].max())

    def axis_plane(
        self, plane: tuple[float, float, float], centre_px: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Slope and its change per px right and down at a pixel, as seen on the axis."""
        a, b, c = plane
        x, y = centre_px
        places = np.array([[x, x - 0.5, x + 0.5, x, x], [y, y, y, y - 0.5, y + 0.5]])
        slopes = a + b * (places[0] - x) + c * (places[1] - y)
        at, left, right, above, below = self.rectification.axis_slope_px(slopes, places).tolist()
        return at, right - left, below - above

    def distance_mm(self, position_mm: float) -> float:
        """Depth of the board's centre at a position of the stage.

        By the calibration where it knows the stage, along the reference camera's +z; else the
        position is the distance.
        """
        stage = self.rectification.geometry.stage
        if stage is None:
            return position_mm
        return stage.zero_mm + stage.scale * float(stage.axis[2]) * position_mm

    @property
    def axis_px(self) -> tuple[float, float]:
        """Pixel of the reference view on its optical axis."""
        x, y, z = self.rectification.common_from_reference[:, 2].tolist()
        camera = self.rectification.camera
        return camera.cx_px + camera.fx_px * x / z, camera.cy_px + camera.fy_px * y / z

    @property
    def axis_variance_rad2(self) -> Float:
        """(2,) how sure the calibration is of the optical axis; 0 without a covariance."""
        geometry = self.rectification.geometry
        if geometry.covariance is None:
            return np.zeros(2)
        first = sum(4 + len(c.coefficients) for c in geometry.cameras[: geometry.reference])
        camera = geometry.cameras[geometry.reference]
        variance = np.diag(geometry.covariance)[first + 2 : first + 4]
        return variance / np.array([camera.fx_px, camera.fy_px]) ** 2

    def reference_directions(self, right_down: Float) -> Float:
        """Small vectors (2,) right and down of the common frame in the reference camera's."""
        return self.rectification.common_from_reference[:2, :2].T @ right_down

    def ray(self, pixel: tuple[float, float], focal_px: float | None) -> Float:
        """(2,) x / z and y / z of a pixel, in the reference camera's frame.

        The calibration knows the focal length; `focal_px` is not used.
        """
        del focal_px
        away = (np.array(pixel) - self.rectification.centre_px) / self.rectification.camera.fx_px
        ray = self.rectification.common_from_reference.T @ np.array([*away, 1.0])
        return ray[:2] / ray[2]

    def pinhole(self, size_px: tuple[int, int], focal_px: float | None) -> Pinhole:
        """The camera that depth maps are seen by.

        The calibration knows size and focal length; what is given is not used.
        """
        del size_px, focal_px
        return self.rectification.pinhole

    def _resampled(self, images: Sequence[GreyImage]) -> NDArray[np.float32]:
        """Of all views, (V, H, W), in colour (V, H, W, 3): each channel by itself."""
        if images[self._reference].ndim == 2:
            return self._resampler(images)
        channels = [self._resampler([image[..., c] for image in images]) for c in range(3)]
        return np.stack(channels, axis=-1)

    @cached_property
    def _reference_resampler(self) -> Resampler:
        camera = self.rectification.geometry.cameras[self._reference]
        map_px = self.rectification.raw_map_px(self._reference)
        return Resampler([map_px], [(camera.height_px, camera.width_px)])

    @cached_property
    def _resampler(self) -> Resampler:
        cameras = self.rectification.geometry.cameras
        return Resampler(
            [self.rectification.raw_map_px(view) for view in range(len(cameras))],
            [(camera.height_px, camera.width_px) for camera in cameras],
            self._soft_px,
        )

    @cached_property
    def _soft_px(self) -> tuple[float, ...]:
        views = range(len(self.rectification.geometry.cameras))
        return softening_px([self.rectification.finer(view) for view in views])

    def _noise_left(self, noise: NoiseModel) -> NoiseModel:
        left = noise_left(self._soft_px)
        if left == 1.0:
            return noise
        return NoiseModel(
            noise.read_noise_levels * left**0.5,
            noise.electrons_per_level / left,
            noise.step_levels * left**0.5,
        )

    @cached_property
    def _per_depth_ratio(self) -> NDArray[np.float32]:
        rows, columns = np.indices(self.rectification.shape, dtype=np.float64)
        return (1.0 / self.rectification.depth_ratio(np.stack([columns, rows]))).astype(np.float32)


def calibrated_optics(
    profile: Profile, geometry: RigGeometry, calibration_id: int | None
) -> CalibratedOptics:
    """Return the optics of a rig by its calibration.

    Args:
        profile: the rig; its views are in the order of the pictures.
        geometry: what the calibration found.
        calibration_id: its number; None for one that is not stored.

    Raises:
        ConfigError: the calibration is of other views.
    """
    rectification = rectify(geometry, profile.pitch_mm)
    _require_same_views(profile, rectification)
    return CalibratedOptics(rectification, calibration_id, noise_of(profile))


def _estimated_noise(image: GreyImage) -> NoiseModel:
    """Of a picture as it was taken, grey (H, W) or in colour (H, W, 3): all channels together."""
    values = np.asarray(image, np.float32)
    channels = [values] if values.ndim == 2 else list(np.moveaxis(values, -1, 0))
    return estimate_noise(channels, step_levels=1.0)


def _require_same_views(profile: Profile, rectification: Rectification) -> None:
    geometry = rectification.geometry
    wanted = tuple(view.name for view in profile.views)
    if geometry.names != wanted or geometry.reference != profile.reference:
        raise ConfigError(
            f"calibration is of the views {', '.join(geometry.names)} about "
            f"{geometry.names[geometry.reference]}, rig {profile.name} has {', '.join(wanted)} "
            f"about {wanted[profile.reference]}",
            advice="calibrate this rig",
        )
    steps = np.array([[view.x_steps, view.y_steps] for view in profile.views])
    places = zip(profile.views, rectification.x_steps, rectification.y_steps, strict=True)
    for view, x, y in places:
        away = float(np.hypot(x - view.x_steps, y - view.y_steps))
        if away > _MISPLACED * float(np.hypot(view.x_steps, view.y_steps)) + 1e-9:
            raise ConfigError(
                f"calibration found view {view.name} at ({x:.3f}, {y:.3f}) view steps, the profile "
                f"has it at ({view.x_steps:g}, {view.y_steps:g})",
                advice=turned_reference(geometry, steps)
                or f"are two cables swapped, or is pitch_mm = {profile.pitch_mm:g} wrong?",
            )
