"""The pipeline behind the seam: sensors -> Sync -> numbered groups, and a look at every sensor."""

import atexit
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Self, cast

from rig.errors import DeviceLostError
from rig_drivers.oak.decode import middle_s, start_s
from rig_drivers.oak.guarded_node import Failures, GuardedNode
from rig_drivers.oak.sdk import dai
from rig_drivers.oak.sensors import Sensors
from rig_drivers.oak.watchdog import Watchdog

_LOST: tuple[type[Exception], ...] = (RuntimeError, dai.MessageQueue.QueueException)
"""What reading raises when the link breaks: the queues close."""
_GROUPS_KEPT = 2
_AT_ONCE = timedelta(0)
_FRAMES_KEPT = 8
"""Per sensor, waiting for their partners in Sync."""
_HALF_PERIOD_SHARE = 0.45
"""Sync pairs frames closer than this share of a period; at half of it pairing would be a guess."""


@dataclass(frozen=True, slots=True)
class Group:
    """Frames of all sensors that belong together."""

    frames: Mapping[str, dai.ImgFrame]
    number: int
    """Of the group; a gap means that groups were overwritten before they were taken."""


class Streams:
    """A running pipeline; frames flow inside `with`.

    Sync runs on the host, so that the same code pairs frames with and without a device. Its inputs
    never block: a sensor that died must not hold up the others, or nobody could tell which it was.

    Args:
        sensors: open.
        period_s: time between the frames of a sensor.
    """

    def __init__(self, sensors: Sensors, *, period_s: float) -> None:
        self._sensors = sensors
        self._period_s = period_s
        self._pipeline: dai.Pipeline | None = None
        self._groups: dai.MessageQueue | None = None
        self._newest: dict[str, dai.MessageQueue] = {}
        self._failures = Failures()
        self.watchdog = Watchdog(())

    def __enter__(self) -> Self:
        try:
            self._start()
        except RuntimeError as error:
            self._stop()
            raise DeviceLostError(
                self._sensors.name,
                f"the pipeline did not start: {error}",
                advice="plug it in again",
            ) from error
        except BaseException:
            self._stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def next_group(self, wait_s: float) -> Group | None:
        """Return the next group, None if none comes within `wait_s`; looks at every sensor.

        Raises:
            DeviceLostError: no frames can come any more.
        """
        if self._groups is None:
            raise DeviceLostError(
                self._sensors.name, "the pipeline does not run", advice="open it again"
            )
        try:
            # The stubs do not say that both kinds of reading give None where nothing came.
            group = cast(
                "dai.MessageGroup | None",
                self._groups.get(timedelta(seconds=max(0.0, wait_s))),
            )
            self._look()
        except _LOST as error:
            raise DeviceLostError(
                self._sensors.name,
                f"stopped answering ({error})",
                advice="check the cable, open it again",
            ) from error
        if group is None:
            self._require_alive()
            return None
        frames = {name: cast("dai.ImgFrame", frame) for name, frame in group}
        for view, frame in frames.items():
            self._saw(view, frame)
        return Group(frames, group.getSequenceNum())

    def _start(self) -> None:
        atexit.register(self._stop)  # threads that outlive the interpreter abort the process
        pipeline = self._sensors.pipeline()
        self._pipeline = pipeline
        sync = pipeline.create(dai.node.Sync)
        sync.setRunOnHost(True)
        sync.setSyncThreshold(timedelta(seconds=_HALF_PERIOD_SHARE * self._period_s))
        outputs = self._sensors.outputs(pipeline)
        for view, output in outputs.items():
            paired = sync.inputs[view]
            paired.setBlocking(False)
            paired.setMaxSize(_FRAMES_KEPT)
            output.link(paired)
            self._newest[view] = output.createOutputQueue(maxSize=1, blocking=False)
        self.watchdog = Watchdog(outputs)
        numbered = pipeline.create(_NumberedGroups, self._failures)
        sync.out.link(numbered.groups)
        self._groups = numbered.out.createOutputQueue(maxSize=_GROUPS_KEPT, blocking=False)
        pipeline.start()

    def _stop(self) -> None:
        atexit.unregister(self._stop)
        pipeline, self._pipeline = self._pipeline, None
        self._groups = None
        self._newest.clear()
        if pipeline is not None:
            pipeline.stop()
            pipeline.wait()

    def _look(self) -> None:
        for view, queue in self._newest.items():
            # `tryGet` would hold the interpreter's lock while it waits for the queue's. A sender
            # that throws a host node's frame away does the reverse: both would wait for ever.
            frame = cast("dai.ImgFrame | None", queue.get(_AT_ONCE))
            if frame is not None:
                self._saw(view, frame)

    def _saw(self, view: str, frame: dai.ImgFrame) -> None:
        self.watchdog.saw(view, start_s=start_s(frame), middle_s=middle_s(frame))

    def _require_alive(self) -> None:
        failure = self._sensors.failure() or self._failures.first()
        if failure is None and self._pipeline is not None and not self._pipeline.isRunning():
            failure = "the pipeline ended by itself"
        if failure is not None:
            raise DeviceLostError(self._sensors.name, f"{failure}", advice="open it again")


class _NumberedGroups(GuardedNode):
    """Counts what Sync paired: only so can a reader tell groups it missed from lost frames."""

    def __init__(self, failures: Failures) -> None:
        super().__init__("the numbering of groups", failures)
        self.groups = self.createInput()
        self.out = self.createOutput()
        self._count = 0

    def step(self) -> None:
        """Pass one group on; Sync numbers it like its frames, here it gets its own number."""
        group = cast("dai.MessageGroup", self.groups.get())
        group.setSequenceNum(self._count)
        self._count += 1
        self.out.send(group)
