"""How long it takes to open a rig of five cameras, beside its slowest camera alone.

python -m benchmarks.opening
"""

import statistics
import time
from dataclasses import replace
from typing import Final

from tests.support.video_arrays import locked, video_array
from tests.support.video_kernel import FakeDevice

OPENING_S: Final = (0.35, 0.40, 0.50, 0.45, 0.30)
"""How long each device takes: cameras on USB need a third of a second to one."""
REPEATS: Final = 9


def opened_s() -> float:
    """Return the time until an array of all cameras is open and its streams have started."""

    def slow(number: int) -> FakeDevice:
        return replace(locked(number), on_open=lambda: time.sleep(OPENING_S[number]))

    array, _, _ = video_array([f"view {number}" for number in range(len(OPENING_S))], slow)
    began_s = time.monotonic()
    with array:
        return time.monotonic() - began_s


def main() -> None:
    """Print the median and the longest time over the slowest device's."""
    times_s = [opened_s() / max(OPENING_S) for _ in range(REPEATS)]
    print(
        f"opening {len(OPENING_S)} cameras: {statistics.median(times_s):.3f} times the slowest "
        f"device's time (median of {REPEATS}; longest {max(times_s):.3f}; goal 1.10)"
    )


if __name__ == "__main__":
    main()
