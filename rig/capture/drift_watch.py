"""Looks now and then, beside a capture, whether views have turned since their calibration.

One multi-view every half minute, on a thread of its own that steps back where the machine is busy;
a frame is never waited for and none is lost. Every look is kept with the temperature, and the first
that is no chance is told.
"""

import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Self

from rig.capture.drift_log import DriftLog
from rig.check.scene_drift import Seen, drift_details, drift_since, judge_scene_drift
from rig.database import Store
from rig.errors import RigError
from rig.frames import MultiView
from rig.live.frame import DepthFrame
from rig.profile import Profile
from rig.progress import Tell
from rig.records import StoredCalibration
from rig.stored import LENSLETS, Run

ALARM = 1e-6
"""Probability below which a look is an alarm. Eight hours are 960 looks: by Bonferroni's
inequality, whatever looks have in common, one in a thousand such days has a false alarm."""
_FIRST_S, _EVERY_S = 10.0, 30.0
_NICE = 10


@dataclass(frozen=True, slots=True)
class SceneLook:
    """Compares multi-views with a stored calibration, keeps and tells."""

    profile: Profile
    calibration: StoredCalibration
    store: Store
    unit: str = ""
    log: DriftLog = field(default_factory=DriftLog)

    def __call__(self, seen: Seen) -> str | None:
        """Look at one; return what is wrong, None where nothing is but chance."""
        views = seen.views
        drift = drift_since(self.calibration, self.profile, [seen])
        look = self.store.save_drift(
            self.calibration.id,
            rig=self.profile.name,
            details=drift_details(drift, self.profile),
            temperature_degc=views.temperature_degc,
            unit=self.unit,
        )
        self.log.add(look)
        if drift.probability >= ALARM:
            return None
        item = judge_scene_drift(
            drift, self.profile, self.calibration, views.temperature_degc, ALARM
        )
        return f"{item.found}; {item.advice}"


class DriftWatch:
    """Gives a look something to look at, now and then.

    Args:
        look: returns an alarm, None for none; None looks at nothing.
        tell: told of the first alarm, after which nothing is looked at any more, and, once, of a
            look that was not possible.
        now_s: tells the time.
    """

    def __init__(
        self,
        look: Callable[[Seen], str | None] | None,
        tell: Tell,
        *,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._look = look
        self._tell = tell
        self._now_s = now_s
        self._due_s = now_s() + _FIRST_S
        self._thread: threading.Thread | None = None
        self._has_complained = False
        self._alarm: str | None = None
        self._earlier: MultiView | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._thread is not None:
            self._thread.join()

    def watched(self, frame: DepthFrame) -> DepthFrame:
        """Take a frame's views if it is time for a look and none is under way; returns at once.

        Returns:
            The frame; after an alarm with that among its warnings, so that pages and files have it.
        """
        self._offer(frame.views)
        if self._alarm is None:
            return frame
        warnings = (*frame.slopes.warnings, self._alarm)
        return replace(frame, slopes=replace(frame.slopes, warnings=warnings))

    def _offer(self, views: MultiView) -> None:
        if self._look is None:
            self._earlier = None
            return
        seen, self._earlier = Seen(views, self._earlier), views
        is_busy = self._thread is not None and self._thread.is_alive()
        if is_busy or self._now_s() < self._due_s:
            return
        self._due_s = self._now_s() + _EVERY_S
        self._thread = threading.Thread(target=self._run, args=(seen, self._look), name="drift")
        self._thread.start()

    def _run(self, seen: Seen, look: Callable[[Seen], str | None]) -> None:
        if sys.platform == "linux":
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        try:
            self._alarm = look(seen)
            if self._alarm is not None:
                self._look = None
                self._tell(self._alarm)
        except RigError as error:
            if not self._has_complained:
                self._has_complained = True
                self._tell(f"whether views have turned is not told: {error}")


def look_of(run: Run, store: Store, unit: str, log: DriftLog) -> SceneLook | None:
    """Return how a run's calibration is looked after; None where it has none that is stored.

    Args:
        run: the rig, with its calibration.
        store: where looks are kept.
        unit: which of the rigs of this name.
        log: begun with earlier looks where it is shown and there is something to look after.
    """
    calibration = run.calibration
    if calibration is None or LENSLETS in calibration.geometry or run.profile.camera.is_scan:
        return None
    log.begin(calibration, store, unit)
    return SceneLook(run.profile, calibration, store, unit, log)
