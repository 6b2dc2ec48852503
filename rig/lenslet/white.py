"""A white picture made ready: dark level off, colours brought to one grey, faults named."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import CalibrationError
from rig.frames import GreyImage

Picture = GreyImage | Float
"""One raw picture, or the mean of several."""

_MOST_SATURATED = 1e-3
"""Share of pixels at full scale; more, and the middles of micro-images are flat."""
_FEWEST_LEVELS = 16.0
"""A white picture whose bright parts have less light than this tells no vignetting."""
_BRIGHT_PCT = 90.0


@dataclass(frozen=True, slots=True)
class RawFormat:
    """What the pixels of a raw picture are."""

    full_scale: int
    """Grey value of a saturated pixel."""
    is_bayer: bool
    """Whether neighbouring pixels lie behind filters of other colours, in blocks of 2 x 2."""
    dark_levels: float
    """Grey value without light, where no dark picture is given."""


@dataclass(frozen=True, slots=True, eq=False)
class White:
    """Light of a white surface."""

    light: NDArray[np.float32]
    """(H, W) in grey levels above dark, colours brought to one grey."""
    colour_gains: Float
    """(2, 2) that bring the colours of a block to one grey; ones for a monochrome sensor."""


def white_light(raw: Picture, form: RawFormat, dark: Picture | None = None) -> White:
    """Return the light of a white picture.

    Args:
        raw: (H, W) the white picture.
        form: of both pictures.
        dark: (H, W) picture without light.

    Raises:
        CalibrationError: it is saturated or too dark, or the dark picture is another camera's.
    """
    saturated = float(np.mean(raw >= form.full_scale))
    if saturated > _MOST_SATURATED:
        raise CalibrationError(
            f"{100.0 * saturated:.1f} % of the white picture is saturated (grey value "
            f"{form.full_scale}), at most {100.0 * _MOST_SATURATED:g} % may be",
            advice="expose it shorter; or set camera.bits to what its pixels have",
        )
    light = without_dark(raw, form, dark)
    bright = float(np.percentile(light[::3, ::3], _BRIGHT_PCT))
    if bright < _FEWEST_LEVELS:
        raise CalibrationError(
            f"the bright parts of the white picture are {bright:.1f} grey levels above dark, "
            f"{_FEWEST_LEVELS:g} are needed",
            advice="expose it longer, or give more light",
        )
    gains = np.ones((2, 2))
    if form.is_bayer:
        means = np.array([[float(light[y::2, x::2].mean()) for x in (0, 1)] for y in (0, 1)])
        if means.min() <= 0.05 * means.max():
            raise CalibrationError(
                "one colour of the white picture has "
                f"{100.0 * means.min() / means.max():.1f} % of the light of the brightest",
                advice="light it white; or set camera.is_bayer = false for a monochrome sensor",
            )
        gains = means.mean() / means
        height, width = light.shape
        tiled = np.tile(gains, (height // 2 + 1, width // 2 + 1))[:height, :width]
        light = light * tiled.astype(np.float32)
    return White(light, gains)


def without_dark(raw: Picture, form: RawFormat, dark: Picture | None) -> NDArray[np.float32]:
    """Return light (H, W) above the dark picture or the dark level.

    Raises:
        CalibrationError: the dark picture has another size.
    """
    if dark is None:
        return raw.astype(np.float32) - np.float32(form.dark_levels)
    if dark.shape != raw.shape:
        raise CalibrationError(
            f"the dark picture has {dark.shape[1]} x {dark.shape[0]} px, the white one "
            f"{raw.shape[1]} x {raw.shape[0]}",
            advice="give a dark picture of this camera",
        )
    return raw.astype(np.float32) - dark.astype(np.float32)
