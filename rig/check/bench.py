"""What a check does with the devices: grab, stream, move; it judges nothing."""

from collections.abc import Iterator
from dataclasses import dataclass

from rig.check.stage import Arrival
from rig.check.stills import search_board
from rig.check.timing import Stream, stream_of
from rig.devices import Camera, Clock, Stage
from rig.epipolar.board.fit import fit_board_slope
from rig.epipolar.board.slope import BoardSlope
from rig.errors import DeviceError, SlopeError, TargetError, ViewSkewError
from rig.frames import MultiView
from rig.optics.optics import Optics
from rig.profile import Profile, SweepConfig
from rig.targets import CornersOrReason, Target

STREAM_FRAMES = 30
STREAM_S = 3.0


@dataclass(frozen=True, slots=True)
class Stills:
    """Repeated pictures of one scene at rest."""

    multiviews: tuple[MultiView, ...]
    failure: DeviceError | None
    """What ended them early, or a skew that came among them."""


@dataclass(frozen=True, slots=True)
class BoardAtStop:
    """The board at one position of the stage, in every view."""

    reached_mm: float
    multiview: MultiView
    by_view: tuple[CornersOrReason, ...]
    """In the order of the views."""
    slope: BoardSlope | None


@dataclass(frozen=True, slots=True)
class Bench:
    """Both devices of a rig, and what a sweep would do with them."""

    profile: Profile
    optics: Optics
    target: Target
    config: SweepConfig
    stage: Stage
    camera: Camera
    clock: Clock

    def go(self, position_mm: float) -> float:
        """Move and settle as a sweep would; return the position read back."""
        reached_mm = self.stage.move_to(position_mm, self.config.move_timeout_s)
        self.clock.sleep_s(self.config.settle_s)
        return reached_mm

    def look(self, position_mm: float) -> BoardAtStop:
        """Move, settle, grab once, and find the board."""
        reached_mm = self.go(position_mm)
        multiview = self.camera.grab(self.profile.camera.timeout_s)
        return see(self.optics, self.target, multiview, reached_mm)

    def arrivals(self, position_mm: float, step_mm: float, count: int) -> Iterator[Arrival]:
        """Come to one position again and again, from the near and the far side in turn."""
        for number in range(count):
            from_near = number % 2 == 0
            away_mm = position_mm + (-step_mm if from_near else step_mm)
            self.stage.move_to(away_mm, self.config.move_timeout_s)
            board = self.look(position_mm)
            yield Arrival(
                from_near,
                board.reached_mm,
                None if board.slope is None else board.slope.slope_px,
                None if board.slope is None else board.slope.sigma_px,
            )


def see(optics: Optics, target: Target, multiview: MultiView, reached_mm: float) -> BoardAtStop:
    """Find the board in every view, and its slope."""
    by_view = tuple(search_board(frame.image, target) for frame in multiview.frames)
    slope: BoardSlope | None
    try:
        slope = fit_board_slope(optics.board_views(multiview.images), by_view)
    except (TargetError, SlopeError):  # the views tell why
        slope = None
    return BoardAtStop(reached_mm, multiview, by_view, slope)


def take_stills(camera: Camera, count: int, timeout_s: float) -> Stills:
    """Grab the same scene again and again; now and then a skewed multi-view may be among them."""
    multiviews: list[MultiView] = []
    failure: DeviceError | None = None
    for _ in range(count):
        try:
            multiviews.append(camera.grab(timeout_s))
        except ViewSkewError as error:
            failure = error
            if not multiviews:
                break
        except DeviceError as error:
            failure = error
            break
    return Stills(tuple(multiviews), failure)


def take_stream(camera: Camera, clock: Clock) -> Stream:
    """Stream for a moment.

    Raises:
        DeviceError: the stream ended with an error.
    """
    before = dict(camera.dropped)
    multiviews: list[MultiView] = []
    begun_s = clock.now_s()
    for multiview in camera.stream():
        multiviews.append(multiview)
        if len(multiviews) >= STREAM_FRAMES or clock.now_s() - begun_s > STREAM_S:
            break
    dropped = {reason: count - before.get(reason, 0) for reason, count in camera.dropped.items()}
    return stream_of(multiviews, dropped)
