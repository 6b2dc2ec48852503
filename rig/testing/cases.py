"""What the suites have to know of a device beside the device."""

from dataclasses import dataclass

from rig.devices import Camera, Clock, Stage


@dataclass(frozen=True, slots=True)
class CameraCase:
    """A camera, not yet open, and what it shares with the test."""

    camera: Camera
    clock: Clock
    """The clock whose time its frames carry."""
    stored: int | None = None
    """How many multi-views there are; None: no end."""
    patience_s: float = 10.0
    """Longest wait for a multi-view, on a machine that is busy."""
    may_drop: bool = False
    """Its frames come in real time, from a program or device that waits for nobody: on a machine
    that is busy some are dropped, and counted."""


@dataclass(frozen=True, slots=True)
class StageCase:
    """A stage, not yet open, and the clock it lives on; it homes and moves: clear its way.

    Its travel takes longer than half a second from end to end.
    """

    stage: Stage
    clock: Clock
    tolerance_mm: float
    """Largest difference between a position asked for and the one reached."""
    brakes: bool = True
    """Whether stopping in motion keeps the position."""
    is_reset_by_opening: bool = True
    """Whether it must be homed after every opening."""
