"""Damage that leaves every code valid: all pixels behind it are brighter or darker by one number.

A picture codes the mean of each block as the difference to the block before. A damaged difference
shifts all blocks behind it, in the order of coding, and the shift ends with the picture or at the
next restart marker. In the picture this is a step edge along the borders of coded units that jumps
by one unit where the damage is: nothing in front of a camera has that form.

Each border between two rows of units is asked how high a step there is, for every column at which
the jump could be. The mean over one whole width of the picture tells a shift that is far below the
texture; how much such means scatter in a picture without damage, the picture itself tells.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.frames import GreyImage

LEAST_STEP: Final = 1.5
"""Smallest shift that is told from the unevenness of compression, in grey levels."""
_LEAST_SHARE: Final = 0.05
"""Part of a row of units that must lie on either side of the damage."""
_OUTSTANDING: Final = 8.0
"""How far the mean step lies beyond the others, in their standard deviations: up to 5 are found in
pictures without damage."""
_AGREEING: Final = 0.7
"""Part of the borders whose step must be nearer to what the shift foretells than to the other:
an edge in the scene is seldom so long, and never on both sides of the jump."""
_UNEVEN: Final = 0.9
"""Least spread of the picture along the step, as part of its height: the border of one even
surface in front of another is no damage."""
_LONGEST_TAIL: Final = 5.0
"""Steps beyond so many times the usual one count as that many: a strong edge is no shift."""
_STILLEST: Final = 0.3
"""Least usual step, and"""
_STEADIEST: Final = 0.05
"""least scatter of means: of a picture without texture, in grey levels."""


def shifted_from(
    image: GreyImage, *, unit_px: tuple[int, int], units_per_restart: int
) -> int | None:
    """Return the number of the unit from which on the picture is shifted; None if it is whole.

    Args:
        image: decoded luma, (H, W).
        unit_px: width and height of one coded unit.
        units_per_restart: units from restart marker to restart marker; 0 without.
    """
    width_px, height_px = unit_px
    across, down = image.shape[1] // width_px, image.shape[0] // height_px
    if across < 8 or down < 3:
        return None
    coded_across = -(-image.shape[1] // width_px)
    is_by_row = units_per_restart == coded_across
    if 0 < units_per_restart <= coded_across and not is_by_row:
        return None  # a shift is too short to be seen
    rows = np.arange(1, down) * height_px
    cut = image[:, : across * width_px].astype(np.float32)
    # The step beyond what the slopes on both sides foretell.
    steps = 1.5 * (cut[rows] - cut[rows - 1]) - 0.5 * (cut[rows + 1] - cut[rows - 2])
    steps = np.median(steps.reshape(down - 1, across, width_px), axis=2)
    above = np.median(cut[rows - 1].reshape(down - 1, across, width_px), axis=2)
    if is_by_row:  # the shift ends with the row: a step up, and one down below it
        row, column = _outstanding(steps, is_by_row=True)
        stepped = (slice(column, None), slice(column, None))
        signs = (1.0, -1.0)
    else:
        row, column = _outstanding(steps, is_by_row=False)
        stepped = (slice(column, None), slice(None, column))
        signs = (1.0, 1.0)
    if row < 0 or not _is_shift(steps[row : row + 2], above[row : row + 2], stepped, signs):
        return None
    return (row + 1) * coded_across + column


def _outstanding(steps: NDArray[np.floating], *, is_by_row: bool) -> tuple[int, int]:
    """Return where the mean step stands out most, as row and column; -1 for the row if nowhere."""
    rows, across = steps.shape
    border = max(3, int(_LEAST_SHARE * across))
    last = across - (max(border, 4) if is_by_row else border)
    if last < border:
        return -1, 0
    usual = max(_STILLEST, float(np.median(np.abs(steps))))
    even = np.clip(steps, -_LONGEST_TAIL * usual, _LONGEST_TAIL * usual)
    before = np.concatenate([np.zeros((rows, 1)), np.cumsum(even, axis=1)], axis=1)
    behind = before[:, -1:] - before
    if is_by_row:
        means = (behind[:-1] - behind[1:]) / np.maximum(1, 2 * (across - np.arange(across + 1)))
    else:
        means = (behind[:-1] + before[1:]) / across
    means = np.abs(means[:, border : last + 1])
    # Means over parts of a row scatter the more, the fewer units they are of.
    scatter = 1.4826 * np.median(means, axis=0 if is_by_row else None) + _STEADIEST
    row, place = divmod(int(np.argmax(means / scatter)), means.shape[1])
    is_far = bool((means / scatter)[row, place] >= _OUTSTANDING)
    return (row if is_far else -1), place + border


def _is_shift(
    steps: NDArray[np.floating],
    above: NDArray[np.floating],
    stepped: tuple[slice, slice],
    signs: tuple[float, float],
) -> bool:
    """Say whether the steps of two rows have one height where it is foretold, and none elsewhere.

    Args:
        steps: of the border at the damage and of the one below, (2, across).
        above: grey values above those borders, (2, across).
        stepped: where the step is foretold.
        signs: whether upwards or downwards.
    """
    upwards = steps * np.array(signs)[:, None]
    is_stepped = np.zeros(steps.shape, bool)
    for row, part in enumerate(stepped):
        is_stepped[row, part] = True
    shift = float(np.median(upwards[is_stepped]))
    if abs(shift) < LEAST_STEP:
        return False
    is_there = upwards * np.sign(shift) > 0.5 * abs(shift)
    agrees = is_there == is_stepped
    parts = [agrees[row, is_stepped[row] == part] for row in (0, 1) for part in (False, True)]
    if min(float(np.mean(part)) for part in parts if part.size) < _AGREEING:
        return False
    return float(np.var(above[is_stepped])) > (_UNEVEN * shift) ** 2 + 4.0
