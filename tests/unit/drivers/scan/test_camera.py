"""A camera that moves, on the simulated slider with its true firmware on the wire."""

import json
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_drivers.scan.camera import ScanCamera
from rig_drivers.scan.on_disk import begin, go_on
from rig_drivers.scan.route import Halt, route, still_to_take
from rig_sim.bench import plugged_world
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock

from rig.devices import Camera
from rig.errors import (
    CameraUseError,
    CaptureTimeoutError,
    DeviceLostError,
    OwnedError,
    SceneMovedError,
    StageAlarmError,
    StoreError,
)
from rig.frames import MultiView
from rig.hardware.opening import open_camera
from rig.profile import Profile, ScanCameraConfig
from rig.profile.kinds import ScanKeeping
from rig.profile.load import load_profile
from rig.profile.scan_camera import REFERENCE
from rig.scan import MovedCamera
from tests.support.small_scan import SMALL_SCAN

ROW = "camera.row.at_mm=[-20.0, 0.0, 12.5]"
PATIENCE_S = 900.0


def rig(*more: str) -> Profile:
    return load_profile("sim-scan", (*SMALL_SCAN, ROW, *more))


@contextmanager
def opened(profile: Profile, scans: ScanKeeping | None = None) -> Generator[ScanCamera]:
    with open_camera(profile, scans=scans) as (camera, _clock):
        assert isinstance(camera, ScanCamera)
        yield camera


class Failing:
    """A camera that fails at one of its grabs, or does something before it."""

    def __init__(self, camera: Camera, at: int, act: Callable[[], None]) -> None:
        self._camera = camera
        self._left = at
        self._act = act

    def __getattr__(self, name: str) -> Any:
        return getattr(self._camera, name)

    def __enter__(self) -> "Failing":
        self._camera.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._camera.__exit__(*error)

    def grab(self, timeout_s: float) -> MultiView:
        if self._left == 0:
            self._act()
        self._left -= 1
        return self._camera.grab(timeout_s)


def pull_the_cable() -> None:
    raise DeviceLostError("camera test", "pulled", advice="plug it in")


def break_camera(
    monkeypatch: pytest.MonkeyPatch, at: int, act: Callable[[], None] = pull_the_cable
) -> None:
    """Let the carried camera fail at its grab of this number, from 0."""
    begin = ScanCamera.__init__

    def broken(self: ScanCamera, config: ScanCameraConfig, around: Any, inner: Camera) -> None:
        failing = cast("Camera", Failing(inner, at, act))
        begin(self, config, around, failing)

    monkeypatch.setattr(ScanCamera, "__init__", broken)


def test_a_route_has_its_reference_at_both_ends_and_in_the_middle():
    config = rig().camera
    assert isinstance(config, ScanCameraConfig)
    halts = route(config)
    assert [(h.view, h.role, h.places_mm) for h in halts] == [
        (REFERENCE, "first", (0.0,)),
        ("h0", "view", (-20.0,)),
        (REFERENCE, "view", (0.0,)),
        ("h2", "view", (12.5,)),
        (REFERENCE, "last", (0.0,)),
    ]
    assert still_to_take(halts, ()) == halts
    assert still_to_take(halts, halts) == ()
    again = Halt(REFERENCE, "again", (0.0,))
    assert still_to_take(halts, halts[:3]) == (again, *halts[3:])


def test_a_column_crosses_the_row_at_its_reference():
    column = (
        "camera.column={at_mm=[4.0, 5.0], reference_mm=4.0}",
        'stages.column={kind="manual", carries="camera", travel_mm=[0.0, 9.0]}',
    )
    config = rig(*column).camera
    assert isinstance(config, ScanCameraConfig)
    assert [(h.view, h.role, h.places_mm) for h in route(config)] == [
        (REFERENCE, "first", (0.0, 4.0)),
        ("h0", "view", (-20.0, 4.0)),
        (REFERENCE, "view", (0.0, 4.0)),
        ("h2", "view", (12.5, 4.0)),
        (REFERENCE, "again", (0.0, 4.0)),
        ("v1", "view", (0.0, 5.0)),
        (REFERENCE, "last", (0.0, 4.0)),
    ]


