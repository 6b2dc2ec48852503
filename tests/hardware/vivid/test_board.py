"""A rendered board on its way through the kernel: written to an output node, captured by us."""

from pathlib import Path

import numpy as np
import pytest
from rig_drivers.v4l2.device_views import cameras_of
from rig_drivers.v4l2.kernel import LinuxKernel

from rig.devices import SystemClock
from rig.targets.checkerboard import Checkerboard
from rig.targets.corners import find_corners
from tests.hardware.vivid.bench import (
    camera_config,
    one_camera,
    output_path,
    use_loop,
    use_webcam,
)
from tests.hardware.vivid.guest import RESULTS
from tests.hardware.vivid.output import VideoOutput

pytestmark = pytest.mark.slow

NUMBER = 4


def test_a_rendered_board_arrives_byte_for_byte_and_is_found():
    pictures = np.load(Path(RESULTS, "board.npy"))
    use_loop(NUMBER, "index=0")
    camera = one_camera(NUMBER, width_px=640, height_px=480, rate_hz=59.94)
    try:
        with VideoOutput(output_path(NUMBER), width_px=640, height_px=480) as output:
            output.write(pictures[0])
            with camera:
                first = camera.grab(10.0).frames[0].image
                output.write(pictures[1])
                second = camera.grab(10.0).frames[0].image
    finally:
        use_webcam(NUMBER)
    assert np.array_equal(first, pictures[0])
    assert np.array_equal(second, pictures[1])
    board = Checkerboard(columns=9, rows=6, square_mm=25.0)
    sent, came = find_corners(pictures[0], board), find_corners(first, board)
    assert np.array_equal(sent.xy_px, came.xy_px)
    assert came.xy_px.shape == (6, 9, 2)


def test_both_views_of_a_stereo_picture_arrive_byte_for_byte_from_one_node():
    pictures = np.load(Path(RESULTS, "pair.npy"))
    use_loop(NUMBER, "index=0")
    parts = {"left": "side-by-side:1", "right": "side-by-side:2"}
    config = camera_config(
        dict.fromkeys(parts, NUMBER), width_px=640, height_px=480, rate_hz=59.94, parts=parts
    )
    (camera,) = cameras_of(config, LinuxKernel(), SystemClock())
    try:
        with VideoOutput(output_path(NUMBER), width_px=640, height_px=480) as output:
            output.write(np.hstack(list(pictures)))
            with camera:
                multiview = camera.grab(10.0)
    finally:
        use_webcam(NUMBER)
    assert camera.views == ("left", "right")
    assert multiview.skew_s == 0.0
    for frame, picture in zip(multiview.frames, pictures, strict=True):
        assert np.array_equal(frame.image, picture)
