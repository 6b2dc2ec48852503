"""The suite of every camera, over five virtual cameras of the kernel."""

import pytest

from rig.devices import SystemClock
from rig.testing import CameraCase
from rig.testing.test_camera import (
    test_a_closed_camera_gives_nothing,
    test_a_frame_is_not_older_than_the_grab_that_asked_for_it,
    test_a_grab_has_every_view_in_the_promised_order,
    test_it_can_be_opened_again,
    test_it_says_who_it_is,
    test_pixels_are_read_only,
    test_times_and_numbers_of_frames_grow,
)
from tests.contract.test_camera import VIEWS
from tests.hardware.vivid.bench import camera_array, use_webcam

pytestmark = pytest.mark.slow

__all__ = [
    "test_a_closed_camera_gives_nothing",
    "test_a_frame_is_not_older_than_the_grab_that_asked_for_it",
    "test_a_grab_has_every_view_in_the_promised_order",
    "test_it_can_be_opened_again",
    "test_it_says_who_it_is",
    "test_pixels_are_read_only",
    "test_times_and_numbers_of_frames_grow",
]


@pytest.fixture
def camera_case() -> CameraCase:
    for number in range(len(VIEWS)):
        use_webcam(number)
    return CameraCase(camera_array(VIEWS), SystemClock(), None)
