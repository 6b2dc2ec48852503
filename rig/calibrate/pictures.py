"""Pictures of the target: from a recording, or with the stage at known positions."""

from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from rig.devices import Camera
from rig.frames import MultiView
from rig.hardware.opening import Hardware
from rig.plan import even_distances_mm
from rig.profile import SweepConfig

STAGE_POSITIONS = 9
"""Six unknowns of the stage, and some to see that its line is straight."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One multi-view of the target."""

    number: int
    multiview: MultiView
    stage_mm: float | None = None
    """Position of the stage that carried the target; None where no stage did."""


def recorded_pictures(camera: Camera) -> Generator[Picture]:
    """Yield every stored multi-view of an open camera."""
    for number, multiview in enumerate(camera.stream()):
        yield Picture(number, multiview)


def stage_positions_mm(config: SweepConfig) -> tuple[float, ...]:
    """Return where the stage stops for a calibration: over the range of the sweep."""
    return tuple(even_distances_mm(config.from_mm, config.to_mm, STAGE_POSITIONS))


def stage_pictures(
    hardware: Hardware,
    positions_mm: Sequence[float],
    config: SweepConfig,
    *,
    first: int,
    timeout_s: float,
    deferred: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Generator[Picture]:
    """Home, then move to every position, let the board come to rest, and yield a picture of it.

    The stage is stopped on every way out.

    Args:
        hardware: opened devices.
        positions_mm: inside the travel of the stage.
        config: settling time and longest wait of a move.
        first: number of the first picture.
        timeout_s: longest wait for a multi-view.
        deferred: context in which an interrupt waits until the picture is taken.

    Raises:
        DeviceError: stage or camera failed.
    """
    stage = hardware.stage
    try:
        stage.home()
        for index, wanted_mm in enumerate(positions_mm):
            reached_mm = stage.move_to(wanted_mm, config.move_timeout_s)
            hardware.clock.sleep_s(config.settle_s)
            with deferred():
                multiview = hardware.camera.grab(timeout_s)
                yield Picture(first + index, multiview, reached_mm)
    finally:
        stage.stop()
