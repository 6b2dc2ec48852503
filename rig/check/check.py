"""One check from devices to items: what is measured, in which order, and what depends on what."""

from collections.abc import Generator, Iterator, Sequence

from rig.check.arrangement import judge_arrangement
from rig.check.bench import Bench, Stills, see, take_stills, take_stream
from rig.check.carried_board import judge_carried_board, judge_curve, judge_places
from rig.check.geometry_drift import judge_geometry_drift
from rig.check.items import Item, failed
from rig.check.request import CheckRequest, check_request
from rig.check.scene import judge_scene
from rig.check.span import middle_mm, plan_mm
from rig.check.stage import judge_travel
from rig.check.storage import judge_room
from rig.check.timing import judge_drops, judge_rate, judge_skew
from rig.devices import Camera, Clock, Stage, stopped
from rig.errors import DeviceError, RigError, ViewSkewError
from rig.frames import MultiView
from rig.hardware.opening import Answers, open_what_answers
from rig.interrupts import Interrupts
from rig.optics.target import target_of
from rig.profile import Profile
from rig.progress import Tell
from rig.stored import Run, RunChoice

STILLS = 16
"""Multi-views of the board at rest: the noise of each view is then known within 1 %."""
CARRIED = ("settling", "curve", "reach", "repeatability")
"""Items that need the board at a known distance."""
QUESTIONS = (
    *("arrangement", "travel", "database", "stage", "camera", "skew", "rate", "drops", "board"),
    *("focus", "exposure", "locks", "noise", "likeness", "disk", *CARRIED, "geometry"),
)
"""Every item that a check answers or skips; `move` comes besides where the stage cannot."""
_CAUSES = ("camera", "move", "skew", "rate", "reach")
"""Items whose failure leaves questions without a picture to answer them from."""


def check_on_rig(
    profile: Profile, choice: RunChoice, tell: Tell, *, moves: bool
) -> Generator[Item]:
    """Look up what the rig uses, open what answers of its devices, and yield every answer.

    Args:
        profile: the rig.
        choice: which calibration; the curve is the newest of the rig.
        tell: told how the check ended, where that was early.
        moves: whether the stage may be moved, where the profile allows it as well.

    Raises:
        ConfigError: the calibration does not fit the rig.
        StoreError: there is no such calibration as was asked for.
    """
    request = check_request(profile, choice, moves=moves)
    with Interrupts(), open_what_answers(profile) as answers:
        yield from check_rig(request, answers, tell)


def check_rig(request: CheckRequest, answers: Answers, tell: Tell) -> Generator[Item]:
    """Yield the answer to every question of the pre-flight as soon as it is known.

    Faults of devices become items and never end the check; what they leave open comes at the end,
    as skipped, with the reason. Whatever ends it early leaves the stage stopped, or tells that it
    could not be stopped.
    """
    items: list[Item] = []
    try:
        for steps in (_on_paper(request), _with_devices(request, answers)):
            for item in steps:
                items.append(item)
                yield item
        yield from left_open(items)
    except BaseException:
        if not isinstance(answers.stage, RigError | None):
            tell(f"the check ended early, {stopped(answers.stage)}")
        raise


def left_open(items: Sequence[Item]) -> Iterator[Item]:
    """Yield the questions that stayed without an answer, and which failure is to blame."""
    failures = [item.name for item in items if item.name in _CAUSES and item.status == "fail"]
    answered = {item.name for item in items}
    for name in QUESTIONS:
        if name not in answered:
            yield Item(name, "skip", f"not reached: {', '.join(failures)} failed, see there")


def _on_paper(request: CheckRequest) -> Iterator[Item]:
    """Everything that needs no device."""
    profile = request.profile
    yield judge_arrangement(profile)
    if profile.stage is None or profile.sweep is None:
        yield Item("travel", "skip", f"the profile has no [{_missing(profile)[0]}]")
    else:
        yield judge_travel(plan_mm(profile), profile.stage.travel_mm)
    yield request.database


def _with_devices(request: CheckRequest, answers: Answers) -> Iterator[Item]:
    profile, camera, clock = request.profile, answers.camera, answers.clock
    item, stage = _ready_stage(request, answers.stage)
    why_standing = "the stage was left alone" if item.status != "fail" else "the stage failed"
    yield item
    if isinstance(camera, RigError):
        yield failed("camera", camera)
        return
    bench = _bench(request.run, stage, camera, clock)
    reached_mm: float | None = None
    if bench is not None:
        try:
            reached_mm = bench.go(middle_mm(profile))
        except DeviceError as error:
            yield failed("move", error)
            bench, why_standing = None, "the stage does not move as it should"
    count = 1 if profile.camera.is_stored else STILLS
    stills = take_stills(camera, count, profile.camera.timeout_s)
    yield _camera_item(camera, stills)
    if stills.failure is None or isinstance(stills.failure, ViewSkewError):
        yield from _over_time(profile, camera, clock, stills)
    if not stills.multiviews:
        return
    multiviews = stills.multiviews
    yield from judge_scene(profile, camera.identity, multiviews, at_mm=reached_mm)
    if profile.sweep is None:
        yield Item("disk", "skip", "the profile has no [sweep]")
    else:
        yield judge_room(profile, request.url, multiviews[0])
    if bench is not None and reached_mm is not None:
        middle = see(request.run.optics, bench.board, multiviews[0], reached_mm)
        yield from judge_carried_board(bench, middle, request.curve)
    else:
        yield from _standing(request, answers.stage, multiviews[0], why_standing)
    yield judge_geometry_drift(profile, request.run.calibration, multiviews[0])


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


def _bench(run: Run, stage: Stage | None, camera: Camera, clock: Clock) -> Bench | None:
    """Join what a sweep would use; None where a part of it is missing."""
    target, config = run.profile.target, run.profile.sweep
    if stage is None or target is None or config is None:
        return None
    board = target_of(target)
    return Bench(run.profile, run.optics, board, config, stage, camera, clock)


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
    request: CheckRequest, stage: Stage | RigError | None, multiview: MultiView, why: str
) -> Iterator[Item]:
    """Judge what one picture tells where the board happens to stand, and say why it stands."""
    profile = request.profile
    target = profile.target
    if target is None or profile.sweep is None or stage is None or isinstance(stage, RigError):
        absent = [f"the profile has no [{section}]" for section in _missing(profile)]
        reason = ", ".join(absent) or "the stage does not answer, see there"
        yield from (Item(name, "skip", reason) for name in CARRIED)
        return
    yield Item("settling", "skip", why)
    try:
        position_mm = stage.position_mm
    except DeviceError as error:
        yield from (Item(name, "skip", error.found, error.advice) for name in CARRIED[1:])
        return
    board = see(request.run.optics, target_of(target), multiview, position_mm)
    yield judge_curve(profile, request.run.optics, board, request.curve)
    yield judge_places(profile, [board])
    yield Item("repeatability", "skip", why)


def _missing(profile: Profile) -> list[str]:
    """Return the sections without which no board is carried."""
    sections = {"stage": profile.stage, "sweep": profile.sweep, "target": profile.target}
    return [name for name, section in sections.items() if section is None]


def _identity(device: Camera | Stage) -> str:
    """What tells it from others, in one line; the controls of single cameras are left out."""
    parts = device.identity.items()
    return ", ".join(f"{key} {value}" for key, value in parts if value and "." not in key)
