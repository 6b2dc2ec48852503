"""Find the corners of an AprilGrid, or of the part of it that is in view.

Tags come first: black quadrilaterals whose bits are a code of the family, at several resolutions.
Each names its four corners. From there corners are fitted as crossings of two edges, and the tags
around are looked for corner by corner, also where their bits cannot be read.
"""

import numpy as np

from rig.arrays import Float
from rig.targets.aprilgrid.board import AprilGrid
from rig.targets.aprilgrid.corner_grid import CornerGrid, fit_corners, rough_corners
from rig.targets.aprilgrid.diagnosis import check_measurable, check_spacing, why_not
from rig.targets.aprilgrid.quads import find_quads
from rig.targets.aprilgrid.tags import Tag, read_tags
from rig.targets.detection import Detection
from rig.targets.pyramid import Image, Picture, from_level, pyramid

FEWEST_CORNERS = 6
"""Fewer do not fix the pose of the board with anything to spare."""
_LEVELS = 4
_BLURRED_PX = 2.5
"""Edges of more are measured better in a coarser picture..."""
_LEAST_CLEAR_PX = 9.0
"""...while there is so much room between them."""


def find_aprilgrid(image: Image, grid: AprilGrid) -> Detection:
    """Find the visible corners of the tags of an AprilGrid to sub-pixel precision.

    Args:
        image: (H, W) grey, finite; float32 in 8-bit grey levels.
        grid: what to look for.

    Raises:
        TargetError: not found as asked for; `reason` is one of wrong-count, wrong-pattern,
            few-corners, mirrored, too-small, blurred, over-exposed, under-exposed, not-found.
    """
    pictures = pyramid(image, _LEVELS)
    quads = [from_level(find_quads(picture), level) for level, picture in enumerate(pictures)]
    tags = _tags_of(grid, _read(pictures[0], quads, grid))
    found = _measured(pictures, rough_corners(tags, grid), grid) if tags else None
    count = 0 if found is None else int(found.found.sum())
    if found is None or count < FEWEST_CORNERS:
        raise why_not(image, pictures[0], np.concatenate(quads), grid, len(tags), count)
    check_spacing(found.xy_px, grid)
    check_measurable(grid, found.side_px, found.blur_px)
    row, column = np.nonzero(found.found)
    return Detection(
        row * grid.columns + column,
        found.xy_px[row, column],
        found.sigma_px[row, column],
        found.blur_px,
        found.contrast,
    )


def _read(picture: Picture, quads: list[Float], grid: AprilGrid) -> list[Tag]:
    return read_tags(
        picture, np.concatenate(quads), border_bits=grid.border_bits, share=grid.spacing
    )


def _tags_of(grid: AprilGrid, tags: list[Tag]) -> list[Tag]:
    """Tags of the grid, each once: of those read several times the one with the best bits.

    A number that is in two places at once is of no use: which one is meant?
    """
    best: dict[int, Tag] = {}
    elsewhere: set[int] = set()
    for tag in sorted(tags, key=lambda tag: tag.wrong_bits):
        if not grid.first_tag <= tag.number < grid.first_tag + grid.tag_count:
            continue
        first = best.setdefault(tag.number, tag)
        side_px = np.linalg.norm(first.corners_px[1] - first.corners_px[0])
        if np.abs(first.corners_px - tag.corners_px).max() > side_px / 2:
            elsewhere.add(tag.number)
    return [tag for number, tag in sorted(best.items()) if number not in elsewhere]


def _measured(pictures: list[Picture], rough: Float, grid: AprilGrid) -> CornerGrid | None:
    """Corners in the picture itself, or in a coarser one that suits their blur."""
    found = fit_corners(pictures[0], 0, rough, grid)
    level = 0
    while found is not None and level + 1 < len(pictures):
        scale = 2**level
        room_px = grid.clear_share * found.side_px / scale
        if found.blur_px / scale <= _BLURRED_PX or room_px < _LEAST_CLEAR_PX:
            break
        level += 1
        coarser = fit_corners(pictures[level], level, found.xy_px, grid)
        if coarser is None or coarser.found.sum() < found.found.sum():
            break
        found = coarser
    return found
