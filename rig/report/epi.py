"""Epipolar-plane images of a board: one line of every view, and the slopes of its edges."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.epipolar import Label, SlopePrior, estimate_slopes
from rig.report.evidence import Picture

PRIOR_SIGMA_PX = 0.1
"""Room around the board's plane for the dense estimator."""
EDGE_SHARE = 0.25
"""An edge is where the grey value changes by this part of the largest change."""
SMOOTHING_PX = 1.0
NEIGHBOURS_PX = 5
"""Around an edge beside the board."""
OUTER_SHARE = 0.35
"""Part of a square around the fitted outline that still belongs to the board: its outer edges."""
MARGIN = 0.15
"""Shown on either side of the board, as a part of its width."""
NEAR_AXIS = 0.1
"""Part of its distance from the reference that a view of the row may lie beside the row."""


@dataclass(frozen=True, slots=True)
class EdgeLine:
    """The line that an edge draws through the views: u = at_px - slope_px * step."""

    at_px: float
    slope_px: float
    label: Label


@dataclass(frozen=True, slots=True)
class Epi:
    """One row of every view of the H row, or one column of every view of the V column."""

    kind: Literal["H", "V"]
    line_px: int
    """Which row or column of the images."""
    steps: tuple[float, ...]
    """(N,) positions of the views, rising."""
    grey: NDArray[np.float32]
    """(N, L) the pixels."""
    first_px: int
    """Place of the first of the L pixels."""
    edges: tuple[EdgeLine, ...]


@dataclass(frozen=True, slots=True)
class _Scene:
    """What the views of one row show; a column is turned into a row first."""

    images: NDArray[np.float32]
    """(N, H, W)"""
    steps: NDArray[np.float64]
    """(N,)"""
    slope_px: NDArray[np.float32]
    """(H, W) of the reference view, NaN unknown."""
    label: NDArray[np.uint8]
    inside: NDArray[np.bool_]
    """(H, W) where the board is."""
    row: float
    """Of the centre of the board."""


def board_epis(range_px: tuple[float, float], picture: Picture) -> tuple[Epi, ...]:
    """Return the H and the V epipolar-plane image through the middle of a board.

    On the board slopes come from the plane that was fitted to it, beside it from the dense
    estimator, which also labels occlusions. An image of one view only is left out.

    Args:
        range_px: slopes that are searched beside the board.
        picture: of the board.
    """
    views = picture.views
    inside, plane_px = _board(picture, views.shape)
    hypothesis_px = np.where(inside, plane_px, np.nan).astype(np.float32)
    prior = SlopePrior(hypothesis_px, np.full(views.shape, PRIOR_SIGMA_PX, np.float32))
    dense = estimate_slopes(views, range_px, prior)
    slope_px = np.where(inside, plane_px, dense.slope_px).astype(np.float32)
    sign = np.where(slope_px > 0, Label.NEARER, Label.BEYOND)
    label = np.where(dense.label == Label.OCCLUSION, Label.OCCLUSION, sign).astype(np.uint8)

    images = views.images.astype(np.float32)
    x, y = views.x_steps, views.y_steps
    room = NEAR_AXIS * np.hypot(x, y)
    in_row, in_column = np.abs(y) <= room, np.abs(x) <= room
    across, down = picture.centre_px
    row = _Scene(images[in_row], x[in_row], slope_px, label, inside, down)
    column = _Scene(
        images[in_column].transpose(0, 2, 1), y[in_column], slope_px.T, label.T, inside.T, across
    )
    kinds: tuple[tuple[Literal["H", "V"], _Scene], ...] = (("H", row), ("V", column))
    return tuple(_epi(kind, scene) for kind, scene in kinds if scene.steps.size > 1)


