"""The picture of two crossing blurred edges, bare or with a marker in either bright quadrant."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float

Single: TypeAlias = NDArray[np.floating[Any]]
"""Single precision; its type gets lost beside Python's numbers."""

PARAMETERS = 7  # x, y, two edge angles, blur, middle grey, half contrast
BLUR, MIDDLE, HALF = 4, 5, 6
"""Columns of the parameters that are no places."""

_ERF = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)
_ERF_SCALE = 0.3275911
_FAR = 36.0
"""Exponent beyond which a bell is nothing: products of two smaller ones would be denormal, and
slow."""
_KEPT_BLURS = 2.0
"""Widths of the edges kept between pixels that count and the bits within a marker."""


@dataclass(frozen=True, slots=True)
class Markers:
    """Black corners in the bright quadrants of N crossings; what is within them is unknown."""

    margin_px: Single
    """(N, 2) from either edge to the outline of the markers, across that edge."""
    border_px: Single
    """(N, 2) width of the black border within the outline, across either edge."""
    uneven_px: Single
    """(N, 2) by how much more it is on the side where distances grow: perspective."""
    fan: Single
    """(N, 2) growth of the margin along an edge, px per px."""

    def part(self, which: NDArray[np.bool_]) -> "Markers":
        """Those of some crossings."""
        return Markers(
            self.margin_px[which], self.border_px[which], self.uneven_px[which], self.fan[which]
        )


@dataclass(frozen=True, slots=True)
class Shape:
    """N crossings at P pixels each, for grey levels from -1 to 1, and how they change."""

    value: Single
    """(N, P)."""
    by_place: list[Single]
    """Four of (N, P): derivatives by x, y and the two angles."""
    by_blur: Single
    known: Single | None
    """(N, P) one where the model holds, zero within markers; None: everywhere."""


def crossing_shape(offset: Single, value: Float, markers: Markers | None) -> Shape:
    """Return the shape of crossings: two bright quadrants, less the corners of markers in them.

    Args:
        offset: (P, 2) pixels, from the pixel that `value` counts from.
        value: (N, PARAMETERS).
        markers: in the bright quadrants; None for none.
    """
    first, second = _edge(offset, value, 2), _edge(offset, value, 3)
    blur = value[:, BLUR, None].astype(np.float32)
    # Seen with this sign, the bright quadrants are those with both distances of one sign.
    sign = np.where(value[:, HALF, None] < 0, -1, 1).astype(np.float32)
    rho = sign * (first.normal * second.normal).sum(axis=1, keepdims=True)
    one, two = _rise(first.across_px, blur), _rise(sign * second.across_px, blur)
    bright = _opposite_quadrants(one, two, rho, blur)
    known = None
    if markers is not None:
        known = np.ones_like(bright.value)
        # Distances across the second edge were turned with the sign; so are its two sides.
        turned = np.concatenate([np.ones_like(sign), sign], axis=1)
        for side in (1, -1):
            margin_px = markers.margin_px + side * turned * markers.uneven_px
            a_px = margin_px[:, :1] + markers.fan[:, :1] * first.along_px
            b_px = margin_px[:, 1:] + markers.fan[:, 1:] * second.along_px
            inner = _rise(side * one.across_px - a_px, blur)
            other = _rise(side * two.across_px - b_px, blur)
            bright.subtract(_quadrant(inner, other, rho, blur), side)
            known *= _outside(inner.across_px, other.across_px, markers.border_px, blur)
    twice = 2 * sign
    by_first, by_second = twice * bright.by_one, 2 * bright.by_two
    turning = 2 * bright.by_rho * _by_angle(first, second)
    by_place: list[Single] = [
        -(by_first * first.normal[:, :1] + by_second * second.normal[:, :1]),
        -(by_first * first.normal[:, 1:] + by_second * second.normal[:, 1:]),
        turning - by_first * first.along_px,
        -turning - by_second * second.along_px,
    ]
    return Shape(twice * bright.value - sign, by_place, twice * bright.by_blur, known)


def crossing_model(shape: Shape, value: Float) -> tuple[Single, Single]:
    """Grey levels (N, P) and their derivatives (N, PARAMETERS, P)."""
    middle, half = value[:, MIDDLE:, None].astype(np.float32).transpose(1, 0, 2)
    jacobian = np.empty((len(value), PARAMETERS, shape.value.shape[1]), np.float32)
    for column, derivative in enumerate([*shape.by_place, shape.by_blur]):
        np.multiply(half, derivative, out=jacobian[:, column])
    jacobian[:, MIDDLE] = 1
    jacobian[:, HALF] = shape.value
    return middle + half * shape.value, jacobian


@dataclass(frozen=True, slots=True)
class _Edge:
    """The N x P pixels seen from one edge."""

    along_px: Single
    across_px: Single
    normal: Single
    """(N, 2)."""


