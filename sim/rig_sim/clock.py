"""Simulated time."""

import threading


class VirtualClock:
    """Time that passes only when somebody waits for it; shared by stage, camera and driver."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s
        self._lock = threading.Lock()

    def now_s(self) -> float:
        """See `Clock.now_s`."""
        with self._lock:
            return self._now_s

    def sleep_s(self, duration_s: float) -> None:
        """See `Clock.sleep_s`; returns at once, later in simulated time."""
        if duration_s > 0.0:
            with self._lock:
                self._now_s += duration_s
