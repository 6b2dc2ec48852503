"""All that is known of a lenslet array: what a calibration stores and a camera divides by."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.kernel import kernel
from rig.errors import CalibrationError
from rig.json_codec import Codec
from rig.lenslet.fit import FittedLattice, fit_lattice, lenslets_inside
from rig.lenslet.lattice import Lattice, LatticeKind
from rig.lenslet.spline import across_cell, brightest, combine, look
from rig.lenslet.vignetting import Vignetting, fit_vignetting
from rig.lenslet.white import Picture, RawFormat, white_light

_BRIGHT = 0.5
"""The gain of a lenslet comes from pixels that have at least this part of its brightest."""
_INSIDE = 0.6
"""Micro-images that take part lie so far inside the picture, in spacings."""
_GAIN_DIGITS = 4


@dataclass(frozen=True, slots=True, eq=False)
class LensletArray:
    """A lenslet array as its white picture shows it.

    Lenslets are arranged in rows j of columns q: `q = i` in a square lattice and
    `q = i + floor(j / 2)` in a hexagonal one, so that rows stand above each other.
    """

    lattice: Lattice
    vignetting: Vignetting
    colour_gains: Float
    """(2, 2) that bring the colours of a Bayer block to one grey."""
    dark_levels: float
    """Grey value without light."""
    full_scale: int
    """Grey value of a saturated pixel."""
    first: tuple[int, int]
    """(q, j) of the first lenslet of `gains`."""
    gains: Float
    """(rows, columns) light of single lenslets over that of the smooth vignetting; 0 for those that
    are missing, dirty or cut by the border."""
    missing: int
    """Lenslets inside the picture without a micro-image."""
    dirty: int
    """Lenslets that are dark or whose micro-image is displaced."""
    white_rms: float
    """Of the single pixels of the white picture around its fit, as a part of its light."""

    @property
    def is_bayer(self) -> bool:
        """Whether neighbouring pixels have filters of other colours."""
        return bool(np.any(self.colour_gains != 1.0))


ARRAY_JSON = Codec(
    LensletArray,
    name="lenslet array",
    error=CalibrationError,
    advice="calibrate again",
)


def columns_of(kind: LatticeKind, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return columns q of lenslets (i, j)."""
    return i + j // 2 if kind == "hexagonal" else i


def numbers_of(kind: LatticeKind, q: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return numbers i within their rows of lenslets (q, j)."""
    return q - j // 2 if kind == "hexagonal" else q


def fit_array(
    raw: Picture,
    form: RawFormat,
    kind: LatticeKind,
    spacing_px: float,
    dark: Picture | None = None,
) -> tuple[LensletArray, FittedLattice]:
    """Calibrate a lenslet array by a white picture.

    Args:
        raw: (H, W) picture of an evenly lit white surface, or of a diffuser before the lens.
        form: what its pixels are.
        kind: of the lattice.
        spacing_px: between neighbouring micro-images, to 10 %.
        dark: (H, W) picture without light.

    Raises:
        CalibrationError: the picture is no white picture of such an array.
    """
    white = white_light(raw, form, dark)
    fitted = fit_lattice(white.light, kind, spacing_px)
    lattice = fitted.lattice
    height_px, width_px = raw.shape
    i, j, centre_px = lenslets_inside(
        lattice, (width_px, height_px), margin_px=_INSIDE * lattice.spacing_px
    )
    unusable = {*fitted.missing, *fitted.dirty}
    usable = np.array([one not in unusable for one in zip(i.tolist(), j.tolist(), strict=True)])
    i, j, centre_px = i[usable], j[usable], centre_px[usable]
    vignetting = fit_vignetting(white.light, lattice, centre_px)
    gain, misfit = np.zeros(len(i)), np.zeros(len(i))
    _gains(
        white.light,
        vignetting.levels * vignetting.table,
        np.array([width_px, height_px], np.float64),
        vignetting.reach_px,
        centre_px,
        0.5 * lattice.spacing_px,
        gain,
        misfit,
    )
    q = columns_of(kind, i, j)
    first = int(q.min()), int(j.min())
    gains = np.zeros((int(j.max()) - first[1] + 1, int(q.max()) - first[0] + 1))
    gains[j - first[1], q - first[0]] = np.round(gain, _GAIN_DIGITS)
    array = LensletArray(
        lattice,
        vignetting,
        white.colour_gains,
        form.dark_levels if dark is None else float(dark.mean()),
        form.full_scale,
        first,
        gains,
        len(fitted.missing),
        len(fitted.dirty),
        math.sqrt(float(np.mean(misfit))),
    )
    return array, fitted


@kernel()
def _gains(
    white: NDArray[np.float32],
    table: Float,
    size_px: Float,
    reach_px: float,
    centre_px: Float,
    radius_px: float,
    gain: Float,
    misfit: Float,
) -> None:
    """Write light over fitted light of micro-images, and the square of what is left, per pixel."""
    cell = np.empty((table.shape[2], table.shape[3]))
    row, column = np.empty(4), np.empty(4)
    for n in range(centre_px.shape[0]):
        x0, y0 = centre_px[n, 0], centre_px[n, 1]
        combine(table, size_px, x0, y0, cell)
        bright = _BRIGHT * brightest(cell, reach_px, radius_px)
        seen = fitted = square = squares = 0.0
        count = 0
        for v in range(math.ceil(y0 - radius_px), math.floor(y0 + radius_px) + 1):
            y = across_cell(v - y0, reach_px, cell.shape[0], row)
            for u in range(math.ceil(x0 - radius_px), math.floor(x0 + radius_px) + 1):
                if (u - x0) * (u - x0) + (v - y0) * (v - y0) > radius_px * radius_px:
                    continue
                x = across_cell(u - x0, reach_px, cell.shape[1], column)
                light = look(cell, y, x, row, column)
                if light < bright:
                    continue
                seen += white[v, u]
                fitted += light
                ratio = white[v, u] / light
                square += ratio
                squares += ratio * ratio
                count += 1
        if count > 0 and fitted > 0.0:
            gain[n] = seen / fitted
            misfit[n] = max(squares / count - (square / count) * (square / count), 0.0)
