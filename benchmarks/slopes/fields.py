"""Smooth fields over the picture, drawn from a seed, and views rendered through them."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import Layout
from tests.support.lightfield import Surface

Array = NDArray[np.float64]
_FIXED_POINT_ROUNDS = 30


class SmoothField:
    """A polynomial of the third order in both coordinates with random coefficients.

    Its value is asked for at any place, so that rendering through it stays exact.
    """

    def __init__(self, seed: int, shape: tuple[int, int]) -> None:
        self._shape = shape
        rng = np.random.default_rng(seed)
        self._coefficients = {
            (i, j): rng.standard_normal() / (1.0 + i + j)
            for i in range(4)
            for j in range(4)
            if i + j <= 3
        }
        self._scale = 1.0

    def __call__(self, u: Array, v: Array) -> Array:
        """Value at columns `u` and rows `v`."""
        height, width = self._shape
        x, y = 2.0 * u / (width - 1) - 1.0, 2.0 * v / (height - 1) - 1.0
        powers = (c * x**i * y**j for (i, j), c in self._coefficients.items())
        return self._scale * sum(powers, np.zeros(np.broadcast(u, v).shape))

    def with_rms(self, rms: float) -> "SmoothField":
        """Scale it to a root mean square over the picture."""
        return self._scaled(rms / float(np.sqrt((self.over_picture() ** 2).mean())))

    def with_peak(self, peak: float) -> "SmoothField":
        """Scale it to a largest magnitude over the picture."""
        return self._scaled(peak / float(np.abs(self.over_picture()).max()))

    def over_picture(self) -> Array:
        """(H, W) its values at the pixel centres."""
        rows, columns = np.indices(self._shape).astype(float)
        return self(columns, rows)

    def _scaled(self, factor: float) -> "SmoothField":
        self._scale *= factor
        return self


def across_px(layout: Layout, rms_px: float, seed: int) -> list[SmoothField | None]:
    """One field of offsets across the epipolar lines for each view, none for the reference."""
    return [
        None
        if x == 0.0 and y == 0.0
        else SmoothField(100 * seed + k, layout.shape).with_rms(rms_px)
        for k, (x, y) in enumerate(zip(layout.x_steps, layout.y_steps, strict=True))
    ]


def render_through(
    surfaces: list[Surface],
    layout: Layout,
    offsets_px: list[SmoothField | None],
    supersample: int = 2,
) -> Array:
    """Render views whose pixels see what lies beside their epipolar lines.

    A pixel (p, q) of a view on the row shows what a faultless one shows at (p, q - offset), so that
    the picture lies lower by the offset; of one on the column, at (p - offset, q). Sampling
    coordinates are displaced, no picture is resampled.

    Returns:
        (V, H, W) grey values.
    """
    rows, columns = np.indices(layout.shape).astype(float)
    parts = (np.arange(supersample) + 0.5) / supersample - 0.5
    views = np.zeros((len(layout.x_steps), *layout.shape))
    for view, field in enumerate(offsets_px):
        step = float(layout.x_steps[view]), float(layout.y_steps[view])
        for dy in parts:
            for dx in parts:
                p, q = columns + dx, rows + dy
                if field is not None:
                    moved = field(p, q)
                    p, q = (p, q - moved) if abs(step[0]) >= abs(step[1]) else (p - moved, q)
                views[view] += _samples(surfaces, p, q, step)
    return views / supersample**2


def _samples(surfaces: list[Surface], p: Array, q: Array, step: tuple[float, float]) -> Array:
    """Grey values of the nearest surfaces at places of a view, as `lightfield` finds them."""
    grey = np.zeros(p.shape)
    for surface in surfaces:
        u, v = p, q
        for _ in range(_FIXED_POINT_ROUNDS):
            m = surface.slope_px(u, v)
            moved_u, moved_v = p + m * step[0], q + m * step[1]
            is_done = max(np.abs(moved_u - u).max(), np.abs(moved_v - v).max()) < 1e-9
            u, v = moved_u, moved_v
            if is_done:
                break
        inside = surface.covers(u, v)
        grey[inside] = surface.grey(u[inside], v[inside])
    return grey
