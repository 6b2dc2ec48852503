"""The true lenslet array of a simulated light-field camera."""

from typing import Literal

from pydantic import Field

from rig.profile.model import Model, NotNegative, Positive


class LensletWorldConfig(Model):
    """How the lenslets of the simulated camera truly lie; its views are those of `world.optics`."""

    lattice: Literal["hexagonal", "square"] = "hexagonal"
    """How the lenslets are arranged."""
    spacing_px: Positive = 10.0
    """Between neighbouring micro-images in the raw picture."""
    step_px: Positive = 1.5
    """Between views that stand one view step apart, inside a micro-image."""
    rotation_deg: float = 0.0
    """Of the array against the sensor."""
    offset_px: tuple[float, float] = (0.0, 0.0)
    """Of the middle micro-image from the middle of the raw picture."""
    g_over_b: NotNegative = 0.01
    """Distance from the lenslets to the sensor over that from the main lens to the lenslets."""
    distortion: float = 0.0
    """Micro-images at the half diagonal lie farther out by this part."""
    aperture_px: Positive = 4.7
    """Radius of a micro-image."""
    barrel_px: Positive = 7.0
    """Radius of the stop that cuts the micro-images of the corners: the cat's eye."""
    barrel_shift: float = 0.001
    """How fast that stop moves towards the corners, px per px."""
    falloff: NotNegative = 0.3
    """Light lost at the half diagonal, beside the cat's eye."""
    is_bayer: bool = False
    """Whether the sensor has colour filters."""
    missing_share: float = Field(default=0.0, ge=0.0, lt=0.5)
    """Lenslets without light."""
