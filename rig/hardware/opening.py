"""From a profile to opened devices: the only place that knows drivers and simulation."""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rig.devices import Bystander, Camera, Clock, Stage, SystemClock
from rig.errors import ConfigError, RigError
from rig.profile import RAW_VIEW, CameraConfig, Profile, ScanCameraConfig, StageConfig
from rig.profile.kinds import ScanKeeping, Surroundings
from rig.profile.plugins import CAMERAS, STAGES

if TYPE_CHECKING:
    from rig_drivers.oak.eeprom import Eeprom
    from rig_sim.bench import SimulatedBench


@dataclass(frozen=True, slots=True)
class Hardware:
    """The opened devices of one rig, and the clock that they share."""

    camera: Camera
    stage: Stage
    clock: Clock


@contextmanager
def open_hardware(profile: Profile, bystander: Bystander | None = None) -> Generator[Hardware]:
    """Open stage and camera of a profile; close both whatever happens.

    Real devices are opened side by side, which takes as long as the slowest; what is simulated
    shares one world and one clock, and is opened in order.

    Args:
        profile: the rig.
        bystander: whom a stage that is a person may ask beside the terminal.

    Raises:
        ConfigError: the profile has no stage.
        DeviceError: a device is not there or does not answer.
    """
    if profile.stage is None:
        raise ConfigError(f"profile {profile.name}: has no [stage]", advice="a sweep needs one")
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=True, bystander=bystander)
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
    profile: Profile, *, target_in_hand: bool = False, scans: ScanKeeping | None = None
) -> Generator[tuple[Camera, Clock]]:
    """Open only the camera of a profile, with the stages that carry it; that of the board rests.

    Args:
        profile: the rig.
        target_in_hand: whether somebody shows the target to it; a simulated rig then does.
        scans: where a camera that moves keeps what it takes; None in memory.

    Raises:
        DeviceError: the camera is not there or does not answer.
    """
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=False, target_in_hand=target_in_hand, scans=scans)
        yield stack.enter_context(bench.camera()), bench.clock


@contextmanager
def open_raw_camera(profile: Profile, config: CameraConfig) -> Generator[Camera]:
    """Open the camera that gives raw pictures of a lenslet array, behind a diffuser.

    Args:
        profile: the rig.
        config: the camera inside its camera, or another one of one view in its place.

    Raises:
        DeviceError: the camera is not there or does not answer.
    """
    with ExitStack() as stack:
        bench = _Bench(profile, stack, uses_stage=False, behind_diffuser=True)
        yield stack.enter_context(bench.raw_camera(config))


class _Bench:
    """Makes each part when it is asked for; a real bench never imports `sim`."""

    def __init__(
        self,
        profile: Profile,
        stack: ExitStack,
        *,
        uses_stage: bool,
        target_in_hand: bool = False,
        scans: ScanKeeping | None = None,
        behind_diffuser: bool = False,
        bystander: Bystander | None = None,
    ) -> None:
        self._profile = profile
        self.clock: Clock = SystemClock()
        self._simulated: SimulatedBench | None = None
        if profile.is_simulated(with_stage=uses_stage):
            from rig_sim import bench

            world = stack.enter_context(
                bench.plugged_world(
                    profile,
                    uses_stage=uses_stage,
                    target_in_hand=target_in_hand,
                    behind_diffuser=behind_diffuser,
                )
            )
            self._simulated, self.clock = bench.SimulatedBench(world), world.clock
        self._around = Surroundings(
            profile.name,
            profile.views,
            self.clock,
            self._simulated,
            scans=scans,
            bystander=bystander,
        )

    def camera(self) -> Camera:
        config, around = self._profile.camera, self._around
        if isinstance(config, ScanCameraConfig):
            carried = replace(around, views=(config.inner_view,))
            around = replace(
                around,
                inner=CAMERAS.kind(config.inner.kind).open(config.inner, carried),
                carriers=tuple(map(self.stage, self._profile.stages.carriers.values())),
            )
        return CAMERAS.kind(config.kind).open(config, around)

    def raw_camera(self, config: CameraConfig) -> Camera:
        around = replace(self._around, views=(RAW_VIEW,))
        return CAMERAS.kind(config.kind).open(config, around)

    def stage(self, config: StageConfig) -> Stage:
        stage = STAGES.kind(config.kind).open(config, self._around)
        if self._simulated is None or config.is_simulated:
            return stage
        return self._simulated.rehearsed(stage)  # a true stage before a simulated camera


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
    protocol: str,
    on_ready: Callable[[str], None],
    *,
    tcp_port: int | None = None,
) -> None:
    """Run the simulated stage of a profile on a pty or TCP port, in real time, until interrupted.

    Args:
        profile: a simulated rig.
        protocol: what its controller speaks, one of `simulated_protocols`.
        on_ready: called once with the path or URL of the port to open.
        tcp_port: TCP port on the loopback interface, 0 for a free one; None for a pty.

    Raises:
        ConfigError: the profile has no `[world]`, the protocol is not simulated, or the TCP port
            is taken.
    """
    from rig_sim.bench import serve_stage

    serve_stage(profile, protocol, on_ready, tcp_port=tcp_port)


def simulated_protocols() -> tuple[str, ...]:
    """Return the kinds of stages that `serve_simulated_stage` can be."""
    from rig_sim.firmware import protocols

    return protocols()
