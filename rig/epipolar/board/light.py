"""Smooth gain and offset of every view over a board, taken out of what is sampled along lines."""

from dataclasses import dataclass

import numpy as np

from rig.arrays import Float


@dataclass(frozen=True, slots=True)
class LightField:
    """Gain and offset of each view against the mean of all, each a quadratic over the board.

    Vignettes differ between lenses, and lamps shine differently into them: one number per view
    leaves what changes across the board in the residual.
    """

    basis: Float
    """(6, N) of 1, x, y, x^2, xy, y^2 about the board's centre, in `reach_px`."""
    reach_px: Float
    """(2, 1)."""

    @classmethod
    def over(cls, pixels: Float, centre_px: Float) -> "LightField":
        """Return the field over reference pixels (2, N)."""
        offset = pixels - centre_px[:, None]
        reach_px = np.maximum(np.abs(offset).max(axis=1, keepdims=True), 1.0)
        x, y = offset / reach_px
        return cls(np.stack([np.ones_like(x), x, y, x * x, x * y, y * y]), reach_px)

    def levelled(self, value: Float, gradient: Float, smooth_px: float) -> tuple[Float, Float]:
        """Take the fields out of values along lines by least squares.

        Args:
            value: (V, N) of the smoothed views.
            gradient: (2, N) of their mean, per px.
            smooth_px: sigma of the Gaussian that has smoothed them. A Gaussian times exp(k x) is
                the same Gaussian moved by k sigma^2: where the gain changes, smoothing moves edges.

        Returns:
            Values (V, N) as all views would have them, and the gains (V,) at the board's centre.
        """
        texture = value.mean(axis=0)
        middle = texture.mean()
        terms = len(self.basis)
        # The common texture is the mean of the views, so gains average to 1 and offsets to 0.
        known = np.concatenate([self.basis * (texture - middle), self.basis])
        fitted = np.linalg.solve(known @ known.T, known @ (value - middle).T).T
        gains, offsets = fitted[:, :terms], fitted[:, terms:]
        gain = gains @ self.basis
        level = (value - middle - offsets @ self.basis) / gain
        one, x, y = self.basis[:3]
        none = np.zeros_like(one)
        across = gains @ np.stack([none, one, none, 2 * x, y, none]) / self.reach_px[0]
        down = gains @ np.stack([none, none, one, none, x, 2 * y]) / self.reach_px[1]
        moved = smooth_px**2 * (across * gradient[0] + down * gradient[1]) / gain
        return level - moved, gains[:, 0]
