"""From a profile to opened devices: the only place that knows drivers and simulation."""

from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.devices import Camera, Clock, Stage, SystemClock
from rig.errors import ConfigError, RigError
from rig.profile import (
    FolderCameraConfig,
    GrblStageConfig,
    MarlinStageConfig,
    OakCameraConfig,
    Profile,
    RecordingCameraConfig,
    SimCameraConfig,
    StageConfig,
    StageProtocol,
    V4l2CameraConfig,
    ZaberStageConfig,
)

if TYPE_CHECKING:
    from rig_drivers.oak.eeprom import Eeprom
    from rig_drivers.oak.sensors import Sensors
    from rig_sim.world import World


@dataclass(frozen=True, slots=True)
class Hardware:
    """The opened devices of one rig, and the clock that they share."""

    camera: Camera
    stage: Stage
    clock: Clock


@contextmanager
def open_hardware(profile: Profile) -> Generator[Hardware]:
    """Open stage and camera of a profile; close both whatever happens.

    Real devices are opened side by side, which takes as long as the slowest; what is simulated
    shares one world and one clock, and is opened in order.

    Raises:
        ConfigError: the profile has no stage.
        DeviceError: a device is not there or does not answer.
    """
    if profile.stage is None:
        raise ConfigError(f"profile {profile.name}: has no [stage]", advice="a sweep needs one")
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=True)
        stage, camera = bench.stage(profile.stage), bench.camera()
        if profile.is_simulated(with_stage=True):
            stack.enter_context(stage)
            stack.enter_context(camera)
        else:
            from rig_drivers.together import open_together

            open_together((stage, camera), name=f"profile {profile.name}")
            stack.push(stage)
            stack.push(camera)
        yield Hardware(camera, stage, bench.clock)


@dataclass(frozen=True, slots=True)
class Answers:
    """The devices of a rig that answered; those that did not say why."""

    camera: Camera | RigError
    stage: Stage | RigError | None
    """None where the profile has no stage."""
    clock: Clock


@contextmanager
def open_what_answers(profile: Profile) -> Generator[Answers]:
    """Open what can be opened of a rig; close it whatever happens."""
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=profile.stage is not None)
        stage: Stage | RigError | None = None
        camera: Camera | RigError
        if profile.stage is not None:
            try:
                stage = stack.enter_context(bench.stage(profile.stage))
            except RigError as error:
                stage = error
        try:
            camera = stack.enter_context(bench.camera())
        except RigError as error:
            camera = error
        yield Answers(camera, stage, bench.clock)


@contextmanager
def open_camera(
    profile: Profile, *, target_in_hand: bool = False
) -> Generator[tuple[Camera, Clock]]:
    """Open only the camera of a profile; no stage is touched.

    Args:
        profile: the rig.
        target_in_hand: whether somebody shows the target to it; a simulated rig then does.

    Raises:
        DeviceError: the camera is not there or does not answer.
    """
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=False, target_in_hand=target_in_hand)
        yield stack.enter_context(bench.camera()), bench.clock


