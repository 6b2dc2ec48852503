"""Fires a camera by a command, at moments that all cameras on one clock share."""

import math

from rig_genicam.door import GenicamDevice
from rig_genicam.feature import execute


class SoftwareTrigger:
    """Fires at whole multiples of a period: cameras fire together without knowing of each other.

    Args:
        period_s: between two commands.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._fired_s: list[float] = []
        self.next_s = -math.inf
        """When the next command is due, on the clock that `fire_when_due` is told."""

    def fire_when_due(self, device: GenicamDevice, now_s: float) -> None:
        """Send the command if its moment has come; the first call only waits for the next moment.

        Raises:
            ControlError: the camera does not take it.
            DeviceLostError: it is gone.
        """
        if now_s < self.next_s:
            return
        if self.next_s > -math.inf:
            self._fired_s.append(now_s)
            execute(device, "TriggerSoftware", key="camera.trigger.source")
        self.next_s = self._period_s * (math.floor(now_s / self._period_s) + 1)

    def answered_s(self, latest_s: float) -> float | None:
        """Return which command a frame may answer whose exposure began at `latest_s` at the latest.

        The oldest of those that wait for an answer: conservative where a frame was lost. None where
        none waits. Commands up to then count as answered.
        """
        if not self._fired_s:
            return None
        answered_s = self._fired_s[0]
        self._fired_s = [fired_s for fired_s in self._fired_s if fired_s > latest_s]
        return answered_s
