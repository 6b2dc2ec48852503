"""What a person asks for while a capture runs."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rig.capture.asked_for import AskedFor
from rig.errors import StoreError
from rig.live.camera import DepthCamera
from rig.live.captured import read_capture
from rig.recording import recorded
from rig.testing.simulated import open_simulated_rig
from tests.support.shown_frames import scene

SCENE = scene()


@pytest.fixture
def camera() -> Iterator[DepthCamera]:
    with open_simulated_rig() as one:
        yield one


def asked(folder: Path, camera: DepthCamera) -> AskedFor:
    return AskedFor(folder, camera, lambda: datetime(2030, 5, 6, 7, 8, 9, tzinfo=UTC))


def test_nothing_is_made_before_somebody_asks(tmp_path: Path, camera: DepthCamera):
    one = asked(tmp_path / "out", camera)
    one.write(SCENE.frame(0))
    one.close()
    assert one.name == "asked-for"
    assert list(tmp_path.iterdir()) == []


def test_saved_frames_are_a_capture(tmp_path: Path, camera: DepthCamera):
    one = asked(tmp_path / "out", camera)
    assert one.save(SCENE.frame(3)) == f"frame 3 is in {tmp_path / 'out'}"
    one.save(SCENE.frame(8))
    one.close()
    found = list(read_capture(tmp_path / "out"))
    assert [frame.index for frame in found] == [3, 8]
    np.testing.assert_array_equal(found[1].depth_mm, SCENE.frame(8).depth_mm)


def test_a_recording_holds_what_came_between_start_and_stop(tmp_path: Path, camera: DepthCamera):
    one = asked(tmp_path, camera)
    one.write(SCENE.frame(0))
    path = tmp_path / "recording_20300506-070809.mcap"
    assert one.start_recording() == f"recording into {path}"
    assert one.start_recording() == f"recording into {path}", "once is enough"
    assert one.is_recording
    one.write(SCENE.frame(1))
    one.write(SCENE.frame(2))
    assert one.stop_recording() == f"2 multi-views are in {path}"
    assert not one.is_recording
    one.write(SCENE.frame(3))
    assert one.stop_recording() == "nothing is being recorded"
    one.close()
    assert [one.views.frames[0].sequence for one in recorded(path)] == [1, 2]


def test_the_end_of_the_capture_ends_the_recording(tmp_path: Path, camera: DepthCamera):
    one = asked(tmp_path / "new", camera)
    one.start_recording()
    one.write(SCENE.frame(1))
    one.close()
    (path,) = (tmp_path / "new").iterdir()
    assert len(list(recorded(path))) == 1
    for late in (one.start_recording, lambda: one.save(SCENE.frame(0))):
        with pytest.raises(StoreError, match="the capture has ended"):
            late()


def test_what_cannot_be_written_is_told_and_the_next_try_may_go(
    tmp_path: Path, camera: DepthCamera
):
    (tmp_path / "out").write_text("a file stands in the way")
    one = asked(tmp_path / "out", camera)
    for deed in (one.start_recording, lambda: one.save(SCENE.frame(0))):
        with pytest.raises(StoreError, match="cannot be written"):
            deed()
    assert not one.is_recording
    (tmp_path / "out").unlink()
    one.start_recording()
    assert one.is_recording
    one.close()
