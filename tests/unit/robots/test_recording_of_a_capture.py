"""`rig capture --record`: multi-views that play back, with depth that other programs show."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import rig
from rig.capture.capture import CaptureRequest, capture_depth
from rig.testing.simulated import PROFILE, open_simulated_rig


def contents(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        topics = {c.topic for _, c, _ in reader.iter_messages()} - {"/multi_view"}
        for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
            found.setdefault(channel.topic, []).append(message)
    return found


def test_depth_and_cameras_lie_beside_the_pictures(tmp_path: Path):
    request = CaptureRequest(2, None, None, recording=tmp_path / "r.mcap", points=True)
    with open_simulated_rig() as camera:
        capture_depth(camera, request, lambda *_: None)
    with open_simulated_rig() as camera:
        live = [frame for frame, _ in zip(camera, range(2), strict=False)]
    found = contents(tmp_path / "r.mcap")
    assert len(found) == 2 * 5 + 5 + 1
    for number, frame in enumerate(live):
        depth_m = np.frombuffer(found["/depth/image"][number].data, "<f4").reshape(100, 160)
        assert depth_m == pytest.approx(frame.depth_mm / 1000.0, rel=1e-6, nan_ok=True)
        label = np.frombuffer(found["/depth/label"][number].data, np.uint8).reshape(100, 160)
        assert (label == frame.label).all()
        points = np.frombuffer(found["/depth/points"][number].data, "<f4").reshape(-1, 4)
        assert len(points) == np.isfinite(frame.depth_mm).sum()
    calibration = found["/depth/calibration"][0]
    assert calibration.frame_id == "centre_optical_frame"
    assert np.array(calibration.K).reshape(3, 3) == pytest.approx(live[0].camera.matrix)
    again = list(rig.read_capture(tmp_path / "r.mcap"))
    for one, frame in zip(again, live, strict=True):
        assert one.views is not None
        assert np.array_equal(one.views.images, frame.views.images)


def test_slopes_alone_are_recorded_as_pictures_with_frames(tmp_path: Path):
    request = CaptureRequest(1, None, None, recording=tmp_path / "r.mcap")
    with rig.open(PROFILE, curve="none", calibration="none") as camera:
        capture_depth(camera, request, lambda *_: None)
    found = contents(tmp_path / "r.mcap")
    assert set(found) == {*(f"/{view}/image" for view in camera.views), "/tf"}
