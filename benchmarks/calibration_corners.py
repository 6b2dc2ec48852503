"""Corners as the fitter finds them: small pictures rendered around each, blur and noise included.

Around every corner the true projection is inverted by a cubic (good to 1e-4 px), the checkers are
averaged over cells of a quarter of a pixel, blurred, integrated over the pixel, given noise and
digitised; then the fitter that finds corners of real pictures runs on them, with the room that the
markers of a ChArUco board leave it. Averaged and not sampled: edges along the rows would lie up to
0.12 px beside their place, which is ten times what the fitter misses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.geometry.sighting import Sighting
from rig.targets.corner_fit import fit_crossings
from tests.support.calibration_scene import (
    COLUMNS,
    HEIGHT,
    WIDTH,
    Scene,
    flat_board_mm,
    turn,
)

BLUR_PX, NOISE = 0.7, 2.0
BLACK, WHITE = 40.0, 200.0
CLEAR_SHARE = 0.25
"""Room around a corner, in sides of a square: twice the white margin of a marker of 3/4 side."""
SIDE = 21
"""Of the picture around each corner, px."""
_FINE = 4
_PAD_PX = 3
_REACH = 0.45


@dataclass(frozen=True)
class Picture:
    """How sharp and how noisy pictures are."""

    blur_px: float = BLUR_PX
    noise: float = NOISE
    """Grey levels, 1 sigma."""


def rendered_sightings(
    scene: Scene,
    seed: int,
    like: Picture = Picture(),
    pictures: Sequence[int] | None = None,
    views: Sequence[int] | None = None,
) -> list[Sighting]:
    """Find the corners of some pictures (None: of all); boards may leave a picture in part."""
    rng = np.random.default_rng(seed)
    found: list[Sighting] = []
    for picture in range(len(scene.poses)) if pictures is None else pictures:
        for view in range(len(scene.cameras)) if views is None else views:
            xy_px = scene.shown(picture, view)
            with np.errstate(invalid="ignore"):
                inside = ((xy_px > 12) & (xy_px < (WIDTH - 13, HEIGHT - 13))).all(axis=1)
            ids = np.flatnonzero(inside)
            if len(ids) >= 6:
                found.append(_sighting(scene, picture, view, ids, xy_px[ids], rng, like))
    return found


def _sighting(
    scene: Scene,
    picture: int,
    view: int,
    ids: NDArray[np.intp],
    xy_px: Float,
    rng: np.random.Generator,
    like: Picture,
) -> Sighting:
    base = np.round(xy_px)
    inverse, axes, side_px = _inverse_maps(scene, picture, view, ids, xy_px)
    tiles = _render(inverse, base - xy_px, ids, like.blur_px)
    tiles = np.clip(np.round(tiles + rng.normal(0, like.noise, tiles.shape)), 0, 255)
    mosaic = tiles.transpose(1, 0, 2).reshape(SIDE, -1).astype(np.float32)
    middle = np.stack([np.arange(len(ids)) * SIDE + SIDE // 2, np.full(len(ids), SIDE // 2)], 1)
    start = middle + (xy_px - base) + rng.normal(0, 0.2, xy_px.shape)
    fit = fit_crossings(mosaic, start, axes, CLEAR_SHARE * side_px)
    good = np.isfinite(fit.sigma_px)
    return Sighting(picture, view, ids[good], (fit.xy_px - middle + base)[good], fit.sigma_px[good])


def _inverse_maps(
    scene: Scene, picture: int, view: int, ids: NDArray[np.intp], xy_px: Float
) -> tuple[Float, Float, Float]:
    """(N, 10, 2) cubics from px about the corner to squares about it; edges; side in px."""
    pose = scene.poses[picture]
    near = np.linspace(-_REACH, _REACH, 7) * scene.square_mm
    across, down = (a.ravel() for a in np.meshgrid(near, near))
    offset = np.stack([across, down, np.zeros_like(across)], axis=1)
    points = scene.board_mm()[ids][:, None] + offset
    world = points.reshape(-1, 3) @ turn(pose.turned_deg).T + pose.middle_mm
    shown = scene.cameras[view].project(world).reshape(len(ids), -1, 2) - xy_px[:, None]
    squares = offset[:, :2] / scene.square_mm
    inverse = np.linalg.pinv(_cubic(shown)) @ squares
    by_px = np.linalg.inv(np.swapaxes(inverse[:, 1:3], 1, 2))  # px by squares, columns the edges
    edges = np.swapaxes(by_px, 1, 2)
    length = np.linalg.norm(edges, axis=2)
    side_px = np.abs(np.linalg.det(by_px)) / length.max(axis=1)
    return inverse, edges / length[..., None], side_px


def _cubic(xy: Float) -> Float:
    x, y = np.moveaxis(xy, -1, 0)
    one = np.ones_like(x)
    return np.stack([one, x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3], axis=-1)


def _render(inverse: Float, off_px: Float, ids: NDArray[np.intp], blur_px: float) -> Float:
    """(N, SIDE, SIDE) grey levels of the pixels around each corner, before noise."""
    half = SIDE // 2 + 0.5 + _PAD_PX
    fine = np.arange(-half + 0.5 / _FINE, half, 1 / _FINE)
    blur = _blur(fine, blur_px)
    tiles = np.empty((len(ids), SIDE, SIDE))
    for n, (cubic, off) in enumerate(zip(inverse, off_px, strict=True)):
        white = _checkers(cubic, fine + off[0], fine + off[1])
        if (ids[n] // COLUMNS + ids[n] % COLUMNS) % 2:
            white = -white
        tiles[n] = blur @ white @ blur.T
    return (BLACK + WHITE) / 2 + (WHITE - BLACK) / 2 * tiles


@kernel()
def _checkers(cubic: Float, x_px: Float, y_px: Float) -> Float:
    """(Y, X) from 1 where the board is white to -1 where it is black, at cells about a corner."""
    white = np.empty((y_px.size, x_px.size))
    for j in range(y_px.size):
        y = y_px[j]
        for i in range(x_px.size):
            x = x_px[i]
            both = 1.0
            for axis in range(2):
                c = cubic[:, axis]
                value = c[0] + x * (c[1] + x * (c[3] + x * c[6] + y * c[7]))
                value += y * (c[2] + x * (c[4] + y * c[8]) + y * (c[5] + y * c[9]))
                by_x = c[1] + x * (2 * c[3] + 3 * x * c[6] + 2 * y * c[7]) + y * (c[4] + y * c[8])
                by_y = c[2] + y * (2 * c[5] + 3 * y * c[9] + 2 * x * c[8]) + x * (c[4] + x * c[7])
                both *= _mean_sign(value, abs(by_x) / _FINE, abs(by_y) / _FINE)
            white[j, i] = both
    return white


@kernel()
def _mean_sign(middle: float, by_width: float, by_height: float) -> float:
    """Mean sign over a cell of what grows evenly across it, by so much over width and height."""
    most, least = max(by_width, by_height), min(by_width, by_height)
    size = abs(middle)
    if size >= (most + least) / 2:
        return np.sign(middle)
    if size <= (most - least) / 2:
        return 2 * middle / most
    return np.sign(middle) * (1 - ((most + least) / 2 - size) ** 2 / (most * least))


def _blur(fine: Float, blur_px: float) -> Float:
    """(SIDE, F) Gaussian and pixel integral, from fine samples to pixels along one axis."""
    pixel = np.arange(SIDE) - SIDE // 2
    steps = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    apart = pixel[:, None, None] + steps[None, :, None] - fine
    weight = np.exp(-0.5 * (apart / blur_px) ** 2).sum(axis=1)
    return weight / weight.sum(axis=1, keepdims=True)


def corner_error_px(scene: Scene, sightings: list[Sighting]) -> float:
    """Rms error of the corners, per coordinate."""
    errors = [s.xy_px - scene.shown(s.picture, s.view)[s.ids] for s in sightings]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def board_mm() -> Float:
    """(P, 3) the board as it is described to the solver."""
    return flat_board_mm()