def test_a_grab_is_a_scan_that_says_so():
    with opened(rig()) as camera:
        found = camera.grab(PATIENCE_S)
        assert camera.views == (REFERENCE, "h0", "h2")
        assert isinstance(camera, MovedCamera)
        assert camera.row_mm == ((-20.0,), (0.0,), (12.5,))
        assert camera.identity["kind"] == "scan"
        assert camera.identity["row port"] == "sim://slider"
        assert camera.dropped == {}
    assert found.scan is not None
    assert [frame.view for frame in found.frames] == [REFERENCE, "h0", "h2"]
    assert found.skew_s == 0.0
    assert found.frames[1].timestamp_s < found.frames[0].timestamp_s < found.frames[2].timestamp_s
    assert found.scan.facts.positions_mm == {
        "h0": (-20.0, None),
        REFERENCE: (0.0, None),
        "h2": (12.5, None),
    }
    assert [take.role for take in found.scan.facts.takes] == [
        "first",
        "view",
        "view",
        "view",
        "last",
    ]
    assert len(found.scan.reference) == 3


@pytest.mark.slow
def test_two_stages_carry_a_camera_over_a_cross():
    port = 'kind="grbl", carries="camera", port="sim://column", travel_mm=[-60.0, 60.0]'
    column = (
        "camera.column.at_mm=[-15.0, 0.0, 20.0]",
        f"stages.column={{{port}, distance_at_machine_zero_mm=80.0, speed_mm_s=20.0}}",
        "world.column.camera_at_machine_zero_mm=80.0",
    )
    with opened(rig(*column)) as camera:
        found = camera.grab(PATIENCE_S)
        assert camera.identity["column port"] == "sim://column"
    assert found.scan is not None
    assert found.scan.facts.positions_mm == {
        "h0": (-20.0, 0.0),
        REFERENCE: (0.0, 0.0),
        "h2": (12.5, 0.0),
        "v0": (0.0, -15.0),
        "v2": (0.0, 20.0),
    }
    # A camera farther down sees everything farther up: by f / Z px per mm.
    above, below = (found.frames[place].image.astype(float) for place in (3, 4))
    rows = [np.average(np.arange(100.0), weights=np.mean(i, axis=1)) for i in (above, below)]
    assert rows[1] < rows[0]


def test_a_scan_takes_little_longer_than_moves_settling_and_exposures():
    with opened(rig()) as camera:
        camera.home()
        found = camera.grab(PATIENCE_S)
    assert found.scan is not None
    times = found.scan.facts.times
    assert times.settling_s == pytest.approx(5 * 2.5)
    assert times.total_s <= 1.02 * times.needed_s
    # The way with its approaches at 20 mm/s: no move is quicker than that.
    assert times.moves_s > (20.0 + 20.0 + 12.5 + 12.5) / 20.0


@pytest.mark.slow
def test_lamps_that_drift_are_taken_out_of_the_views():
    steady = rig("world.lamp.drift_pct_per_min=0.0", "world.sensor.read_noise_levels=0.0")
    swift = rig("world.lamp.drift_pct_per_min=30.0", "world.lamp.swing_pct=20.0")
    with opened(steady) as camera:
        plain = camera.grab(PATIENCE_S)
    with opened(swift) as camera:
        found = camera.grab(PATIENCE_S)
    assert found.scan is not None
    assert plain.scan is not None
    assert plain.scan.facts.brightness_drift < 0.002
    assert found.scan.facts.brightness_drift > 0.05
    bright = plain.frames[0].image > 150
    ratios = [
        np.mean(f.image[bright]) / np.mean(p.image[bright])
        for f, p in zip(found.frames, plain.frames, strict=True)
    ]
    assert ratios[1] / ratios[0] == pytest.approx(1.0, abs=0.01)
    assert ratios[2] / ratios[0] == pytest.approx(1.0, abs=0.01)


def test_a_stream_is_refused_with_the_reason():
    with opened(rig()) as camera, pytest.raises(CameraUseError, match="moves through 5 takes"):
        camera.stream()


def test_a_camera_that_is_not_open_gives_nothing():
    with opened(rig()) as camera:
        pass
    with pytest.raises(DeviceLostError, match="not open"):
        camera.grab(PATIENCE_S)


