"""Procedural textures: numpy arrays (rows, columns), the same for the same seed."""

import numpy as np
from numpy.typing import NDArray

Texture = NDArray[np.float32]


def fractal(shape: tuple[int, int], seed: int, *, fall: float = 1.0) -> Texture:
    """Return noise whose amplitude falls with frequency^-fall, mean 0 and deviation 1.

    The amplitude spectrum of natural pictures falls about as 1/f: D. J. Field, "Relations between
    the statistics of natural images and the response properties of cortical cells",
    J. Opt. Soc. Am. A 4 (1987).
    """
    rows, columns = shape
    vertical, horizontal = np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns)[None, :]
    frequency = np.hypot(vertical, horizontal)
    frequency[0, 0] = np.inf
    white = np.random.default_rng(seed).standard_normal(shape)
    noise = np.fft.irfft2(np.fft.rfft2(white) * frequency**-fall, s=shape)
    return ((noise - noise.mean()) / noise.std()).astype(np.float32)
