"""Brings raw pictures into the common frame, for the dense estimator.

Every rectified pixel comes from 6 x 6 raw ones. Places and fractions are computed once, in double
precision; per picture only the 36 products remain. OpenCV's `remap` rounds places to 1/32 px
and is out of the question.

The weights are those of the polynomial through six neighbours (Lagrange; see R. W. Schafer and
L. R. Rabiner, "A digital signal processing approach to interpolation", Proc. IEEE 61, 1973). Its
phase is what moves an edge, and is as good as that of a prefiltered cubic B-spline (M. Unser,
"Splines: a perfect fit for signal and image processing", IEEE Signal Processing Magazine 16,
1999), which would need two more passes over every picture.
"""

import threading
from collections.abc import Sequence
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.compute.bands import run_in_bands
from rig.compute.kernel import kernel
from rig.errors import SlopeError

Weights: TypeAlias = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]

_PAD = 3
_BEFORE = 2
"""Neighbours before a place, of six."""


class Resampler:
    """Resamples the pictures of one rig, again and again, without new memory but for the result.

    Args:
        raw_px: per view (H, W, 2) raw pixel (x, y) of every rectified pixel; NaN for none.
        raw_shapes: per view height and width of its raw pictures.
        soft_px: per view 1 sigma of a Gaussian that softens its raw pictures first, 0 for none;
            None: none.
    """

    def __init__(
        self,
        raw_px: Sequence[Float],
        raw_shapes: Sequence[tuple[int, int]],
        soft_px: Sequence[float] | None = None,
    ) -> None:
        self._shapes = tuple(raw_shapes)
        self._soft_px = tuple(soft_px or [0.0] * len(self._shapes))
        self._one_at_a_time = threading.Lock()
        height, width = raw_px[0].shape[:2]
        views = len(raw_px)
        self.valid = np.empty((views, height, width), np.bool_)
        """(V, H, W) whether a rectified pixel has a source; read-only."""
        self._size = (height, width)
        self._runs: list[tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]] = []
        self._x = np.empty((views, height, width), np.float32)
        self._y = np.empty((views, height, width), np.float32)
        for view, (places, shape) in enumerate(zip(raw_px, self._shapes, strict=True)):
            self._place(view, places, shape)
        self.valid.flags.writeable = False
        self._padded: list[NDArray[np.float32]] = [
            np.empty((rows + 2 * _PAD, columns + 2 * _PAD), np.float32)
            for rows, columns in self._shapes
        ]

    def __call__(self, images: Sequence[NDArray[np.generic]]) -> NDArray[np.float32]:
        """Return (V, H, W) rectified pictures; a pixel without source repeats the nearest border.

        Args:
            images: per view a raw picture, (H, W) grey.

        Raises:
            SlopeError: a picture has another size than the cameras of the calibration.
        """
        found = tuple(image.shape for image in images)
        if found != self._shapes:
            raise SlopeError(
                f"pictures of {_sizes(found)} px given, the calibration is of "
                f"{_sizes(self._shapes)} px",
                advice="calibrate at the size that is captured",
            )
        views, (height, width) = len(self._shapes), self._size
        out = np.empty((views, height, width), np.float32)

        def work(start: int, stop: int) -> None:
            for view in range(views):
                padded = self._padded[view]
                _resample(
                    padded.reshape(-1), padded.shape[1], *self._runs[view],
                    self._x[view], self._y[view], start, stop, out[view],
                )  # fmt: skip

        with self._one_at_a_time:
            for padded, image, soft_px in zip(self._padded, images, self._soft_px, strict=True):
                inner = padded[_PAD:-_PAD, _PAD:-_PAD]
                inner[:] = image
                if soft_px > 0.0:
                    inner[:] = cv2.GaussianBlur(inner, (0, 0), soft_px)
                _repeat_border(padded)
            run_in_bands(work, height)
        return out

    def _place(self, view: int, places: Float, shape: tuple[int, int]) -> None:
        rows, columns = shape
        x, y = places[..., 0], places[..., 1]
        with np.errstate(invalid="ignore"):
            inside = (x >= 0) & (x <= columns - 1) & (y >= 0) & (y <= rows - 1)
        self.valid[view] = inside
        x = np.clip(np.nan_to_num(x), 0, columns - 1)
        y = np.clip(np.nan_to_num(y), 0, rows - 1)
        column, row = np.floor(x), np.floor(y)
        self._x[view], self._y[view] = x - column, y - row
        stride = columns + 2 * _PAD
        # The first of the 36, in the padded picture.
        at = _PAD - _BEFORE
        self._runs.append(_runs((row + at) * stride + (column + at)))


