"""What lenses, sensors and compression do to a picture of a board."""

import cv2
import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.float32]


def compressed(picture: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """The picture after JPEG."""
    _, file = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE), np.uint8)


def vignetted(clean: Grey, loss: float, centre_px: NDArray[np.float64]) -> Grey:
    """Light that falls with the square of the distance from a centre, `loss` at half a diagonal.

    Args:
        clean: (H, W).
        loss: share of the light lost there.
        centre_px: (x, y) from the picture's middle.
    """
    height, width = clean.shape
    x = np.arange(width) - (width - 1) / 2 - centre_px[0]
    y = np.arange(height)[:, None] - (height - 1) / 2 - centre_px[1]
    far = (x**2 + y**2) / ((width**2 + height**2) / 4)
    return (clean * (1 - loss * far)).astype(np.float32)


def tilted_light(clean: Grey, change: NDArray[np.float64]) -> Grey:
    """Gain that changes by `change` (along x, along y) from border to border, 1 in the middle."""
    height, width = clean.shape
    x, y = np.arange(width) / width - 0.5, np.arange(height)[:, None] / height - 0.5
    return (clean * (1 + change[0] * x + change[1] * y)).astype(np.float32)


def banded(clean: Grey, levels: float, rng: np.random.Generator) -> Grey:
    """Every row with an offset of its own, of rms `levels`."""
    return (clean + levels * rng.standard_normal((clean.shape[0], 1))).astype(np.float32)


def skewed(clean: Grey, share: float, apart_px: float) -> Grey:
    """Coma along x: a share of the light falls up to `apart_px` to the right, none to the left.

    The picture is moved back by the mean displacement, so that its centroids stay in place.
    """
    spectrum = np.fft.rfft(clean, axis=1)
    frequency = 2 * np.pi * np.fft.rfftfreq(clean.shape[1])
    tail = np.mean([np.exp(-1j * frequency * apart_px * t) for t in (0.25, 0.5, 0.75, 1.0)], axis=0)
    whole = (1 - share) + share * tail
    back = np.exp(1j * frequency * share * apart_px * 0.625)
    return np.fft.irfft(spectrum * whole * back, n=clean.shape[1], axis=1).astype(np.float32)
