"""Where small patches of the reference lie in another view, along its line and across it.

B. D. Lucas and T. Kanade, "An iterative image registration technique with an application to stereo
vision" (IJCAI 1981), with one gain and one offset of the grey values for every patch (C.-S. Fuh and
P. Maragos, "Affine models for image matching and motion detection", ICASSP 1991), so that light
that differs between the cameras does not pull.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel

Places = NDArray[np.intp]

_RADIUS_PX = 5
BORDER_PX = _RADIUS_PX + 1
_ROUNDS = 10
_SETTLED_PX = 0.02
_SUMS = 10
_LIKE = 0.8
"""Correlation from which a patch is taken for the same."""


@dataclass(frozen=True, slots=True)
class Patches:
    """What was found of N patches in one view."""

    columns: Places
    """(N,) centres in the reference."""
    rows: Places
    """(N,)."""
    along_px: Float
    """(N,) shift along the line, towards falling slopes."""
    across_px: Float
    """(N,) shift across it, in the sense of `directions`."""
    sigma_px: Float
    """(N,) of the shift across, by what the patches differ by, 1 sigma."""

    def on_line_px(self, steps: tuple[float, float]) -> tuple[Float, Float]:
        """Columns and rows (N,) in a view at some steps if nothing lay across its lines."""
        along, _ = directions(*steps)
        return self.columns + along[0] * self.along_px, self.rows + along[1] * self.along_px

    def __getitem__(self, chosen: NDArray[np.bool_]) -> "Patches":
        return Patches(
            self.columns[chosen], self.rows[chosen], self.along_px[chosen],
            self.across_px[chosen], self.sigma_px[chosen],
        )  # fmt: skip


def directions(x_step: float, y_step: float) -> tuple[Float, Float]:
    """Unit vectors (2,), right and down, along the line of a view and across it."""
    along = np.array([x_step, y_step]) / np.hypot(x_step, y_step)
    return along, np.array([-along[1], along[0]])


def distinctness(grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """How much any shift changes the patch around every pixel, (H, W).

    J. Shi and C. Tomasi, "Good features to track" (CVPR 1994).
    """
    return np.asarray(cv2.cornerMinEigenVal(grey, 2 * _RADIUS_PX + 1), np.float32)


def most_distinct(strength: NDArray[np.float32], cell_px: int) -> tuple[Places, Places]:
    """Rows and columns (N,) of the most distinct pixel of every square cell inside the border."""
    inner = strength[BORDER_PX : -BORDER_PX or None, BORDER_PX : -BORDER_PX or None]
    height, width = inner.shape[0] // cell_px, inner.shape[1] // cell_px
    if strength.size == 0 or min(inner.shape) < cell_px:
        nothing = np.zeros(0, np.intp)
        return nothing, nothing
    cells = inner[: height * cell_px, : width * cell_px]
    cells = cells.reshape(height, cell_px, width, cell_px).swapaxes(1, 2).reshape(height, width, -1)
    best, used = cells.argmax(axis=2), cells.max(axis=2) > 0
    rows, columns = np.indices((height, width)) * cell_px + BORDER_PX
    return (rows + best // cell_px)[used], (columns + best % cell_px)[used]


def most_distinct_near(
    strength: NDArray[np.float32], rows: Places, columns: Places, size_px: int
) -> tuple[Places, Places]:
    """Rows and columns (N,) of the most distinct pixel of the squares that begin at some pixels."""
    height, width = strength.shape
    steps = np.arange(size_px)
    down = np.minimum(rows[:, None, None] + steps[:, None], height - 1)
    right = np.minimum(columns[:, None, None] + steps, width - 1)
    best = strength[down, right].reshape(len(rows), size_px**2).argmax(axis=1)
    return (
        np.minimum(rows + best // size_px, height - 1),
        np.minimum(columns + best % size_px, width - 1),
    )


def find_patches(
    reference: NDArray[np.float32],
    picture: NDArray[np.float32],
    rows: Places,
    columns: Places,
    along_px: Float,
    across_px: Float,
    steps: tuple[float, float],
    reach_px: float,
) -> Patches:
    """Find patches of the reference in a view.

    Args:
        reference: (H, W) grey values, a little soft.
        picture: (H, W) the other view.
        rows: (N,) centres of the patches.
        columns: (N,) centres of the patches.
        along_px: (N,) where to begin, along the line of the view.
        across_px: (N,) where to begin, across it.
        steps: position of the view, right and down; only its direction counts.
        reach_px: farthest that a patch may lie from where it is begun.

    Returns:
        The patches that are found again, surely.
    """
    along, across = directions(*steps)
    begin = along_px[:, None] * along + across_px[:, None] * across
    moved = begin.copy()
    quality = np.zeros((len(rows), 2))

    def work(start: int, stop: int) -> None:
        _fit(
            reference, picture, rows[start:stop], columns[start:stop], reach_px, across,
            moved[start:stop], quality[start:stop],
        )  # fmt: skip

    run_in_bands(work, len(rows))
    found = Patches(columns, rows, moved @ along, moved @ across, quality[:, 1])
    return found[quality[:, 0] > _LIKE]


@kernel()
def _fit(
    reference: NDArray[np.float32],
    picture: NDArray[np.float32],
    rows: Places,
    columns: Places,
    reach: float,
    across: NDArray[np.float64],
    moved: NDArray[np.float64],
    quality: NDArray[np.float64],
) -> None:
    """Gauss-Newton for each patch; fills correlation (0 where lost) and sigma across the line."""
    height, width = reference.shape
    count = (2 * _RADIUS_PX + 1) ** 2
    sums = np.empty(_SUMS)
    for i in range(len(rows)):
        v, u = rows[i], columns[i]
        x, y = moved[i, 0], moved[i, 1]
        quality[i, 0] = 0.0
        if v < _RADIUS_PX or u < _RADIUS_PX or v >= height - _RADIUS_PX or u >= width - _RADIUS_PX:
            continue
        for _ in range(_ROUNDS):
            if not _sum(reference, picture, v, u, x, y, sums):
                break
            pp, qq, pq, px, py = sums[0], sums[1], sums[2], sums[3], sums[4]
            qx, qy, xx, xy, yy = sums[5], sums[6], sums[7], sums[8], sums[9]
            det = xx * yy - xy * xy
            if pp <= 0.0 or qq <= 0.0 or det <= 1e-9 * xx * yy:
                break
            gain = np.sqrt(pp / qq)
            # Sums of the derivatives with what is left between the patches, in grey levels of q.
            left_x, left_y = px / gain - qx, py / gain - qy
            dx, dy = (yy * left_x - xy * left_y) / det, (xx * left_y - xy * left_x) / det
            x += dx
            y += dy
            if not np.hypot(x - moved[i, 0], y - moved[i, 1]) <= reach:
                break
            if abs(dx) + abs(dy) < _SETTLED_PX:
                left = 2.0 * qq * (1.0 - pq / np.sqrt(pp * qq)) / (count - 4)
                a, b = across[0], across[1]
                spread = (a * a * yy - 2.0 * a * b * xy + b * b * xx) / det
                moved[i, 0], moved[i, 1] = x, y
                quality[i, 0] = pq / np.sqrt(pp * qq)
                quality[i, 1] = np.sqrt(max(left * spread, 0.0))
                break


@kernel()
def _sum(
    reference: NDArray[np.float32],
    picture: NDArray[np.float32],
    v: int,
    u: int,
    x: float,
    y: float,
    sums: NDArray[np.float64],
) -> bool:
    """Central moments of a patch p and the shifted one q with its derivatives; False outside.

    pp, qq, pq, p dq/dx, p dq/dy, q dq/dx, q dq/dy, and those of the derivatives.
    """
    height, width = picture.shape
    left, top = int(np.floor(u + x)) - _RADIUS_PX, int(np.floor(v + y)) - _RADIUS_PX
    size = 2 * _RADIUS_PX + 1
    if left < 1 or top < 1 or left + size + 2 > width or top + size + 2 > height:
        return False
    s, t = u + x - np.floor(u + x), v + y - np.floor(v + y)
    sums[:] = 0.0
    total_p = total_q = total_x = total_y = 0.0
    for j in range(size):
        for k in range(size):
            r, c = top + j, left + k
            p = float(reference[v - _RADIUS_PX + j, u - _RADIUS_PX + k])
            upper = picture[r, c] + s * (picture[r, c + 1] - picture[r, c])
            lower = picture[r + 1, c] + s * (picture[r + 1, c + 1] - picture[r + 1, c])
            q = upper + t * (lower - upper)
            # Central differences between the pixels, interpolated as the values are.
            ux = picture[r, c + 1] - picture[r, c - 1]
            ux += s * (picture[r, c + 2] - picture[r, c] - ux)
            lx = picture[r + 1, c + 1] - picture[r + 1, c - 1]
            lx += s * (picture[r + 1, c + 2] - picture[r + 1, c] - lx)
            dx = 0.5 * (ux + t * (lx - ux))
            uy = picture[r + 1, c] - picture[r - 1, c]
            uy += s * (picture[r + 1, c + 1] - picture[r - 1, c + 1] - uy)
            ly = picture[r + 2, c] - picture[r, c]
            ly += s * (picture[r + 2, c + 1] - picture[r, c + 1] - ly)
            dy = 0.5 * (uy + t * (ly - uy))
            total_p += p
            total_q += q
            total_x += dx
            total_y += dy
            sums[0] += p * p
            sums[1] += q * q
            sums[2] += p * q
            sums[3] += p * dx
            sums[4] += p * dy
            sums[5] += q * dx
            sums[6] += q * dy
            sums[7] += dx * dx
            sums[8] += dx * dy
            sums[9] += dy * dy
    n = float(size * size)
    sums[0] -= total_p * total_p / n
    sums[1] -= total_q * total_q / n
    sums[2] -= total_p * total_q / n
    sums[3] -= total_p * total_x / n
    sums[4] -= total_p * total_y / n
    sums[5] -= total_q * total_x / n
    sums[6] -= total_q * total_y / n
    sums[7] -= total_x * total_x / n
    sums[8] -= total_x * total_y / n
    sums[9] -= total_y * total_y / n
    return True
