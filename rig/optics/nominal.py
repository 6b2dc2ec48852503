"""The cameras as the profile has them: pictures are taken as they are."""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar import RectifiedViews, SlopeMap
from rig.epipolar.board.lines import BoardViews
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.views import Image
from rig.errors import SlopeError
from rig.frames import Pictures
from rig.geometry.pinhole import Pinhole
from rig.optics.optics import Pixels
from rig.profile import Profile


@dataclass(frozen=True, eq=False, slots=True)
class NominalOptics:
    """Optics of a rig without a calibration: pictures are rectified, at the places they are told.

    Distances are positions of the stage, and every pixel looks along the axis.
    """

    x_steps: Float
    """(V,) places of the views."""
    y_steps: Float
    """(V,)."""
    reference: int
    """Index of the view at (0, 0)."""
    noise: NoiseModel | None = None
    """Of the pictures; None where it was not measured."""
    size_px: tuple[int, int] | None = None
    """Width and height of a picture; None where the profile does not tell it."""
    calibration_id: int | None = None
    """Number of the calibration of the lenslets that the views come from; None for views that a
    camera gives itself."""

    def board_views(self, images: Pictures) -> BoardViews:
        """Return the pictures as they are."""
        return self.views(images)

    def views(self, images: Pictures) -> RectifiedViews:
        """Return the pictures as they are, with the places of their views.

        Raises:
            SlopeError: they differ in size: only a calibration knows what brings them together.
        """
        sizes = {f"{image.shape[1]} x {image.shape[0]}" for image in images}
        if len(sizes) > 1:
            raise SlopeError(
                f"slopes asked for of views of {', '.join(sorted(sizes))} px without a calibration",
                advice="rig calibrate: it brings views of any size into one frame",
            )
        stacked = cast("Image", np.asarray(images))
        return RectifiedViews(
            images=stacked,
            x_steps=self.x_steps,
            y_steps=self.y_steps,
            reference=self.reference,
            noise=self.noise if stacked.ndim == 3 else None,  # measured in grey values
        )

    def pictures(self, images: Pictures) -> Pictures:
        """Return the pictures themselves."""
        return images

    def reference_picture(self, image: Pixels) -> Pixels:
        """Return the picture itself."""
        return image

    def answered(self, slopes: SlopeMap) -> SlopeMap:
        """Return the slopes themselves: every pixel shows something."""
        return slopes

    def axis_slopes_px(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the slopes themselves."""
        return slope_px

    @property
    def axis_law(self) -> None:
        """None: nobody knows the focal length."""
        return

    def everywhere_px(self, axis_px: tuple[float, float]) -> tuple[float, float]:
        """Return the slopes themselves: every pixel looks along the axis."""
        return axis_px

    def axis_plane(
        self, plane: tuple[float, float, float], centre_px: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Return the plane itself."""
        del centre_px
        return plane

    def distance_mm(self, position_mm: float) -> float:
        """Return the position: it is the distance."""
        return position_mm

    @property
    def axis_px(self) -> tuple[float, float] | None:
        """The middle of the picture, None where its size is unknown."""
        if self.size_px is None:
            return None
        width_px, height_px = self.size_px
        return (width_px - 1) / 2.0, (height_px - 1) / 2.0

    @property
    def axis_variance_rad2(self) -> Float:
        """(2,) zeros: nobody knows."""
        return np.zeros(2)

    def reference_directions(self, right_down: Float) -> Float:
        """Return the vectors themselves: the common frame is the reference camera's."""
        return right_down

    def ray(self, pixel: tuple[float, float], focal_px: float | None) -> Float | None:
        """(2,) x / z and y / z of a pixel; None where axis or focal length are unknown."""
        if focal_px is None or self.axis_px is None:
            return None
        return (np.array(pixel) - self.axis_px) / focal_px

    def pinhole(self, size_px: tuple[int, int], focal_px: float | None) -> Pinhole | None:
        """The camera that depth maps are seen by: it looks along the axis through their middle."""
        if focal_px is None:
            return None
        width_px, height_px = size_px
        middle_px = ((width_px - 1) / 2.0, (height_px - 1) / 2.0)
        return Pinhole(width_px, height_px, focal_px, middle_px, np.eye(3))


def nominal_optics(profile: Profile, calibration_id: int | None = None) -> NominalOptics:
    """Return the optics of a rig as its profile has it; its views are those of the pictures.

    Args:
        profile: the rig.
        calibration_id: number of the calibration of its lenslets, where it has some.
    """
    return NominalOptics(
        x_steps=np.array([view.x_steps for view in profile.views]),
        y_steps=np.array([view.y_steps for view in profile.views]),
        reference=profile.reference,
        noise=noise_of(profile),
        size_px=profile.camera.size_of(profile.views[profile.reference].name),
        calibration_id=calibration_id,
    )


def noise_of(profile: Profile) -> NoiseModel | None:
    """Return the noise of the pictures that a profile has, None where it was not measured."""
    noise = profile.camera.noise
    if noise is None:
        return None
    return NoiseModel(noise.read_noise_levels, noise.electrons_per_level)
