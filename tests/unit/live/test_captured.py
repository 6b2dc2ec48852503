"""What a capture wrote comes back as values: folders and recordings."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rig
from rig.capture.capture import CaptureRequest, capture_depth
from rig.errors import CalibrationError, CurveError, FormatError, StoreError
from rig.live.captured import CapturedFrame
from rig.live.frame import DepthFrame
from rig.testing.simulated import CURVE, PROFILE, open_simulated_rig


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("captured")
    request = CaptureRequest(
        frames=2, duration_s=None, folder=folder / "maps", recording=folder / "all.mcap"
    )
    with open_simulated_rig() as camera:
        summary = capture_depth(camera, request, lambda *_: None)
    assert summary.frames == 2
    return folder / "maps", folder / "all.mcap"


def same_frames() -> list[DepthFrame]:
    """The frames of the capture: the same seed gives the same pictures."""
    with open_simulated_rig() as camera:
        return [frame for frame, _ in zip(camera, range(2), strict=False)]


def test_maps_of_a_folder_are_those_of_the_frames(captured: tuple[Path, Path]):
    frames = list(rig.read_capture(captured[0]))
    assert [frame.index for frame in frames] == [0, 1]
    for frame, live in zip(frames, same_frames(), strict=True):
        for name in ("depth_mm", "sigma_mm", "label"):
            assert np.array_equal(getattr(frame, name), getattr(live, name), equal_nan=True), name
        assert np.array_equal(frame.slope_px, live.slopes.slope_px, equal_nan=True)
        assert (frame.camera.matrix == live.camera.matrix).all()
        assert np.array_equal(frame.points_mm(), live.points_mm(), equal_nan=True)
        assert frame.timestamp_s == live.views.timestamp_s
        assert frame.views is None
        assert frame.time_ns is not None
        assert frame.facts["rig"] == "simulated-rig"


def test_pictures_of_a_recording_are_those_of_the_frames(captured: tuple[Path, Path]):
    frames = list(rig.read_capture(str(captured[1])))
    assert [f.time_ns for f in frames] == [f.time_ns for f in rig.read_capture(captured[0])]
    for frame, live in zip(frames, same_frames(), strict=True):
        assert frame.views is not None
        assert np.array_equal(frame.views.images, live.views.images)
        with pytest.raises(
            StoreError, match="holds pictures, asked for depth; measure it: rig capture"
        ):
            _ = frame.depth_mm
        with pytest.raises(StoreError, match="holds pictures, asked for the camera of its maps"):
            _ = frame.camera


def test_a_capture_of_slopes_has_no_depth(tmp_path: Path):
    request = CaptureRequest(frames=1, duration_s=None, folder=tmp_path)
    with rig.open(PROFILE, curve="none", calibration="none") as camera:
        capture_depth(camera, request, lambda *_: None)
    (frame,) = rig.read_capture(tmp_path)
    assert np.isfinite(frame.slope_px[frame.label > 0]).all()
    for name in ("depth_mm", "sigma_mm"):
        with pytest.raises(StoreError, match="holds slopes only"):
            getattr(frame, name)
    with pytest.raises(CalibrationError, match="run `rig calibrate simulated-rig`, capture again"):
        frame.points_mm()


def test_what_is_no_capture_is_refused(tmp_path: Path):
    with pytest.raises(StoreError, match="no such capture"):
        rig.read_capture(tmp_path / "gone")
    with pytest.raises(StoreError, match=r"frames\.jsonl"):
        rig.read_capture(tmp_path)
    (tmp_path / "text").write_text("no recording")
    with pytest.raises(StoreError, match="is no MCAP file, or damaged"):
        list(rig.read_capture(tmp_path / "text"))
    (tmp_path / "frames.jsonl").write_text('{"frame": 0, "timestamp_s": 1.0}\n')
    (tmp_path / "camera.json").write_text("[]")
    with pytest.raises(FormatError, match=r"camera\.json: no camera of depth maps"):
        rig.read_capture(tmp_path)
    (tmp_path / "camera.json").unlink()
    (frame,) = rig.read_capture(tmp_path)
    (tmp_path / "label_00000.png").write_bytes(b"no picture")
    with pytest.raises(
        StoreError, match=r"label_00000\.png: is no picture of labels: it is no image"
    ):
        _ = frame.label


LINE = st.text(max_size=40) | st.dictionaries(
    st.sampled_from(["frame", "timestamp_s", "time_ns"]),
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
).map(json.dumps)


@given(line=LINE)
def test_a_line_of_facts_is_read_or_refused(line: str, tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.getbasetemp() / "facts"
    folder.mkdir(exist_ok=True)
    (folder / "frames.jsonl").write_text(line, encoding="utf-8")
    try:
        frames = list(rig.read_capture(folder))
    except FormatError as error:
        assert "frames.jsonl: line" in error.found
        return
    assert all(isinstance(frame, CapturedFrame) for frame in frames)


def test_a_curve_comes_from_a_file_and_what_is_none_is_refused(tmp_path: Path):
    curve = rig.load_curve(CURVE)
    assert curve == rig.load_curve(str(CURVE))
    path = tmp_path / "curve.json"
    path.write_text(json.dumps(curve.to_json()))
    assert rig.load_curve(path) == curve
    for content in ("{", "[1]", "{}"):
        path.write_text(content)
        with pytest.raises(CurveError, match=r"curve|JSON"):
            rig.load_curve(path)
    with pytest.raises(StoreError, match="there is none"):
        rig.load_curve("nobody", database=f"sqlite:///{tmp_path}/gone.sqlite")
