"""From the pictures of a rig to what the estimators measure, by its calibration or without one."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar import Label, RectifiedViews, SlopeMap
from rig.epipolar.board.lines import BoardViews
from rig.epipolar.noise.model import NoiseModel, estimate_noise
from rig.epipolar.resample import Resampler
from rig.epipolar.views import Image
from rig.errors import ConfigError
from rig.frames import GreyImage
from rig.geometry.rectification import Rectification, rectify
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.rig_geometry_json import geometry_from_json
from rig.optics.calibrated_views import CalibratedViews
from rig.profile import Profile
from rig.records import StoredCalibration

_MISPLACED = 0.25
"""A calibrated view farther than this part of its baseline from where the profile has it is another
view, or another rig."""


class Rectifier:
    """What stands between the pictures of one rig and its slopes.

    Without a calibration the pictures are taken as they are: rectified, at the places that the
    profile tells. With one, boards are measured in the raw pictures, dense slopes in rectified
    ones, and slopes are told as if seen on the optical axis of the reference camera, which is what
    a depth-slope curve is a function of.

    Args:
        profile: the rig; its views are in the order of the pictures.
        geometry: what its calibration found; None for none.
        calibration_id: number of the calibration.

    Raises:
        ConfigError: the calibration is of other views.
    """

    def __init__(
        self,
        profile: Profile,
        geometry: RigGeometry | None = None,
        calibration_id: int | None = None,
    ) -> None:
        self.profile = profile
        self.calibration_id = calibration_id
        self.rectification: Rectification | None = None
        if geometry is not None:
            self.rectification = rectify(geometry, profile.pitch_mm)
            _require_same_views(profile, geometry, self.rectification)

    def board_views(self, images: GreyImage) -> BoardViews:
        """Return pictures (V, H, W) for measuring a board: never resampled.

        Raises:
            SlopeError: the images do not fit the views or the calibration.
        """
        if self.rectification is None:
            return self.views(images)
        return CalibratedViews(images, self.rectification)

    def views(self, images: Sequence[GreyImage] | GreyImage) -> RectifiedViews:
        """Return rectified views for the dense estimator; with a calibration they are float32.

        Raises:
            SlopeError: the images do not fit the views or the calibration.
        """
        if self.rectification is None:
            places = self.profile.views
            return RectifiedViews(
                images=cast("Image", np.asarray(images)),
                x_steps=np.array([view.x_steps for view in places]),
                y_steps=np.array([view.y_steps for view in places]),
                reference=self.profile.reference,
                noise=self.noise,
            )
        return RectifiedViews(
            images=self._resampler(list(images)),
            x_steps=self.rectification.x_steps,
            y_steps=self.rectification.y_steps,
            reference=self.profile.reference,
            noise=self.noise or _noise_of(images[self.profile.reference]),
        )

    @property
    def noise(self) -> NoiseModel | None:
        """Noise of the pictures as the profile tells it; None where it was not measured."""
        told = self.profile.camera.noise
        if told is None:
            return None
        return NoiseModel(told.read_noise_levels, told.electrons_per_level)

    def pictures(self, images: GreyImage) -> GreyImage:
        """Return pictures (V, H, W) for people, rectified and of the type that they came in."""
        if self.rectification is None:
            return images
        top = np.iinfo(images.dtype).max
        rounded = np.clip(np.rint(self.views(images).images), 0, top)
        return cast("GreyImage", rounded.astype(images.dtype))

    def answered(self, slopes: SlopeMap) -> SlopeMap:
        """Take the answer from every pixel of the reference view that shows nothing."""
        if self.rectification is None:
            return slopes
        shown = self._resampler.valid[self.profile.reference]
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
        if self.rectification is None:
            return slope_px
        m0 = np.float32(self.rectification.infinity_px)
        return (slope_px + m0) * self._per_depth_ratio - m0

    def axis_plane(
        self, plane: tuple[float, float, float], centre_px: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Slope and its change per px right and down at a pixel, as seen on the axis."""
        if self.rectification is None:
            return plane
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
        stage = None if self.rectification is None else self.rectification.geometry.stage
        if stage is None:
            return position_mm
        return stage.zero_mm + stage.scale * float(stage.axis[2]) * position_mm

    @property
    def axis_px(self) -> tuple[float, float] | None:
        """Pixel of the reference view on its optical axis.

        Without a calibration the middle of the picture, None where the profile has no size of it.
        """
        if self.rectification is None:
            camera = self.profile.camera
            width_px, height_px = (
                getattr(camera, "width_px", None),
                getattr(camera, "height_px", None),
            )
            if width_px is None or height_px is None:
                return None
            return (width_px - 1) / 2.0, (height_px - 1) / 2.0
        x, y, z = self.rectification.common_from_reference[:, 2].tolist()
        camera = self.rectification.camera
        return camera.cx_px + camera.fx_px * x / z, camera.cy_px + camera.fy_px * y / z

    @property
    def axis_variance_rad2(self) -> Float:
        """(2,) how sure the calibration is of the optical axis, right and down; 0 without one."""
        if self.rectification is None or self.rectification.geometry.covariance is None:
            return np.zeros(2)
        geometry = self.rectification.geometry
        first = sum(4 + len(c.coefficients) for c in geometry.cameras[: geometry.reference])
        camera = geometry.cameras[geometry.reference]
        variance = np.diag(self.rectification.geometry.covariance)[first + 2 : first + 4]
        return variance / np.array([camera.fx_px, camera.fy_px]) ** 2

    def reference_directions(self, right_down: Float) -> Float:
        """Small vectors (2,) right and down of the common frame in the reference camera's."""
        if self.rectification is None:
            return right_down
        return self.rectification.common_from_reference[:2, :2].T @ right_down

    def ray(self, pixel: tuple[float, float], focal_px: float | None) -> Float | None:
        """(2,) x / z and y / z of a pixel of the reference view, in the reference camera's frame.

        None without a calibration where the focal length or the middle of the picture is unknown.
        """
        if self.rectification is None:
            if focal_px is None or self.axis_px is None:
                return None
            return (np.array(pixel) - self.axis_px) / focal_px
        away = (np.array(pixel) - self.rectification.centre_px) / self.rectification.camera.fx_px
        ray = self.rectification.common_from_reference.T @ np.array([*away, 1.0])
        return ray[:2] / ray[2]

    @cached_property
    def _resampler(self) -> Resampler:
        if self.rectification is None:
            raise ConfigError("pictures without a calibration are not resampled")
        cameras = self.rectification.geometry.cameras
        return Resampler(
            [self.rectification.raw_map_px(view) for view in range(len(cameras))],
            [(camera.height_px, camera.width_px) for camera in cameras],
        )

    @cached_property
    def _per_depth_ratio(self) -> NDArray[np.float32]:
        if self.rectification is None:
            raise ConfigError("without a calibration there is no ratio of depths")
        rows, columns = np.indices(self.rectification.shape, dtype=np.float64)
        return (1.0 / self.rectification.depth_ratio(np.stack([columns, rows]))).astype(np.float32)


