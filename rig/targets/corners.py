"""Find the inner corners of a checkerboard, or say why they cannot be found.

The work is bounded by structure, so a black, noisy or adversarial picture costs no more than a
few passes over it: at most `MAX_SADDLES` points per resolution, three resolutions, one walk over
their links, a fixed number of steps per corner.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import TargetError
from rig.targets.candidates import candidates
from rig.targets.checkerboard import Checkerboard
from rig.targets.checkerboard_diagnosis import at_border, why_not
from rig.targets.corner_fit import CrossingFit, fit_crossings
from rig.targets.lattice import RING_PX, Lattice, cut_to_size, plain_lattices
from rig.targets.measurable import check_measurable
from rig.targets.outline import ended_sides, goes_on
from rig.targets.placing import black_first, certain_place, completed, turns
from rig.targets.pyramid import Image, at_level, from_level, pyramid
from rig.targets.smooth_lines import smooth_triples

_LEVELS = 3
_SHARP_PX, _BLURRED_PX = 1.0, 2.5
"""Blur of the picture in which corners are measured best, where there is a finer or coarser one."""
_MIN_FOUND = 0.85
"""Share of the corners that must be seen before the missing ones are looked for."""
_FEWEST_SHARE = 0.4
"""Of the corners, that a part must have."""
_LEAST_CONTRAST = 0.35
"""Of the median: a corner of a part with less is glare, or of something else."""
_MOST_SIGMAS = 6.0
"""Sigma of a corner of a part, in medians: fitted to something else."""
_LARGEST_SIGMA_PX = 0.3
"""And of any corner that is so many medians off: no edges cross there, in shadow or not."""
_MAX_BEND = 0.3
"""Change of step along a row or column, in steps, above which a corner is not of the board; where a
lens bends the line, change of that change."""


@dataclass(frozen=True, slots=True)
class Corners:
    """The inner corners of one board in one picture."""

    board: Checkerboard
    xy_px: Float
    """(rows, columns, 2), px; corner (0, 0) touches the black corner square of the board.

    NaN where `find_board` did not see one.
    """
    sigma_px: Float
    """(rows, columns), 1 sigma per coordinate; NaN likewise."""
    blur_px: float
    """Median sigma of the edges, pixel area included."""
    contrast: float
    """Median difference of white and black, grey levels of the picture."""

    @property
    def count(self) -> int:
        """How many were found."""
        return int(np.isfinite(self.xy_px[..., 0]).sum())

    @property
    def side_px(self) -> float:
        """Median side of a square, px."""
        return Lattice(self.xy_px, self.xy_px).side_px


def find_corners(image: Image, board: Checkerboard) -> Corners:
    """Find all inner corners of a board to sub-pixel precision.

    The order is the same in every view: rows and columns run right-handed as on
    `Checkerboard.points_mm`, and the square outside corner (0, 0) is black. Where the colours leave
    a choice (rows and columns both even or both odd), corner (0, 0) is the one nearest the top left
    of the image; a board turned past that point changes its order.

    Args:
        image: (H, W) grey; float32 in 8-bit grey levels.
        board: The board to look for; all of it must be visible.

    Raises:
        TargetError: the board is not there as asked for; `reason` is one of wrong-count, blurred,
            too-small, clipped, which-part, over-exposed, under-exposed, not-found.
    """
    corners = find_board(image, board)
    found = np.isfinite(corners.xy_px[..., 0])
    if found.all():
        return corners
    borders = at_border(completed(corners.xy_px)[~found], image.shape)
    where = f" up to the {' and '.join(borders)} border of the picture" if borders else ""
    raise TargetError(
        f"all inner corners of a {board} board asked for, found {corners.count} of "
        f"{found.size}{where}",
        advice="move the board until all of it is in view"
        if borders
        else "uncover the board, and avoid glare and bending",
        reason="clipped",
    )


def find_board(image: Image, board: Checkerboard) -> Corners:
    """Find the inner corners of a board that can be seen, where it is certain which they are.

    All of them, or a part that is as long as the board one way and reaches an end of it the other
    way; the rest is NaN. The order is that of `find_corners`.

    Args:
        image: (H, W) grey; float32 in 8-bit grey levels.
        board: The board to look for.

    Raises:
        TargetError: as `find_corners`; clipped only where too little is seen.
    """
    if image.ndim != 2 or min(image.shape) < 16 or not _is_finite(image):
        raise TargetError(
            f"{board} board asked for in an array of shape {image.shape}",
            advice="give a grey picture (H, W) of at least 16 x 16 finite pixels",
            reason="not-found",
        )
    pictures = pyramid(image, _LEVELS)
    seen: list[tuple[int, Lattice]] = []
    for level, lattice in candidates(pictures, RING_PX, plain_lattices):
        corners = _fit(pictures, level, lattice, board)
        if corners is not None:
            return _checked(corners)
        seen.append((level, lattice))
    parts = [part for level, lattice in seen for part in _fit_part(pictures, level, lattice, board)]
    if parts:
        return _checked(max(parts, key=lambda part: part.count))
    raise why_not(image, board, [lattice for _, lattice in seen])


def _is_finite(image: Image) -> bool:
    return image.dtype.kind != "f" or bool(np.isfinite(image).all())


def corner_motion_px(first: Corners, last: Corners) -> float:
    """Root mean square distance that the corners moved between two pictures of one view, px.

    Raises:
        TargetError: the two pictures are of different boards.
    """
    if first.xy_px.shape != last.xy_px.shape:
        raise TargetError(
            f"motion asked for between boards of {first.board} and {last.board} inner corners",
            advice="compare pictures of one board",
            reason="wrong-count",
        )
    moved = np.linalg.norm(last.xy_px - first.xy_px, axis=-1)
    return float(np.sqrt(np.mean(moved**2)))


def _fit(
    pictures: list[NDArray[np.float32]], level: int, lattice: Lattice, board: Checkerboard
) -> Corners | None:
    """All corners in the picture that suits their blur; None if it is not all of that board."""
    turned = _oriented(lattice, board)
    if turned is None or turned.found.mean() < _MIN_FOUND:
        return None
    xy_px = completed(turned.xy_px)
    if goes_on(pictures[level], Lattice(at_level(xy_px, level), turned.bright)):
        return None
    whole = np.ones(turned.shape, np.bool_)
    # Most pictures are sharp enough for the next finer one.
    for start in sorted({max(level - 1, 0), level}):
        corners = _measured(pictures, start, xy_px, whole, board)
        if corners is not None:
            return corners
    return None


def _fit_part(
    pictures: list[NDArray[np.float32]], level: int, lattice: Lattice, board: Checkerboard
) -> Iterator[Corners]:
    """The corners of a lattice where it is certain which they are, fitted from either level."""
    there = Lattice(at_level(lattice.xy_px, level), lattice.bright)
    if goes_on(pictures[level], there):
        return
    place = certain_place(lattice, board, ended_sides(pictures[level], there))
    if place is None:
        return
    xy_px = place.on_board(board)
    for start in sorted({max(level - 1, 0), level}):
        found = np.isfinite(xy_px[..., 0])
        corners = _measured(pictures, start, completed(xy_px), found, board)
        if corners is not None:
            yield corners


def _measured(
    pictures: list[NDArray[np.float32]],
    level: int,
    xy_px: Float,
    wanted: NDArray[np.bool_],
    board: Checkerboard,
) -> Corners | None:
    """Corners from starts (rows, columns, 2); None if they are not those of a board."""
    measured: Corners | None = None
    tried: set[int] = set()
    while level not in tried:
        fit = _crossings(pictures[level], at_level(xy_px, level), wanted)
        kept = _on_board(fit, wanted)
        if kept is None:
            return None
        tried.add(level)
        fit, wanted = fit.part(kept[wanted]), kept
        xy_px = xy_px.copy()
        xy_px[wanted] = from_level(fit.xy_px, level)
        measured = _corners(board, xy_px, wanted, fit, 2**level)
        level = _suiting(measured.blur_px / 2**level, level, len(pictures))
    return measured


def _corners(
    board: Checkerboard, xy_px: Float, found: NDArray[np.bool_], fit: CrossingFit, scale: int
) -> Corners:
    """Corners where they are found, from a fit in px of so many."""
    sigma_px = np.full(found.shape, np.nan)
    sigma_px[found] = fit.sigma_px * scale
    return Corners(
        board,
        np.where(found[..., None], xy_px, np.nan),
        sigma_px,
        float(np.median(fit.blur_px)) * scale,
        float(np.median(np.abs(fit.contrast))),
    )


def _suiting(blur_px: float, level: int, levels: int) -> int:
    """The next finer or coarser picture where edges are too sharp or too blurred for this one."""
    if blur_px < _SHARP_PX:
        return max(level - 1, 0)
    return min(level + 1, levels - 1) if blur_px > _BLURRED_PX else level


def _oriented(lattice: Lattice, board: Checkerboard) -> Lattice | None:
    """Cut to the board's size and turned to its order; None if the counts differ."""
    choices: list[tuple[float, Lattice]] = []
    for turned in turns(lattice):
        turned = cut_to_size(turned, (board.rows, board.columns), _MIN_FOUND)
        if turned is not None and black_first(turned):
            choices.append((float(np.nan_to_num(turned.xy_px[0, 0]).sum()), turned))
    return min(choices, key=lambda choice: choice[0])[1] if choices else None


