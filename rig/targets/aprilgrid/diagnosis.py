"""Why an AprilGrid was not found as asked for, from what was found instead."""

import numpy as np

from rig.arrays import Float
from rig.errors import TargetError
from rig.targets.aprilgrid.board import AprilGrid
from rig.targets.aprilgrid.tags import Tag, read_tags
from rig.targets.checkerboard_diagnosis import exposure_at_fault
from rig.targets.pyramid import Image, Picture
from rig.targets.saddles import bilinear

_LEAST_BIT_PX = 2.0
"""Smaller bits cannot be told apart."""
_MOST_BLUR = 0.4
"""Sigma of the edges over the distance to the next one, above which they run together."""
_MOST_BLUR_BITS = 0.5
"""The same over the side of a bit, above which tags cannot be read."""
_BLUR_REACH = 0.18
"""Half the length of the profiles that show the blur, in sides: no longer than a border."""
_BLUR_SAMPLES = 25
_ALIKE = 0.3
"""Largest difference in size of quadrilaterals of one kind, as a logarithm."""
_MOST_OFF = 0.15
"""Relative error of the gap between tags that perspective does not explain."""
_FEWEST_GAPS = 3
_FEWEST_TAGS = 2
"""One tag may be read by chance."""


def check_measurable(grid: AprilGrid, side_px: float, blur_px: float) -> None:
    """Refuse corners that are there but too blurred to measure.

    Raises:
        TargetError: with reason blurred.
    """
    most_px = _MOST_BLUR * grid.clear_share * side_px
    if blur_px > most_px:
        raise TargetError(
            f"AprilGrid of {grid} tags found with edges blurred by {blur_px:.1f} px on tags of "
            f"{side_px:.1f} px, at most {most_px:.1f} px can be measured",
            advice="focus the lens, hold the board still, or bring it nearer",
            reason="blurred",
        )


def check_spacing(xy_px: Float, grid: AprilGrid) -> None:
    """Refuse tags that stand closer together or further apart than asked for.

    Raises:
        TargetError: with reason wrong-pattern.
    """
    ratios = [_gaps(lines) for lines in (xy_px, xy_px.transpose(1, 0, 2))]
    found = np.concatenate(ratios)
    if len(found) < _FEWEST_GAPS:
        return
    spacing = float(np.median(found))
    if abs(spacing / grid.spacing - 1.0) > _MOST_OFF:
        raise TargetError(
            f"AprilGrid with tags {grid.spacing:g} of their side apart asked for, they are "
            f"{spacing:.3f} apart",
            advice="set spacing to what the board has: the gap over the side of a tag",
            reason="wrong-pattern",
        )


def why_not(
    image: Image, picture: Picture, quads_px: Float, grid: AprilGrid, tags: int, corners: int
) -> TargetError:
    """Return the error that says what was asked, what was found and what to do.

    Args:
        image: (H, W) grey, as it was given.
        picture: the same, for reading bits.
        quads_px: (Q, 4, 2) black quadrilaterals.
        grid: what was asked for.
        tags: how many tags of it were read.
        corners: how many corners of it were found: too few.
    """
    asked = f"AprilGrid of {grid} tags (36h11, numbers {grid.first_tag}.."
    asked += f"{grid.first_tag + grid.tag_count - 1}, border of {grid.border_bits} bits) asked for"
    own = read_tags(picture, quads_px, border_bits=grid.border_bits, share=grid.spacing)
    if tags:
        return TargetError(
            f"{asked}, found {tags} of its tags and {corners} of its corners, 6 are needed",
            advice="bring more of it into view, nearer, and out of glare; small black squares must "
            "touch the corners of its tags",
            reason="few-corners",
        )
    return (
        _others(own, grid, asked)
        or _other_border(picture, quads_px, grid, asked)
        or _mirrored(picture, quads_px, grid, asked)
        or exposure_at_fault(image, asked)
        or _unread(picture, quads_px, grid, asked)
        or TargetError(
            f"{asked}, no tag of it found among {len(quads_px)} dark quadrilaterals",
            advice="put the board in view, light it, and hold it still",
            reason="not-found",
        )
    )


def _others(tags: list[Tag], grid: AprilGrid, asked: str) -> TargetError | None:
    last = grid.first_tag + grid.tag_count
    others = sorted({t.number for t in tags if not grid.first_tag <= t.number < last})
    if len(others) < _FEWEST_TAGS:
        return None
    return TargetError(
        f"{asked}, found tags {', '.join(map(str, others[:6]))}",
        advice="set tag_columns, tag_rows and first_tag to what the board has",
        reason="wrong-count",
    )


