"""The depth-slope sweep: move, settle, grab; again and again."""

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from rig.devices import Camera, Clock, Stage
from rig.errors import DeviceLostError
from rig.frames import MultiView
from rig.plan import Stop


@dataclass(frozen=True, slots=True)
class NewSample:
    """One multi-view taken at one stop."""

    stop: Stop
    sample: int
    """Number of the sample within its stop, from 0."""
    reached_mm: float
    """Position of the stage, read back."""
    multiview: MultiView


@dataclass(slots=True)
class SweepTimes:
    """Where the time of a sweep went, on the bench's clock."""

    moves_s: float = 0.0
    settling_s: float = 0.0
    exposures_s: float = 0.0
    total_s: float | None = None
    """From the first move until everything was measured."""
    is_simulated: bool = False
    """Whether the clock ran as fast as the computer could; then no ratio means anything."""

    @property
    def needed_s(self) -> float:
        """What the bench itself needed; all else is overhead."""
        return self.moves_s + self.settling_s + self.exposures_s


def run_sweep(
    stops: Sequence[Stop],
    *,
    stage: Stage,
    camera: Camera,
    clock: Clock,
    samples: int,
    settle_s: float,
    move_timeout_s: float,
    grab_timeout_s: float,
    times: SweepTimes,
    done: Mapping[int, frozenset[int]] | None = None,
    deferred: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> Generator[NewSample]:
    """Yield every sample as soon as it is taken.

    A generator on purpose: the consumer stores each sample before the next is taken, so a failure
    loses at most one. Targets are static: the stage stops, oscillations get `settle_s` to die
    away, and only then exposures begin.

    Args:
        stops: where to halt, in order.
        stage: homed and open.
        camera: open; every grab is exposed after the move.
        clock: what the devices share.
        samples: multi-views per stop.
        settle_s: pause between the end of a move and the first exposure.
        move_timeout_s: longest wait for one move.
        grab_timeout_s: longest wait for one multi-view.
        times: filled while the sweep runs.
        done: by stop index, the samples that exist already (of an interrupted sweep).
        deferred: what keeps interrupts waiting while a sample is taken and stored.

    Raises:
        DeviceError: stage or camera failed, or the camera gave a frame from before it was asked.
    """
    finished = done or {}
    for stop in stops:
        missing = [k for k in range(samples) if k not in finished.get(stop.index, frozenset())]
        if not missing:
            continue
        begun_s = clock.now_s()
        reached_mm = stage.move_to(stop.distance_mm, move_timeout_s)
        moved_s = clock.now_s()
        clock.sleep_s(settle_s)
        settled_s = clock.now_s()
        times.moves_s += moved_s - begun_s
        times.settling_s += settled_s - moved_s
        for sample in missing:
            with deferred():
                before_s = clock.now_s()
                multiview = camera.grab(grab_timeout_s)
                times.exposures_s += clock.now_s() - before_s
                _require_fresh(multiview, before_s)
                yield NewSample(stop, sample, reached_mm, multiview)


def _require_fresh(multiview: MultiView, called_s: float) -> None:
    """Refuse a queued frame: it shows the board where it stood before."""
    for frame in multiview.frames:
        if frame.timestamp_s < called_s:
            raise DeviceLostError(
                f"camera, view {frame.view}",
                f"asked for a new frame, got one exposed {called_s - frame.timestamp_s:.3f} s "
                "before",
                advice="the camera is stuck or repeats its queue: open it again",
            )
