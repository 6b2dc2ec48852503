"""The world, its camera's clock and what is printed on a board, by numbers."""

import itertools
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from rig_sim.board import INK, PAPER
from rig_sim.cache import PictureCache
from rig_sim.carriage import Carriage
from rig_sim.charuco_print import charuco_print
from rig_sim.clock import VirtualClock
from rig_sim.motion import trapezoid
from rig_sim.noise import Exposure, ViewExposure
from rig_sim.pictures import Exposures

from rig.errors import CaptureTimeoutError, ConfigError
from rig.profile import CarriageConfig, CharucoConfig
from rig.profile.world import SensorConfig, ViewErrorConfig
from tests.support.cameras import SMALL, Slide, SmallRig

SHIFTED = "world.view_errors.centre={shift_mm=[3.0, -2.0, 10.0], rotation_deg=[0.0, 4.0, 0.0]}"


def test_the_distance_counts_from_the_true_reference_camera_along_its_axis():
    rig = SmallRig((SHIFTED, "world.board_offset_mm=[20.0, 0.0]"), slide=Slide(-603.0))
    turn_rad = np.radians(4.0)
    expected_mm = 17.0 * np.sin(turn_rad) + 590.0 * np.cos(turn_rad)
    assert rig.world.true_distance_mm(0.0) == pytest.approx(expected_mm, abs=1e-3)


def test_cameras_stand_on_a_grid_with_their_own_errors():
    rig = SmallRig((SHIFTED,))
    pitch_mm = rig.profile.pitch_mm
    px_per_mm = rig.world.config.optics.focal_px / rig.world.focus_mm
    for view, camera in zip(rig.profile.views, rig.world.moment(0.0).cameras, strict=True):
        error = (3.0, -2.0, 10.0) if view.name == "centre" else (0.0, 0.0, 0.0)
        right_mm, down_mm = view.x_steps * pitch_mm, view.y_steps * pitch_mm
        assert camera.position_mm == pytest.approx(
            (right_mm + error[0], down_mm + error[1], error[2])
        )
        assert camera.centre_px == pytest.approx(
            (319.5 + px_per_mm * right_mm, 199.5 + px_per_mm * down_mm)
        )
        assert (camera.width_px, camera.height_px) == (640, 400)
        assert camera.rotation_deg[1] == (4.0 if view.name == "centre" else 0.0)


def test_the_board_goes_along_the_axis_and_leans_as_it_is_told():
    rig = SmallRig(
        ("world.board_offset_mm=[11.0, -7.0]", "world.board_tilt_deg=[5.0, -6.0]"),
        slide=Slide(-700.0),
    )
    board = rig.world.moment(0.0).board
    assert board is not None
    assert board.centre_mm == pytest.approx((11.0, -7.0, 503.0), abs=1e-3)
    assert board.rotation_deg == (5.0, -6.0, 0.0)


def test_the_true_slope_of_a_depth_is_that_of_similar_triangles():
    world = SmallRig().world
    focal_px, pitch_mm = world.config.optics.focal_px, world.profile.pitch_mm
    assert world.true_slope_px(500.0) == pytest.approx(
        pitch_mm * focal_px * (1.0 / 500.0 - 1.0 / world.focus_mm)
    )


TIMED = (*SMALL, "camera.frame_interval_s=0.125", "camera.exposure_s=0.03125")


@pytest.mark.parametrize(
    ("wait_s", "slot"), [(0.0, 0), (0.001, 1), (0.125, 1), (0.126, 2), (0.249, 2), (0.25, 2)]
)
def test_a_grab_takes_the_first_frame_that_begins_after_the_call(wait_s: float, slot: int):
    rig = SmallRig(TIMED, clock=VirtualClock(4.0))
    with rig.camera() as camera:
        rig.clock.sleep_s(wait_s)
        taken = camera.grab(1.0)
        assert taken.timestamp_s == 4.0 + 0.125 * slot + 0.015625
        assert rig.clock.now_s() == 4.0 + 0.125 * slot + 0.03125
        assert {frame.sequence for frame in taken.frames} == {0}
        assert {frame.exposure_s for frame in taken.frames} == {0.03125}


def test_a_grab_ends_when_its_time_is_over_and_takes_what_comes_at_the_very_end():
    rig = SmallRig(TIMED, clock=VirtualClock(4.0))
    with rig.camera() as camera:
        with pytest.raises(CaptureTimeoutError) as caught:
            camera.grab(0.03)
        assert rig.clock.now_s() == 4.03
        assert caught.value.missing == camera.views
        rig.clock.sleep_s(4.125 - rig.clock.now_s())
        assert camera.grab(0.03125).timestamp_s == 4.125 + 0.015625


@pytest.mark.parametrize(
    ("pause_s", "lost"), [(0.0, 0), (0.125, 0), (0.249, 1), (0.25, 1), (0.375, 2), (0.5, 3)]
)
def test_frames_that_were_overwritten_are_counted(pause_s: float, lost: int):
    rig = SmallRig(TIMED, clock=VirtualClock(4.0))
    with rig.camera() as camera:
        stream = camera.stream()
        first = next(stream)
        rig.clock.sleep_s(pause_s)
        second = next(stream)
        assert camera.dropped == {"late": max(0, lost - (pause_s == 0.249))}
        assert second.frames[0].sequence == 1 + camera.dropped["late"]
        assert second.timestamp_s == first.timestamp_s + 0.125 * second.frames[0].sequence
        assert len(list(itertools.islice(stream, 2))) == 2
    with camera:
        assert camera.dropped == {"late": 0}
        assert camera.grab(1.0).frames[0].sequence == 0


