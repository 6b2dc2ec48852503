"""Views that are not rectified: what is followed, and what is left alone."""

import numpy as np
import pytest

from rig.epipolar.board.corner_tracks import fit_corner_tracks
from rig.epipolar.board.misalignment import across_px, fit_misalignment, rows_met

X_STEPS, Y_STEPS = np.array([0.0, -1.06, 0.93, 0.0]), np.array([0.0, 0.0, 0.0, 1.08])
CENTRE_PX = np.array([320.0, 200.0])
PLANE = np.array([5.0, 1e-3, -2e-3])
ROWS, COLUMNS = np.mgrid[0:6, 0:9]
REFERENCE_PX = np.stack([200.0 + 30.0 * COLUMNS, 120.0 + 30.0 * ROWS], axis=-1)


def turned(view: int, angle_rad: float) -> np.ndarray:
    """How far a view's picture moves when the camera is turned about its axis and shifted."""
    offset = REFERENCE_PX - CENTRE_PX
    across, down = angle_rad * view * offset[..., 1], -angle_rad * view * offset[..., 0]
    return np.stack([across + 0.7 * view, down - 0.3 * view], axis=-1)


def corners(angle_rad: float) -> list[np.ndarray]:
    offset = REFERENCE_PX - CENTRE_PX
    slope = PLANE[0] + offset @ PLANE[1:]
    return [
        REFERENCE_PX - slope[..., None] * np.array([x, y]) + turned(view, angle_rad)
        for view, (x, y) in enumerate(zip(X_STEPS, Y_STEPS, strict=True))
    ]


def fit(angle_rad: float, residual_px: float):
    return fit_misalignment(
        corners(angle_rad), X_STEPS, Y_STEPS, 0, PLANE, CENTRE_PX,
        residual_px=residual_px, corner_sigma_px=0.01,
    )  # fmt: skip


def test_a_turned_view_is_followed_to_every_pixel():
    field = fit(0.004, residual_px=1.0)
    found = field.at(REFERENCE_PX.reshape(-1, 2).T)
    for view in range(4):
        assert pytest.approx(turned(view, 0.004).reshape(-1, 2), abs=1e-9) == found[view].T


def test_straight_tracks_are_left_alone():
    assert not fit(0.004, residual_px=0.02).coefficients.any()


def test_the_reference_defines_the_lines():
    assert fit(0.01, residual_px=1.0).coefficients[0] == pytest.approx(0.0, abs=1e-12)


def test_what_lies_across_the_lines_has_no_share_in_the_slope():
    slope = PLANE[0] + (REFERENCE_PX - CENTRE_PX) @ PLANE[1:]
    low_px = 1.2 + 1e-3 * (REFERENCE_PX - CENTRE_PX)[..., 0]
    seen = [
        REFERENCE_PX - slope[..., None] * np.array([x, y])
        for x, y in zip(X_STEPS, Y_STEPS, strict=True)
    ]
    seen[2] = seen[2] + low_px[..., None] * np.array([0.0, 1.0])
    beside = across_px(seen, X_STEPS, Y_STEPS, 0)
    assert beside[2] == pytest.approx(low_px.ravel())
    assert np.abs(np.delete(beside, 2, axis=0)).max() < 1e-9

    def slope_px(corners: list[np.ndarray]) -> float:
        return float(fit_corner_tracks(corners, X_STEPS, Y_STEPS, 0, CENTRE_PX).plane[0])

    assert abs(slope_px(seen) - PLANE[0]) > 0.05  # what the fit did before
    met = rows_met(seen, X_STEPS, Y_STEPS, 0, CENTRE_PX)
    assert slope_px(met) == pytest.approx(PLANE[0], abs=1e-9)
