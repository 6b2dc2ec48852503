"""One check from devices to items: what is measured, in which order, and what depends on what."""

from collections.abc import Generator, Iterator, Sequence

from rig.check.arrangement import judge_arrangement
from rig.check.bench import Bench, see, take_stills
from rig.check.carried_board import judge_carried_board
from rig.check.devices import judge_camera, judge_stream, ready_stage
from rig.check.geometry_drift import judge_geometry_drift
from rig.check.items import Item, failed
from rig.check.request import CheckRequest, check_request, missing_sections
from rig.check.scans import judge_rest, judge_scans
from rig.check.scene import judge_scene
from rig.check.search import judge_range
from rig.check.slider_play import judge_play
from rig.check.span import middle_mm, plan_mm
from rig.check.stage import judge_travel
from rig.check.standing_board import CARRIED, judge_standing_board
from rig.check.storage import judge_room
from rig.devices import Camera, Clock, Stage, stopped
from rig.errors import DeviceError, RigError, ViewSkewError
from rig.hardware.opening import Answers, open_what_answers
from rig.interrupts import Interrupts
from rig.optics.target import target_of
from rig.profile import Profile, ScanCameraConfig
from rig.progress import Tell
from rig.scan import MovedCamera
from rig.stored import Run, RunChoice

STILLS = 16
"""Multi-views of the board at rest: the noise of each view is then known within 1 %."""
SCANS = 3
"""The same of a camera that moves, which takes its time: noise is then known within 3 %."""
QUESTIONS = (
    *("arrangement", "travel", "database", "stage", "camera", "skew", "rate", "drops", "board"),
    *("focus", "exposure", "locks", "noise", "likeness", "disk", *CARRIED, "geometry"),
)
"""Every item that a check answers or skips; `move` comes besides where the stage cannot, `range`
where the profile gives distances."""
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
    with Interrupts(), open_what_answers(request.profile) as answers:
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
        yield Item("travel", "skip", f"the profile has no [{missing_sections(profile)[0]}]")
    else:
        yield judge_travel(plan_mm(profile), profile.stage.travel_mm)
    yield request.database
    if profile.slopes.range_mm is not None:
        yield judge_range(request.run, request.curve)


def _with_devices(request: CheckRequest, answers: Answers) -> Iterator[Item]:
    profile, camera, clock = request.profile, answers.camera, answers.clock
    item, stage = ready_stage(request, answers.stage)
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
    if isinstance(profile.camera, ScanCameraConfig) and isinstance(camera, MovedCamera):
        yield from judge_rest(profile.camera, camera, clock)
        yield judge_play(profile, camera, clock)
    stills = take_stills(camera, _stills_of(profile), profile.camera.timeout_s)
    yield judge_camera(camera, stills)
    if profile.camera.is_scan:
        yield from judge_scans(stills.multiviews)
    elif stills.failure is None or isinstance(stills.failure, ViewSkewError):
        yield from judge_stream(profile, camera, clock, stills)
    if not stills.multiviews:
        return
    multiviews = stills.multiviews
    yield from judge_scene(profile, camera.identity, multiviews, at_mm=reached_mm)
    if profile.sweep is None:
        yield Item("disk", "skip", "the profile has no [sweep]")
    else:
        yield judge_room(profile, request.url, multiviews[0])
    if bench is not None and reached_mm is not None:
        middle = see(request.run.optics, bench.target, multiviews[0], reached_mm)
        yield from judge_carried_board(bench, middle, request.curve)
    else:
        yield from judge_standing_board(request, answers.stage, multiviews[0], why_standing)
    yield judge_geometry_drift(profile, request.run.calibration, multiviews[0])


def _stills_of(profile: Profile) -> int:
    if profile.camera.is_scan:
        return SCANS
    return 1 if profile.camera.is_stored else STILLS


def _bench(run: Run, stage: Stage | None, camera: Camera, clock: Clock) -> Bench | None:
    """Join what a sweep would use; None where a part of it is missing."""
    target, config = run.profile.target, run.profile.sweep
    if stage is None or target is None or config is None:
        return None
    return Bench(run.profile, run.optics, target_of(target), config, stage, camera, clock)
