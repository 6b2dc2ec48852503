"""Whether rows still miss as they did when a curve was made."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.row_errors import NOTICEABLE_PX, RowErrors
from rig.epipolar.mending.smooth_field import SmoothField, grid_of

_SURE, _LEAST_SHARE = 3.0, 0.05
"""Sigmas beyond which a place has moved, and the share of such places from which rows have."""


@dataclass(frozen=True, slots=True)
class RowDrift:
    """What pictures show beyond the row errors that were expected and taken out of them."""

    expected: RowErrors
    left: RowErrors
    """Of the same views, measured once the expected ones were taken out."""
    steps: Float
    """(V,) how far the views stand from the reference, view steps."""

    def kept(self, kept: NDArray[np.bool_]) -> "RowDrift":
        """Return that of some of the views, (V,)."""
        return RowDrift(self.expected.kept(kept), self.left.kept(kept), self.steps[kept])

    @property
    def sure_px(self) -> Float:
        """(V,) rms over the places that have moved beyond doubt, 0 where rows lie as expected.

        The doubt is that of both measurements; where the first one has not been, nothing has moved.
        """
        return np.array(
            [
                0.0 if left is None else _sure_px(before, left)
                for before, left in zip(self.expected.fields, self.left.fields, strict=True)
            ]
        )


def _sure_px(before: SmoothField | None, left: SmoothField) -> float:
    x_px, y_px = grid_of(left.shape)
    values = left.at(x_px, y_px)
    variance = NOTICEABLE_PX**2 + left.sigma_at(x_px, y_px) ** 2
    if before is not None:
        variance += before.sigma_at(x_px, y_px) ** 2
    moved = np.abs(values) > _SURE * np.sqrt(variance)
    return float(np.sqrt(np.mean(values[moved] ** 2))) if moved.mean() > _LEAST_SHARE else 0.0
