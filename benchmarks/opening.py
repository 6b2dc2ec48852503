"""How long it takes to open a rig of five cameras and a stage, beside its slowest device alone.

python -m benchmarks.opening
"""

import statistics
import time
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Final, Self

from rig_drivers.together import close_together, open_together

from tests.support.video_arrays import locked, video_array
from tests.support.video_kernel import FakeDevice

OPENING_S: Final = (0.35, 0.40, 0.50, 0.45, 0.30)
"""How long each device takes: cameras on USB need a third of a second to one."""
STAGE_S: Final = 1.5
"""As long as a controller takes that resets when its port is opened."""
REPEATS: Final = 9


@dataclass
class SlowStage:
    """A device that only takes its time to open."""

    identity: dict[str, str] = field(default_factory=dict[str, str])

    def __enter__(self) -> Self:
        time.sleep(STAGE_S)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """There is nothing to close."""


def opened_s(*, with_stage: bool) -> float:
    """Return the time until an array of all cameras is open and its streams have started."""

    def slow(number: int) -> FakeDevice:
        return replace(locked(number), on_open=lambda: time.sleep(OPENING_S[number]))

    array, _, _ = video_array([f"view {number}" for number in range(len(OPENING_S))], slow)
    devices = (SlowStage(), array) if with_stage else (array,)
    began_s = time.monotonic()
    open_together(devices, name="rig")
    took_s = time.monotonic() - began_s
    close_together(devices)
    return took_s


def main() -> None:
    """Print the median and the longest time over the slowest device's."""
    for name, slowest_s in (("", max(OPENING_S)), (" and a stage", max(*OPENING_S, STAGE_S))):
        times_s = [opened_s(with_stage=bool(name)) / slowest_s for _ in range(REPEATS)]
        print(
            f"opening {len(OPENING_S)} cameras{name}: {statistics.median(times_s):.3f} times the "
            f"slowest device's time (median of {REPEATS}; longest {max(times_s):.3f}; goal 1.10)"
        )


if __name__ == "__main__":
    main()
