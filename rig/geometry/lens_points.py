"""The lens models of `rig.geometry.lens`, compiled: one point at a time, and stacks of points."""

import math

import numpy as np

from rig.arrays import Float
from rig.compute.kernel import kernel

MOST_COEFFICIENTS = 8
"""Of any model; shorter ones are filled up with zeros."""
_SMALL_RADIUS = 1e-8


@kernel()
def brown_at(
    k: Float, tan_x: float, tan_y: float
) -> tuple[float, float, float, float, float, float, float]:
    """Brown's lens with 8 coefficients at one ideal point.

    Returns:
        Distorted x and y; derivatives of x by x, of both by the other, of y by y; the radial factor
        and its denominator.
    """
    x, y = tan_x, tan_y
    r2 = x * x + y * y
    above = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
    below = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]))
    radial = above / below
    # d radial / d r2, then d r2 / dx = 2 x.
    slope = k[0] + r2 * (2.0 * k[1] + 3.0 * k[4] * r2)
    slope = (slope - radial * (k[5] + r2 * (2.0 * k[6] + 3.0 * k[7] * r2))) / below
    return (
        x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
        y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y,
        radial + 2.0 * x * x * slope + 2.0 * k[2] * y + 6.0 * k[3] * x,
        2.0 * x * y * slope + 2.0 * k[2] * x + 2.0 * k[3] * y,
        radial + 2.0 * y * y * slope + 6.0 * k[2] * y + 2.0 * k[3] * x,
        radial,
        below,
    )


@kernel()
def brown_by_lens(
    tan_x: float, tan_y: float, radial: float, below: float, by_x: Float, by_y: Float
) -> None:
    """Write derivatives (K,) of the distorted x and y by 0, 5 or 8 coefficients."""
    count = by_x.size
    if count == 0:
        return
    x, y = tan_x, tan_y
    r2 = x * x + y * y
    power = r2 / below
    by_x[0], by_y[0] = x * power, y * power
    by_x[1], by_y[1] = x * r2 * power, y * r2 * power
    by_x[2], by_y[2] = 2.0 * x * y, r2 + 2.0 * y * y
    by_x[3], by_y[3] = r2 + 2.0 * x * x, 2.0 * x * y
    by_x[4], by_y[4] = x * r2 * r2 * power, y * r2 * r2 * power
    for column in range(5, count):
        change = -radial * power
        by_x[column], by_y[column] = x * change, y * change
        power *= r2


@kernel()
def fisheye_at(
    k: Float, tan_x: float, tan_y: float
) -> tuple[float, float, float, float, float, float, float]:
    """Kannala and Brandt's lens with 4 coefficients at one ideal point.

    Returns:
        Distorted x and y; derivatives of x by x, of both by the other, of y by y; the angle from
        the axis (rad) and what turns the point into its direction.
    """
    x, y = tan_x, tan_y
    r = math.sqrt(x * x + y * y)
    angle = math.atan(r)
    a2 = angle * angle
    scale, change, inverse = 1.0, 0.0, 1.0
    if not r < _SMALL_RADIUS:  # what is no number stays so
        inverse = 1.0 / r
        bent = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))))
        by_angle = 1.0 + a2 * (3.0 * k[0] + a2 * (5.0 * k[1] + a2 * (7.0 * k[2] + 9.0 * k[3] * a2)))
        scale = bent * inverse
        # d scale / d r, divided by r: multiplies x * x and so on.
        change = (by_angle / (1.0 + r * r) - scale) * inverse * inverse
    return (
        x * scale,
        y * scale,
        scale + x * x * change,
        x * y * change,
        scale + y * y * change,
        angle,
        inverse,
    )


@kernel()
def fisheye_by_lens(
    tan_x: float, tan_y: float, angle_rad: float, inverse: float, by_x: Float, by_y: Float
) -> None:
    """Write derivatives (4,) of the distorted x and y by the coefficients."""
    power = angle_rad * inverse
    for column in range(by_x.size):
        power *= angle_rad * angle_rad
        by_x[column], by_y[column] = tan_x * power, tan_y * power


@kernel()
def bend_points(
    is_fisheye: bool, k: Float, xy: Float, bent: Float, by_xy: Float, by_k: Float
) -> None:
    """Distort N points.

    Args:
        is_fisheye: the model; Brown's otherwise.
        k: (8,).
        xy: (N, 2) ideal.
        bent: (N, 2), written.
        by_xy: (N, 2, 2), written.
        by_k: (N, 2, K), written.
    """
    for n in range(len(xy)):
        x, y = xy[n]
        if is_fisheye:
            u, v, xx, both, yy, one, other = fisheye_at(k, x, y)
            fisheye_by_lens(x, y, one, other, by_k[n, 0], by_k[n, 1])
        else:
            u, v, xx, both, yy, one, other = brown_at(k, x, y)
            brown_by_lens(x, y, one, other, by_k[n, 0], by_k[n, 1])
        bent[n, 0], bent[n, 1] = u, v
        by_xy[n, 0, 0], by_xy[n, 1, 1] = xx, yy
        by_xy[n, 0, 1] = by_xy[n, 1, 0] = both


def filled_up(coefficients: Float) -> Float:
    """(8,) coefficients, as the compiled models take them."""
    full = np.zeros(MOST_COEFFICIENTS)
    full[: len(coefficients)] = coefficients
    return full