def _noise_of(image: GreyImage) -> NoiseModel:
    return estimate_noise([np.asarray(image, np.float32)], step_levels=1.0)


def rectifier_of(profile: Profile, calibration: StoredCalibration | None) -> Rectifier:
    """Return the rectifier of a stored calibration, or of none.

    Raises:
        ConfigError: the calibration is of another rig, of other views, of another stage, or of a
            version that this program does not read.
    """
    if calibration is None:
        return Rectifier(profile)
    if calibration.rig != profile.name:
        raise ConfigError(
            f"calibration {calibration.id} is of rig {calibration.rig}, asked to use it for "
            f"{profile.name}; choose another with --calibration, or none"
        )
    geometry = geometry_from_json(calibration.geometry)
    if geometry.stage is not None:
        _require_same_stage(profile, calibration)
    return Rectifier(profile, geometry, calibration.id)


def _require_same_views(
    profile: Profile, geometry: RigGeometry, rectification: Rectification
) -> None:
    wanted = tuple(view.name for view in profile.views)
    if geometry.names != wanted or geometry.reference != profile.reference:
        raise ConfigError(
            f"calibration is of the views {', '.join(geometry.names)} about "
            f"{geometry.names[geometry.reference]}, rig {profile.name} has {', '.join(wanted)} "
            f"about {wanted[profile.reference]}; calibrate this rig"
        )
    places = zip(profile.views, rectification.x_steps, rectification.y_steps, strict=True)
    for view, x, y in places:
        away = float(np.hypot(x - view.x_steps, y - view.y_steps))
        if away > _MISPLACED * float(np.hypot(view.x_steps, view.y_steps)) + 1e-9:
            raise ConfigError(
                f"calibration found view {view.name} at ({x:.3f}, {y:.3f}) view steps, the profile "
                f"has it at ({view.x_steps:g}, {view.y_steps:g}); are two cables swapped, or is "
                f"pitch_mm = {profile.pitch_mm:g} wrong?"
            )


def _require_same_stage(profile: Profile, calibration: StoredCalibration) -> None:
    """Refuse stage positions that are counted otherwise than when the calibration was made."""
    stage, then = profile.stage, calibration.profile.get("stage")
    if stage is None or not isinstance(then, dict):
        return
    for key in ("distance_at_machine_zero_mm", "direction"):
        now = getattr(stage, key, None)
        if then.get(key) != now:
            raise ConfigError(
                f"calibration {calibration.id} was made with stage.{key} = {then.get(key)}, now it "
                f"is {now}: its stage positions mean other places; calibrate again"
            )
