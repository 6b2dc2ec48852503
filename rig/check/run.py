"""One check from devices to items: what is measured, in which order, and what depends on what."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

from rig.check.arrangement import judge_arrangement
from rig.check.bench import Bench, Stills, see, take_stills, take_stream
from rig.check.carried_board import judge_drift, judge_over_travel, judge_seen
from rig.check.geometry_drift import GeometryDrift
from rig.check.items import Item, failed
from rig.check.scene import judge_scene
from rig.check.span import middle_mm, plan_mm
from rig.check.stage import judge_travel
from rig.check.storage import judge_database, judge_room
from rig.check.timing import judge_drops, judge_rate, judge_skew
from rig.curve import Curve
from rig.devices import Camera, Clock, Stage, stopped
from rig.errors import DeviceError, RigError, ViewSkewError
from rig.frames import MultiView
from rig.hardware.opening import Answers
from rig.optics.rectifier import Rectifier
from rig.optics.target import target_of
from rig.profile import Profile

STILLS = 16
"""Multi-views of the board at rest: the noise of each view is then known within 1 %."""
MOVING = ("settling", "curve", "reach", "repeatability")
"""Items that need the board at a known distance."""


@dataclass(frozen=True, slots=True)
class CheckRequest:
    """What a check is to look at."""

    rectifier: Rectifier
    """Of the rig, with its calibration if it has one."""
    database: str | None
    """URL, as for every verb."""
    moves: bool
    """Whether the stage may be moved, where the profile allows it as well."""
    curve: tuple[int, Curve] | RigError
    """Number and newest curve of the rig, or why there is none."""
    geometry_drift: GeometryDrift | None = None
    """Compares a picture with the stored geometric calibration; None where there is none."""

    @property
    def profile(self) -> Profile:
        """The rig."""
        return self.rectifier.profile


def check_rig(
    request: CheckRequest, answers: Answers, tell: Callable[[str], None]
) -> Generator[Item]:
    """Yield the answer to every question of the pre-flight as soon as it is known.

    Faults of devices become items and never end the check. Whatever ends it early leaves the stage
    stopped, or tells that it could not be stopped.
    """
    try:
        yield from _on_paper(request)
        yield from _with_devices(request, answers)
    except BaseException:
        if not isinstance(answers.stage, RigError | None):
            tell(f"the check ended early, {stopped(answers.stage)}")
        raise


def _on_paper(request: CheckRequest) -> Iterator[Item]:
    """Everything that needs no device."""
    profile = request.profile
    yield judge_arrangement(profile)
    if profile.stage is not None and profile.sweep is not None:
        yield judge_travel(plan_mm(profile), profile.stage.travel_mm)
    yield judge_database(request.database)


def _with_devices(request: CheckRequest, answers: Answers) -> Iterator[Item]:
    profile, camera, clock = request.profile, answers.camera, answers.clock
    item, stage = _ready_stage(request, answers.stage)
    yield item
    if isinstance(camera, RigError):
        yield failed("camera", camera)
        return
    bench = _bench(request.rectifier, stage, camera, clock)
    reached_mm: float | None = None
    if bench is not None:
        try:
            reached_mm = bench.go(middle_mm(profile))
        except DeviceError as error:
            yield failed("move", error)
            bench = None
    count = 1 if profile.camera.is_stored else STILLS
    stills = take_stills(camera, count, profile.camera.timeout_s)
    yield _camera_item(camera, stills)
    if stills.failure is None or isinstance(stills.failure, ViewSkewError):
        yield from _over_time(profile, camera, clock, stills)
    if not stills.multiviews:
        return
    taken = stills.multiviews
    yield from judge_scene(profile, camera.identity, taken, at_mm=reached_mm)
    if profile.sweep is not None:
        yield judge_room(profile, request.database, taken[0])
    if bench is not None and reached_mm is not None:
        middle = see(request.rectifier, bench.board, taken[0], reached_mm)
        yield from judge_over_travel(bench, middle, request.curve)
    else:
        yield from _standing(request, answers.stage, taken[0])
    yield _geometry(request, taken[0])


def _ready_stage(
    request: CheckRequest, stage: Stage | RigError | None
) -> tuple[Item, Stage | None]:
    """Home the stage; return it only where it may be moved and was homed."""
    config = request.profile.stage
    if isinstance(stage, RigError):
        return failed("stage", stage), None
    if stage is None or config is None:
        return Item("stage", "skip", "the profile has no [stage]"), None
    named = _identity(stage)
    if not request.moves:
        return Item("stage", "pass", f"{named}; left alone"), None
    if not config.may_move:
        advice = "when the way is clear: stage.may_move = true"
        return Item("stage", "warn", f"{named}; the profile forbids to move it", advice), None
    try:
        stage.home()
    except DeviceError as error:
        return failed("stage", error), None
    return Item("stage", "pass", f"{named}; homed"), stage


def _bench(rectifier: Rectifier, stage: Stage | None, camera: Camera, clock: Clock) -> Bench | None:
    """Join what a sweep would use; None where a part of it is missing."""
    target, config = rectifier.profile.target, rectifier.profile.sweep
    if stage is None or target is None or config is None:
        return None
    board = target_of(target)
    return Bench(rectifier, board, config, stage, camera, clock)


def _camera_item(camera: Camera, stills: Stills) -> Item:
    failure = stills.failure
    if failure is None or isinstance(failure, ViewSkewError):
        return Item("camera", "pass", f"{_identity(camera)}; {len(camera.views)} views answer")
    return failed("camera", failure)


def _over_time(profile: Profile, camera: Camera, clock: Clock, stills: Stills) -> Iterator[Item]:
    """Skew, rate and drops of a short stream."""
    if stills.failure is not None:
        yield failed("skew", stills.failure)
    try:
        stream = take_stream(camera, clock)
    except DeviceError as error:
        if stills.failure is None:
            yield failed("rate", error)
        else:
            yield Item("rate", "skip", "no multi-views whose views are in step")
        return
    if stills.failure is None:
        skews_s = [multiview.skew_s for multiview in stills.multiviews]
        yield judge_skew([*skews_s, *stream.skews_s], profile.camera.max_skew_s)
    yield judge_rate(stream, profile.camera.asked_rate_hz)
    yield judge_drops(stream)


def _standing(
    request: CheckRequest, stage: Stage | RigError | None, taken: MultiView
) -> Iterator[Item]:
    """Judge what one picture tells where the board happens to stand."""
    profile = request.profile
    target = profile.target
    if target is None or profile.sweep is None or stage is None or isinstance(stage, RigError):
        reason = "needs a stage that answers, a [target] and a [sweep]"
        yield from (Item(name, "skip", reason) for name in MOVING)
        return
    yield Item("settling", "skip", "the stage was left alone")
    try:
        position_mm = stage.position_mm
    except DeviceError as error:
        yield from (Item(name, "skip", str(error)) for name in MOVING[1:])
        return
    board = target_of(target)
    seen = see(request.rectifier, board, taken, position_mm)
    yield judge_drift(request.rectifier, seen, request.curve)
    yield judge_seen(profile, [seen])
    yield Item("repeatability", "skip", "the stage was left alone")


def _geometry(request: CheckRequest, taken: MultiView) -> Item:
    if request.geometry_drift is not None:
        return request.geometry_drift(taken)
    return Item(
        "geometry",
        "skip",
        "nothing to compare with: this rig has no stored geometric calibration",
        f"rig calibrate {request.profile.name}",
    )


def _identity(device: Camera | Stage) -> str:
    """What tells it from others, in one line; the controls of single cameras are left out."""
    parts = device.identity.items()
    return ", ".join(f"{key} {value}" for key, value in parts if value and "." not in key)