def test_the_last_three_moments_are_kept():
    rig = SmallRig(SMALL)
    exposures = Exposures(rig.world)
    assert exposures.renderer == "analytic"

    def at(place_mm: float) -> tuple[ViewExposure, ...]:
        rig.slide.at_mm = place_mm
        return exposures.at(0.0)

    first, second, third = (at(place_mm) for place_mm in (-603.0, -503.0, -403.0))
    assert at(-603.0) is first
    assert at(-303.0) is not third
    assert at(-603.0) is first, "used again, and so kept"
    assert at(-403.0) is third
    assert at(-503.0) is not second


@pytest.mark.parametrize(("bits", "most"), [(8, 255), (16, 65535)])
def test_levels_run_from_zero_to_the_full_scale_of_the_bits(bits: Literal[8, 16], most: int):
    sensor = SensorConfig(bits=bits, black_level=0.0, read_noise_levels=0.0)
    light = np.array([[0.0, 0.5], [1.0, 2.0]], np.float32)
    exposed = Exposure.of(light, sensor, ViewErrorConfig(), blur_px=0.0)
    assert exposed.mean_levels == pytest.approx(light * most)
    assert exposed.sigma_levels[1, 0] == pytest.approx(
        np.sqrt(255.0 / sensor.electrons_per_level) * most / 255.0
    )
    image = exposed.draw((1,))
    assert (image[0, 0], image[1, 1]) == (0, most)
    assert image.dtype == (np.uint8 if bits == 8 else np.uint16)


CHARUCO: dict[str, Any] = {
    "kind": "charuco",
    "squares_across": 5,
    "squares_down": 4,
    "dictionary": "4X4_50",
}


@pytest.mark.parametrize(
    ("marker_mm", "texels"),
    [(15.0, 8), (12.0, 10), (18.0, 20), (10.0, 12), (16.0, 30)],
)
def test_a_print_has_the_fewest_texels_that_fit_bits_and_margins(marker_mm: float, texels: int):
    """A marker is 6 bits across: n texels, n m / 6 of them to a bit, n (1 - m) / 2 beside it."""
    printed = charuco_print(CharucoConfig(**CHARUCO, square_mm=20.0, marker_mm=marker_mm))
    assert len(printed) == 4 * texels
    assert {len(row) for row in printed} == {5 * texels}


def test_a_print_that_needs_too_many_texels_is_refused():
    with pytest.raises(ConfigError, match="under 64 steps"):
        charuco_print(CharucoConfig(**CHARUCO, square_mm=20.0, marker_mm=19.0))


@pytest.mark.parametrize("inverted", [False, True])
def test_the_texels_of_a_print_are_ink_and_paper(inverted: bool):
    keys = (
        "squares_across=5, squares_down=4, square_mm=20.0, marker_mm=15.0,"
        f' dictionary="4X4_50", inverted={str(inverted).lower()}'
    )
    board = SmallRig((f'target={{kind="charuco", {keys}}}',)).world.moment(0.0).board
    assert board is not None
    assert (board.columns, board.rows) == (4, 3)
    assert board.square_mm == 20.0
    assert board.texel_mm == 2.5
    assert set(np.unique(board.texels)) == {np.float32(INK), np.float32(PAPER)}
    assert board.margin_light == (INK if inverted else PAPER)


def test_a_stop_rings_no_more_than_the_way_of_its_braking():
    config = CarriageConfig(
        board_at_machine_zero_mm=500.0, power_up_mm=-100.0, ring_mm=0.5, ring_hz=10.0,
        ring_decay_s=0.1,
    )  # fmt: skip
    for to_mm, amplitude_mm in ((-99.9, 0.05), (-100.1, -0.05), (-90.0, 0.5), (-110.0, -0.5)):
        carriage = Carriage(config, VirtualClock())
        phases = trapezoid(1.0, -100.0, to_mm, speed_mm_s=50.0, acceleration_mm_s2=400.0)
        carriage.follow(phases)
        end_s = phases[-1].end_s
        assert carriage.travelled_mm(end_s) == pytest.approx(to_mm)
        for quarters, sign in ((1, 1.0), (2, 0.0), (3, -1.0)):
            passed_s = quarters * 0.025
            expected_mm = to_mm + sign * amplitude_mm * np.exp(-passed_s / 0.1)
            assert carriage.travelled_mm(end_s + passed_s) == pytest.approx(expected_mm)
        assert carriage.travelled_mm(end_s + 2.0 + 0.025) == to_mm


def test_a_full_cache_loses_the_oldest_until_a_fifth_is_free(tmp_path: Path):
    picture = list(np.random.default_rng(1).random((1, 16, 16), np.float32))
    probe = PictureCache(tmp_path / "probe")
    probe.store("aa", picture)
    size = next((tmp_path / "probe").rglob("*.png")).stat().st_size
    cache = PictureCache(tmp_path / "held", largest_bytes=5 * size)
    for number in range(5):
        cache.store(f"k{number}", picture)
    assert len(list((tmp_path / "held").rglob("*.png"))) == 5, "just full"
    cache.store("k5", picture)
    assert len(list((tmp_path / "held").rglob("*.png"))) == 4
    for number in range(6, 20):
        cache.store(f"k{number}", picture)
        assert len(list((tmp_path / "held").rglob("*.png"))) <= 5
