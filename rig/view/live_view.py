"""The live page of a capture."""

import time
from collections import deque
from collections.abc import Callable

import numpy as np

from rig.drift_series import DriftSeries
from rig.live.frame import DepthFrame
from rig.stored import Run
from rig.view.frame_message import Drops, FrameMessage, Pace
from rig.view.packing import packed
from rig.view.server import ViewServer

_PACE_FRAMES = 32


class LiveView:
    """Shows every frame that it is given to whoever looks on, and nothing waits for it.

    Args:
        run: what the rig uses.
        dropped: of the capture.
        server: started; closed with this.
        clock_s: passes evenly.
        drift: tells what looks at the cameras have told so far.
    """

    def __init__(
        self,
        run: Run,
        dropped: Drops,
        server: ViewServer[FrameMessage],
        clock_s: Callable[[], float] = time.monotonic,
        *,
        drift: Callable[[], DriftSeries | None] = lambda: None,
    ) -> None:
        self._run = run
        self._dropped = dropped
        self._server = server
        self._clock_s = clock_s
        self._drift = drift
        self._came_s: deque[float] = deque(maxlen=_PACE_FRAMES)
        packed(np.zeros((1, 1), np.float32))  # its machine code is there before the first page is

    @property
    def name(self) -> str:
        """What the counts of dropped frames call it."""
        return "view"

    def write(self, frame: DepthFrame) -> None:
        """Make the frame the newest; who looks on gets it as soon as it has drawn the last one."""
        self._came_s.append(self._clock_s())
        pace = Pace(self._frames_per_s(), dict(self._dropped()))
        self._server.publish(FrameMessage(frame, pace, self._run, self._drift()))

    def close(self) -> None:
        """Tell the pages that the capture has ended."""
        self._server.close()

    def _frames_per_s(self) -> float | None:
        took_s = self._came_s[-1] - self._came_s[0]
        return (len(self._came_s) - 1) / took_s if took_s > 0.0 else None


def capture_save(save: Callable[[DepthFrame], str]) -> Callable[[FrameMessage], str]:
    """Return what saves the frame of a message; see `Actions.save`."""

    def saved(message: FrameMessage) -> str:
        return save(message.frame)

    return saved
