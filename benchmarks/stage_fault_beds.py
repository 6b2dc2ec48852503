"""What the fault campaign sweeps over: a stage, its camera, the truth, and one fault on its way.

Serial protocols are struck at their wire. Of `two grbl` the second stage carries the camera
(`rig_drivers.scan`), and its wire is struck. `benchmarks.stage_fault_answers` has the others.
"""

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from rig_drivers.scan.camera import ScanCamera
from rig_sim.bench import make_firmware
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.wire import Firmware, plug
from rig_sim.wire.faults import Fault, FaultyWire

from rig.devices import Camera, Clock, Stage
from rig.frames import Frame, MultiView
from rig.profile import ScanCameraConfig, StageConfig
from rig.profile.kinds import Surroundings
from rig.testing.witness import Witness
from tests.support.stages import CARRIAGE, FIRMWARE, STAGE, ZERO_MM, make_stage, simulated_bench


class Striker(Protocol):
    """What strikes once, and can be mended."""

    @property
    def has_struck(self) -> bool:
        """Whether the fault has happened."""
        ...

    @property
    def passed(self) -> int:
        """How much has passed: bytes, or answers."""
        ...

    @property
    def in_motion(self) -> Sequence[int]:
        """How much had passed at the moments at which something moved."""
        ...

    def mend(self) -> None:
        """Make all good from now on."""
        ...


class WatchedWire(FaultyWire):
    """A wire that notes how much had passed whenever the carriage moved."""

    def __init__(self, firmware: Firmware, fault: Fault) -> None:
        super().__init__(firmware, fault)
        self.is_moving: Callable[[], bool] = lambda: False
        self.in_motion: list[int] = []

    @property
    def passed(self) -> int:
        """See `Striker`."""
        return self.passed_bytes

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`."""
        if self.is_moving():
            self.in_motion.append(self.passed_bytes)
        super().receive(data)


@dataclass(frozen=True, slots=True)
class Bed:
    """A stage to sweep with, not yet open, and what is true about it."""

    clock: VirtualClock
    stage: Stage
    true_mm: Callable[[], float]
    """Where the board really is."""
    is_moving: Callable[[], bool]
    striker: Striker
    carry: Callable[[Witness], Camera] = lambda witness: witness
    """What becomes of the camera: another stage may carry it."""
    worst_elsewhere_mm: Callable[[], float] = lambda: 0.0
    """Largest difference between where another stage was told to be, and was."""


@contextmanager
def serial_bed(config: StageConfig, fault: Fault) -> Generator[Bed]:
    """Give a stage behind a wire with a fault."""
    wires: list[WatchedWire] = []

    def spoil(firmware: Firmware) -> FaultyWire:
        wires.append(WatchedWire(firmware, fault))
        return wires[0]

    with simulated_bench(config, before=spoil) as bench:
        wires[0].is_moving = bench.is_moving
        yield Bed(bench.clock, bench.stage, bench.true_mm, bench.is_moving, wires[0])


# -- two stages -----------------------------------------------------------------------------------

SLIDER_ZERO_MM = 60.0
SLIDER = STAGE.model_copy(
    update={
        "port": "sim://test-slider",
        "travel_mm": (-40.0, 40.0),
        "distance_at_machine_zero_mm": SLIDER_ZERO_MM,
    }
)
HALTS_MM = (-20.0, 0.0, 12.5)
SCAN = ScanCameraConfig.model_validate(
    {
        "kind": "scan",
        "row": {"at_mm": HALTS_MM},
        "settle_s": 0.4,
        "move_timeout_s": 10.0,
        "inner": {"kind": "sim", "width_px": 64, "height_px": 48, "exposure_s": 0.008},
    }
)


class Carried:
    """The camera on the slider: sees a texture at rest, and notes where it truly is."""

    views = ("camera",)
    identity: Mapping[str, str] = {"kind": "witness"}
    dropped: Mapping[str, int] = {}

    def __init__(self, witness: Witness, clock: Clock, true_mm: Callable[[], float]) -> None:
        self._witness = witness
        self._clock = clock
        self._true_mm = true_mm
        self._image = np.random.default_rng(1).integers(0, 256, (48, 64), np.uint8)
        self.worst_mm = 0.0

    def __enter__(self) -> "Carried":
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to give back."""

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        sequence = self._witness.grab(timeout_s).frames[0].sequence
        here_mm = self._true_mm()
        self.worst_mm = max(self.worst_mm, min(abs(here_mm - halt_mm) for halt_mm in HALTS_MM))
        return MultiView((Frame("camera", self._image, self._clock.now_s(), sequence),))

    def stream(self) -> Generator[MultiView]:
        """See `Camera.stream`."""
        while True:
            yield self.grab(1.0)


@contextmanager
def two_stages_bed(config: StageConfig, fault: Fault) -> Generator[Bed]:
    """Give a good stage of the board, and one with a fault that carries the camera."""
    clock = VirtualClock(100.0)
    carriages = [Carriage(CARRIAGE, clock) for _ in range(2)]
    board, slider = (make_firmware("grbl", FIRMWARE, carriage, clock) for carriage in carriages)
    wire = WatchedWire(slider, fault)

    def is_moving(carriage: Carriage) -> bool:
        now_s = clock.now_s()
        later_mm = [carriage.travelled_mm(now_s + wait_s) for wait_s in (10.0, 10.5)]
        return abs(carriage.travelled_mm(now_s) - later_mm[0]) > 0.3 or later_mm[0] != later_mm[1]

    def slider_mm() -> float:
        return SLIDER_ZERO_MM + carriages[1].travelled_mm(clock.now_s() + 10.0)

    carried: list[Carried] = []

    def carry(witness: Witness) -> Camera:
        carried.append(Carried(witness, clock, slider_mm))
        around = Surroundings(
            "test", SCAN.views_at(20.0), clock, carriers=(make_stage(SLIDER, clock),)
        )
        return ScanCamera(SCAN, around, carried[-1])

    wire.is_moving = lambda: is_moving(carriages[1])
    with plug(STAGE.port, board), plug(SLIDER.port, wire):
        yield Bed(
            clock,
            make_stage(config, clock),
            lambda: ZERO_MM + carriages[0].travelled_mm(clock.now_s() + 10.0),
            lambda: any(is_moving(carriage) for carriage in carriages),
            wire,
            carry,
            lambda: max((one.worst_mm for one in carried), default=0.0),
        )
