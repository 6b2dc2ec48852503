"""The picture of two crossing blurred edges, bare or with a marker in either bright quadrant."""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rig.arrays import Float
from rig.compute.kernel import kernel

PARAMETERS = 7  # x, y, two edge angles, blur, middle grey, half contrast
BLUR, MIDDLE, HALF = 4, 5, 6
"""Columns of the parameters that are no places."""

Edges: TypeAlias = tuple[float, float, float, float, float, float]
"""Normals of the first and the second edge, x and y each, blur, and the sign of the contrast."""
Rise: TypeAlias = tuple[float, float]
"""Value of a blurred step, and its slope per px."""
Light: TypeAlias = tuple[float, float, float, float, float]
"""Light from some quadrants beyond two blurred edges, and its derivatives: by the distances across
the first and the second edge, by the blur (all per px), by the cosine between the normals."""

_FAR = 4.6
"""Widths from an edge beyond which it is not felt: to 2e-6 of its height."""
_PER_WIDTH = 128
"""Entries of the table of steps per width: interpolated between them they are wrong by 2e-6."""
_LAST = int(2 * _FAR * _PER_WIDTH)
_WIDTHS = np.arange(_LAST + 1) / _PER_WIDTH - _FAR
_BELL: Float = np.exp(-0.5 * _WIDTHS * _WIDTHS) / math.sqrt(2 * math.pi)
_STEP: Float = np.array([0.5 + 0.5 * math.erf(width * math.sqrt(0.5)) for width in _WIDTHS])
_KEPT_BLURS = 2.0
"""Widths of the edges kept between pixels that count and the bits within a marker."""


@dataclass(frozen=True, slots=True)
class Markers:
    """Black corners in the bright quadrants of N crossings; what is within them is unknown."""

    margin_px: Float
    """(N, 2) from either edge to the outline of the markers, across that edge."""
    border_px: Float
    """(N, 2) width of the black border within the outline, across either edge."""
    uneven_px: Float
    """(N, 2) by how much more it is on the side where distances grow: perspective."""
    fan: Float
    """(N, 2) growth of the margin along an edge, px per px."""

    def measures(self) -> Float:
        """(N, 8) all four, one after the other."""
        return np.concatenate([self.margin_px, self.border_px, self.uneven_px, self.fan], axis=1)


def crossing_model(
    offset_px: Float, value: Float, markers: Markers | None
) -> tuple[Float, Float, Float]:
    """Return what crossings look like: two bright quadrants, less the corners of markers in them.

    Args:
        offset_px: (P, 2) pixels, from the pixel that `value` counts from.
        value: (N, PARAMETERS).
        markers: in the bright quadrants; None for none.

    Returns:
        Grey levels (N, P), their derivatives (N, PARAMETERS, P), and where the model holds (N, P):
        one, and zero within markers.
    """
    measures = np.empty((0, 8)) if markers is None else markers.measures()
    return _look(np.asarray(offset_px, np.float64), value, np.asarray(measures, np.float64))


@kernel()
def _look(offset_px: Float, value: Float, measures: Float) -> tuple[Float, Float, Float]:
    count, pixels = len(value), len(offset_px)
    grey, known = np.empty((count, pixels)), np.empty((count, pixels))
    jacobian = np.empty((count, PARAMETERS, pixels))
    for n in range(count):
        own = measures[n] if len(measures) else np.zeros(8)
        edges = edges_of(value[n])
        for p in range(pixels):
            x, y = offset_px[p, 0] - value[n, 0], offset_px[p, 1] - value[n, 1]
            form, by_x, by_y, by_first, by_second, by_blur, known[n, p] = crossing_at(
                x, y, edges, own, len(measures) > 0
            )
            half = value[n, HALF]
            grey[n, p] = value[n, MIDDLE] + half * form
            jacobian[n, 0, p], jacobian[n, 1, p] = half * by_x, half * by_y
            jacobian[n, 2, p], jacobian[n, 3, p] = half * by_first, half * by_second
            jacobian[n, 4, p], jacobian[n, 5, p], jacobian[n, 6, p] = half * by_blur, 1.0, form
    return grey, jacobian, known


@kernel()
def edges_of(value: Float) -> Edges:
    """The edges of one crossing, of its (PARAMETERS,)."""
    sign = -1.0 if value[HALF] < 0 else 1.0
    first, second = value[2], value[3]
    return -math.sin(first), math.cos(first), -math.sin(second), math.cos(second), value[BLUR], sign


