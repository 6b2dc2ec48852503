"""What is known of the rows of whole pictures, for a part of them."""

from dataclasses import replace

import numpy as np

from rig.epipolar.mending.row_errors import RowErrors
from rig.epipolar.mending.smooth_field import SmoothField, basis, grid_of


def cropped_rows(rows: RowErrors, x_px: int, y_px: int, shape: tuple[int, int]) -> RowErrors:
    """Return the errors of the rows of a part of the pictures.

    Args:
        rows: of the whole pictures.
        x_px: first column of the part.
        y_px: its first row.
        shape: its height and width.
    """
    fields = tuple(
        None if field is None else cropped_field(field, x_px, y_px, shape) for field in rows.fields
    )
    return replace(rows, fields=fields)


def cropped_field(field: SmoothField, x_px: int, y_px: int, shape: tuple[int, int]) -> SmoothField:
    """Return the same field, counted from another corner: a polynomial stays one.

    Args:
        field: of whole pictures.
        x_px: first column of the part.
        y_px: its first row.
        shape: its height and width.
    """
    x, y = grid_of(shape)
    change, *_ = np.linalg.lstsq(basis(x, y, shape), basis(x + x_px, y + y_px, field.shape))
    return replace(
        field,
        coefficients=change @ field.coefficients,
        covariance=change @ field.covariance @ change.T,
        shape=shape,
    )