def _runs(first: Float) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Cut each row where the sources of two neighbours are not neighbours.

    Args:
        first: (H, W) index of the source of every pixel.

    Returns:
        First column of every run, closed by one more entry; index of its source; and (H + 1) where
        the runs of each row begin.
    """
    begins = np.ones(first.shape, np.bool_)
    begins[:, 1:] = np.diff(first, axis=1) != 1
    rows, columns = np.nonzero(begins)
    per_row = np.bincount(rows, minlength=len(first))
    return (
        np.append(columns, 0).astype(np.int32),
        first[rows, columns].astype(np.int32),
        np.concatenate([[0], np.cumsum(per_row)]).astype(np.int32),
    )


def _repeat_border(padded: NDArray[np.float32]) -> None:
    padded[:_PAD, _PAD:-_PAD] = padded[_PAD, _PAD:-_PAD]
    padded[-_PAD:, _PAD:-_PAD] = padded[-_PAD - 1, _PAD:-_PAD]
    padded[:, :_PAD] = padded[:, _PAD, None]
    padded[:, -_PAD:] = padded[:, -_PAD - 1, None]


def _sizes(shapes: Sequence[tuple[int, ...]]) -> str:
    return ", ".join(sorted({" x ".join(map(str, shape[::-1])) for shape in shapes}))


@kernel()
def _resample(
    flat: NDArray[np.float32],
    stride: int,
    starts: NDArray[np.int32],
    firsts: NDArray[np.int32],
    runs: NDArray[np.int32],
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    start: int,
    stop: int,
    out: NDArray[np.float32],
) -> None:
    """Fill rows `start` to `stop` of `out` (H, W) from the padded picture `flat`, run by run."""
    for v in range(start, stop):
        for run in range(runs[v], runs[v + 1]):
            a, b = starts[run], starts[run + 1]
            if run + 1 == runs[v + 1]:
                b = out.shape[1]
            _run(flat[firsts[run] :], stride, x[v, a:b], y[v, a:b], out[v, a:b])


@kernel()
def _run(
    flat: NDArray[np.float32],
    stride: int,
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Fill neighbours whose sources are neighbours; contiguous, so that it vectorises."""
    count = len(out)
    # Six rows of six neighbours each: a sum along each row, then one down the six sums.
    p, q, r = flat, flat[stride:], flat[2 * stride :]
    s, t, z = flat[3 * stride :], flat[4 * stride :], flat[5 * stride :]
    for u in range(count):
        across = _weights(x[u])
        down = _weights(y[u])
        out[u] = (
            down[0] * _weighed(p, u, across)
            + down[1] * _weighed(q, u, across)
            + down[2] * _weighed(r, u, across)
            + down[3] * _weighed(s, u, across)
            + down[4] * _weighed(t, u, across)
            + down[5] * _weighed(z, u, across)
        )


@kernel()
def _weights(part: np.float32) -> Weights:
    """Of six neighbours for a place between the third and the fourth.

    Lagrange's polynomial of degree 5 through the pixels -2..3: weight k is the product over the
    other pixels i of (part - i) / (k - i). a..f are part - i; some products serve twice.
    """
    a, b, c = part + np.float32(2), part + np.float32(1), part
    d, e, f = part - np.float32(1), part - np.float32(2), part - np.float32(3)
    ab, ef = a * b, e * f
    abc, def_ = ab * c, d * ef
    abcd, cdef = abc * d, c * def_
    return (
        np.float32(-1 / 120) * b * cdef,
        np.float32(1 / 24) * a * cdef,
        np.float32(-1 / 12) * ab * def_,
        np.float32(1 / 12) * abc * ef,
        np.float32(-1 / 24) * abcd * f,
        np.float32(1 / 120) * abcd * e,
    )


@kernel()
def _weighed(row: NDArray[np.float32], first: int, weights: Weights) -> np.float32:
    """Sum of six neighbours."""
    return (
        weights[0] * row[first]
        + weights[1] * row[first + 1]
        + weights[2] * row[first + 2]
        + weights[3] * row[first + 3]
        + weights[4] * row[first + 4]
        + weights[5] * row[first + 5]
    )
