"""Where views really are, against where they were told to be; and pictures brought to their lines.

A picture is moved by less than a pixel with a windowed sinc of eight taps (R. W. Schafer and L. R.
Rabiner, "A digital signal processing approach to interpolation", Proc. IEEE 61, 1973), which keeps
the fine texture.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands

_TAPS = 8


@dataclass(frozen=True, slots=True)
class Placement:
    """Errors of the places of views, as the match itself shows them; the reference has none."""

    beside_px: Float
    """(V, 2) by how much each picture lies right of and below its lines; 0 where not sure."""
    steps: Float
    """(V, 2) what to add to the positions, view steps right and down; 0 where not sure."""
    distance_px: Float
    """(V,) how far each picture seems to lie from where its position puts it, rms of the pixels."""
    sigma_px: Float
    """(V,) 1 sigma of that, by noise and by what neighbouring pixels share."""
    misplaced: NDArray[np.bool_]
    """(V,) views that are surely not where they were told to be, and that agree better with the
    others at their new places, in the half of the picture that was not asked for them."""
    slope_variance: Float
    """(3,) what is unknown about the places once `beside_px` and `steps` are applied, as a variance
    of the slopes: 1, slope and slope^2 times these, px^2."""

    def slope_sigma_px(self, slope_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """Say how uncertain places make slopes (H, W) that are told at them, 1 sigma, px.

        Whatever is unknown about the places is common to many pixels, so that the scatter of
        neighbours does not show it.
        """
        constant, linear, square = (np.float32(c) for c in self.slope_variance)
        variance = constant + slope_px * (linear + slope_px * square)
        return np.sqrt(np.maximum(variance, np.float32(0)))

    def warnings(self, x_steps: Float, y_steps: Float) -> tuple[str, ...]:
        """Say of every misplaced view how far it is from its position (V,) and where it may be."""
        return tuple(
            f"view {i} at ({x_steps[i]:g}, {y_steps[i]:g}) lies {self.distance_px[i]:.2f} px "
            f"(1 sigma {self.sigma_px[i]:.2f}) from where it is told; corrected here, position "
            f"({x_steps[i] + self.steps[i, 0]:.4f}, {y_steps[i] + self.steps[i, 1]:.4f}) and "
            f"({self.beside_px[i, 0]:+.2f}, {self.beside_px[i, 1]:+.2f}) px beside its lines fit "
            "better: calibrate the rig"
            for i in np.flatnonzero(self.misplaced)
        )


def on_their_lines(images: NDArray[np.float32], beside_px: Float) -> NDArray[np.float32]:
    """Bring pictures (V, H, W) that lie (V, 2) px beside their lines onto them; the border repeats.

    Args:
        images: grey values.
        beside_px: right and down.
    """
    moved = images.copy()

    def work(start: int, stop: int) -> None:
        for i in range(start, stop):
            if beside_px[i].any():
                across, down = (_taps(float(shift_px)) for shift_px in beside_px[i])
                cv2.sepFilter2D(
                    images[i], -1, across, down, dst=moved[i], borderType=cv2.BORDER_REPLICATE
                )

    run_in_bands(work, len(images))
    return moved


def _taps(shift_px: float) -> NDArray[np.float32]:
    """Weights of the pixels around for the place `shift_px` beside one, an odd number of them."""
    reach = _TAPS // 2 + int(np.ceil(abs(shift_px)))
    away = np.arange(-reach, reach + 1) - shift_px
    window = np.where(np.abs(away) < _TAPS / 2, np.cos(np.pi * away / _TAPS) ** 2, 0.0)
    taps = np.sinc(away) * window
    return (taps / taps.sum()).astype(np.float32)
