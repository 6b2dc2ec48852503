"""A whole simulated bench: clock, stage and world, plugged together."""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pkgutil import resolve_name

from rig.devices import Clock, Stage, SystemClock
from rig.errors import ConfigError
from rig.profile import (
    FirmwareConfig,
    OakCameraConfig,
    Profile,
    SerialStageConfig,
    WorldConfig,
)
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware import protocols
from rig_sim.oak import SimOakRack
from rig_sim.rehearsal import RehearsedStage
from rig_sim.track import track_of
from rig_sim.wire import Firmware, plug
from rig_sim.wire.serve import serve_on_pty
from rig_sim.wire.serve_tcp import serve_on_tcp
from rig_sim.world import World


@contextmanager
def plugged_world(
    profile: Profile,
    *,
    uses_stage: bool,
    target_in_hand: bool = False,
    behind_diffuser: bool = False,
) -> Generator[World]:
    """Build the World of a profile and plug its stage into the serial port that it names.

    Args:
        profile: a profile with a `[world]`.
        uses_stage: whether the stage takes part; it decides what stands before the camera.
        target_in_hand: whether a hand shows the board, where no stage carries it.
        behind_diffuser: whether somebody holds a diffuser before the lens.

    Raises:
        ConfigError: the profile has no `[world]`.
    """
    config = _world_of(profile)
    stage = profile.stage if uses_stage else None
    # A stage at a true port needs true time: in a fast world its deadlines would never come.
    moved = (stage, *profile.stages.carriers.values())
    is_fast = config.clock == "fast" and all(s is None or s.is_simulated for s in moved)
    clock: Clock = VirtualClock() if is_fast else SystemClock()
    track = track_of(profile, clock)
    carriage = Carriage(config.carriage, clock)
    scene = config.sweep_scene if uses_stage else config.capture_scene
    if target_in_hand:
        scene = "board"
    with ExitStack() as stack:
        if isinstance(stage, SerialStageConfig) and stage.is_simulated:
            firmware = make_firmware(stage.kind, config.firmware, carriage, clock)
            stack.enter_context(plug(stage.port, firmware))
        for name, carrier in profile.stages.carriers.items():
            if (
                track is not None
                and isinstance(carrier, SerialStageConfig)
                and carrier.is_simulated
            ):
                slider = track.sliders[name]
                firmware = make_firmware(
                    carrier.kind, slider.config.firmware, slider.carriage, clock
                )
                stack.enter_context(plug(carrier.port, firmware))
        yield World(
            profile,
            clock=clock,
            carriage=carriage,
            scene=scene,
            in_hand=target_in_hand,
            track=track,
            behind_diffuser=behind_diffuser,
        )


@dataclass(frozen=True, slots=True)
class SimulatedBench:
    """What devices are opened in on a simulated bench: `Surroundings.simulated`."""

    world: World

    def rehearsed(self, stage: Stage) -> Stage:
        """Return a stage that is no simulation, and let the simulated board follow it."""
        following = RehearsedStage(stage, self.world.config.carriage)
        self.world.carried_by(following)
        return following

    def oak_rack(
        self, config: OakCameraConfig, *, device: str, views: tuple[str, ...]
    ) -> SimOakRack:
        """Return the sensors of one simulated OAK device, all in step with each other.

        Args:
            config: the profile's camera.
            device: tells it from other devices of the rig.
            views: of this device.
        """
        return SimOakRack(config, self.world, device=device, views=views)


def make_firmware(
    protocol: str, config: FirmwareConfig, carriage: Carriage, clock: Clock
) -> Firmware:
    """Return the controller that speaks a protocol and moves `carriage`.

    Raises:
        ConfigError: no controller of this protocol is simulated.
    """
    known = protocols()
    if protocol not in known:
        raise ConfigError(
            f"asked to simulate a stage that speaks {protocol!r}, simulated are: "
            f"{', '.join(known)}",
            advice="choose one of them",
        )
    make: Callable[[FirmwareConfig, Carriage, Clock], Firmware] = resolve_name(
        f"rig_sim.firmware.{protocol}:make"
    )
    return make(config, carriage, clock)


def serve_stage(
    profile: Profile,
    protocol: str,
    on_ready: Callable[[str], None],
    *,
    tcp_port: int | None = None,
) -> None:
    """Offer the stage of a profile on a pseudo-terminal or TCP port, in real time, until Ctrl-C.

    Args:
        profile: a profile with a `[world]`.
        protocol: what the controller speaks, whatever the profile's own stage is.
        on_ready: called once with the path or URL to open.
        tcp_port: TCP port on the loopback interface, 0 for a free one; None for a terminal.

    Raises:
        ConfigError: the profile has no `[world]`, or the TCP port is taken.
    """
    config, clock = _world_of(profile), SystemClock()
    firmware = make_firmware(protocol, config.firmware, Carriage(config.carriage, clock), clock)
    if tcp_port is None:
        serve_on_pty(firmware, on_ready=on_ready)
        return
    try:
        serve_on_tcp(firmware, tcp_port, on_ready=on_ready)
    except OSError as error:
        raise ConfigError(
            f"TCP port {tcp_port} cannot be opened ({error})",
            advice="choose another, 0 takes a free one",
        ) from error


def _world_of(profile: Profile) -> WorldConfig:
    if profile.world is None:
        raise ConfigError(
            f"profile {profile.name}: a simulated rig needs a [world] section",
            advice="add it to the file",
        )
    return profile.world