def _edge(offset: Single, value: Float, which: int) -> _Edge:
    place = value.astype(np.float32)
    angle = place[:, which, None]
    x, y = offset[:, 0] - place[:, :1], offset[:, 1] - place[:, 1:2]
    normal = np.concatenate([-np.sin(angle), np.cos(angle)], axis=1)
    across = x * normal[:, :1] + y * normal[:, 1:]
    along = x * normal[:, 1:] - y * normal[:, :1]
    return _Edge(along, across, normal)


def _by_angle(first: _Edge, second: _Edge) -> Single:
    """(N, 1) derivative of the cosine between the normals by the angle of the first edge."""
    (a, b), (c, d) = first.normal.T, second.normal.T
    return (a * d - b * c)[:, None]


@dataclass(frozen=True, slots=True)
class _Rise:
    """A blurred step from 0 to 1 at some distances."""

    across_px: Single
    value: Single
    slope: Single
    """Per px."""


def _rise(across_px: Single, blur_px: Single) -> _Rise:
    """The integral of a Gaussian of sigma `blur_px`.

    To 1.5e-7, what single precision holds: Abramowitz and Stegun, Handbook of Mathematical
    Functions, 1964, 7.1.26. It shares the exponential with the slope, which is what makes it quick.
    """
    scaled = across_px * (np.float32(np.sqrt(0.5)) / blur_px)
    bell = np.exp(-np.minimum(scaled * scaled, np.float32(_FAR)))
    t = 1 / (1 + np.float32(_ERF_SCALE) * np.abs(scaled))
    series = np.float32(_ERF[4]) * t
    for factor in _ERF[3::-1]:
        series += np.float32(factor)
        series *= t
    tail = np.float32(0.5) * series * bell
    value = np.where(scaled > 0, 1 - tail, tail)
    return _Rise(across_px, value, bell * (np.float32(1 / np.sqrt(2 * np.pi)) / blur_px))


@dataclass(frozen=True, slots=True)
class _Light:
    """Light from some quadrants beyond two blurred edges, and its derivatives."""

    value: Single
    by_one: Single
    """By the distance across the first edge, per px."""
    by_two: Single
    by_blur: Single
    by_rho: Single

    def subtract(self, quadrant: "_Light", side: int) -> None:
        """Darken a quadrant, whose distances grow the same way or the other way."""
        np.subtract(self.value, quadrant.value, out=self.value)
        np.subtract(self.by_one, side * quadrant.by_one, out=self.by_one)
        np.subtract(self.by_two, side * quadrant.by_two, out=self.by_two)
        np.subtract(self.by_blur, quadrant.by_blur, out=self.by_blur)
        np.subtract(self.by_rho, quadrant.by_rho, out=self.by_rho)


def _quadrant(one: _Rise, two: _Rise, rho: Single, blur: Single) -> _Light:
    """A blurred quadrant whose edges need not be square to each other.

    It is the bivariate normal integral with the cosine between the edges' normals as correlation,
    here to its second power: W. F. Kibble, "An extension of a theorem of Mehler's on Hermite
    polynomials", Proc. Cambridge Phil. Soc. 41, 1945.
    """
    bells = one.slope * two.slope
    skew, both = rho * bells, rho * one.across_px * two.across_px
    area = blur * blur
    by_one = one.slope * two.value - skew * one.across_px
    by_two = one.value * two.slope - skew * two.across_px
    value = one.value * two.value + skew * (area + 0.5 * both)
    by_blur = -(by_one * one.across_px + by_two * two.across_px) / blur
    return _Light(value, by_one, by_two, by_blur, bells * (area + both))


def _opposite_quadrants(one: _Rise, two: _Rise, rho: Single, blur: Single) -> _Light:
    """A quadrant and the one across the corner together, at the cost of one."""
    bells = 2 * one.slope * two.slope
    skew, both = rho * bells, rho * one.across_px * two.across_px
    area = blur * blur
    wave, other = 2 * one.value - 1, 2 * two.value - 1
    by_one = one.slope * other - skew * one.across_px
    by_two = wave * two.slope - skew * two.across_px
    value = 0.5 * (1 + wave * other) + skew * (area + 0.5 * both)
    by_blur = -(by_one * one.across_px + by_two * two.across_px) / blur
    return _Light(value, by_one, by_two, by_blur, bells * (area + both))


def _outside(one_px: Single, two_px: Single, border_px: Single, blur: Single) -> Single:
    """(N, P) one outside the bits within a marker, falling to zero over a pixel."""
    room = np.float32(0.5) + border_px - np.float32(_KEPT_BLURS) * blur
    return np.clip(np.maximum(room[:, :1] - one_px, room[:, 1:] - two_px), 0, 1)