def _board(
    picture: Picture, shape: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Where the board is, and its slope plane everywhere: (H, W) each."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(mask, np.round(picture.outline_px).astype(np.int32), 1)
    side = 2 * round(OUTER_SHARE * picture.square_px) + 1
    mask = cv2.dilate(mask, np.ones((side, side), np.uint8))
    v, u = np.indices(shape)
    a, b, c = picture.plane
    return mask > 0, a + b * (u - picture.centre_px[0]) + c * (v - picture.centre_px[1])


def _epi(kind: Literal["H", "V"], scene: _Scene) -> Epi:
    order = np.argsort(scene.steps)
    reference = scene.images[int(np.argmin(np.abs(scene.steps)))]
    line = _clearest_row(reference, scene)
    first, last = _span(scene, line)
    edges = [
        _edge_line(scene, line, pixel, at_px)
        for pixel, at_px in _edges(reference[line], first, last)
    ]
    return Epi(
        kind,
        line,
        tuple(scene.steps[order].tolist()),
        scene.images[order, line, first:last],
        first,
        tuple(edge for edge in edges if edge is not None),
    )


def _edge_line(scene: _Scene, line: int, pixel: int, at_px: float) -> EdgeLine | None:
    """Slope and label of one edge; None where the dense estimator has no answer.

    Beside the board an edge may separate two surfaces: it moves with the nearer one, whose slope is
    the larger.
    """
    if scene.inside[line, pixel]:
        around = slice(pixel, pixel + 1)
    else:
        around = slice(max(0, pixel - NEIGHBOURS_PX), pixel + NEIGHBOURS_PX + 1)
    slopes_px, labels = scene.slope_px[line, around], scene.label[line, around]
    known = np.isfinite(slopes_px)
    if not known.any():
        return None
    nearest = int(np.argmax(np.where(known, slopes_px, -np.inf)))
    is_occlusion = bool(np.any(labels == Label.OCCLUSION))
    label = Label.OCCLUSION if is_occlusion else Label(int(labels[nearest]))
    return EdgeLine(at_px, float(slopes_px[nearest]), label)


def _clearest_row(reference: NDArray[np.float32], scene: _Scene) -> int:
    """A row near the middle of the board that crosses edges, instead of running along one.

    Squares alternate, so rows with much contrast along them lie within half a square of any row;
    the nearest that has nearly as much as the best one is taken.
    """
    rows = np.flatnonzero(scene.inside.any(axis=1))
    rows = rows[np.abs(rows - scene.row) <= 0.1 * rows.size]
    contrast = np.array(
        [np.abs(np.diff(reference[row]))[scene.inside[row, 1:]].sum() for row in rows]
    )
    good = rows[contrast >= 0.9 * contrast.max()]
    return int(good[np.argmin(np.abs(good - scene.row))])


def _span(scene: _Scene, line: int) -> tuple[int, int]:
    """First and last pixel to show: the board, a margin, and its shift through the views."""
    columns = np.flatnonzero(scene.inside[line])
    shift_px = float(np.abs(scene.slope_px[line, columns]).max() * np.abs(scene.steps).max())
    margin_px = round(MARGIN * columns.size + shift_px)
    width = scene.inside.shape[1]
    return max(0, int(columns[0]) - margin_px), min(width, int(columns[-1]) + margin_px + 1)


def _edges(grey: NDArray[np.float32], first: int, last: int) -> list[tuple[int, float]]:
    """Edges between two pixels: the nearest pixel and the sub-pixel place of each."""
    smooth = cv2.GaussianBlur(grey[None], (0, 0), SMOOTHING_PX)[0].astype(np.float64)
    change = np.abs(np.gradient(smooth))
    floor = EDGE_SHARE * float(change[first:last].max())
    found: list[tuple[int, float]] = []
    for i in range(max(first, 1), min(last, change.size - 1)):
        before, here, after = change[i - 1 : i + 2].tolist()
        if here >= floor and here > before and here >= after:
            # Vertex of the parabola through three samples.
            offset = 0.5 * (before - after) / (before - 2.0 * here + after)
            found.append((i, i + offset))
    return found
