"""The simulated ChArUco board: what is drawn is what OpenCV prints, where the world puts it."""

import numpy as np
import pytest
from rig_sim.charuco_print import charuco_print
from rig_sim.render_analytic import AnalyticRenderer
from rig_sim.render_mitsuba import MitsubaRenderer

from rig.errors import ConfigError
from rig.optics.nominal import nominal_optics
from rig.optics.target import target_of
from rig.profile import CharucoConfig
from rig.sweep.measure_sample import measure_sample
from tests.support.cameras import Slide, SmallRig

CHARUCO = (
    'target={kind="charuco", squares_across=8, squares_down=6, square_mm=28.0, marker_mm=21.0,'
    ' dictionary="4X4_50"}',
)


def a_board(**changes: object) -> CharucoConfig:
    fields = {"squares_across": 5, "squares_down": 4, "square_mm": 20.0, "marker_mm": 15.0}
    return CharucoConfig.model_validate(
        {"kind": "charuco", "dictionary": "DICT_4X4_50", **fields, **changes}
    )


@pytest.mark.slow
def test_a_sweep_measures_a_charuco_board_as_it_does_a_checkerboard():
    rig = SmallRig(CHARUCO, slide=Slide(-603.0))
    with rig.camera() as camera:
        images = camera.grab(3.0).images
    measured = measure_sample(rig.profile, nominal_optics(rig.profile), images)
    truth = rig.world.true_slope_px(600.0)
    assert measured.slope_px == pytest.approx(truth, abs=0.01)
    assert measured.sigma_px is not None
    assert measured.sigma_px < 0.005


@pytest.mark.slow
def test_a_part_of_a_charuco_board_is_refused_by_a_sweep_with_the_reason():
    rig = SmallRig((*CHARUCO, "world.board_offset_mm=[150.0, 0.0]"), slide=Slide(-803.0))
    with rig.camera() as camera:
        images = camera.grab(3.0).images
    measured = measure_sample(rig.profile, nominal_optics(rig.profile), images)
    assert measured.failure is not None
    assert measured.failure.reason == "clipped"


@pytest.mark.slow
def test_both_renderers_draw_the_same_markers():
    rig = SmallRig((*CHARUCO, "world.board_tilt_deg=[10.0, -15.0]"), slide=Slide(-703.0))
    moment = rig.world.moment(0.0)
    traced = np.stack(MitsubaRenderer(samples_per_px=64, seed=1).render(moment))
    drawn = np.stack(AnalyticRenderer().render(moment))
    board = moment.board
    assert board is not None
    corners_px = moment.cameras[0].pixels(board.in_world_mm(board.corners_mm()))
    x_px, y_px = corners_px.mean(axis=0).astype(int)
    window = np.s_[0, y_px - 60 : y_px + 60, x_px - 80 : x_px + 80]
    assert np.abs(traced[window] - drawn[window]).mean() < 0.01
    assert np.ptp(drawn[window]) > 0.6


def test_an_inverted_print_swaps_ink_and_paper():
    upright, inverted = charuco_print(a_board()), charuco_print(a_board(inverted=True))
    swapped = [row.translate(str.maketrans("#.", ".#")) for row in upright]
    assert list(inverted) == swapped


@pytest.mark.parametrize(
    ("changes", "match"), [({"dictionary": "9X9"}, "no dictionary"), ({"marker_mm": 15.1}, "grid")]
)
def test_boards_that_cannot_be_printed_are_refused(changes: dict[str, object], match: str):
    with pytest.raises(ConfigError, match=match):
        charuco_print(a_board(**changes))


def test_a_profile_describes_either_target():
    board = target_of(SmallRig(CHARUCO).profile.target or a_board())
    assert (str(board), board.points_mm.shape) == ("8 x 6", (5, 7, 3))
    with pytest.raises(ConfigError, match=r"marker_mm is 30"):
        SmallRig(("target.kind=charuco", *CHARUCO, "target.marker_mm=30.0"))
