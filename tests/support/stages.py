"""Stages to test, and the simulated bench behind them with its truth."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

from rig_drivers.stage.serial_stage import SerialStage
from rig_sim.bench import make_firmware
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.zaber import ZaberFirmware
from rig_sim.wire import Firmware, plug

from rig.devices import Clock
from rig.profile import (
    CarriageConfig,
    FirmwareConfig,
    GrblStageConfig,
    MarlinStageConfig,
    StageConfig,
    ZaberStageConfig,
)
from rig.profile.kinds import Surroundings
from rig.profile.plugins import STAGES

URL = "sim://test-stage"
ZERO_MM = 210.0
TIMEOUT_S = 20.0
"""Enough for every move, in virtual time."""
MICROSTEP_MM = 0.003
"""No position is finer than the motor's step."""

STAGE = GrblStageConfig(
    kind="grbl",
    port=URL,
    travel_mm=(110.0, 200.0),
    distance_at_machine_zero_mm=ZERO_MM,
    speed_mm_s=80.0,
    homing_timeout_s=20.0,
)
ZABER = ZaberStageConfig(
    kind="zaber",
    port=URL,
    travel_mm=STAGE.travel_mm,
    distance_at_machine_zero_mm=ZERO_MM,
    direction=-1,
    speed_mm_s=80.0,
    homing_timeout_s=20.0,
    microstep_mm=0.0025,
)
MARLIN = MarlinStageConfig(
    kind="marlin",
    port=URL,
    travel_mm=STAGE.travel_mm,
    distance_at_machine_zero_mm=ZERO_MM,
    direction=-1,
    speed_mm_s=80.0,
    homing_timeout_s=20.0,
)
FIRMWARE = FirmwareConfig(travel_mm=120.0, homing_locate_mm_s=20.0, homing_pause_s=0.05)
CARRIAGE = CarriageConfig(
    board_at_machine_zero_mm=ZERO_MM, power_up_mm=-40.0, backlash_mm=0.12, ring_mm=0.25
)


@dataclass(frozen=True, slots=True)
class Bench:
    """A stage that is not yet open, and what is true about it."""

    stage: SerialStage
    clock: VirtualClock
    carriage: Carriage
    wire: Firmware

    def true_mm(self) -> float:
        """Where the board really is, after it has stopped ringing."""
        return ZERO_MM + self.carriage.travelled_mm(self.clock.now_s() + 10.0)

    def is_moving(self) -> bool:
        """Whether the motor turns, or will."""
        now_s = self.clock.now_s()
        later_mm = [self.carriage.travelled_mm(now_s + 10.0 + wait_s) for wait_s in (0.0, 0.5)]
        return (
            abs(self.carriage.travelled_mm(now_s) - later_mm[0]) > 0.3 or later_mm[0] != later_mm[1]
        )


def make_stage(config: StageConfig, clock: Clock) -> SerialStage:
    """Return the stage of a profile, not yet opened."""
    stage = STAGES.kind(config.kind).open(config, Surroundings("test", (), clock))
    assert isinstance(stage, SerialStage)
    return stage


@contextmanager
def simulated_bench(
    stage: StageConfig = STAGE,
    firmware: FirmwareConfig = FIRMWARE,
    carriage: CarriageConfig = CARRIAGE,
    before: Callable[[Firmware], Firmware] = lambda firmware: firmware,
) -> Generator[Bench]:
    """Plug a simulated controller in and describe the stage that talks to it.

    Args:
        stage: the profile's part.
        firmware: settings of the controller.
        carriage: mechanics.
        before: puts something before the firmware, such as a faulty wire.
    """
    clock = VirtualClock(100.0)
    mechanics = Carriage(carriage, clock)
    wire = before(make_firmware(stage.kind, firmware, mechanics, clock))
    with plug(URL, wire):
        yield Bench(make_stage(stage, clock), clock, mechanics, wire)


def zaber_of(bench: Bench) -> ZaberFirmware:
    """Return the device at the other end of a Zaber stage's wire."""
    assert isinstance(bench.wire, ZaberFirmware)
    return bench.wire
