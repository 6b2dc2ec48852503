"""Recordings: what goes in comes out, also from a file that was cut off, and never nonsense."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rig_drivers.stored.recording import ReplayCamera

from rig.devices import SystemClock
from rig.errors import DeviceLostError, DeviceNotFoundError, OwnedError, StoreError
from rig.frames import Frame, MultiView
from rig.profile import RecordingCameraConfig, ViewConfig
from rig.recording import RecordingWriter, recorded, recorded_views
from tests.support.command import Command
from tests.support.recordings import VIEWS, assert_same, taken, time_ns, written
from tests.support.small_sim import as_options


@pytest.mark.parametrize("bits", [8, 10, 16])
def test_everything_comes_back_exactly(tmp_path: Path, bits: int):
    expected = written(tmp_path / "r.mcap", bits=bits)
    found = list(recorded(tmp_path / "r.mcap"))
    assert recorded_views(tmp_path / "r.mcap") == VIEWS
    for number, (one, other) in enumerate(zip(found, expected, strict=True)):
        assert_same(one.views, other)
        assert one.time_ns == time_ns(number)


def test_a_file_is_never_overwritten(tmp_path: Path):
    written(tmp_path / "r.mcap")
    with pytest.raises(StoreError, match="exists already"):
        RecordingWriter(tmp_path / "r.mcap", VIEWS, {})
    with pytest.raises(StoreError, match="cannot be written: No such file"):
        RecordingWriter(tmp_path / "no" / "r.mcap", VIEWS, {})


def test_a_recording_has_one_writer(tmp_path: Path):
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, VIEWS, {}) as recording:
        with pytest.raises(OwnedError, match=f"it belongs to process {os.getpid()} on"):
            RecordingWriter(path, VIEWS, {})
        recording.write(taken(0, bits=8), time_ns(0))
    assert [file.name for file in tmp_path.iterdir()] == ["r.mcap"]
    assert len(list(recorded(path))) == 1


def test_a_file_that_was_cut_off_ends_with_a_whole_multiview(tmp_path: Path):
    big = np.random.default_rng(1).integers(0, 256, (600, 800)).astype(np.uint8)
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, VIEWS, {}) as recording:
        for number in range(6):
            frames = tuple(Frame(view, big, float(number), number) for view in VIEWS)
            recording.write(MultiView(frames), number)
    content = path.read_bytes()
    assert len(content) < 6 * 2 * 1.05 * big.size
    counts: list[int] = []
    for share in (0.3, 0.55, 0.8):
        path.write_bytes(content[: int(share * len(content))])
        found = list(recorded(path))
        assert all(np.array_equal(f.image, big) for m in found for f in m.views.frames)
        counts.append(len(found))
    assert counts == [1, 3, 4]


@pytest.mark.parametrize("content", [b"", b"no recording at all", bytes(5000)])
def test_something_else_is_refused(tmp_path: Path, content: bytes):
    (tmp_path / "r.mcap").write_bytes(content)
    with pytest.raises(StoreError, match=r"r\.mcap: "):
        recorded_views(tmp_path / "r.mcap")


def damaged(content: bytes, at: int, value: int, cut: int) -> bytes:
    spoilt = bytearray(content)
    spoilt[at % len(spoilt)] = value
    return bytes(spoilt[: max(1, len(spoilt) - cut)])


@given(at=st.integers(0, 1 << 16), value=st.integers(0, 255), cut=st.integers(0, 4000))
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_file_gives_true_images_or_is_refused(
    tmp_path: Path, at: int, value: int, cut: int
):
    path = tmp_path / "r.mcap"
    path.unlink(missing_ok=True)
    expected = written(path, 2)
    path.write_bytes(damaged(path.read_bytes(), at, value, cut))
    try:
        found = list(recorded(path))
    except StoreError:
        return
    for one, other in zip(found, expected, strict=False):
        assert all(
            np.array_equal(f.image, g.image)
            for f, g in zip(one.views.frames, other.frames, strict=True)
        )


def replay(path: Path, *views: str) -> ReplayCamera:
    config = RecordingCameraConfig(kind="recording", file=str(path))
    places = [ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(views)]
    return ReplayCamera(config, places, SystemClock())


def test_played_back_the_times_between_views_stay(tmp_path: Path):
    expected = written(tmp_path / "r.mcap")
    with replay(tmp_path / "r.mcap", "right", "left") as camera:
        found = list(camera.stream())
        with pytest.raises(DeviceLostError, match=r"asked for multi-view 6, .* holds 5"):
            camera.grab(1.0)
    for one, other in zip(found, expected, strict=True):
        assert one.skew_s == pytest.approx(other.skew_s, abs=1e-9)
        assert [frame.view for frame in one.frames] == ["right", "left"]
        assert np.array_equal(one.frames[0].image, other.frames[1].image)


def test_a_recording_of_other_views_is_refused(tmp_path: Path):
    written(tmp_path / "r.mcap")
    with pytest.raises(DeviceNotFoundError, match="holds the views left, right, the profile has"):
        replay(tmp_path / "r.mcap", "left", "top").__enter__()
    with pytest.raises(DeviceNotFoundError, match="cannot be read: No such file"):
        replay(tmp_path / "none.mcap", *VIEWS).__enter__()


@pytest.mark.slow
def test_a_capture_is_recorded_and_measured_again_the_same(rig: Command, tmp_path: Path):
    file = tmp_path / "run.mcap"
    common = ("capture", "sim", "--slopes-only", "--frames", "2", "--json")
    # The wall around the board is plain and has no answer.
    board = ("--set", "quality.valid_share_pct=30", *as_options())
    board = (*board, "--set", "world.capture_scene=board")
    live = rig(*common, *board, "--record", str(file), "--out", str(tmp_path / "live"))
    assert live.code == 0
    played = ("--set", f"camera={{kind = 'recording', file = '{file}'}}", *as_options()[-2:])
    played = ("--set", "quality.valid_share_pct=30", *played)
    again = rig(*common, *played, "--out", str(tmp_path / "again"))
    assert again.code == 0
    for name in ("slope_00000.pfm", "slope_00001.pfm"):
        first = (tmp_path / "live" / name).read_bytes()
        assert first == (tmp_path / "again" / name).read_bytes()
    refused = rig(*common, *played, "--record", str(file), "--out", str(tmp_path / "third"))
    assert refused.code == 1
    assert "exists already" in refused.err
