"""What goes wrong in the middle of a sweep or a capture: told in one line, nothing lost."""

import os
import sqlite3
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

import pytest
from rig_sim.bench import make_firmware
from rig_sim.camera import SimCamera
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.faults import (
    CameraFault,
    FaultyCamera,
    LateViews,
    LostViews,
    StuckCamera,
    UnpluggedCamera,
)
from rig_sim.wire import plug
from rig_sim.wire.faults import BrownOut, Fault, FaultyWire, HangUp, Silence
from rig_sim.world import World

from rig.capture.capture import CaptureRequest, capture_depth
from rig.database import Store, open_store
from rig.errors import (
    CaptureTimeoutError,
    DeviceError,
    DeviceLostError,
    OwnedError,
    RigError,
    StageAlarmError,
    StoreError,
)
from rig.folder_lock import FolderLock
from rig.hardware.opening import Hardware
from rig.live.camera import DepthCamera
from rig.optics.nominal import nominal_optics
from rig.profile import (
    MarlinStageConfig,
    Profile,
    SerialStageConfig,
    SimCameraConfig,
    ZaberStageConfig,
)
from rig.profile.load import load_profile
from rig.stored import Run
from rig.sweep.job import new_sweep, resumed_sweep
from rig.sweep.request import SweepRequest
from rig.sweep.sweep import sweep_and_conclude
from tests.support.command import Command
from tests.support.small_sim import SMALL_SIM
from tests.support.stages import make_stage

REQUEST = SweepRequest(at_mm=(400.0, 500.0, 650.0, 900.0, 1200.0), samples=1)


@pytest.fixture
def profile() -> Profile:
    return load_profile(
        "sim",
        [*SMALL_SIM, "sweep.holdout_every=0", "sweep.backward_every=0"],
    )


@pytest.fixture
def store(tmp_path: Path) -> Generator[Store]:
    with open_store(f"sqlite:///{tmp_path}/rig.sqlite") as opened:
        yield opened


@contextmanager
def bench(
    profile: Profile, *, camera_fault: CameraFault | None = None, wire_fault: Fault | None = None
) -> Generator[tuple[Hardware, Carriage]]:
    assert profile.world is not None
    assert isinstance(profile.stage, SerialStageConfig)
    assert isinstance(profile.camera, SimCameraConfig)
    clock = VirtualClock()
    carriage = Carriage(profile.world.carriage, clock)
    firmware = make_firmware(profile.stage.kind, profile.world.firmware, carriage, clock)
    world = World(profile, clock=clock, carriage=carriage, scene="board")
    camera = SimCamera(profile.camera, world)
    with ExitStack() as stack:
        wire = firmware if wire_fault is None else FaultyWire(firmware, wire_fault)
        stack.enter_context(plug(profile.stage.port, wire))
        stage = stack.enter_context(make_stage(profile.stage, clock))
        seen = (
            camera
            if camera_fault is None
            else FaultyCamera(
                camera,
                camera_fault,
                clock=clock,
                max_skew_s=profile.camera.max_skew_s,
                timeout_s=profile.camera.timeout_s,
            )
        )
        yield Hardware(stack.enter_context(seen), stage, clock), carriage


def depth_camera(profile: Profile, hardware: Hardware) -> DepthCamera:
    run = Run(profile, nominal_optics(profile))
    return DepthCamera(run, lambda: nullcontext((hardware.camera, hardware.clock)))


def stands_still(carriage: Carriage, clock: VirtualClock) -> bool:
    now_s = clock.now_s()
    return abs(carriage.travelled_mm(now_s + 1.0) - carriage.travelled_mm(now_s + 30.0)) < 1e-6


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        (LostViews(("left",), after=2), CaptureTimeoutError),
        (UnpluggedCamera(after=2), DeviceLostError),
        (StuckCamera(after=2), DeviceLostError),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, type) else value.__name__,
)
def test_a_camera_that_fails_half_way_loses_nothing(
    profile: Profile, store: Store, fault: CameraFault, error: type[DeviceError]
):
    told: list[str] = []
    with bench(profile, camera_fault=fault) as (hardware, carriage):
        with pytest.raises(error) as caught:
            sweep_and_conclude(
                new_sweep(store, profile, REQUEST), hardware, store, lambda *_: None, told.append
            )
        assert isinstance(hardware.clock, VirtualClock)
        assert stands_still(carriage, hardware.clock)
    assert "\n" not in str(caught.value)
    assert len(store.samples(1)) == 2
    assert store.sweep(1).state == "failed"
    assert any("go on with: rig sweep sim --resume 1" in line for line in told)


