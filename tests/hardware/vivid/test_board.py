"""A rendered board on its way through the kernel: written to an output node, captured by us."""

import numpy as np
import pytest

from rig.frames import GreyImage
from rig.geometry.board import Board
from rig.geometry.corners import find_corners
from tests.hardware.vivid.bench import one_camera, output_path, use_loop, use_webcam
from tests.hardware.vivid.output import VideoOutput
from tests.support.cameras import SmallRig

pytestmark = pytest.mark.slow

NUMBER = 4


def rendered(at_mm: float) -> GreyImage:
    """Return what the reference view of the simulated rig sees of its board."""
    rig = SmallRig(("camera.width_px=640", "camera.height_px=480"))
    rig.slide.at_mm = at_mm
    with rig.camera() as camera:
        return camera.grab(1.0).frames[0].image


def test_a_rendered_board_arrives_byte_for_byte_and_is_found():
    pictures = [rendered(-603.0), rendered(-500.0)]
    use_loop(NUMBER, "index=0")
    camera = one_camera(NUMBER, width_px=640, height_px=480, rate_hz=59.94)
    try:
        with VideoOutput(output_path(NUMBER), width_px=640, height_px=480) as output:
            output.write(pictures[0])
            with camera:
                first = camera.grab(5.0).frames[0].image
                output.write(pictures[1])
                second = camera.grab(5.0).frames[0].image
    finally:
        use_webcam(NUMBER)
    assert np.array_equal(first, pictures[0])
    assert np.array_equal(second, pictures[1])
    board = Board(columns=9, rows=6, square_mm=25.0)
    sent, came = find_corners(pictures[0], board), find_corners(first, board)
    assert np.array_equal(sent.xy_px, came.xy_px)
    assert len(came.xy_px) == 54