def test_a_scan_has_no_longer_than_it_was_given():
    with opened(rig()) as camera, pytest.raises(CaptureTimeoutError, match="h2") as caught:
        camera.grab(12.0)
    assert caught.value.timeout_s == 12.0


@pytest.mark.parametrize("at", [0, 3])
def test_whatever_ends_a_scan_leaves_its_stage_standing(at: int, monkeypatch: pytest.MonkeyPatch):
    stops: list[float] = []
    break_camera(monkeypatch, at)
    with opened(rig()) as camera:
        (carrier,) = camera._carriers  # pyright: ignore[reportPrivateUsage]
        stop = carrier.stop
        monkeypatch.setattr(carrier, "stop", lambda: stops.append(carrier.position_mm) or stop())
        with pytest.raises(DeviceLostError, match="pulled"):
            camera.grab(PATIENCE_S)
    assert len(stops) == 1


def test_a_stage_that_cannot_be_stopped_is_told(monkeypatch: pytest.MonkeyPatch):
    def stuck() -> None:
        raise KeyError("no such register")

    break_camera(monkeypatch, 1)
    with opened(rig()) as camera:
        (carrier,) = camera._carriers  # pyright: ignore[reportPrivateUsage]
        with monkeypatch.context() as broken:
            broken.setattr(carrier, "stop", stuck)
            with pytest.raises(StageAlarmError, match=r"ended \(.*pulled.* row: the stage may st"):
                camera.grab(PATIENCE_S)


def test_a_scene_that_moved_refuses_the_scan_and_shows_where(tmp_path: Path):
    profile = rig("world.hand.hold_s=20.0", "world.hand.move_s=1.0")
    keeping = ScanKeeping(tmp_path / "scans")
    with open_camera(profile, target_in_hand=True, scans=keeping) as (camera, _clock):
        with pytest.raises(SceneMovedError, match="the scene moved during the scan") as caught:
            for _ in range(3):
                camera.grab(PATIENCE_S)
        left, top, right, bottom = caught.value.region_px
        assert 0 <= left < right <= 160
        assert 0 <= top < bottom <= 100
        assert Path(caught.value.picture).is_file()
        folder = Path(caught.value.picture).parent
        assert json.loads((folder / "end.json").read_text()) == {"state": "moved"}


def test_an_interrupted_scan_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    keeping = ScanKeeping(tmp_path / "scans")
    with monkeypatch.context() as broken:
        break_camera(broken, 2)
        with opened(rig(), keeping) as camera, pytest.raises(DeviceLostError):
            camera.grab(PATIENCE_S)
    (folder,) = keeping.folder.iterdir()
    before = {file.name: file.read_bytes() for file in folder.glob("take_*")}
    assert sorted(before) == ["take_000.json", "take_000.png", "take_001.json", "take_001.png"]
    with opened(rig(), ScanKeeping(keeping.folder, resume=True)) as camera:
        found = camera.grab(PATIENCE_S)
    assert {name: (folder / name).read_bytes() for name in before} == before
    assert found.scan is not None
    assert [(take.role, take.session) for take in found.scan.facts.takes] == [
        ("first", 0),
        ("view", 0),
        ("again", 1),
        ("view", 1),
        ("view", 1),
        ("last", 1),
    ]
    assert json.loads((folder / "end.json").read_text()) == {"state": "complete"}


