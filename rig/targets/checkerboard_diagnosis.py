"""Why a board was not found, from what was found instead."""

import numpy as np
from numpy.typing import NDArray

from rig.errors import TargetError
from rig.geometry.homography import fit_homography, grid_places, map_points
from rig.targets.checkerboard import Checkerboard
from rig.targets.lattice import Lattice
from rig.targets.measurable import MIN_SIDE_PX
from rig.targets.outline import ended_sides
from rig.targets.pyramid import Image, Picture
from rig.targets.saddles import bilinear
from rig.targets.smooth_lines import smooth_triples

_EDGE_PX = 4.0
"""Corners nearer to the border than this cannot be fitted."""
_FEWEST = 9
"""A lattice of fewer corners than this is chance."""
_MAX_UNEVEN = 0.11
"""Rms distance from a flat grid, in squares."""
_MAX_BEND = 0.2
"""Change of step along a line, or change of that change, in steps: of large squares through a wide
lens it is this."""
_MOSTLY = 0.6
"""Share of its places that a lattice bent by a lens must have..."""
_NEARLY_ALL = 0.9
"""...and share of three neighbours that must lie on a smooth line: corners at a border may not."""
_IN_SQUARE = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Where the grey of a square is looked at, in squares..."""
_OF_TWO_COLOURS = 0.85
"""...and share of the squares that must be brighter or darker than the middle as their turn is."""
_MAX_UNEVEN_GREY = 0.155
"""Standard deviation of the grey within squares of one colour, over the step between colours: 0.137
where blur has left a product of two sines, less where it has left more. Markers make white ones
uneven, never black ones."""
_DARK = 0.12
"""Brightest pixels below this share of full scale: too dark."""
_BURNT = 0.2
"""Share of saturated pixels above which exposure is to blame."""


def why_not(image: Image, board: Checkerboard, seen: list[Lattice]) -> TargetError:
    """Return the error that says what was asked, what was found and what to do.

    Args:
        image: (H, W) grey.
        board: What was asked for.
        seen: Lattices found at any resolution, in px of the image.
    """
    asked = f"{board} board asked for"
    picture = np.asarray(image, np.float32)
    boards = [lattice for lattice in seen if is_board_like(picture, lattice)]
    best = max(boards, key=lambda lattice: int(lattice.found.sum()), default=None)
    if best is None:
        return exposure_at_fault(image, asked) or TargetError(
            f"{asked}, nothing like a checkerboard found",
            advice="put the board in view and light it",
            reason="not-found",
        )
    return (
        _size(best, asked)
        or _count(best, board, image.shape, asked)
        or _part(picture, best, board, asked)
        or exposure_at_fault(image, asked)
        or TargetError(
            f"{asked}, found {int(best.found.sum())} corners on a lattice of {_across(best)}",
            advice="uncover the board, and avoid glare, blur and bending",
            reason="not-found",
        )
    )


def is_board_like(picture: Picture, lattice: Lattice, *, with_markers: bool = False) -> bool:
    """Whether a lattice (px of the picture) is flat or evenly bent, with squares of two colours."""
    return _is_plane(lattice) and _is_checkered(picture, lattice, with_markers=with_markers)


def _is_checkered(picture: Picture, lattice: Lattice, *, with_markers: bool) -> bool:
    """Whether its squares are bright and dark in turns: walls of bricks have saddles as well."""
    xy_px = lattice.xy_px
    corner = [xy_px[:-1, :-1], xy_px[:-1, 1:], xy_px[1:, :-1], xy_px[1:, 1:]]
    row, column = np.nonzero(np.isfinite(sum(corner))[..., 0])
    is_even = (row + column) % 2 == 0
    if is_even.all() or not is_even.any():
        return False
    u, v = (place.ravel() for place in np.meshgrid(_IN_SQUARE, _IN_SQUARE))
    shares = ((1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v)
    place = sum(
        share[:, None] * one[row, column][:, None]
        for share, one in zip(shares, corner, strict=True)
    )
    look = bilinear(picture, np.clip(place, 0, np.array(picture.shape[::-1]) - 1))
    grey = look.mean(axis=1)
    even, odd = np.median(grey[is_even]), np.median(grey[~is_even])
    right = (grey > (even + odd) / 2) == (is_even == (even > odd))
    # Usual grey of a square of either colour, place by place: the middle one tells the step.
    usual = np.stack([np.median(look[which], axis=0) for which in (is_even, ~is_even)])
    step = abs(np.subtract(*usual[:, len(u) // 2]))
    uneven = usual.std(axis=1)
    rougher = uneven.min() if with_markers else uneven.max()
    return bool(right.mean() > _OF_TWO_COLOURS and rougher < _MAX_UNEVEN_GREY * step)


def _is_plane(lattice: Lattice) -> bool:
    """Whether it looks like a flat board rather than chance; wide lenses bend what is flat."""
    found = lattice.found
    if int(found.sum()) < _FEWEST:
        return False
    if _is_even(lattice):
        return True
    places, xy_px = grid_places(*lattice.shape)[found], lattice.xy_px[found]
    apart = map_points(fit_homography(places, xy_px), places) - xy_px
    rms_px = float(np.sqrt(np.mean((apart**2).sum(axis=1))))
    return rms_px < _MAX_UNEVEN * lattice.side_px


def _is_even(lattice: Lattice) -> bool:
    """Whether most of it is seen, and nearly all its lines are smooth."""
    if float(lattice.found.mean()) < _MOSTLY or min(lattice.shape) < 3:
        return False
    lines = (lattice.xy_px, lattice.xy_px.transpose(1, 0, 2))
    return all(smooth_triples(points, _MAX_BEND).mean() > _NEARLY_ALL for points in lines)


def _size(lattice: Lattice, asked: str) -> TargetError | None:
    if lattice.side_px >= MIN_SIDE_PX:
        return None
    return TargetError(
        f"{asked}, found {_across(lattice)} corners on squares of {lattice.side_px:.1f} px, at "
        f"least {MIN_SIDE_PX:.0f} px are needed",
        advice="bring the board nearer or use larger squares",
        reason="too-small",
    )


def _count(
    lattice: Lattice, board: Checkerboard, shape: tuple[int, ...], asked: str
) -> TargetError | None:
    """More or fewer corners than asked for: another board, or a part of this one."""
    wanted, found = sorted((board.rows, board.columns)), sorted(lattice.shape)
    borders = _touched(lattice, shape)
    if found[0] > wanted[0] or found[1] > wanted[1]:
        at_least = "at least " if borders or not lattice.found.all() else ""
        return TargetError(
            f"{asked}, found {at_least}{_across(lattice)} inner corners",
            advice="set the board's columns and rows to what it has, or use the other board",
            reason="wrong-count",
        )
    if found == wanted and not at_border(lattice.xy_px.reshape(-1, 2), shape):
        return None
    if borders:
        return TargetError(
            f"{asked}, found {_across(lattice)} corners up to the {' and '.join(borders)} border "
            "of the picture",
            advice="move the board until all of it is in view",
            reason="clipped",
        )
    return None


def _part(
    picture: Picture, lattice: Lattice, board: Checkerboard, asked: str
) -> TargetError | None:
    """Fewer corners than asked for: a smaller board that ends on all sides, or a part of one."""
    if sorted(lattice.shape) == sorted((board.rows, board.columns)):
        return None
    across = _across(lattice)
    if all(ended_sides(picture, lattice)):
        return TargetError(
            f"{asked}, found one of {across} inner corners",
            advice=f"set columns and rows to {across}, or use the other board",
            reason="wrong-count",
        )
    return TargetError(
        f"{asked}, found {int(lattice.found.sum())} corners on a lattice of {across}, and not "
        "which part of the board they are",
        advice="uncover the board so that one side with its white border and both sides next to it "
        f"are seen, or set columns and rows to {across} if that is all of it",
        reason="which-part",
    )


def _across(lattice: Lattice) -> str:
    return f"{max(lattice.shape)} x {min(lattice.shape)}"


def _touched(lattice: Lattice, shape: tuple[int, ...]) -> list[str]:
    """Borders beyond which the next row or column of corners would lie."""
    xy_px = lattice.xy_px
    beyond = np.concatenate(
        [
            (2 * near - far).reshape(-1, 2)
            for near, far in (
                (xy_px[0], xy_px[1]),
                (xy_px[-1], xy_px[-2]),
                (xy_px[:, 0], xy_px[:, 1]),
                (xy_px[:, -1], xy_px[:, -2]),
            )
        ]
    )
    return at_border(beyond, shape)


def at_border(xy_px: NDArray[np.float64], shape: tuple[int, ...]) -> list[str]:
    """Borders of the picture that some of (N, 2) points, NaN left out, touch or cross."""
    x, y = xy_px[np.isfinite(xy_px[:, 0])].T
    outside = {
        "left": x < _EDGE_PX,
        "right": x > shape[1] - 1 - _EDGE_PX,
        "top": y < _EDGE_PX,
        "bottom": y > shape[0] - 1 - _EDGE_PX,
    }
    return [name for name, out in outside.items() if out.any()]


def exposure_at_fault(image: Image, asked: str) -> TargetError | None:
    """Too dark or too bright a picture, if that is what it is."""
    full = _full_scale(image)
    burnt = float((image >= full).mean())
    if burnt > _BURNT:
        return TargetError(
            f"{asked}, not found with {burnt:.0%} of the pixels saturated at {full:.0f}",
            advice="shorten the exposure or dim the light",
            reason="over-exposed",
        )
    brightest = float(np.percentile(image, 99.5))
    if brightest < _DARK * full:
        return TargetError(
            f"{asked}, not found in a dark picture: brightest pixels at "
            f"{brightest:.0f} of {full:.0f}",
            advice="lengthen the exposure or add light",
            reason="under-exposed",
        )
    return None


def _full_scale(image: Image) -> float:
    """Largest grey level; 16-bit pictures may hold 10, 12, 14 or 16 bits."""
    if image.dtype != np.uint16:
        return 255.0
    return next(2.0**bits - 1 for bits in (10, 12, 14, 16) if int(image.max()) < 2**bits)
