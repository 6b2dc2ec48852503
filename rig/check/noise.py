"""Judgement of noise: how much, whether it is that of light, and what the profile says of it."""

import math
import statistics
from collections.abc import Sequence

from rig.check.items import Item, Status, graded, worst
from rig.check.photon_transfer import PhotonTransfer
from rig.check.stills import ViewStills
from rig.profile import NoiseConfig

NOISY, DROWNED = 0.03, 0.1
"""Noise of the board's white over its contrast."""
UNLINEAR = 0.6
"""Straightness of the photon transfer line below which noise does not come from light alone."""
OTHER_NOISE = 1.25
"""Noise of the board's white over what the profile tells, either way."""


def judge_noise(views: Sequence[ViewStills], by_profile: NoiseConfig | None) -> Item:
    """Judge the noise on the board, whether it is that of light, and what the profile tells of it.

    Args:
        views: repeated pictures of each.
        by_profile: `camera.noise` of the profile.
    """
    statuses: list[Status] = []
    found: list[str] = []
    advice: list[str] = []
    for view in views:
        noise, exposure = view.noise, view.exposure
        if noise is None:
            found.append(f"{view.view}: no even areas of different brightness to tell it from")
            statuses.append("warn")
            continue
        sigma = noise.sigma_levels(exposure.white)
        contrast = max(exposure.white - exposure.black, 1e-9)
        statuses.append(graded(sigma / contrast, warn_above=NOISY, fail_above=DROWNED))
        text = f"{view.view} {sigma:.1f} levels on white"
        if _is_light(noise):
            text += (
                f" ({noise.electrons_per_level:.1f} e/level, "
                f"read {noise.read_noise_levels:.2f} levels)"
            )
        else:
            statuses.append("warn")
            text += " (not in proportion to light)"
            advice.append(
                f"{view.view}: noise does not grow with light as photons do: switch compression "
                "(MJPG), denoising and automatic gain off"
            )
        if sigma / contrast > NOISY:
            advice.append(f"{view.view}: add light, or lower the gain and expose longer")
        found.append(text)
    if all(view.noise is None for view in views):
        advice.append("put the board in view, in focus and in light")
    measured = _of_all(views)
    if measured is not None:
        line = (
            f"camera.noise = {{ read_noise_levels = {measured.read_noise_levels:.2f}, "
            f"electrons_per_level = {measured.electrons_per_level:.3g} }}"
        )
        white = statistics.median(view.exposure.white for view in views)
        if by_profile is None:
            found.append(f"for the profile: {line}")
        elif _differs(by_profile, measured, white):
            statuses.append("warn")
            advice.append(f"the profile tells another noise; where gain is as it should be: {line}")
    numbers = {
        "electrons_per_level": {v.view: v.noise.electrons_per_level for v in views if v.noise},
        "read_noise_levels": {v.view: v.noise.read_noise_levels for v in views if v.noise},
    }
    return Item("noise", worst(statuses), ", ".join(found), "; ".join(advice), numbers)


def _is_light(noise: PhotonTransfer) -> bool:
    """Whether the noise grows with light as photons do."""
    return 0.0 < noise.electrons_per_level < math.inf and noise.straightness >= UNLINEAR


def _of_all(views: Sequence[ViewStills]) -> PhotonTransfer | None:
    """Return the noise that stands for all views; None unless each has that of light."""
    noises = [view.noise for view in views if view.noise is not None and _is_light(view.noise)]
    if len(noises) < len(views):
        return None
    return PhotonTransfer(
        statistics.median(noise.electrons_per_level for noise in noises),
        statistics.median(noise.read_noise_levels for noise in noises),
        min(noise.straightness for noise in noises),
    )


def _differs(by_profile: NoiseConfig, noise: PhotonTransfer, white: float) -> bool:
    """Whether a profile tells another noise of a white pixel than was measured."""
    stated = PhotonTransfer(by_profile.electrons_per_level, by_profile.read_noise_levels, 1.0)
    ratio = noise.sigma_levels(white) / stated.sigma_levels(white)
    return not 1.0 / OTHER_NOISE <= ratio <= OTHER_NOISE