def over(protocol: str, profile: Profile) -> Profile:
    """Return the same rig with a stage that speaks another protocol."""
    stage = profile.stage
    assert stage is not None
    if protocol == "grbl":
        return profile
    values = stage.model_dump(exclude={"kind", "axis"})
    turned = {"direction": -1, "port": f"sim://{protocol}"}
    other = (
        ZaberStageConfig.model_validate(
            {"kind": "zaber", "microstep_mm": 0.0025, **values, **turned}
        )
        if protocol == "zaber"
        else MarlinStageConfig.model_validate({"kind": "marlin", **values, **turned})
    )
    return profile.model_copy(update={"stage": other})


@pytest.mark.slow
@pytest.mark.parametrize("fault", [Silence, HangUp, BrownOut])
@pytest.mark.parametrize(
    ("protocol", "after_bytes"),
    [
        ("grbl", 3000),
        pytest.param("zaber", 12_000, marks=pytest.mark.slow),
        pytest.param("marlin", 3000, marks=pytest.mark.slow),
    ],
)
def test_a_stage_that_fails_half_way_loses_nothing_and_the_sweep_goes_on(
    profile: Profile,
    store: Store,
    fault: Callable[[int], Fault],
    protocol: str,
    after_bytes: int,
):
    profile = over(protocol, profile)
    with (
        pytest.raises((DeviceError, StageAlarmError)),
        bench(profile, wire_fault=fault(after_bytes)) as (hardware, _),
    ):
        sweep_and_conclude(
            new_sweep(store, profile, REQUEST), hardware, store, lambda *_: None, lambda _: None
        )
    assert hardware.clock.now_s() < 120.0
    taken = store.samples(1)
    assert len(taken) < 5
    with bench(profile) as (hardware, _):
        job = resumed_sweep(store, profile, 1)
        result = sweep_and_conclude(job, hardware, store, lambda *_: None, lambda _: None)
    assert sum(stop.point is not None for stop in result.stops) == 5
    assert store.samples(1)[: len(taken)] == taken


def test_a_stage_that_never_answers_is_told(profile: Profile):
    with pytest.raises(DeviceError) as caught, bench(profile, wire_fault=Silence(0)):
        pytest.fail("opening a stage that never answers must not succeed")
    assert "no" in str(caught.value)


def test_skewed_multiviews_are_dropped_and_counted(profile: Profile):
    fault = LateViews(("top",), late_s=0.02, after=1)
    with bench(profile, camera_fault=fault) as (hardware, _), pytest.raises(RigError):
        request = CaptureRequest(frames=3, duration_s=None, folder=None)
        with depth_camera(profile, hardware) as camera:
            capture_depth(camera, request, lambda *_: None)
    assert hardware.camera.dropped["skew"] > 0


def test_no_stage_at_the_port_is_one_line(rig: Command):
    answer = rig("sweep", "sim", "--set", "stage.port=/dev/does-not-exist")
    assert answer.code == 1
    assert answer.err.splitlines()[-1].startswith("rig: ")
    assert "/dev/does-not-exist" in answer.err


def test_a_database_that_cannot_be_written(rig: Command, tmp_path: Path):
    (tmp_path / "file").write_text("")
    answer = rig("history", "--db", f"sqlite:///{tmp_path}/file/rig.sqlite")
    assert answer.code == 1
    assert len(answer.err.splitlines()) == 1


def test_a_database_of_a_newer_version_is_left_alone(rig: Command):
    open_store(os.environ["RIG_DATABASE"]).close()
    path = Path(os.environ["RIG_DATABASE"].removeprefix("sqlite:///"))
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE alembic_version SET version_num = 'rig_9999'")
    connection.close()
    before = path.read_bytes()
    answer = rig("sweep", "sim")
    assert answer.code == 1
    assert "rig_9999" in answer.err
    assert path.read_bytes() == before


def test_a_capture_folder_that_cannot_be_made(profile: Profile, tmp_path: Path):
    (tmp_path / "file").write_text("")
    request = CaptureRequest(frames=1, duration_s=None, folder=tmp_path / "file" / "out")
    with (
        bench(profile) as (hardware, _),
        depth_camera(profile, hardware) as camera,
        pytest.raises(StoreError, match="--out"),
    ):
        capture_depth(camera, request, lambda *_: None)


def test_a_capture_folder_has_one_owner(profile: Profile, tmp_path: Path):
    request = CaptureRequest(frames=1, duration_s=None, folder=tmp_path / "out")
    (tmp_path / "out").mkdir()
    with (
        bench(profile) as (hardware, _),
        depth_camera(profile, hardware) as camera,
        FolderLock(tmp_path / "out"),
        pytest.raises(OwnedError, match=f"out, it belongs to process {os.getpid()} on"),
    ):
        capture_depth(camera, request, lambda *_: None)
    assert [file.name for file in (tmp_path / "out").iterdir()] == []
