"""Light that changes between takes of the reference, against light that was changed on purpose."""

import numpy as np
import pytest
from rig_drivers.scan.brightness import Light, block_means, in_one_light, lights, relative_light
from rig_drivers.scan.kept import Kept
from rig_drivers.scan.route import Halt

from rig.frames import Frame, GreyImage
from rig.profile.scan_camera import REFERENCE

BLACK = 8.0


def scene(gain: float, seed: int = 0, contrast: float = 1.0) -> GreyImage:
    """Blocks of many brightnesses and a little noise, in some light, on a black level."""
    random = np.random.default_rng(seed)
    blocks = 90.0 + contrast * 70.0 * np.sin(np.arange(80.0)).reshape(8, 10)
    light = np.kron(blocks, np.ones((16, 16)))
    grey = BLACK + gain * light + random.normal(0.0, 0.5, light.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def frame(image: GreyImage, at_s: float = 0.0, view: str = REFERENCE) -> Frame:
    return Frame(view, image, at_s, 0)


def take(view: str, at_s: float, gain: float, session: int = 0) -> Kept:
    image = scene(gain, int(10 * at_s) + 100 * session)
    halt = Halt(view, "view", (0.0,))
    return Kept(halt, (0.0,), frame(image, at_s, view), session, None)


def test_gain_and_black_level_are_told_apart():
    found = relative_light(frame(scene(1.05, 1)), frame(scene(1.0, 2)))
    assert found.gain == pytest.approx(1.05, abs=1e-3)
    assert found.offset_levels == pytest.approx(BLACK * (1.0 - 1.05), abs=0.1)


def test_a_part_that_moved_does_not_bend_the_light():
    moved = scene(0.95, 3).copy()
    moved[:32, :48] = 200
    found = relative_light(frame(moved), frame(scene(1.0, 4)))
    assert found.gain == pytest.approx(0.95, abs=2e-3)


def test_a_scene_of_one_brightness_has_a_gain_alone():
    found = relative_light(frame(scene(1.1, 5, 0.0)), frame(scene(1.0, 6, 0.0)))
    assert found.offset_levels == 0.0
    assert found.gain == pytest.approx((BLACK + 99.0) / (BLACK + 90.0), abs=1e-3)


def test_saturated_blocks_tell_nothing():
    full = np.full((128, 160), 255, np.uint8)
    assert relative_light(frame(full), frame(full)) == Light()


def test_means_are_of_whole_blocks():
    image = np.zeros((40, 50), np.uint8)
    image[16:32, 32:48] = 100
    assert block_means(image).tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 100.0]]


def test_light_is_taken_out_and_what_is_saturated_stays():
    image = np.array([[100, 255, 0, 250]], np.uint8)
    np.testing.assert_array_equal(in_one_light(frame(image), Light()), image)
    found = in_one_light(frame(image), Light(0.5, 10.0))
    assert found.tolist() == [[180, 255, 0, 255]]
    assert found.dtype == np.uint8


def test_light_between_two_takes_of_the_reference_changes_evenly():
    takes = [take(REFERENCE, 0.0, 1.0), take("h0", 1.0, 1.01), take("h1", 3.0, 1.03)]
    takes.append(take(REFERENCE, 4.0, 1.04))
    gains = [light.gain for light in lights(takes, takes[0])]
    assert gains == pytest.approx([1.0, 1.01, 1.03, 1.04], abs=1e-3)
    assert gains[0] == 1.0


def test_sessions_are_not_mixed():
    takes = [take(REFERENCE, 0.0, 1.0), take("h0", 9.0, 1.0)]
    takes += [take(REFERENCE, 0.0, 1.2, session=1), take("h1", 9.0, 1.2, session=1)]
    takes.append(take("h2", 0.0, 1.0, session=2))
    gains = [light.gain for light in lights(takes, takes[0])]
    assert gains == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.0], abs=2e-3)
