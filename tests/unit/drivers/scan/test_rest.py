"""What moved between two takes of the reference."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.scan.rest import find_motion, show_motion

from rig.errors import StoreError
from rig.frames import Frame, GreyImage


def scene(seed: int, *, shift_px: float = 0.0, gain: float = 1.0) -> GreyImage:
    """Waves in both directions, shot noise; the same scene for every seed."""
    y, x = np.mgrid[0:192, 0:256].astype(np.float64)
    light = 100.0 + 50.0 * np.sin((x - shift_px) / 6.0) * np.cos(y / 9.0)
    noise = np.random.default_rng(seed).normal(size=light.shape) * np.sqrt(light / 40.0)
    return np.rint(gain * light + noise).astype(np.uint8)


def frame(image: GreyImage) -> Frame:
    return Frame("reference", image, 0.0, 0)


@pytest.mark.parametrize("seed", range(6))
def test_noise_alone_is_rest(seed: int):
    assert find_motion(frame(scene(2 * seed)), frame(scene(2 * seed + 1)), 0.1) is None


def test_other_light_is_rest():
    assert find_motion(frame(scene(1)), frame(scene(2, gain=1.04)), 0.1) is None


def test_a_region_that_changed_is_named_to_the_block():
    after = scene(2).copy()
    after[64:96, 128:176] = 30
    motion = find_motion(frame(scene(1)), frame(after), 0.1)
    assert motion is not None
    assert motion.region_px == (128, 64, 176, 96)
    before = scene(1)[64:96, 128:176].astype(float)
    assert motion.change_levels == pytest.approx(np.sqrt(np.mean((before - 30) ** 2)), rel=0.05)


def test_the_largest_of_two_regions_is_named():
    after = scene(2).copy()
    after[0:16, 0:32] = 30
    after[96:144, 32:64] = 30
    motion = find_motion(frame(scene(1)), frame(after), 0.1)
    assert motion is not None
    assert motion.region_px == (32, 96, 64, 144)


def test_one_block_alone_is_a_fly():
    after = scene(2).copy()
    after[64:80, 128:144] = 30
    assert find_motion(frame(scene(1)), frame(after), 0.1) is None


@pytest.mark.parametrize(("shift_px", "is_moved"), [(0.05, False), (0.6, True)])
def test_a_scene_that_shifted_as_a_whole_counts_from_the_tolerance(shift_px: float, is_moved: bool):
    motion = find_motion(frame(scene(1)), frame(scene(2, shift_px=shift_px)), 0.2)
    assert (motion is not None) == is_moved


def test_saturated_pixels_tell_no_change():
    before, after = scene(1).copy(), scene(2).copy()
    before[64:128, 64:128] = 255
    after[64:128, 64:128] = 240
    assert find_motion(frame(before), frame(after), 0.1) is None


def test_a_motion_is_shown_by_a_red_frame_around_it(tmp_path: Path):
    after = scene(2).copy()
    after[64:96, 128:176] = 30
    motion = find_motion(frame(scene(1)), frame(after), 0.1)
    assert motion is not None
    show_motion(frame(after), motion, tmp_path / "moved.png")
    shown = cv2.imread(str(tmp_path / "moved.png"))
    assert shown is not None
    left, top, right, bottom = motion.region_px
    red = (shown == (0, 0, 255)).all(axis=2)
    rows, columns = np.flatnonzero(red.any(axis=1)), np.flatnonzero(red.any(axis=0))
    # A line of two pixels, drawn on and beside the outermost ones of the region.
    assert (columns[0], columns[-1]) == (left - 1, right)
    assert (rows[0], rows[-1]) == (top - 1, bottom)
    assert not red[top + 2 : bottom - 2, left + 2 : right - 2].any()
    with pytest.raises(StoreError):
        show_motion(frame(after), motion, tmp_path / "gone" / "moved.png")
