"""Brings raw pictures into the common frame, for the dense estimator.

Every rectified pixel comes from 4 x 4 raw ones. Places and fractions are computed once, in double
precision; per picture only the sixteen products remain. OpenCV's `remap` rounds places to 1/32 px
and is out of the question.

The weights are those of the cubic through four neighbours (Lagrange; see R. W. Schafer and L. R.
Rabiner, "A digital signal processing approach to interpolation", Proc. IEEE 61, 1973): its phase,
which is what moves an edge, is good to one order more than that of a Catmull-Rom spline, whose
smooth joints nobody needs here.
"""

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.bands import run_in_bands
from rig.epipolar.kernel import kernel
from rig.errors import SlopeError

Float = NDArray[np.float64]

_PAD = 2


class Resampler:
    """Resamples the pictures of one rig, again and again, without new memory but for the result.

    Args:
        raw_px: per view (H, W, 2) raw pixel (x, y) of every rectified pixel; NaN for none.
        raw_shapes: per view height and width of its raw pictures.
    """

    def __init__(self, raw_px: Sequence[Float], raw_shapes: Sequence[tuple[int, int]]) -> None:
        self._shapes = tuple(raw_shapes)
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
                f"{_sizes(self._shapes)} px; calibrate at the size that is captured"
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
            for padded, image in zip(self._padded, images, strict=True):
                padded[_PAD:-_PAD, _PAD:-_PAD] = image
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
        # The first of the sixteen: one up and one left, in the padded picture.
        self._runs.append(_runs((row + _PAD - 1) * stride + (column + _PAD - 1)))


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
    p0, p1, p2, p3 = flat[:count], flat[1 : count + 1], flat[2 : count + 2], flat[3 : count + 3]
    q = flat[stride:]
    q0, q1, q2, q3 = q[:count], q[1 : count + 1], q[2 : count + 2], q[3 : count + 3]
    r = flat[2 * stride :]
    r0, r1, r2, r3 = r[:count], r[1 : count + 1], r[2 : count + 2], r[3 : count + 3]
    s = flat[3 * stride :]
    s0, s1, s2, s3 = s[:count], s[1 : count + 1], s[2 : count + 2], s[3 : count + 3]
    one, two = np.float32(1), np.float32(2)
    half, sixth = np.float32(0.5), np.float32(1 / 6)
    for u in range(count):
        t = x[u]
        up, down, far = t + one, t - one, t - two
        w0 = -sixth * t * down * far
        w1 = half * up * down * far
        w2 = -half * up * t * far
        w3 = sixth * up * t * down
        a = w0 * p0[u] + w1 * p1[u] + w2 * p2[u] + w3 * p3[u]
        b = w0 * q0[u] + w1 * q1[u] + w2 * q2[u] + w3 * q3[u]
        c = w0 * r0[u] + w1 * r1[u] + w2 * r2[u] + w3 * r3[u]
        d = w0 * s0[u] + w1 * s1[u] + w2 * s2[u] + w3 * s3[u]
        t = y[u]
        up, down, far = t + one, t - one, t - two
        out[u] = (
            -sixth * t * down * far * a
            + half * up * down * far * b
            - half * up * t * far * c
            + sixth * up * t * down * d
        )
