"""One camera that stages carry from view to view; keeps `rig.devices.Camera`."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Self

from rig.devices import STANDS, Camera, Clock, Stage, not_open, stopped
from rig.errors import CameraUseError, CaptureTimeoutError, StageAlarmError
from rig.frames import MultiView
from rig.profile import ScanCameraConfig
from rig.profile.kinds import Surroundings
from rig.scan import ScanTimes
from rig_drivers.scan.kept import InMemory, Keeping, Kept
from rig_drivers.scan.multiview import multiview_of
from rig_drivers.scan.on_disk import OnDisk, begin, go_on
from rig_drivers.scan.route import Halt, route, still_to_take

_NAME = "camera scan"


@dataclass(slots=True)
class _Times:
    """Where the time goes, while it goes."""

    moves_s: float = 0.0
    settling_s: float = 0.0
    exposures_s: float = 0.0


class ScanCamera:
    """Moves, settles, exposes, keeps; view after view. The scene must be at rest meanwhile.

    Every take is kept before the next move. Whatever ends a scan early leaves all its stages
    stopped; before the next scan they are homed again.

    Args:
        config: positions and times.
        around: with the stages, and the place for the takes.
        inner: the camera that is carried.
    """

    def __init__(self, config: ScanCameraConfig, around: Surroundings, inner: Camera) -> None:
        self._config = config
        self._names = tuple(view.name for view in around.views)
        self._rig = around.profile
        self._clock: Clock = around.clock
        self._inner = inner
        self._carriers: tuple[Stage, ...] = around.carriers
        self._scans = around.scans
        self._resumes = around.scans is not None and around.scans.resume
        self._halts = route(config)
        self._opened = ExitStack()
        self._is_open = False
        self._is_homed = False

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            for carrier in self._carriers:
                stack.enter_context(carrier)
            stack.enter_context(self._inner)
            self._opened = stack.pop_all()
        self._is_open, self._is_homed = True, False
        return self

    def __exit__(self, *error: object) -> None:
        self._is_open = False
        del error
        self._opened.close()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`; keys of the stages begin with their name."""
        stages = {
            f"{name} {key}": value
            for name, carrier in zip(("row", "column"), self._carriers, strict=False)
            for key, value in carrier.identity.items()
        }
        return {
            **self._inner.identity,
            "kind": "scan",
            "carried": self._config.inner.kind,
            **stages,
        }

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._names

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; a scan drops nothing."""
        return {}

    @property
    def carried(self) -> Camera:
        """The camera that is carried, open while this one is."""
        return self._inner

    @property
    def row_mm(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """See `rig.scan.MovedCamera.row_mm`."""
        row = self._halts[1 : 1 + len(self._config.row.positions_mm)]
        return row[0].places_mm, self._halts[0].places_mm, row[-1].places_mm

    def grab(self, timeout_s: float) -> MultiView:
        """Take one light field; see `Camera.grab`.

        Where takes are kept on the disk and a scan is to be resumed, the first call goes on with
        it, and gives a complete one as it is: its earlier takes were exposed before the call.

        Raises:
            SceneMovedError: the scene was not at rest; shows where.
            StoreError: a take cannot be kept, or there is no scan to resume.
            OwnedError: another program works on the scan that is to be resumed.
        """
        if not self._is_open:
            raise not_open(_NAME)
        keeping = self._keeping()
        times, begun_s = _Times(), self._clock.now_s()
        try:
            self._take_all(keeping, times, begun_s + timeout_s, timeout_s)
            total_s = self._clock.now_s() - begun_s
            taken = ScanTimes(times.moves_s, times.settling_s, times.exposures_s, total_s)
            return multiview_of(
                keeping, self._names, taken, tolerance_px=self._config.max_motion_px, name=_NAME
            )
        finally:
            keeping.close()

    def stream(self) -> Iterator[MultiView]:
        """Refuse: a camera that moves has no frames between which nothing is lost.

        Raises:
            CameraUseError: always.
        """
        seconds = self._config.typical_grab_s
        raise CameraUseError(
            _NAME,
            f"asked for a stream, but it moves through {len(self._halts)} takes that need "
            f"{seconds:.0f} s and more for one light field",
            advice="ask for one at a time: rig capture PROFILE --frames 1, or camera.grab()",
        )

    def home(self) -> None:
        """Home the stages that carry the camera, unless they are.

        Raises:
            DeviceError: a stage does not find its switch.
        """
        if self._is_homed:
            return
        for carrier in self._carriers:
            carrier.home()
        self._is_homed = True

    def go(self, places_mm: tuple[float, ...]) -> tuple[float, ...]:
        """Move to a place without settling; return the positions read back.

        Raises:
            DeviceError: a stage failed; all of them are stopped.
        """
        try:
            self.home()
            return tuple(
                carrier.move_to(place_mm, self._config.move_timeout_s)
                for carrier, place_mm in zip(self._carriers, places_mm, strict=True)
            )
        except BaseException as error:
            self._stop(error)
            raise

    def _take_all(
        self, keeping: Keeping, times: _Times, deadline_s: float, timeout_s: float
    ) -> None:
        left = still_to_take(self._halts, [take.halt for take in keeping.taken])
        try:
            for number, halt in enumerate(left):
                self._require_time(left[number:], deadline_s, timeout_s)
                keeping.keep(self._take(halt, keeping.session, times))
        except BaseException as error:
            self._stop(error)
            raise

    def _require_time(self, left: Sequence[Halt], deadline_s: float, timeout_s: float) -> None:
        if self._clock.now_s() > deadline_s:
            missing = tuple(dict.fromkeys(halt.view for halt in left))
            raise CaptureTimeoutError(_NAME, missing=missing, timeout_s=timeout_s)

    def _take(self, halt: Halt, session: int, times: _Times) -> Kept:
        clock = self._clock
        self.home()
        begun_s = clock.now_s()
        reached_mm = self.go(halt.places_mm)
        moved_s = clock.now_s()
        clock.sleep_s(self._config.settle_s)
        settled_s = clock.now_s()
        taken = self._inner.grab(self._config.inner.timeout_s)
        times.moves_s += moved_s - begun_s
        times.settling_s += settled_s - moved_s
        times.exposures_s += clock.now_s() - settled_s
        return Kept(halt, reached_mm, taken.frames[0], session, taken.temperature_degc)

    def _stop(self, error: BaseException) -> None:
        """Stop every stage, also those after one that cannot be stopped.

        Raises:
            StageAlarmError: instead of what ended the scan, where a stage may still move.
        """
        self._is_homed = False
        told = {
            name: words
            for name, carrier in zip(("row", "column"), self._carriers, strict=False)
            if (words := stopped(carrier)) != STANDS
        }
        if told:
            moving = "; ".join(f"{name}: {words}" for name, words in told.items())
            raise StageAlarmError(
                _NAME,
                f"the scan ended ({error or type(error).__name__}), and {moving}",
                advice="see that the camera stands before you go near it",
                code="not stopped",
            ) from error

    def _keeping(self) -> InMemory | OnDisk:
        plan = self._plan()
        if self._resumes and self._scans is not None:
            self._resumes = False
            return go_on(self._scans, plan, self._clock.now_s())
        return begin(self._scans, plan, self._clock.now_s())

    def _plan(self) -> dict[str, object]:
        """What takes of one scan have in common, as JSON data."""
        inner = self._config.inner.model_dump(mode="json")
        return {
            "rig": self._rig,
            "halts": [[halt.view, halt.role, list(halt.places_mm)] for halt in self._halts],
            "camera": inner,
            "device": dict(self._inner.identity),
        }
