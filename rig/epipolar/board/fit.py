"""The joint line fit: one slope plane for all edge pixels of a board and all views."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from rig.arrays import Float
from rig.epipolar.board.corner_tracks import CornerPlane, corner_epipolar_error, fit_corner_tracks
from rig.epipolar.board.light import LightField
from rig.epipolar.board.lines import BoardLines, BoardViews, Paths
from rig.epipolar.board.misalignment import (
    across_px,
    fit_misalignment,
    is_misaligned,
    rows_met,
)
from rig.epipolar.board.sigma import Scores, asymmetry_px, plane_covariance
from rig.epipolar.board.slope import BoardSlope
from rig.epipolar.spline import Coefficients, spline_coefficients
from rig.errors import SlopeError, TargetError
from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.targets.corners import Corners

SMOOTH_PX = 0.6
"""Gaussian before the fit. Splines need some; every bit more than that costs information."""
_MORE_BLUR_PX = (1.0, 1.5)
"""Gaussians that show how values and gradients change with blur. Splines of sharper pictures move
edges to one side, most at a quarter of a pixel, by thousandths."""
_BORDER_PX = 5.0
"""Blur and smoothing carry the background this far into the outermost squares."""
_STEPS = 10
_SETTLED_PX = 1e-7


def fit_board_slope(
    views: BoardViews, corners: Sequence[Corners | TargetError | None]
) -> BoardSlope:
    """Measure the slope plane of a board by maximum likelihood over all its edge pixels.

    The tracks of the corners give an unambiguous start. From there Gauss-Newton minimises
    `sum (I_v(u - m x_v, v - m y_v) - T(u, v))^2` over the plane m(u, v), with the unknown texture
    T eliminated as the mean over views, so that no single view's noise counts twice, and with a
    smooth gain and offset of every view fitted along. Views that are not rectified leave their
    lines by a smooth field that their corners tell; it is taken along, and its part across the
    lines has no share in the slope. Pictures of calibrated
    cameras are sampled where the calibration says, themselves and not a resampled copy.
    Deterministic to the last bit.

    Args:
        views: Rectified views, or raw ones with a calibration; the board stands still in them.
        corners: Per view the corners of one board in its own picture, or why there are none; those
            views are left out.

    Raises:
        TargetError: fewer than two views with corners, or none in the reference view.
        SlopeError: too few edges in common, or the fit leaves its start.
    """
    used, found = _usable(views, corners)
    x_steps, y_steps = views.x_steps[used], views.y_steps[used]
    reference = used.index(views.reference)
    board = found[reference]
    common = views.common_px({v: corner.xy_px for v, corner in zip(used, found, strict=True)})
    xy_px = _one_way_up([common[view] for view in used], reference)
    centre_px, outline_px = _outline(xy_px[reference], board.side_px)
    tracks = fit_corner_tracks(xy_px, x_steps, y_steps, reference, centre_px)
    residual_px = tracks.residual_px
    corner_sigma_px = float(np.median([np.median(corner.sigma_px) for corner in found]))
    if is_misaligned(residual_px, corner_sigma_px):
        met = rows_met(xy_px, x_steps, y_steps, reference, centre_px)
        tracks = fit_corner_tracks(met, x_steps, y_steps, reference, centre_px)
    misalignment = fit_misalignment(
        xy_px,
        x_steps,
        y_steps,
        reference,
        tracks.plane,
        centre_px,
        residual_px=residual_px,
        corner_sigma_px=corner_sigma_px,
    )
    coefficients = _filled_up([spline_coefficients(views.images[v], SMOOTH_PX) for v in used])
    lines = BoardLines(views, used, coefficients, centre_px, misalignment)
    paths = lines.edges(outline_px, tracks.plane, reference)
    fit = _gauss_newton(lines, paths)
    # A checkerboard repeats along its diagonals, after sqrt(2) squares.
    longest = float(np.hypot(x_steps, y_steps).max())
    period_px = float(np.sqrt(2)) * board.side_px / longest
    _stays_at_start(fit, tracks, period_px)
    covariance, beside_px = _certainty(lines, paths, fit, board.side_px)
    a, b, c = (float(number) for number in fit.plane)
    return BoardSlope(
        slope_px=a,
        sigma_px=float(np.sqrt(covariance[0, 0])),
        plane=(a, b, c),
        plane_covariance=covariance,
        centre_px=(float(centre_px[0]), float(centre_px[1])),
        corner_slope_px=float(tracks.plane[0]),
        corner_sigma_px=float(np.hypot(tracks.sigma_px, beside_px)),
        track_residual_px=residual_px,
        epipolar=corner_epipolar_error(xy_px, x_steps, y_steps, reference),
        corners_px=xy_px[reference],
        across_px=across_px(xy_px, x_steps, y_steps, reference),
        residual=float(np.sqrt(np.mean(fit.look.scores.residual**2))),
        edge_pixels=paths.pixels.shape[1],
        side_px=board.side_px,
        period_px=period_px,
        outline_px=outline_px,
        views=tuple(used),
        gains=tuple(float(gain) for gain in fit.look.gains),
        asymmetry_px=beside_px,
    )


def _usable(
    views: BoardViews, corners: Sequence[Corners | TargetError | None]
) -> tuple[list[int], list[Corners]]:
    if len(corners) != len(views.images):
        raise TargetError(
            f"corners of {len(corners)} views given for {len(views.images)} views",
            advice="give one entry per view",
            reason="not-found",
        )
    used = [view for view, found in enumerate(corners) if isinstance(found, Corners)]
    if views.reference not in used or len(used) < 2:
        missing = [view for view in range(len(corners)) if view not in used]
        blamed = views.reference if views.reference not in used else missing[0]
        why = corners[blamed]
        cause = why if isinstance(why, TargetError) else "no corners found"
        raise TargetError(
            f"board needed in the reference view {views.reference} and one more, found in "
            f"{len(used)} of {len(corners)}",
            advice=f"view {blamed}: {cause}",
            reason=why.reason if isinstance(why, TargetError) else "not-found",
        )
    found = [corner for corner in corners if isinstance(corner, Corners)]
    if len({corner.xy_px.shape for corner in found}) > 1:
        raise TargetError(
            "the views show boards of different counts",
            advice="look for one board in all views",
            reason="wrong-count",
        )
    return used, found


def _one_way_up(xy_px: Sequence[Float], reference: int) -> list[Float]:
    """Corners (rows, columns, 2) of all views, numbered from the same end of the board.

    In the common frame all views see the board the same way up. A board that looks the same after
    half a turn is numbered from the top of each picture, and a camera may stand upside down.
    """
    here = xy_px[reference]
    along = here[-1, -1] - here[0, 0]
    return [xy[::-1, ::-1] if (xy[-1, -1] - xy[0, 0]) @ along < 0.0 else xy for xy in xy_px]


def _filled_up(pictures: Sequence[Coefficients]) -> Coefficients:
    """(V, H, W) pictures of any size, the smaller ones continued by their last pixels."""
    height, width = np.max([picture.shape for picture in pictures], axis=0).tolist()
    return np.stack(
        [
            np.pad(picture, ((0, height - picture.shape[0]), (0, width - picture.shape[1])), "edge")
            for picture in pictures
        ]
    )


def _outline(xy_px: Float, side_px: float) -> tuple[Float, Float]:
    """Image of the board's centre, and the polygon that only the board's own edges cross."""
    rows, columns = xy_px.shape[:2]
    places = grid_places(rows, columns).reshape(-1, 2)
    homography = fit_homography(places, xy_px.reshape(-1, 2))
    out = max(0.0, 1 - _BORDER_PX / side_px)
    right, bottom = columns - 1 + out, rows - 1 + out
    outline = np.array([[-out, -out], [right, -out], [right, bottom], [-out, bottom]])
    centre = np.array([(columns - 1) / 2, (rows - 1) / 2])
    return map_points(homography, centre), map_points(homography, outline)


@dataclass(frozen=True, slots=True)
class _Look:
    """The views along the lines of one plane."""

    scores: Scores
    texture: Float
    """(N,) mean over the views."""
    gradient: Float
    """(2, N) of the same."""
    gains: Float


@dataclass(frozen=True, slots=True)
class _Fit:
    plane: Float
    light: LightField
    look: _Look


def _gauss_newton(lines: BoardLines, paths: Paths) -> _Fit:
    plane = paths.plane.copy()
    light = LightField.over(paths.pixels, lines.centre_px)
    reach = np.abs(lines.design(paths.pixels)).max(axis=1)
    change = np.full(3, np.inf)
    for _ in range(_STEPS):
        look = _look(lines, paths, plane, light, SMOOTH_PX)
        scores = look.scores
        normal = scores.normal / np.outer(reach, reach)
        score = scores.design @ (scores.rate * scores.residual).sum(axis=0)
        change = np.linalg.solve(normal, score / reach) / reach
        plane = plane - change
        if float(np.abs(change * reach).sum()) < _SETTLED_PX:
            break
    else:
        raise SlopeError(
            f"line fit of the board still moves by {np.abs(change * reach).sum():.1e} px after "
            f"{_STEPS} steps",
            advice="look for motion, glare or a bent board",
        )
    return _Fit(plane, light, look)


def _look(
    lines: BoardLines, paths: Paths, plane: Float, light: LightField, smooth_px: float
) -> _Look:
    design, steps = lines.design(paths.pixels), lines.steps()
    value, gradient = lines.sample(paths, plane)
    level, gains = light.levelled(value, gradient, smooth_px)
    # d value / d slope of each view, about the mean over views.
    rate = -(steps @ gradient)
    normal = (design * (rate**2).sum(axis=0)) @ design.T
    scores = Scores(paths.pixels, design, rate, level - level.mean(axis=0), normal)
    return _Look(scores, value.mean(axis=0), gradient, gains)


def _certainty(lines: BoardLines, paths: Paths, fit: _Fit, side_px: float) -> tuple[Float, float]:
    """Covariance of the plane, and by how much the lenses' asymmetry may move the slope."""
    smoother, smoothest = (
        _look(_blurred(lines, blur_px), paths, fit.plane, fit.light, blur_px)
        for blur_px in _MORE_BLUR_PX
    )
    # More or less blur in a view is even about an edge and pulls no slope; left in the residuals it
    # would look like noise.
    scores, change = fit.look.scores, smoother.texture - fit.look.texture
    blur = scores.residual @ change / (change @ change)
    noise = replace(scores, residual=scores.residual - blur[:, None] * change)
    bend = smoothest.gradient - smoother.gradient
    beside_px = asymmetry_px(noise, smoother.scores, bend, side_px)
    covariance = plane_covariance(noise, side_px)
    covariance[0, 0] += beside_px**2
    return covariance, beside_px


def _blurred(lines: BoardLines, blur_px: float) -> BoardLines:
    """The views smoothed by `blur_px` instead; what is linear in pictures is so in splines."""
    more_px = float(np.sqrt(blur_px**2 - SMOOTH_PX**2))
    coefficients = np.stack([cv2.GaussianBlur(c, (0, 0), more_px) for c in lines.coefficients])
    return replace(lines, coefficients=coefficients)


def _stays_at_start(fit: _Fit, tracks: CornerPlane, period_px: float) -> None:
    """Refuse a fit that has left the period of the board in which the corners put it."""
    moved = abs(float(fit.plane[0] - tracks.plane[0]))
    if not moved < period_px / 4:
        raise SlopeError(
            f"line fit of the board moved {moved:.3f} px per step from its corners, more than a "
            f"quarter of the board's period of {period_px:.3f} px",
            advice="look for motion or glare",
        )