@kernel()
def crossing_at(
    x_px: float, y_px: float, edges: Edges, measures: Float, has_markers: bool
) -> tuple[float, float, float, float, float, float, float]:
    """Look at one pixel of one crossing whose levels are -1 and 1.

    Args:
        x_px: from the corner.
        y_px: likewise.
        edges: that cross.
        measures: (8,) of its markers, see `Markers`.
        has_markers: whether there are any.

    Returns:
        The level, its derivatives by x, y, the two angles and the blur, and whether the model
        holds there: one, and zero within markers.
    """
    # Seen with this sign, the bright quadrants are those with both distances of one sign.
    n1_x, n1_y, n2_x, n2_y, blur, sign = edges
    along_1, along_2 = x_px * n1_y - y_px * n1_x, x_px * n2_y - y_px * n2_x
    one_px, two_px = x_px * n1_x + y_px * n1_y, sign * (x_px * n2_x + y_px * n2_y)
    rho = sign * (n1_x * n2_x + n1_y * n2_y)
    one, two = _rise(one_px, blur), _rise(two_px, blur)
    light, by_one, by_two, by_blur, by_rho = _opposite_quadrants(
        one_px, two_px, one, two, rho, blur
    )
    known = 1.0
    if has_markers:
        for side in (1.0, -1.0):
            # Distances across the second edge were turned with the sign; so are its two sides.
            a_px = measures[0] + side * measures[4] + measures[6] * along_1
            b_px = measures[1] + side * sign * measures[5] + measures[7] * along_2
            inner_px, other_px = side * one_px - a_px, side * two_px - b_px
            if min(inner_px, other_px) < -_FAR * blur:
                continue
            inner, other = _rise(inner_px, blur), _rise(other_px, blur)
            dark = _quadrant(inner_px, other_px, inner, other, rho, blur)
            light -= dark[0]
            by_one -= side * dark[1]
            by_two -= side * dark[2]
            by_blur -= dark[3]
            by_rho -= dark[4]
            known *= _outside(inner_px, other_px, measures[2], measures[3], blur)
    by_one, by_two = 2 * sign * by_one, 2 * by_two
    turning = 2 * by_rho * (n1_x * n2_y - n1_y * n2_x)
    return (
        2 * sign * light - sign,
        -(by_one * n1_x + by_two * n2_x),
        -(by_one * n1_y + by_two * n2_y),
        turning - by_one * along_1,
        -turning - by_two * along_2,
        2 * sign * by_blur,
        known,
    )


@kernel()
def _rise(across_px: float, blur_px: float) -> Rise:
    """A step from 0 to 1, the integral of a Gaussian of sigma `blur_px`, to 2e-6; by a table."""
    place = (across_px / blur_px + _FAR) * _PER_WIDTH
    if not 0.0 <= place < _LAST:
        return (1.0 if across_px > 0 else 0.0), 0.0
    before = int(place)
    part = place - before
    value = _STEP[before] + part * (_STEP[before + 1] - _STEP[before])
    slope = _BELL[before] + part * (_BELL[before + 1] - _BELL[before])
    return value, slope / blur_px


@kernel()
def _quadrant(one_px: float, two_px: float, one: Rise, two: Rise, rho: float, blur: float) -> Light:
    """A blurred quadrant whose edges need not be square to each other.

    It is the bivariate normal integral with the cosine between the edges' normals as correlation,
    here to its second power: W. F. Kibble, "An extension of a theorem of Mehler's on Hermite
    polynomials", Proc. Cambridge Phil. Soc. 41, 1945.
    """
    bells = one[1] * two[1]
    skew, both = rho * bells, rho * one_px * two_px
    area = blur * blur
    by_one = one[1] * two[0] - skew * one_px
    by_two = one[0] * two[1] - skew * two_px
    value = one[0] * two[0] + skew * (area + 0.5 * both)
    by_blur = -(by_one * one_px + by_two * two_px) / blur
    return value, by_one, by_two, by_blur, bells * (area + both)


@kernel()
def _opposite_quadrants(
    one_px: float, two_px: float, one: Rise, two: Rise, rho: float, blur: float
) -> Light:
    """A quadrant and the one across the corner together, at the cost of one."""
    bells = 2 * one[1] * two[1]
    skew, both = rho * bells, rho * one_px * two_px
    area = blur * blur
    wave, other = 2 * one[0] - 1, 2 * two[0] - 1
    by_one = one[1] * other - skew * one_px
    by_two = wave * two[1] - skew * two_px
    value = 0.5 * (1 + wave * other) + skew * (area + 0.5 * both)
    by_blur = -(by_one * one_px + by_two * two_px) / blur
    return value, by_one, by_two, by_blur, bells * (area + both)


@kernel()
def _outside(
    one_px: float, two_px: float, one_border_px: float, two_border_px: float, blur: float
) -> float:
    """One outside the bits within a marker, falling to zero over a pixel."""
    room = 0.5 - _KEPT_BLURS * blur
    clear = max(room + one_border_px - one_px, room + two_border_px - two_px)
    return min(max(clear, 0.0), 1.0)
