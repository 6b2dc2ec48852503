"""Corners that do not lie where their neighbours put them."""

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.geometry.homography import grid_places

_REACH = 2
"""Neighbours: so many rows and columns away. Lens distortion is small over that distance."""
_FEWEST = 6
"""Neighbours needed: a homography has as many unknowns as four points have coordinates."""
_MOST_SPREADS = 6.0
"""Misses above so many times the median of all are outliers ..."""
_LEAST_PX = 0.08
"""... unless they are so small that distortion or a bent board may be the reason."""
_MOST_SIGMAS = 5.0
_ROUNDS = 12
_WORST_CONDITION = 1e12
"""Of the normal equations, above which neighbours (all in one line) do not fix a homography."""


def inliers(xy_px: Float, sigma_px: Float, places: Float | None = None) -> NDArray[np.bool_]:
    """Tell which corners fit a homography through their neighbours, which leaves them out.

    The worst one goes first, because it spoils the prediction of all its neighbours; then all
    are judged again, up to a fixed number of rounds.

    Args:
        xy_px: (rows, columns, 2) corners on a grid, NaN where there is none.
        sigma_px: (rows, columns) 1 sigma per coordinate.
        places: (rows, columns, 2) where they are on the board, in steps of about one; None for a
            regular grid.

    Returns:
        (rows, columns) False where there is no corner or an outlier. Corners with too few
        neighbours are kept.
    """
    kept = np.isfinite(xy_px[..., 0])
    grid = grid_places(*kept.shape)
    places = grid if places is None else places
    for _ in range(_ROUNDS):
        row, column = np.nonzero(kept)
        miss, predicted_sigma = _misses(
            places[row, column], xy_px[row, column], sigma_px[row, column], grid[row, column]
        )
        judged = np.isfinite(miss)
        if not judged.any():
            break
        limit = np.maximum(_MOST_SPREADS * np.median(miss[judged]), _LEAST_PX)
        over = np.where(judged, miss / np.maximum(limit, _MOST_SIGMAS * predicted_sigma), 0.0)
        worst = int(over.argmax())
        if over[worst] <= 1.0:
            break
        kept[row[worst], column[worst]] = False
    return kept


def _misses(
    places: Float, xy_px: Float, sigma_px: Float, grid: Float | None = None
) -> tuple[Float, Float]:
    """(N,) distance from the prediction, px, NaN with too few neighbours; and its sigma.

    Neighbours are those of the grid (N, 2) of rows and columns; by default places are it.
    """
    count = len(places)
    grid = places if grid is None else grid
    apart = np.abs(grid[:, None] - grid[None]).max(axis=-1)
    near = (apart <= _REACH) & (apart > 0)
    # Place and position in units of about one about the middle keep the normal equations sound.
    x, y = (places - places.mean(axis=0)).T / _REACH
    middle = xy_px.mean(axis=0)
    scale_px = max(float(np.abs(xy_px - middle).max(initial=0.0)), 1e-9)
    u, v = ((xy_px - middle) / scale_px).T
    one, none = np.ones(count), np.zeros(count)
    along_u = np.stack([x, y, one, none, none, none, -x * u, -y * u], axis=-1)
    along_v = np.stack([none, none, none, x, y, one, -x * v, -y * v], axis=-1)
    weight = near.astype(np.float64)
    products = along_u[:, :, None] * along_u[:, None] + along_v[:, :, None] * along_v[:, None]
    normal = (weight @ products.reshape(count, -1)).reshape(count, 8, 8)
    wanted = weight @ (along_u * u[:, None] + along_v * v[:, None])
    # A trace of the identity keeps inversions of what neighbours do not fix from failing.
    size = np.linalg.norm(normal, axis=(1, 2))
    inverse = np.linalg.inv(normal + (1e-15 * size[:, None, None] + 1e-300) * np.eye(8))
    condition = size * np.linalg.norm(inverse, axis=(1, 2))
    enough = (near.sum(axis=1) >= _FEWEST) & (condition < _WORST_CONDITION)
    miss, sigma = np.full(count, np.nan), np.full(count, np.nan)
    if not enough.any():
        return miss, sigma
    inverse = inverse[enough]
    h = (inverse @ wanted[enough][..., None])[..., 0]
    place = np.stack([x, y, one], axis=-1)[enough]
    below = 1.0 + h[:, 6] * place[:, 0] + h[:, 7] * place[:, 1]
    at_u = (h[:, :3] * place).sum(axis=1) / below
    at_v = (h[:, 3:6] * place).sum(axis=1) / below
    miss[enough] = scale_px * np.hypot(at_u - u[enough], at_v - v[enough])
    spread = np.einsum("ni,nij,nj->n", along_u[enough], inverse, along_u[enough])
    typical = np.median(sigma_px)
    sigma[enough] = np.sqrt(sigma_px[enough] ** 2 + spread * typical**2)
    return miss, sigma
