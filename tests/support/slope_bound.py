"""The least error that any estimator of a board's slope can have."""

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.board.slope import BoardSlope


def slope_bound_px(
    clean: NDArray[np.float32], fit: BoardSlope, x_steps: Float, y_steps: Float, noise: float
) -> float:
    """Cramer-Rao bound of the slope at the centre: plane model, texture unknown.

    Noise of the sensor and of rounding to whole grey levels; gradients of the clean reference
    view, exact by Fourier transform; every pixel inside the fit's outline counts.
    """
    spectrum = np.fft.rfft2(clean)
    along_y = 2j * np.pi * np.fft.fftfreq(clean.shape[0])[:, None]
    along_x = 2j * np.pi * np.fft.rfftfreq(clean.shape[1])
    inside = np.zeros(clean.shape, np.uint8)
    cv2.fillConvexPoly(inside, np.round(fit.outline_px).astype(np.int32), 1)
    y, x = np.nonzero(inside)
    gradient = np.stack(
        [np.fft.irfft2(spectrum * along, s=clean.shape)[y, x] for along in (along_x, along_y)]
    )
    steps = np.stack([x_steps, y_steps])
    steps = steps - steps.mean(axis=1, keepdims=True)
    energy = ((steps.T @ gradient) ** 2).sum(axis=0)
    design = np.stack([np.ones(x.size), x - fit.centre_px[0], y - fit.centre_px[1]])
    information = (design * energy) @ design.T / (noise**2 + 1 / 12)
    return float(np.sqrt(np.linalg.inv(information)[0, 0]))
