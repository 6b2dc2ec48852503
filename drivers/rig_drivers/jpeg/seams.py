"""Damage that leaves every code valid: all pixels behind it are brighter or darker by one number.

A picture codes the mean of each block as the difference to the block before. A damaged difference
shifts all blocks behind it, in the order of coding, and the shift ends with the picture or at the
next restart marker. In the picture this is a step edge along the borders of coded units, of the
same height everywhere, that jumps by one unit where the damage is: nothing in front of a camera
has that form.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.compute.kernel import kernel
from rig.frames import GreyImage

LEAST_STEP: Final = 1.5
"""Smallest shift that is told from the unevenness of compression, in grey levels."""
_LEAST_SHARE: Final = 0.05
"""Part of a row of units that must lie on either side of the damage."""
_AGREEING: Final = 0.7
"""Part of the borders in two rows of units whose steps must be as the shift foretells."""
_UNEVEN: Final = 0.9
"""Least spread of the picture along the step, as part of its height: the border of one even
surface in front of another is no damage."""


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
    row, column = _shift(steps, above, is_by_row)
    return None if row < 0 else row * coded_across + column


@kernel()
def _shift(
    steps: NDArray[np.floating], above: NDArray[np.floating], is_by_row: bool
) -> tuple[int, int]:
    rows, across = steps.shape
    border = max(3, int(_LEAST_SHARE * across))
    noise = np.median(np.abs(steps))
    for row in range(rows - 1):
        last_column = across - (max(border, 4) if is_by_row else border)
        for column in range(border, last_column + 1):
            top = np.median(steps[row, column:])
            if abs(top) < LEAST_STEP:
                continue
            # Where the shift ends with the row it is a step up, and one down below it.
            first = column if is_by_row else 0
            last = across if is_by_row else column
            sign = -1.0 if is_by_row else 1.0
            bottom = sign * np.median(steps[row + 1, first:last])
            if abs(top - bottom) > 0.5 * abs(top):
                continue
            shift = 0.5 * (top + bottom)
            apart = min(0.5 * abs(shift), max(0.2 * abs(shift), 2.5 * noise))
            near = np.zeros(4, np.int64)
            count, total, squares = 0, 0.0, 0.0
            for lower in range(2):
                for place in range(across):
                    step = steps[row + lower, place]
                    if lower == 0:
                        foretold = shift if place >= column else 0.0
                    else:
                        foretold = sign * shift if first <= place < last else 0.0
                    group = 2 * lower + (place >= column)
                    near[group] += abs(step - foretold) < apart
                    level = above[row + lower, place]
                    if foretold != 0.0:
                        count += 1
                        total += level
                        squares += level * level
            spread = squares / count - (total / count) ** 2
            left, right = min(near[0], near[2]), min(near[1], near[3])
            if (
                left >= _AGREEING * column
                and right >= _AGREEING * (across - column)
                and spread > (_UNEVEN * shift) ** 2 + 4.0
            ):
                return row + 1, column
    return -1, -1