class _Bench:
    """Makes each part when it is asked for; a real bench never imports `sim`."""

    def __init__(
        self,
        profile: Profile,
        stack: ExitStack,
        *,
        uses_stage: bool,
        target_in_hand: bool = False,
    ) -> None:
        self._profile = profile
        self._world: World | None = None
        self.clock: Clock = SystemClock()
        if profile.is_simulated(with_stage=uses_stage):
            from rig_sim.bench import plugged_world

            world = stack.enter_context(
                plugged_world(profile, uses_stage=uses_stage, target_in_hand=target_in_hand)
            )
            self._world, self.clock = world, world.clock

    def camera(self) -> Camera:
        match self._profile.camera:
            case SimCameraConfig() as config:
                from rig_sim.camera import SimCamera

                return SimCamera(config, self._looked_at())
            case FolderCameraConfig() as config:
                from rig_drivers.stored.folder import FolderCamera

                return FolderCamera(
                    config, self._profile.views, root=Path(config.folder), clock=self.clock
                )
            case RecordingCameraConfig() as config:
                from rig_drivers.stored.recording import ReplayCamera

                return ReplayCamera(config, self._profile.views, self.clock)
            case OakCameraConfig() as config:
                return self._oaks(config)
            case V4l2CameraConfig() as config:
                return self._v4l2_array(config)

    def _v4l2_array(self, config: V4l2CameraConfig) -> Camera:
        from rig_drivers.array.camera_array import CameraArray
        from rig_drivers.v4l2 import LinuxKernel, V4l2Camera

        views = [view.name for view in self._profile.views]
        kernel = LinuxKernel()
        return CameraArray(
            [V4l2Camera(config, view, kernel=kernel, clock=SystemClock()) for view in views],
            views=views,
            period_s=1.0 / config.rate_hz,
            max_skew_s=config.max_skew_s,
            timeout_s=config.timeout_s,
        )

    def _oaks(self, config: OakCameraConfig) -> Camera:
        from rig_drivers.oak.camera import OakCamera

        views = [view.name for view in self._profile.views]
        cameras = [
            OakCamera(
                config,
                [view for view in views if view in sockets],
                self._oak_sensors(config, device, sockets),
                self.clock,
            )
            for device, sockets in config.by_device.items()
        ]
        if len(cameras) == 1:
            return cameras[0]
        from rig_drivers.array.camera_array import CameraArray

        return CameraArray(
            cameras,
            views=views,
            period_s=1.0 / config.rate_hz,
            max_skew_s=config.max_skew_s,
            timeout_s=config.timeout_s,
        )

    def _oak_sensors(
        self, config: OakCameraConfig, device: str, sockets: Mapping[str, str]
    ) -> "Sensors":
        if not config.is_simulated:
            from rig_drivers.oak.device_sensors import DeviceSensors

            return DeviceSensors(config, device, sockets)
        from rig_drivers.oak.host_sensors import HostSensors
        from rig_sim.oak import SimOakRack

        return HostSensors(
            SimOakRack(config, self._looked_at(), device=device, views=tuple(sockets))
        )

    def _looked_at(self) -> "World":
        if self._world is None:
            raise ConfigError(
                f"profile {self._profile.name}: has no [world] to look at",
                advice="add it to the file",
            )
        return self._world

    def stage(self, config: StageConfig) -> Stage:
        match config:
            case GrblStageConfig():
                from rig_drivers.grbl.controller import grbl_stage

                return grbl_stage(config, self.clock)
            case ZaberStageConfig():
                from rig_drivers.zaber.controller import zaber_stage

                return zaber_stage(config, self.clock)
            case MarlinStageConfig():
                from rig_drivers.marlin.controller import marlin_stage

                return marlin_stage(config, self.clock)


@contextmanager
def oak_eeprom(device: str) -> Generator["Eeprom"]:
    """Open an OAK device for the calibration in its EEPROM; no sensor is started.

    Args:
        device: id or address; empty for the only one.

    Raises:
        ConfigError: the extra `oak` is not installed.
        DeviceNotFoundError: it is not there or cannot be opened.
    """
    from rig_drivers.oak.eeprom import open_eeprom

    with open_eeprom(device) as eeprom:
        yield eeprom


def serve_simulated_stage(
    profile: Profile,
    protocol: StageProtocol,
    on_ready: Callable[[str], None],
    *,
    tcp_port: int | None = None,
) -> None:
    """Run the simulated stage of a profile on a pty or TCP port, in real time, until interrupted.

    Args:
        profile: a simulated rig.
        protocol: what its controller speaks.
        on_ready: called once with the path or URL of the port to open.
        tcp_port: TCP port on the loopback interface, 0 for a free one; None for a pty.

    Raises:
        ConfigError: the profile has no `[world]`, or the TCP port is taken.
    """
    from rig_sim.bench import serve_stage

    serve_stage(profile, protocol, on_ready, tcp_port=tcp_port)
