"""One lens on a straight line, from views that were solved on their own."""

import numpy as np
import pytest

from rig.errors import CalibrationError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.geometry.slider import Sliders, tied_to_sliders

READ_MM = np.array([[-30.0], [-10.0], [0.0], [15.0], [32.0]])
REFERENCE = 2
WAY = 1.001 * np.array(
    [
        np.cos(np.radians(0.3)) * np.cos(np.radians(1.0)),
        np.cos(np.radians(0.3)) * np.sin(np.radians(1.0)),
        np.sin(np.radians(0.3)),
    ]
)
"""0.3 degrees forward, 1 degree clockwise, 1.001 mm per mm."""
SIGMA = np.array([0.3, 0.3, 0.5, 0.5] * 5 + [1e-4, 1e-4, 1e-4, 0.02, 0.02, 0.05] * 4)


def views(
    places_mm: np.ndarray = READ_MM @ WAY[None, :],
    errors: np.ndarray | None = None,
    covariance: np.ndarray | None = None,
) -> RigGeometry:
    """A geometry with these places, and errors on its numbers in the order of its covariance."""
    off = np.zeros(len(SIGMA)) if errors is None else errors
    cameras = tuple(
        CameraModel(640, 400, *(np.array([610.0, 611.0, 319.5, 199.5]) + off[4 * v : 4 * v + 4]))
        for v in range(5)
    )
    poses = [Pose.identity()] * 5
    for n, view in enumerate(v for v in range(5) if v != REFERENCE):
        at = 20 + 6 * n
        turn = Pose.from_vectors(off[at : at + 3], np.zeros(3)).rotation
        poses[view] = Pose(turn, -places_mm[view] + off[at + 3 : at + 6])
    names = tuple("abcde")
    known = np.diag(SIGMA**2) if covariance is None else covariance
    return RigGeometry(names, REFERENCE, cameras, tuple(poses), known)


def drawn(seed: int) -> tuple[RigGeometry, Sliders]:
    random = np.random.default_rng(seed)
    mixing = np.eye(len(SIGMA)) + 0.1 * random.standard_normal((len(SIGMA), len(SIGMA)))
    root = SIGMA[:, None] * mixing
    errors = root @ random.standard_normal(len(SIGMA))
    return tied_to_sliders(views(errors=errors, covariance=root @ root.T), READ_MM)


def test_a_perfect_line_comes_back_exactly():
    geometry, found = tied_to_sliders(views(), READ_MM)
    (line,) = found.lines
    assert line.along == "row"
    assert line.forward_deg == pytest.approx(0.3, abs=1e-9)
    assert line.roll_deg == pytest.approx(1.0, abs=1e-9)
    assert line.scale == pytest.approx(1.001, abs=1e-12)
    np.testing.assert_allclose(line.direction, WAY / 1.001, atol=1e-12)
    assert (found.straightness_mm, found.turn_deg) == (0.0, 0.0)
    np.testing.assert_allclose(geometry.centres_mm(), READ_MM @ WAY[None, :], atol=1e-9)
    np.testing.assert_allclose(found.off_line_mm, 0.0, atol=1e-9)


def test_all_views_have_the_mean_lens():
    errors = np.zeros(len(SIGMA))
    errors[0:20:4] = [0.1, -0.2, 0.3, 0.0, 0.3]
    geometry, _ = tied_to_sliders(views(errors=errors), READ_MM)
    assert [camera.fx_px for camera in geometry.cameras] == pytest.approx([610.1] * 5)
    assert geometry.covariance is not None
    assert geometry.covariance[0, 0] == pytest.approx(0.3**2 / 5)
    assert geometry.covariance[0, 4] == pytest.approx(0.3**2 / 5)


def test_sigmas_of_a_line_are_those_of_its_regression():
    _, found = tied_to_sliders(views(), READ_MM)
    moment = float(np.sum(READ_MM**2))
    assert found.lines[0].scale_sigma == pytest.approx(0.02 / np.sqrt(moment), rel=1e-2)
    down = np.degrees(0.05 / np.sqrt(moment)) / 1.001
    assert found.lines[0].forward_sigma_deg == pytest.approx(down, rel=1e-2)
    # The place of a view is the way per mm, times its mm: its sigma is that of the way.
    assert found.place_sigma_mm[4] == pytest.approx(
        32.0 / np.sqrt(moment) * np.array([0.02, 0.02, 0.05]), rel=1e-6
    )
    assert not found.place_sigma_mm[REFERENCE].any()


@pytest.mark.slow
def test_sigmas_tell_how_far_off_the_line_is():
    lines = [drawn(seed)[1].lines[0] for seed in range(60)]
    pulls = np.array(
        [
            [
                (line.forward_deg - 0.3) / line.forward_sigma_deg,
                (line.roll_deg - 1.0) / line.roll_sigma_deg,
                (line.scale - 1.001) / line.scale_sigma,
            ]
            for line in lines
        ]
    )
    assert 0.75 < float(np.sqrt(np.mean(pulls**2))) < 1.2


def test_a_bent_slider_keeps_its_bend():
    bow_mm = 0.3 * (READ_MM / 30.0) ** 2 @ np.array([[0.0, 1.0, 0.0]])
    bent_mm = READ_MM @ WAY[None, :] + bow_mm
    geometry, found = tied_to_sliders(views(bent_mm), READ_MM)
    assert 0.05 <= found.straightness_mm <= 0.5
    np.testing.assert_allclose(geometry.centres_mm(), bent_mm, atol=0.02)
    straight = np.diag((SIGMA * 1e3) ** 2)
    _, loose = tied_to_sliders(views(bent_mm, covariance=straight), READ_MM)
    assert loose.straightness_mm == 0.0


def test_a_row_and_a_column_are_two_lines():
    read_mm = np.array([[-30.0, 5.0], [30.0, 5.0], [0.0, 5.0], [0.0, -15.0], [0.0, 30.0]])
    ways = np.array([[1.0, 0.0, 0.0], [-0.02, 1.0, 0.01]])
    places_mm = (read_mm - read_mm[REFERENCE]) @ ways
    _, found = tied_to_sliders(views(places_mm), read_mm)
    row, column = found.lines
    assert (row.along, column.along) == ("row", "column")
    assert row.roll_deg == pytest.approx(0.0, abs=1e-9)
    assert column.roll_deg == pytest.approx(np.degrees(np.arctan(0.02)), abs=1e-9)
    length = np.sqrt(1.0 + 0.02**2 + 0.01**2)
    assert column.scale == pytest.approx(length, abs=1e-12)
    assert column.forward_deg == pytest.approx(np.degrees(np.arcsin(0.01 / length)), abs=1e-9)


def test_a_slider_that_stood_still_is_told():
    with pytest.raises(CalibrationError, match="stood still"):
        tied_to_sliders(views(), np.zeros((5, 1)))


def test_views_of_two_lens_models_are_told():
    geometry = views()
    other = CameraModel(640, 400, 610.0, 610.0, 319.5, 199.5, "brown5", (0.0,) * 5)
    count = len(SIGMA) + 5
    mixed = RigGeometry(
        geometry.names,
        REFERENCE,
        (*geometry.cameras[:4], other),
        geometry.cam_from_reference,
        np.eye(count),
    )
    with pytest.raises(CalibrationError, match="different lens models"):
        tied_to_sliders(mixed, READ_MM)