def _crossings(
    picture: NDArray[np.float32], start: Float, wanted: NDArray[np.bool_]
) -> CrossingFit:
    """Fit N corners where they are wanted of starts (rows, columns, 2)."""
    down, right = np.gradient(start, axis=0)[wanted], np.gradient(start, axis=1)[wanted]
    area = np.abs(down[:, 0] * right[:, 1] - down[:, 1] * right[:, 0])
    axes = np.stack([right, down], axis=1)
    length = np.linalg.norm(axes, axis=2)
    clear_px = area / length.max(axis=1)
    return fit_crossings(picture, start[wanted], axes / length[..., None], clear_px)


def _on_board(fit: CrossingFit, wanted: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """(rows, columns) where a corner is: colours in turn, rows and columns smooth.

    Of a whole board all are there, or it is none; of a part those that fit the others.
    """
    fitted = np.isfinite(fit.xy_px[:, 0]) & np.isfinite(fit.sigma_px)
    if not fitted.any():
        return None
    row, column = np.nonzero(wanted)
    signed = fit.contrast * np.where((row + column) % 2, -1, 1)
    usual = float(np.median(signed[fitted]))
    unlike = fit.sigma_px >= _MOST_SIGMAS * np.median(fit.sigma_px[fitted])
    good = fitted & (signed * np.sign(usual) > 0)
    good &= ~(unlike & (fit.sigma_px > _LARGEST_SIGMA_PX))
    if not wanted.all():
        good &= signed * np.sign(usual) > _LEAST_CONTRAST * abs(usual)
        good &= ~unlike
    kept = wanted.copy()
    kept[wanted] = good
    xy_px = np.full((*wanted.shape, 2), np.nan)
    xy_px[kept] = fit.xy_px[good]
    lines = (xy_px, xy_px.transpose(1, 0, 2))
    is_smooth = all(smooth_triples(points, _MAX_BEND).all() for points in lines)
    enough = good.all() if wanted.all() else good.sum() >= _FEWEST_SHARE * wanted.size
    return kept if enough and is_smooth else None


def _checked(corners: Corners) -> Corners:
    """Refuse a board that is there but too small or too blurred to measure."""
    check_measurable(f"{corners.board} board", corners.side_px, corners.blur_px)
    return corners
