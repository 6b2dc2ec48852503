"""From a raw picture to its sub-aperture views on one upright grid."""

import math
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve, spline_filter1d

from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.frames import GreyImage
from rig.lenslet.array import LensletArray
from rig.lenslet.plan import Plan

TOP = 65535
"""Grey value of a saturated pixel in a view."""
_COLUMN_STEP = math.sqrt(3.0) / 2.0
"""Columns of a view of a hexagonal lattice lie as near as its rows, in spacings."""


def view_size_px(array: LensletArray, plan: Plan) -> tuple[int, int]:
    """Return width and height of the views."""
    rows, columns = plan.usable.shape
    if array.lattice.kind == "square":
        return columns, rows
    return math.floor((columns - 1.5) / _COLUMN_STEP) + 1, rows


def sub_apertures(
    raw: GreyImage, array: LensletArray, plan: Plan, dark: GreyImage | None = None
) -> NDArray[np.uint16]:
    """Return the views (V, H, W) of a raw picture, devignetted, on one grid of square pixels.

    Lenslets without light take the mean of their neighbours. Rows of a hexagonal lattice are
    brought to common columns by a cubic spline along the row.

    Args:
        raw: (H, W) picture of the camera.
        array: of the camera.
        plan: of the views.
        dark: (H, W) picture without light, in place of the dark level.
    """
    values = np.zeros(plan.left.shape, np.float32)
    pixels = cast("GreyImage", np.ascontiguousarray(raw))
    darkness = cast("GreyImage", pixels[:0] if dark is None else np.ascontiguousarray(dark))

    def work(start: int, stop: int) -> None:
        band = np.s_[:, start:stop]
        _gather(
            pixels,
            darkness,
            array.dark_levels,
            plan.left[band],
            plan.top[band],
            plan.weights[band],
            values[band],
        )

    run_in_bands(work, plan.usable.shape[0])
    if not plan.usable.all():
        values = _filled(values, plan.usable)
    if array.lattice.kind == "hexagonal":
        values = _upright(values, plan.first_row, view_size_px(array, plan)[0])
    values *= np.float32(TOP / (array.full_scale - array.dark_levels))
    np.rint(values, out=values)
    np.clip(values, 0.0, TOP, out=values)  # a full well or an empty one
    return values.astype(np.uint16)


def _filled(values: NDArray[np.float32], usable: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Give lenslets without light the mean of those around them."""
    around = np.ones((3, 3), np.float32)
    known = usable.copy()
    while not known.all():
        count = convolve(known.astype(np.float32), around, mode="constant")
        new = ~known & (count > 0.0)
        if not new.any():
            break
        for view in values:
            total = convolve(np.where(known, view, np.float32(0.0)), around, mode="constant")
            view[new] = total[new] / count[new]
        known |= new
    return values


def _upright(values: NDArray[np.float32], first_row: int, width_px: int) -> NDArray[np.float32]:
    """Resample rows that are shifted by half a spacing to common columns."""
    coefficients = spline_filter1d(values, order=3, axis=-1, output=np.float32, mode="mirror")
    columns = coefficients.shape[-1]
    out = np.empty((*values.shape[:2], width_px), np.float32)
    for parity in (0, 1):
        rows = np.arange((parity - first_row) % 2, values.shape[1], 2)
        place = 0.5 + np.arange(width_px) * _COLUMN_STEP - 0.5 * parity
        left = np.floor(place).astype(int)
        part = place - left
        rest = 1.0 - part
        weights = (
            rest**3 / 6.0,
            (4.0 - 6.0 * part**2 + 3.0 * part**3) / 6.0,
            (4.0 - 6.0 * rest**2 + 3.0 * rest**3) / 6.0,
            part**3 / 6.0,
        )
        total = np.zeros((values.shape[0], len(rows), width_px), np.float32)
        for step, weight in enumerate(weights, -1):
            mirrored = np.abs(left + step)
            mirrored = np.where(mirrored >= columns, 2 * (columns - 1) - mirrored, mirrored)
            total += coefficients[:, rows][:, :, mirrored] * weight.astype(np.float32)
        out[:, rows] = total
    return out


@kernel()
def _gather(
    raw: GreyImage,
    dark: GreyImage,
    dark_levels: float,
    left: NDArray[np.int32],
    top: NDArray[np.int32],
    weights: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    for n in range(out.shape[0]):
        for r in range(out.shape[1]):
            for c in range(out.shape[2]):
                u, v = left[n, r, c], top[n, r, c]
                total = np.float32(0.0)
                for a in range(4):
                    for b in range(4):
                        light = np.float32(raw[v + a, u + b])
                        if dark.shape[0] > 0:
                            light -= np.float32(dark[v + a, u + b])
                        else:
                            light -= np.float32(dark_levels)
                        total += weights[n, r, c, a, b] * light
                out[n, r, c] = total
