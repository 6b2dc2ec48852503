"""Taking the pictures of a calibration: from files, with the stage, and of a target in the hand."""

from dataclasses import dataclass, field

from rig.calibrate.album import Album
from rig.calibrate.collection import Collection
from rig.calibrate.conclude import error_text
from rig.calibrate.coverage import Coverage, coverage_of
from rig.calibrate.guide import (
    FEWEST_PICTURES,
    JUDGED_AT,
    SOLVE_EVERY,
    advise,
    coverage_text,
    enough,
    next_pose,
)
from rig.calibrate.in_hand import pictures_in_hand
from rig.calibrate.pictures import Picture, recorded_pictures, stage_pictures, stage_positions_mm
from rig.calibrate.sight import PictureSightings
from rig.calibrate.solve import SolveChoices
from rig.calibrate.watch import Look, Watch, unwatched
from rig.devices import stopped
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration
from rig.hardware.opening import open_camera, open_hardware
from rig.interrupts import Interrupts
from rig.progress import Progress, Tell
from rig.sweep.request import sweep_setup

PATIENCE_S = 60.0
"""Live capture ends when nothing new was shown for so long."""
_SCANS_OF_PATIENCE = 20.0
"""A camera that moves looks so often in vain: a target that is carried spoils a scan or two."""
_FIRST_ADVICE = "hold the target still in view of all cameras"


@dataclass(frozen=True, slots=True)
class Operator:
    """Who runs a calibration: hears of it, and may interrupt it."""

    interrupts: Interrupts
    """An interrupt waits until the picture at hand is stored."""
    progress: Progress
    """Told how many pictures there are, and what to do next."""
    tell: Tell
    watch: Watch = unwatched
    """Told of every picture of a target in the hand."""


def read_stored(collection: Collection, operator: Operator) -> None:
    """Look through all pictures of a stored camera; they are not copied."""
    with open_camera(collection.profile) as (camera, _clock):
        collection.devices["camera"] = dict(camera.identity)
        for picture in recorded_pictures(camera):
            collection.add(picture)
            shown = len(collection.sightings)
            operator.progress(
                collection.tally.pictures, f"pictures of the recording with the target: {shown}"
            )


def read_album(collection: Collection, album: Album, operator: Operator) -> None:
    """Look again at what an interrupted run has kept."""
    for picture in album.pictures():
        collection.add(picture)
    if collection.sightings:
        operator.tell(f"{collection.tally.pictures} pictures are there already")


def take_on_stage(collection: Collection, album: Album, operator: Operator) -> None:
    """Let the stage carry the target through known positions, once."""
    if any(one.stage_mm is not None for one in collection.sightings):
        return
    profile = collection.profile
    config = sweep_setup(profile).config
    positions_mm = stage_positions_mm(config)
    operator.tell(f"the stage carries the target to {len(positions_mm)} positions")
    with open_hardware(profile) as hardware:
        collection.devices["stage"] = dict(hardware.stage.identity)
        try:
            for picture in stage_pictures(
                hardware,
                positions_mm,
                config,
                first=collection.tally.pictures,
                timeout_s=profile.camera.timeout_s,
                deferred=operator.interrupts.deferred,
            ):
                album.keep(picture)
                collection.add(picture)
                operator.progress(collection.tally.pictures, f"stage at {picture.stage_mm:.1f} mm")
        except BaseException:
            with operator.interrupts.shielded():
                operator.tell(f"the stage ended early, {stopped(hardware.stage)}")
            raise


def take_in_hand(
    collection: Collection, album: Album, operator: Operator, most_pictures: int
) -> None:
    """Take pictures of a target in the hand until more would not help, or there are enough."""
    if collection.in_hand >= most_pictures:
        return
    guide = _Guide(collection, operator.tell)
    operator.tell("take the target in your hand: hold it still, then somewhere else, tilted")
    profile = collection.profile
    with open_camera(profile, target_in_hand=True) as (camera, clock):
        collection.devices["camera"] = dict(camera.identity)
        for picture, sightings in pictures_in_hand(
            camera,
            clock,
            collection.target,
            collection.sightings,
            first=collection.tally.pictures,
            timeout_s=profile.camera.timeout_s,
            patience_s=max(PATIENCE_S, _SCANS_OF_PATIENCE * profile.camera.typical_grab_s),
            progress=lambda count, text: operator.progress(count, f"{text}; {guide.advice}"),
            watch=lambda picture, now, moving: operator.watch(guide.seen(picture, now, moving)),
            deferred=operator.interrupts.deferred,
        ):
            album.keep(picture)
            collection.add(picture, sightings)
            guide.look()
            if enough(guide.solves) or collection.in_hand >= most_pictures:
                return
    operator.tell(f"nothing new was shown for {PATIENCE_S:.0f} s; solving with what there is")


@dataclass(slots=True)
class _Guide:
    """Says what to show next; solves again where it is time to."""

    collection: Collection
    tell: Tell
    advice: str = _FIRST_ADVICE
    solves: list[Calibration] = field(default_factory=list[Calibration])
    coverage: Coverage | None = None
    errors: tuple[tuple[int, float], ...] = ()

    def seen(self, picture: Picture, now: PictureSightings, is_moving: bool) -> Look:
        """Return what somebody who watches is told of a picture."""
        collection = self.collection
        kept = len(collection.sightings)
        return Look(
            collection.profile,
            picture,
            now,
            is_moving,
            kept,
            self.advice,
            self.coverage,
            self.errors,
        )

    def look(self) -> None:
        """Look at what was added."""
        collection = self.collection
        coverage = coverage_of(collection.sightings, collection.target, len(collection.names))
        self.coverage = coverage
        advice = advise(coverage, collection.names, collection.profile.reference)
        self.advice = advice.text
        count = collection.in_hand
        if count < FEWEST_PICTURES or count % SOLVE_EVERY:
            return
        self.tell(coverage_text(coverage, collection.names))
        try:
            solve = collection.solved(SolveChoices(lens="brown5"))
        except CalibrationError as error:
            self.tell(f"{count} pictures do not do yet: {error}")
            return
        self.solves.append(solve)
        if solve.depth_error:  # one camera alone has none
            self.errors += ((count, solve.depth_error[JUDGED_AT].seen_pct),)
        self.tell(f"{count} pictures: {error_text(solve)} (k=2); {solve.verdict}")
        if advice.covered:
            self.advice = next_pose(solve) or advice.text
