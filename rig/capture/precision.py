"""How sure the pixels of a capture are, frame by frame."""

from dataclasses import dataclass

import numpy as np

from rig.live.frame import DepthFrame

SURE_PX = 0.1
"""Slopes with a smaller 1 sigma, px per view step, are called sure where there is no depth."""

_ENOUGH = 20_000
"""Of so many pixels the median is known to a per cent; more only take time."""


@dataclass(slots=True)
class Precision:
    """The middle pixel of every frame, and its mean over the frames so far."""

    _frames: int = 0
    _medians: float = 0.0
    _sure_shares: float = 0.0

    def add(self, frame: DepthFrame) -> None:
        """Count one frame; one without an answer counts with no pixel that is sure only."""
        sigma = frame.slopes.sigma_px if frame.depth is None else frame.depth.sigma_mm
        known = sigma[np.isfinite(sigma)]
        if known.size:
            self._frames += 1
            self._medians += float(np.median(known[:: 1 + known.size // _ENOUGH]))
        with np.errstate(invalid="ignore"):
            self._sure_shares += float(np.mean(frame.slopes.sigma_px < SURE_PX))

    @property
    def median_k2(self) -> float | None:
        """Expanded uncertainty (k = 2) of the median answered pixel, mean over the frames.

        In mm; in px per view step in a capture of slopes. None before the first answer.
        """
        return 2.0 * self._medians / self._frames if self._frames else None

    def sure_pct(self, frames: int) -> float | None:
        """Mean share of the pixels with a sure slope, per cent; None without a frame."""
        return 100.0 * self._sure_shares / frames if frames else None