@pytest.mark.slow
def test_a_complete_scan_is_given_again_without_a_move(tmp_path: Path):
    keeping = ScanKeeping(tmp_path / "scans")
    with opened(rig(), keeping) as camera:
        first = camera.grab(PATIENCE_S)
    with opened(rig(), ScanKeeping(keeping.folder, resume=True)) as camera:
        again = camera.grab(PATIENCE_S)
        assert len(list(keeping.folder.iterdir())) == 1
        camera.grab(PATIENCE_S)
    assert len(list(keeping.folder.iterdir())) == 2
    for one, other in zip(first.frames, again.frames, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
    assert again.scan is not None
    assert again.scan.facts.times.moves_s == 0.0


@pytest.mark.slow
def test_a_take_that_was_taken_away_is_taken_again_and_no_other_is_lost(tmp_path: Path):
    with opened(rig(), ScanKeeping(tmp_path)) as camera:
        camera.grab(PATIENCE_S)
    (folder,) = tmp_path.iterdir()
    (folder / "take_001.json").unlink()
    kept = {name: (folder / name).read_bytes() for name in ("take_003.png", "take_004.png")}
    with opened(rig(), ScanKeeping(tmp_path, resume=True)) as camera:
        found = camera.grab(PATIENCE_S)
    assert {name: (folder / name).read_bytes() for name in kept} == kept
    assert found.scan is not None
    assert [(take.view, take.session) for take in found.scan.facts.takes if take.session] == [
        (REFERENCE, 1),
        ("h0", 1),
    ]
    assert (folder / "take_006.json").is_file()


@pytest.mark.slow
def test_a_scan_of_another_program_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    keeping, resuming = (
        ScanKeeping(tmp_path / "scans"),
        ScanKeeping(tmp_path / "scans", resume=True),
    )
    seen: list[OwnedError] = []

    def another() -> None:
        profile = rig('stages.camera.port="sim://other"')
        with opened(profile, resuming) as camera, pytest.raises(OwnedError) as caught:
            camera.grab(PATIENCE_S)
        seen.append(caught.value)

    break_camera(monkeypatch, 1, another)
    with opened(rig(), keeping) as camera:
        monkeypatch.undo()
        camera.grab(PATIENCE_S)
    assert len(seen) == 1


@pytest.mark.slow
def test_nothing_to_resume_and_another_scan_are_told(tmp_path: Path):
    resuming = ScanKeeping(tmp_path / "scans", resume=True)
    with opened(rig(), resuming) as camera, pytest.raises(StoreError, match="there is none"):
        camera.grab(PATIENCE_S)
    with opened(rig(), ScanKeeping(tmp_path / "scans")) as camera:
        camera.grab(PATIENCE_S)
    other = load_profile("sim-scan", (*SMALL_SCAN, "camera.row.at_mm=[-21.0, 0.0, 12.5]"))
    with opened(other, resuming) as camera, pytest.raises(StoreError, match="other positions"):
        camera.grab(PATIENCE_S)


def test_a_damaged_take_is_told(tmp_path: Path):
    with opened(rig(), ScanKeeping(tmp_path)) as camera:
        camera.grab(PATIENCE_S)
    (picture,) = tmp_path.glob("*/take_002.png")
    picture.write_bytes(b"no picture")
    resuming = ScanKeeping(tmp_path, resume=True)
    with (
        opened(rig(), resuming) as camera,
        pytest.raises(StoreError, match=r"take_002\.png: the t"),
    ):
        camera.grab(PATIENCE_S)


@pytest.mark.parametrize("name", ["plan.json", "end.json", "take_001.json"])
@given(text=st.sampled_from(["", "{", "[1]", "{}"]) | st.text(max_size=20))
@settings(max_examples=10, deadline=None)
def test_a_damaged_file_of_a_scan_is_one_line(name: str, text: str):
    with TemporaryDirectory() as place:
        keeping = ScanKeeping(Path(place))
        begin(keeping, {"a": 1}, 0.0).close()
        (folder,) = keeping.folder.iterdir()
        (folder / name).write_text(text, encoding="utf-8", newline="")
        (folder / "take_001.png").write_bytes(b"")
        try:
            go_on(keeping, {"a": 1}, 0.0).close()
            assert name == "end.json"  # a state that nobody writes: the scan has not moved
        except StoreError as error:
            assert "\n" not in str(error)
            assert error.advice


def test_the_simulated_camera_of_a_scan_is_one(tmp_path: Path):
    with plugged_world(rig(), uses_stage=False) as world:
        config = rig().camera
        assert isinstance(config, ScanCameraConfig)
        camera = SimCamera(config.inner, world)  # pyright: ignore[reportArgumentType]
        assert camera.views == ("camera",)
        assert isinstance(world.clock, VirtualClock)
        assert world.true_slope_px(610.0) == pytest.approx(20.0 * 152.5 / 610.0)
        assert world.lamp(0.0) == 1.0
        # 5 % per minute at first; never more than 5 % to either side.
        assert world.lamp(0.6) == pytest.approx(1.0005, abs=1e-5)
        assert world.lamp(30.0 * np.pi) == pytest.approx(1.05, abs=1e-5)
