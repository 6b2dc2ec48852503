"""The protocols that every camera and every stage keeps, real, recorded or simulated."""

import time
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self

from rig.errors import DeviceError, DeviceLostError

if TYPE_CHECKING:  # whoever only names devices needs no arrays
    from rig.frames import MultiView


class Clock(Protocol):
    """Time as a device sees it; injected, so that simulated benches need not wait."""

    def now_s(self) -> float:
        """Return a time that never goes back; its zero has no meaning."""
        ...

    def sleep_s(self, duration_s: float) -> None:
        """Return when `duration_s` has passed on this clock."""
        ...


class SystemClock:
    """The real time of this machine (CLOCK_MONOTONIC)."""

    def now_s(self) -> float:
        """See `Clock.now_s`."""
        return time.monotonic()

    def sleep_s(self, duration_s: float) -> None:
        """See `Clock.sleep_s`."""
        if duration_s > 0.0:
            time.sleep(duration_s)


class Device(Protocol):
    """A context manager: open inside `with`, refused outside of it."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None: ...

    @property
    def identity(self) -> Mapping[str, str]:
        """What tells this device from another one: kind, model, serial number, firmware."""
        ...


class Camera(Device, Protocol):
    """Gives one image per view of one instant."""

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the views in the order in which every grab returns them."""
        ...

    def grab(self, timeout_s: float) -> "MultiView":
        """Expose all views after this call began and return them.

        Never returns a frame that was already queued: the stage may have moved since.

        Raises:
            CaptureTimeoutError: not all views arrived within `timeout_s`.
            ViewSkewError: they arrived, but too far apart in time.
            DeviceLostError: the camera is gone and must be opened again.
        """
        ...

    def stream(self) -> "Iterator[MultiView]":
        """Yield multi-views for live use, dropping the oldest; the driver is never blocked.

        A stored camera (folder, recording) yields every multi-view once and ends.

        Raises:
            CaptureTimeoutError: the frames stopped coming.
            DeviceLostError: the camera is gone.
        """
        ...

    @property
    def dropped(self) -> Mapping[str, int]:
        """How many multi-views were dropped since opening, by reason."""
        ...


class Stage(Device, Protocol):
    """Carries the target along one axis; positions are distances to the reference camera."""

    @property
    def travel_mm(self) -> tuple[float, float]:
        """Nearest and farthest position that may be asked for."""
        ...

    @property
    def position_mm(self) -> float:
        """Where the stage is now, read back, not remembered.

        Raises:
            StageAlarmError: the position is not known; home first.
        """
        ...

    def home(self) -> None:
        """Find the reference switch; afterwards positions can be trusted.

        Raises:
            StageAlarmError: homing failed.
            StageTimeoutError: it did not end in time.
        """
        ...

    def move_to(self, position_mm: float, timeout_s: float) -> float:
        """Move, wait until motion has ended, and return the position read back.

        Raises:
            StageLimitError: the position is outside `travel_mm`; nothing moved.
            StageAlarmError: the controller stopped the motion.
            StageTimeoutError: motion did not end within `timeout_s`; the stage was stopped.
            StagePositionError: it ended elsewhere.
        """
        ...

    def stop(self) -> None:
        """Stop all motion now; safe from any state and any number of times."""
        ...


class Bystander(Protocol):
    """Somebody who looks on, as at a live page, and whom a stage without a motor may ask."""

    def ask(self, text: str) -> None:
        """Show a question; what was said before does not answer it."""
        ...

    def settle(self) -> None:
        """Take the question back."""
        ...

    def answer(self, timeout_s: float) -> str | None:
        """Return what was said since the question; None where nothing was in time."""
        ...


STANDS = "the stage stands still"
"""What `stopped` says of a stage that it could stop."""


def not_open(device: str) -> DeviceLostError:
    """Return the error of a camera that is asked for frames outside `with`."""
    return DeviceLostError(
        device, "asked for frames, but it is not open", advice='use "with camera:"'
    )


def stopped(stage: Stage) -> str:
    """Stop the stage; say in words whether it stands still, and let the first error be the one.

    Whatever stopping raises is said, never raised: what ends a run must reach its own end.
    """
    try:
        stage.stop()
    except DeviceError as error:
        return str(error)
    except Exception as error:  # of another package: it may raise what it likes
        found = " ".join(f"{type(error).__name__}: {error}".split())
        return f"the stage may still move, it could not be stopped ({found}); cut its power"
    return STANDS
