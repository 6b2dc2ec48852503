"""One grey value from three channels: the sum of them that shows texture best above its noise.

Luminance is made for eyes: red and green of equal brightness look alike in it, and its weights ask
for no noise. Here each channel is brought to a noise of 1, and the weights are the principal axis
of what neighbouring pixels differ by (S. Di Zenzo, "A note on the gradient of a multi-image", CVGIP
33, 1986, for all pixels together).
"""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.mending.first_match import FirstMatch
from rig.epipolar.mending.photometry import Light, equalise
from rig.epipolar.noise.model import NoiseModel
from rig.epipolar.scales import noise_of, stabilise
from rig.epipolar.search.window import Cameras
from rig.epipolar.views import Image

_CHANNELS = 3


def merge_channels(
    images: Image,
    cameras: Cameras,
    first: FirstMatch,
    grey_step: float,
    noise: NoiseModel | None,
    light: Sequence[Light] | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float64], tuple[Light, ...]]:
    """Bring all channels of every view to the scale of the reference, and join them.

    Args:
        images: (V, H, W, 3).
        cameras: where the views stand.
        first: which pixels show the same point.
        grey_step: what channels were rounded to multiples of.
        noise: noise of each channel; None to estimate it.
        light: light fields of each channel, as known; None to look for them.

    Returns:
        Grey values (V, H, W); how well each view agrees with the reference, as `equalise`; and the
        light fields of each channel.
    """
    channels: list[NDArray[np.float32]] = []
    agreements: list[NDArray[np.float64]] = []
    found: list[Light] = []
    for c in range(_CHANNELS):
        channel = cast("Image", np.ascontiguousarray(images[..., c]))
        equal = equalise(channel, cameras, first, None if light is None else light[c])
        model = noise_of(equal.images, grey_step, noise)
        stable, grading = stabilise(
            equal.images, cameras.reference, model, is_told=noise is not None
        )
        channels.append(stable / np.float32(grading.scales.noise))
        agreements.append(equal.agreement)
        found.append(equal.light)
    weights = _texture_axis([channel[cameras.reference] for channel in channels])
    merged = np.zeros_like(channels[0])
    for weight, channel in zip(weights, channels, strict=True):
        merged += np.float32(weight) * channel
    return merged, np.average(agreements, axis=0, weights=weights**2), tuple(found)


def luminance(images: Image) -> NDArray[np.float32]:
    """Mean of the channels (V, H, W), from which rows and a first match are told."""
    return cast("NDArray[np.float32]", images.mean(axis=-1, dtype=np.float32))


def _texture_axis(channels: list[NDArray[np.float32]]) -> NDArray[np.float64]:
    """Weights of channels (H, W) of unit noise, of length 1, for the steepest sum."""
    power = np.zeros((len(channels), len(channels)))
    for axis in (0, 1):
        steps = np.stack([np.diff(channel, axis=axis).ravel() for channel in channels])
        power += (steps @ steps.T).astype(np.float64)
    axis = np.linalg.eigh(power)[1][:, -1]
    return axis * np.sign(axis.sum() or 1.0)