def _other_border(
    picture: Picture, quads_px: Float, grid: AprilGrid, asked: str
) -> TargetError | None:
    other = 3 - grid.border_bits
    read = read_tags(picture, quads_px, border_bits=other, share=grid.spacing)
    tags = {tag.number for tag in read}
    if len(tags) < _FEWEST_TAGS:
        return None
    return TargetError(
        f"{asked}, found {len(tags)} tags with a border of {other} bit{'s' * (other > 1)}",
        advice=f"set border_bits = {other}",
        reason="wrong-pattern",
    )


def _mirrored(picture: Picture, quads_px: Float, grid: AprilGrid, asked: str) -> TargetError | None:
    """Tags that are read once their corners are taken the other way round."""
    other_way = quads_px[:, ::-1]
    read = read_tags(picture, other_way, border_bits=grid.border_bits, share=grid.spacing)
    tags = {tag.number for tag in read}
    if len(tags) < _FEWEST_TAGS:
        return None
    return TargetError(
        f"{asked}, found {len(tags)} of its tags mirrored",
        advice="switch the mirroring off in the camera's driver or settings, or mirror the stored "
        "pictures back",
        reason="mirrored",
    )


def _unread(picture: Picture, quads_px: Float, grid: AprilGrid, asked: str) -> TargetError | None:
    """Several quadrilaterals whose bits are too small or too blurred to be read."""
    if len(quads_px) < 2 * _FEWEST_TAGS:
        return None
    sides_px = np.linalg.norm(quads_px - np.roll(quads_px, 1, axis=1), axis=2).mean(axis=1)
    # Tags are of one size; outlines of the paper and of other things are not.
    alike = np.abs(np.log(sides_px[:, None] / sides_px)) < _ALIKE
    alike = alike[alike.sum(axis=1).argmax()]
    if alike.sum() < grid.tag_count / 2:
        return None
    side_px = float(np.median(sides_px[alike]))
    bit_px = side_px / grid.bits_across
    shown = f"found {int(alike.sum())} dark quadrilaterals with sides of {side_px:.0f} px"
    if bit_px < _LEAST_BIT_PX:
        return TargetError(
            f"{asked}, {shown}, bits of {bit_px:.1f} px; at least {_LEAST_BIT_PX:g} px are needed",
            advice="bring the board nearer or use larger tags",
            reason="too-small",
        )
    blur_px = _blur_px(picture, quads_px[alike])
    if blur_px > _MOST_BLUR_BITS * bit_px:
        return TargetError(
            f"{asked}, {shown} but edges blurred by {blur_px:.1f} px on bits of {bit_px:.1f} px: "
            "its tags cannot be read",
            advice="focus the lens, or hold the board still",
            reason="blurred",
        )
    return None


def _blur_px(picture: Picture, quads_px: Float) -> float:
    """Width of the edges, measured across the middle of every side of a quadrilateral.

    A blurred step of height h has its steepest slope h / (sqrt(2 pi) sigma) in the middle.
    """
    along = np.roll(quads_px, -1, axis=1) - quads_px
    side_px = np.linalg.norm(along, axis=2, keepdims=True)
    across = np.stack([-along[..., 1], along[..., 0]], axis=2) / side_px
    reach_px = _BLUR_REACH * side_px
    place = np.linspace(-1.0, 1.0, _BLUR_SAMPLES) * reach_px
    xy_px = (quads_px + along / 2)[:, :, None] + place[..., None] * across[:, :, None]
    grey = bilinear(picture, np.clip(xy_px, 0, np.array(picture.shape[::-1]) - 1))
    step_px = 2 * reach_px[..., 0] / (_BLUR_SAMPLES - 1)
    steepest = np.abs(np.diff(grey, axis=-1)).max(axis=-1) / step_px
    return float(np.median(np.ptp(grey, axis=-1) / np.maximum(steepest, 1e-9) / np.sqrt(2 * np.pi)))


def _gaps(lines: Float) -> Float:
    """(K,) gaps of rows of tags over the mean side of the tags on either side."""
    begin, end = lines[:, 0::2], lines[:, 1::2]
    side_px = np.linalg.norm(end - begin, axis=-1)
    gap_px = np.linalg.norm(begin[:, 1:] - end[:, :-1], axis=-1)
    ratio = gap_px / ((side_px[:, 1:] + side_px[:, :-1]) / 2)
    return ratio[np.isfinite(ratio)]
