"""Tilt of board and stage from the stops of a sweep, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import linregress

from rig.cli.sweep_result import alignment_as_dict, alignment_lines, use_lines
from rig.curve import CurvePoint
from rig.geometry.epipolar_error import EpipolarError
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.nominal import nominal_optics
from rig.optics.optics import Optics
from rig.plan import Stop
from rig.profile.load import load_profile
from rig.sweep.alignment import board_field, measure_alignment
from rig.sweep.calibration_use import calibration_use
from rig.sweep.points import StopResult, without_field
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry

DISTANCES_MM = (400.0, 480.0, 560.0, 650.0, 750.0, 900.0, 1050.0, 1200.0)
REAL = SmallRig(name="sim-real")
FOCAL_PX = 610.0


def stops(
    optics: Optics, *, board_deg: tuple[float, float], stage_deg: tuple[float, float]
) -> list[StopResult]:
    """A flat board with a tilt against the reference camera, carried along a slanted way."""
    numbers = np.random.default_rng(2)
    rise = np.tan(np.radians(board_deg))
    way = np.tan(np.radians(stage_deg))
    made: list[StopResult] = []
    for index, z_mm in enumerate(DISTANCES_MM):
        centre_mm = np.array([3.0 + way[0] * z_mm, -2.0 + way[1] * z_mm, z_mm])
        if not isinstance(optics, CalibratedOptics):
            centre_px = FOCAL_PX * centre_mm[:2] / z_mm + (319.5, 199.5)
        else:
            raw = optics.rectification.geometry.project(0, centre_mm[None])
            centre_px = optics.rectification.rectified_px(0, raw)[0]
        centre_px = centre_px + numbers.normal(0.0, 0.005, 2)
        # m = f p / Z and 1 / Z = (1 - rise (x, y)) / (Z_centre - rise (X, Y)).
        common = rise if not isinstance(optics, CalibratedOptics) else (
            optics.rectification.common_from_reference[:2, :2] @ rise
        )  # fmt: skip
        tilt = -40.0 * common / (z_mm - rise @ centre_mm[:2]) + numbers.normal(0.0, 2e-6, 2)
        slope_px = 24400.0 / z_mm - 35.0
        made.append(
            StopResult(
                stop=Stop(index, z_mm, "fit", "forward"),
                point=CurvePoint(z_mm, slope_px, 1e-3, 1e-3, 3, "fit", "forward"),
                corner_slope_px=slope_px,
                dense_slope_px=None,
                track_residual_px=0.01,
                motion_px=0.01,
                epipolar=EpipolarError(0.01, 0.02, 0.05),
                centre_px=(float(centre_px[0]), float(centre_px[1])),
                tilt=(float(tilt[0]), float(tilt[1])),
                tilt_sigma=(2e-6, 2e-6),
                problem=None,
            )
        )
    return made


def both_kinds() -> list[Optics]:
    geometry = true_geometry(REAL.profile, REAL.world.moment(0.0))
    return [nominal_optics(load_profile("sim")), calibrated_optics(REAL.profile, geometry, 1)]


@pytest.mark.parametrize("optics", both_kinds(), ids=["as they are", "calibrated"])
def test_what_is_tilted_is_found_with_its_sign_and_size(optics: Optics) -> None:
    taken = stops(optics, board_deg=(0.8, -0.4), stage_deg=(-0.3, 0.5))
    field = board_field(taken, optics)
    assert field is not None
    found = measure_alignment(taken, optics, field, pitch_mm=40.0, focal_px=FOCAL_PX)
    assert found.board is not None
    assert found.stage is not None
    assert (found.board.right_deg, found.board.down_deg) == pytest.approx((0.8, -0.4), abs=0.02)
    assert (found.stage.right_deg, found.stage.down_deg) == pytest.approx((-0.3, 0.5), abs=0.01)
    assert max(*found.board.sigma_deg, *found.stage.sigma_deg) < 0.02
    board, stage = alignment_lines(found)
    assert "right side 0.8" in board
    assert "farther and lower side 0.4" in board
    assert "nearer (k=2); turn it back" in board
    assert "deg left" in stage
    assert "deg below" in stage
    assert ("middle of the picture" in stage) == (optics.calibration_id is None)


def test_what_stands_right_needs_no_turning() -> None:
    optics = both_kinds()[0]
    taken = stops(optics, board_deg=(0.0, 0.0), stage_deg=(0.01, 0.0))
    field = board_field(taken, optics)
    found = measure_alignment(taken, optics, field, pitch_mm=40.0, focal_px=FOCAL_PX)
    assert all("nothing to turn" in line for line in alignment_lines(found))


def test_what_is_unknown_is_not_made_up() -> None:
    optics = both_kinds()[0]
    taken = stops(optics, board_deg=(1.0, 0.0), stage_deg=(0.0, 0.0))
    assert board_field(taken[:4], optics) is None
    blind = [replace(stop, tilt=None, centre_px=None) for stop in taken]
    assert board_field(blind, optics) is None
    found = measure_alignment(blind, optics, None, pitch_mm=40.0, focal_px=None)
    assert (found.board, found.stage, alignment_lines(found)) == (None, None, [])
    assert alignment_as_dict(found) == {"board": None, "stage": None, "calibrated": False}


def test_a_field_is_taken_out_of_every_slope_of_a_stop() -> None:
    optics = both_kinds()[0]
    taken = stops(optics, board_deg=(1.0, 0.0), stage_deg=(0.5, 0.0))
    turned = [
        replace(stop, tilt=(stop.tilt[0] + 1e-4, stop.tilt[1]))
        for stop in taken
        if stop.tilt is not None
    ]
    field = board_field(turned, optics)
    assert field is not None
    assert field.term is not None
    for before, after in zip(turned, without_field(turned, field.term), strict=True):
        assert before.point is not None
        assert after.point is not None
        assert before.centre_px is not None
        added_px = 1e-4 * (before.centre_px[0] - 319.5)
        assert before.point.slope_px - after.point.slope_px == pytest.approx(added_px, abs=2e-4)
        assert after.corner_slope_px == after.point.slope_px
        assert after.dense_slope_px is None


def test_cameras_and_stage_are_compared() -> None:
    plain, calibrated = both_kinds()
    assert calibration_use([], plain) is None
    taken = stops(calibrated, board_deg=(0.0, 0.0), stage_deg=(0.0, 0.0))
    assert isinstance(calibrated, CalibratedOptics)
    rectification = calibrated.rectification
    law = rectification.inverse_law_px_mm
    off = [
        replace(s, point=replace(s.point, slope_px=law / (1.001 * z) - rectification.infinity_px))
        for s, z in zip(taken, DISTANCES_MM, strict=True)
        if s.point is not None
    ]
    use = calibration_use(off, calibrated)
    assert use is not None
    assert use.disagreement_pct == pytest.approx(0.1, abs=1e-6)
    assert use.stage is not None
    assert use.stage.scale == 1.0015
    assert use.stage.axis_deg == pytest.approx(0.585, abs=0.01)
    assert "scale 1.00150" in use_lines(use)[0]
    assert "0.1000 % rms" in use_lines(use)[1]


def test_the_sigma_of_the_way_is_that_of_a_line_of_rays_over_nearness() -> None:
    optics = nominal_optics(load_profile("sim"))
    taken = stops(optics, board_deg=(0.0, 0.0), stage_deg=(-0.3, 0.5))
    found = measure_alignment(taken, optics, None, pitch_mm=40.0, focal_px=FOCAL_PX)
    assert found.stage is not None
    centres_px = np.array([stop.centre_px for stop in taken])
    for axis, middle_px in enumerate((319.5, 199.5)):
        rays = (centres_px[:, axis] - middle_px) / FOCAL_PX
        line = linregress(1.0 / np.array(DISTANCES_MM), rays)
        expected_deg = float(np.degrees(line.intercept_stderr))
        assert found.stage.sigma_deg[axis] == pytest.approx(expected_deg, rel=1e-6)
