"""A stream that looks again for a camera that goes away."""

from collections import Counter
from collections.abc import Callable, Generator, Mapping

from rig.devices import Camera, Clock
from rig.errors import CaptureTimeoutError, DeviceLostError, DeviceNotFoundError
from rig.frames import MultiView

_PAUSE_S = 0.2
"""Between two looks; also how soon giving up is noticed."""


class Reopening:
    """Opens a camera again that is lost in a stream. A grab never goes on across a loss.

    Args:
        camera: open.
        clock: of the bench.
        reconnect_s: how long a lost camera is looked for; 0 not at all.
        is_over: whether nobody waits for it any more.
    """

    def __init__(
        self, camera: Camera, clock: Clock, *, reconnect_s: float, is_over: Callable[[], bool]
    ) -> None:
        self._camera = camera
        self._clock = clock
        self._reconnect_s = reconnect_s
        self._is_over = is_over
        self._before: Counter[str] = Counter()

    @property
    def dropped(self) -> Mapping[str, int]:
        """What the camera dropped since it was first opened; `reconnect`: how often it was lost."""
        total = Counter(self._before)
        total.update(self._camera.dropped)
        return dict(total)

    def stream(self) -> Generator[MultiView]:
        """Yield what the camera streams.

        Raises:
            DeviceError: see `Camera.stream`; the camera was not found again in time.
        """
        while True:
            try:
                yield from self._camera.stream()
            except DeviceLostError as lost:
                self._look_for(lost)
                continue
            return

    def _look_for(self, lost: DeviceLostError) -> None:
        if self._reconnect_s <= 0.0 or self._is_over():
            raise lost
        self._before.update(self._camera.dropped)
        self._camera.__exit__(type(lost), lost, lost.__traceback__)
        ends_s = self._clock.now_s() + self._reconnect_s
        while self._clock.now_s() < ends_s and not self._is_over():
            self._clock.sleep_s(_PAUSE_S)
            try:
                self._camera.__enter__()
            except (DeviceNotFoundError, DeviceLostError, CaptureTimeoutError):
                continue
            self._before["reconnect"] += 1
            return
        raise DeviceLostError(
            lost.device,
            f"{lost.symptom}; looked for it for {self._reconnect_s:g} s, it did not come back",
            advice=lost.advice,
        ) from lost
