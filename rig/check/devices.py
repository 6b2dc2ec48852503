"""Judgement of the devices themselves: stage and camera answer, and frames come in time."""

from collections.abc import Iterator

from rig.check.bench import Stills, take_stream
from rig.check.items import Item, failed
from rig.check.request import CheckRequest
from rig.check.timing import judge_drops, judge_rate, judge_skew
from rig.devices import Camera, Clock, Stage
from rig.errors import DeviceError, RigError, ViewSkewError
from rig.profile import Profile


def ready_stage(request: CheckRequest, stage: Stage | RigError | None) -> tuple[Item, Stage | None]:
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


def judge_camera(camera: Camera, stills: Stills) -> Item:
    """Say which camera answers; views out of step are judged with the skew."""
    failure = stills.failure
    if failure is None or isinstance(failure, ViewSkewError):
        return Item("camera", "pass", f"{_identity(camera)}; {len(camera.views)} views answer")
    return failed("camera", failure)


def judge_stream(profile: Profile, camera: Camera, clock: Clock, stills: Stills) -> Iterator[Item]:
    """Take a short stream, and judge skew, rate and drops."""
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
        yield judge_skew(
            [*skews_s, *stream.skews_s],
            profile.camera.max_skew_s,
            is_one_picture=profile.camera.is_one_picture,
        )
    yield judge_rate(stream, profile.camera.asked_rate_hz)
    yield judge_drops(stream)


def _identity(device: Camera | Stage) -> str:
    """What tells it from others, in one line; the controls of single cameras are left out."""
    parts = device.identity.items()
    return ", ".join(f"{key} {value}" for key, value in parts if value and "." not in key)
