"""Which pixels of a raw picture make which pixel of which view, and with what weight."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.errors import CalibrationError
from rig.lenslet.array import LensletArray, numbers_of
from rig.lenslet.spline import across_cell, combine, look

_DIMMEST = 0.1
"""A view is used where it has this part of the light of the middle; the rest is noise."""
_SMALLEST_PART = 0.4
"""Of the width of the raw picture that must be left then."""
_INSIDE = 0.61
"""Micro-images are used so far inside the picture, in spacings: there their light is known."""
_TAPS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Views of a lenslet array as sums over 4 x 4 pixels of the raw picture."""

    left: NDArray[np.int32]
    """(V, rows, columns) first column; views, then lenslets."""
    top: NDArray[np.int32]
    """(V, rows, columns) first row."""
    weights: NDArray[np.float32]
    """(V, rows, columns, 4, 4): gives light in levels of the brightest micro-image; 0 for lenslets
    that give none."""
    usable: NDArray[np.bool_]
    """(rows, columns) lenslets that give light."""
    first_row: int
    """Number j of the first row of lenslets: odd rows of a hexagonal array lie half a spacing to
    the right."""

    @property
    def noise_gain(self) -> NDArray[np.float32]:
        """(V, rows, columns) noise of a lenslet's value over that of a single raw pixel."""
        squares = np.einsum("vrcab,vrcab->vrc", self.weights, self.weights)
        return np.sqrt(squares, dtype=np.float32)


def plan_views(array: LensletArray, offsets_px: Float) -> Plan:
    """Return the plan of views at places inside the micro-images.

    Around its place a view takes the light of about two pixels, each way: the weights are the
    linear interpolation of pixels that are smoothed by (1 2 1) / 4. In a Bayer picture all colours
    have their full part whatever the place, no place is rounded, and noise hardly depends on it.

    Args:
        array: of the camera.
        offsets_px: (V, 2) places of the views in a micro-image, along the rows of lenslets and
            across them.

    Raises:
        CalibrationError: a view lies outside the micro-images, or in their dark part.
    """
    lattice = array.lattice
    most_px = 0.5 * lattice.spacing_px - 1.0
    far_px = float(np.hypot(offsets_px[:, 0], offsets_px[:, 1]).max())
    if far_px > most_px:
        raise CalibrationError(
            f"a view {far_px:.2f} px from the middle of its micro-image asked for, micro-images "
            f"{lattice.spacing_px:.2f} px apart hold views up to {most_px:.2f} px",
            advice="set the views nearer, or camera.step_px smaller",
        )
    cos, sin = math.cos(lattice.rotation_rad), math.sin(lattice.rotation_rad)
    on_sensor = offsets_px @ np.array([[cos, sin], [-sin, cos]])
    q0, q1, j0, j1 = _window(array, on_sensor)
    j, q = np.meshgrid(np.arange(j0, j1 + 1), np.arange(q0, q1 + 1), indexing="ij")
    centre_px = lattice.centres_px(numbers_of(lattice.kind, q, j), j)
    gains = np.ascontiguousarray(
        array.gains[j0 - array.first[1] : j1 + 1 - array.first[1]][
            :, q0 - array.first[0] : q1 + 1 - array.first[0]
        ]
    )
    shape = (len(offsets_px), *gains.shape)
    left, top = np.zeros(shape, np.int32), np.zeros(shape, np.int32)
    weights = np.zeros((*shape, _TAPS, _TAPS), np.float32)
    table = array.vignetting.table * (array.vignetting.levels / _peak(array))
    size_px = np.array(array.vignetting.size_px, np.float64)

    def work(start: int, stop: int) -> None:
        _fill(
            table,
            size_px,
            array.vignetting.reach_px,
            array.colour_gains,
            centre_px[start:stop],
            gains[start:stop],
            on_sensor,
            left[:, start:stop],
            top[:, start:stop],
            weights[:, start:stop],
        )

    run_in_bands(work, gains.shape[0])
    return Plan(left, top, weights, gains > 0.0, j0)


def _peak(array: LensletArray) -> float:
    """Light in the middle of the micro-image in the middle of the picture."""
    middle = np.array(array.vignetting.size_px, np.float64)[None] / 2.0
    return float(array.vignetting.light(middle, np.zeros((1, 2)))[0])


