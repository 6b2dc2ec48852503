"""Views of one rig on several OAK devices."""

import itertools

from rig.hardware.opening import open_camera
from tests.support.oak import OakRig, oak_config

TWO = ('camera.sockets.left="second/CAM_A"', 'camera.sockets.top="second/CAM_B"')


def test_sockets_are_sorted_by_their_device():
    config = oak_config(device="1844", sockets={"a": "CAM_B", "b": "192.168.1.7/CAM_A"})
    assert config.by_device == {"1844": {"a": "CAM_B"}, "192.168.1.7": {"b": "CAM_A"}}


def test_two_devices_on_one_trigger_give_one_multiview_in_the_order_of_the_profile():
    profile = OakRig(
        (*TWO, 'camera.sync="external"', "camera.rate_hz=25", "world.capture_scene=board")
    ).profile
    with open_camera(profile) as (camera, clock):
        assert camera.views == ("centre", "left", "right", "top")
        for _ in range(3):
            called_s = clock.now_s()
            multiview = camera.grab(10.0)
            assert tuple(frame.view for frame in multiview.frames) == camera.views
            assert multiview.skew_s < 0.001
            assert min(frame.timestamp_s for frame in multiview.frames) > called_s
        assert len(list(itertools.islice(camera.stream(), 3))) == 3
        serials = {value for key, value in camera.identity.items() if key.endswith(".serial")}
        assert serials == {"sim-oak oak", "sim-oak second"}
