"""Memory of an endless capture: `python -m benchmarks.live_memory [FRAMES]`.

Frames of 160 x 100 go through the whole of `rig capture` (taking, rectifying, slopes, depth), once
without files and once into a folder. After the warm-up the resident memory is read every ten
frames; printed is what the straight line through it gains over all frames, with its 95 per cent
bounds, and how many threads and open files there were first and last.
"""

import gc
import os
import sys
import tempfile
import threading
from collections.abc import Generator, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from rig.capture.capture import CaptureRequest, capture_depth
from rig.capture.folder import CaptureFolder
from rig.capture.output import WantedOutput
from rig.devices import Camera, Clock, SystemClock
from rig.frames import MultiView
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.testing.simulated import open_simulated_rig

WARM_UP = 2000
EVERY = 10
BLOCKS = 40
"""The line goes through so many means: neighbouring readings are not independent."""


class Cycling:
    """A stored camera that gives a few multi-views again and again."""

    def __init__(self, multiviews: list[MultiView]) -> None:
        self._multiviews = multiviews
        self.views = tuple(frame.view for frame in multiviews[0].frames)
        self.identity: Mapping[str, str] = {"kind": "cycle"}
        self.dropped: Mapping[str, int] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        del timeout_s
        return self._multiviews[0]

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        while True:
            yield from self._multiviews


class FilesThatGo(CaptureFolder):
    """Removes each file after it was written: the disk of a benchmark is small."""

    def write(self, frame: DepthFrame) -> None:
        """See `CaptureFolder.write`."""
        super().write(frame)
        for kind in ("slope", "label", "sigma", "depth", "image"):
            for ending in ("pfm", "png"):
                (self.folder / f"{kind}_{frame.index:05d}.{ending}").unlink(missing_ok=True)


def rig_of_pictures(count: int) -> DepthCamera:
    """Return a rig of so many different multi-views, without end."""
    with open_simulated_rig() as simulated:
        device = Cycling([simulated.grab().views for _ in range(count)])
    views = ", ".join(f'{view} = "{view}.png"' for view in device.views)
    stored = ("camera.kind=folder", "camera.folder=.", f"camera.files={{{views}}}")

    @contextmanager
    def opened() -> Generator[tuple[Camera, Clock]]:
        with device:
            yield device, SystemClock()

    def door() -> AbstractContextManager[tuple[Camera, Clock]]:
        return opened()

    return DepthCamera(open_simulated_rig(stored).run, door)


def handles() -> tuple[int, int]:
    """Return how many threads and open files there are."""
    return threading.active_count(), len(list(Path("/proc/self/fd").iterdir()))


def resident_mb() -> float:
    """Return the resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def growth_pct(readings_mb: list[float]) -> tuple[float, float]:
    """Return what the line through the readings gains, per cent of their mean, and 1.96 sigma."""
    means = np.array([block.mean() for block in np.array_split(np.array(readings_mb), BLOCKS)])
    at = np.linspace(-0.5, 0.5, BLOCKS)
    gain, middle = np.polyfit(at, means, 1)
    left = means - (middle + gain * at)
    sigma = np.sqrt((left**2).sum() / (BLOCKS - 2) / (at**2).sum())
    return 100.0 * gain / middle, 196.0 * sigma / middle


def run(frames: int, outputs: tuple[WantedOutput, ...], name: str) -> None:
    """Capture so many frames after the warm-up, and print what memory did."""
    readings_mb: list[float] = []
    counted: list[tuple[int, int]] = []  # of the first frames, then of the last

    def progress(done: int, _: str) -> None:
        if done == WARM_UP:
            gc.collect()
        if done < WARM_UP:
            return
        if done % EVERY == 0:
            readings_mb.append(resident_mb())
        if not EVERY <= done - WARM_UP < frames - EVERY:
            counted.append(handles())

    asked = CaptureRequest(WARM_UP + frames, None, None, outputs=outputs)
    with rig_of_pictures(7) as camera:
        capture_depth(camera, asked, progress)
    gain_pct, bound_pct = growth_pct(readings_mb)
    first, last = min(counted[:EVERY]), min(counted[EVERY:])  # a map may just be written
    print(
        f"{name:14} {frames} frames after {WARM_UP}: {readings_mb[0]:.1f} -> {readings_mb[-1]:.1f} "
        f"MB, line {gain_pct:+.2f} +- {bound_pct:.2f} % (95 %); threads and files "
        f"{first} -> {last}"
    )


def main(frames: int = 30_000) -> None:
    """Print both runs."""
    run(frames, (), "no files")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        files = WantedOutput(lambda camera: FilesThatGo(out, camera.run), is_kept=True)
        run(frames, (files,), "files")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