def _window(array: LensletArray, on_sensor: Float) -> tuple[int, int, int, int]:
    """First and last column and row of the largest upright window of lenslets with light.

    Raises:
        CalibrationError: it is too small a part of the picture.
    """
    rows, columns = array.gains.shape
    middle = np.array([columns - 1, rows - 1]) / 2.0
    width_px, height_px = array.vignetting.size_px
    spacing_px = array.lattice.spacing_px
    tall = {"hexagonal": math.sqrt(0.75), "square": 1.0}[array.lattice.kind]
    half = np.array([width_px, height_px / tall]) / spacing_px / 2.0
    for part in np.arange(1.0, _SMALLEST_PART, -0.01):
        low = np.ceil(middle - part * half).astype(int)
        high = np.floor(middle + part * half).astype(int)
        q0, q1 = int(low[0]) + array.first[0], int(high[0]) + array.first[0]
        j0, j1 = int(low[1]) + array.first[1], int(high[1]) + array.first[1]
        inside = low.min() >= 0 and high[0] < columns and high[1] < rows
        if inside and _is_lit(array, on_sensor, (q0, q1, j0, j1)):
            return q0, q1, j0, j1
    raise CalibrationError(
        f"a view {np.hypot(*on_sensor.T).max():.2f} px from the middle of the micro-images has "
        f"light only in less than {100 * _SMALLEST_PART:.0f} % of the picture's width",
        advice="open the lens's stop, or set the views nearer (camera.step_px)",
    )


def _is_lit(array: LensletArray, on_sensor: Float, window: tuple[int, int, int, int]) -> bool:
    """Whether all views have light in all corners and along all sides of a window."""
    q0, q1, j0, j1 = window
    run = np.linspace(0.0, 1.0, 25)
    q = np.rint(q0 + (q1 - q0) * run).astype(np.int64)
    j = np.rint(j0 + (j1 - j0) * run).astype(np.int64)
    around_q = np.concatenate([q, q, np.full(25, q0), np.full(25, q1)])
    around_j = np.concatenate([np.full(25, j0), np.full(25, j1), j, j])
    i = numbers_of(array.lattice.kind, around_q, around_j)
    centre_px = array.lattice.centres_px(i, around_j)
    width_px, height_px = array.vignetting.size_px
    margin_px = _INSIDE * array.lattice.spacing_px
    last = np.array([width_px - 1, height_px - 1])
    if np.any(centre_px < margin_px) or np.any(centre_px > last - margin_px):
        return False
    dimmest = _DIMMEST * _peak(array)
    return all(
        bool(np.all(array.vignetting.light(centre_px, np.tile(place, (100, 1))) > dimmest))
        for place in on_sensor
    )


@kernel()
def _fill(
    table: Float,
    size_px: Float,
    reach_px: float,
    colour_gains: Float,
    centre_px: Float,
    gains: Float,
    on_sensor: Float,
    left: NDArray[np.int32],
    top: NDArray[np.int32],
    out: NDArray[np.float32],
) -> None:
    cell = np.empty((table.shape[2], table.shape[3]))
    row, column = np.empty(4), np.empty(4)
    along, down = np.empty(4), np.empty(4)
    for r in range(gains.shape[0]):
        for c in range(gains.shape[1]):
            x0, y0 = centre_px[r, c, 0], centre_px[r, c, 1]
            combine(table, size_px, x0, y0, cell)
            for n in range(on_sensor.shape[0]):
                x, y = x0 + on_sensor[n, 0], y0 + on_sensor[n, 1]
                u0, v0 = math.floor(x) - 1, math.floor(y) - 1
                left[n, r, c], top[n, r, c] = u0, v0
                if gains[r, c] <= 0.0:
                    continue
                _soft(x - math.floor(x), along)
                _soft(y - math.floor(y), down)
                for a in range(4):
                    v = v0 + a
                    first_row = across_cell(v - y0, reach_px, cell.shape[0], row)
                    for b in range(4):
                        u = u0 + b
                        first = across_cell(u - x0, reach_px, cell.shape[1], column)
                        light = look(cell, first_row, first, row, column) * gains[r, c]
                        weight = along[b] * down[a] * colour_gains[v % 2, u % 2]
                        if weight > 0.0:
                            out[n, r, c, a, b] = weight / max(light, 0.02)


@kernel()
def _soft(part: float, out: Float) -> None:
    """Write the weights of linear interpolation between pixels smoothed by (1 2 1) / 4."""
    out[0] = 0.25 * (1.0 - part)
    out[1] = 0.25 * (2.0 - part)
    out[2] = 0.25 * (1.0 + part)
    out[3] = 0.25 * part
