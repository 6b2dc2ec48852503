"""A calibration with its effects: devices, pictures on disk, database and report."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from rig.calibrate.album import SOLVED, Album
from rig.calibrate.conclude import CalibrationResult, quality_of
from rig.calibrate.coverage import coverage_of
from rig.calibrate.guide import FEWEST_PICTURES, SOLVE_EVERY, advise, enough, next_pose
from rig.calibrate.live import held_pictures
from rig.calibrate.pictures import (
    Picture,
    recorded_pictures,
    stage_pictures,
    stage_positions_mm,
)
from rig.calibrate.sight import PictureSightings, Tally, sight
from rig.calibrate.solve import SolveChoices, solve
from rig.database import Store, software_versions
from rig.errors import CalibrationError, ConfigError, TargetError
from rig.frames import GreyImage
from rig.geometry.bundle import Calibration
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.hardware.opening import open_camera, open_hardware
from rig.interrupts import Interrupts
from rig.optics.target import target_of
from rig.profile import FolderCameraConfig, Profile
from rig.report.calibration.shown import ShownCalibration
from rig.report.write import write_calibration_page
from rig.sweep.request import sweep_setup
from rig.targets import Target

PATIENCE_S = 60.0
"""Live capture ends when nothing new was shown for so long."""


@dataclass(frozen=True, slots=True)
class CalibrateRequest:
    """What is asked for."""

    profile: Profile
    choices: SolveChoices = field(default_factory=SolveChoices)
    most_pictures: int = 60
    """Live capture ends with so many pictures of a target in the hand."""
    on_stage: bool = False
    """Whether the stage first carries the target through known positions."""
    resume: bool = False
    """Whether to go on with the newest unfinished calibration of the rig."""


Report = Callable[[int, str], None]
"""Hears how many pictures there are, and what to do next."""


def run_calibration(
    request: CalibrateRequest,
    store: Store,
    interrupts: Interrupts,
    report: Report,
    tell: Callable[[str], None],
) -> CalibrationResult:
    """Take pictures, solve, store.

    Every picture is on the disk before the next is taken. A recording is not copied.

    Args:
        request: what is asked for.
        store: where the calibration goes.
        interrupts: active; an interrupt waits until the picture at hand is stored.
        report: hears of progress.
        tell: hears what there is to say beside it.

    Raises:
        CalibrationError: the pictures do not determine the geometry.
        TargetError: the target was hardly seen; says why.
        RigError: devices, profile, database.
    """
    profile = request.profile
    if profile.target is None:
        raise ConfigError(f"profile {profile.name}: a calibration needs [target]", advice="add it")
    if request.on_stage:
        sweep_setup(profile)
    session = _Session(request, target_of(profile.target), interrupts, report, tell)
    recorded = isinstance(profile.camera, FolderCameraConfig)
    if recorded and (request.resume or request.on_stage):
        raise ConfigError(
            f"profile {profile.name}: stored pictures are read from the start and know no stage",
            advice="leave out --resume and --stage",
        )
    if recorded:
        session.read_recording()
        album = Album.new(store.frames, profile)
    else:
        album = (
            Album.unfinished(store.frames, profile)
            if request.resume
            else Album.new(store.frames, profile)
        )
        session.read_album(album)
        session.take(album)
    report(len(session.sighted), "solving")
    calibration = session.solved()
    return _store(session, calibration, album, store)


class _Session:
    """What has been seen so far."""

    def __init__(
        self,
        request: CalibrateRequest,
        target: Target,
        interrupts: Interrupts,
        report: Report,
        tell: Callable[[str], None],
    ) -> None:
        self.request = request
        self.profile = request.profile
        self.target = target
        self.names = tuple(view.name for view in request.profile.views)
        self.sighted: list[PictureSightings] = []
        self.tally = Tally(self.names)
        self.devices: dict[str, object] = {}
        self.temperature_degc: float | None = None
        self._interrupts = interrupts
        self._report = report
        self._tell = tell

    def add(self, picture: Picture, sighted: PictureSightings | None = None) -> None:
        """Count a picture."""
        seen = sight(picture, self.target) if sighted is None else sighted
        self.tally.add(seen)
        if seen.views:
            self.sighted.append(seen)
        self.temperature_degc = picture.multiview.temperature_degc

    def read_recording(self) -> None:
        """Look through all stored pictures."""
        with open_camera(self.profile) as (camera, _clock):
            self.devices["camera"] = dict(camera.identity)
            for picture in recorded_pictures(camera):
                self.add(picture)
                self._report(
                    self.tally.pictures, f"target in {len(self.sighted)} pictures of the recording"
                )

    def read_album(self, album: Album) -> None:
        """Look again at what an interrupted run has kept."""
        for picture in album.pictures():
            self.add(picture)
        if self.sighted:
            self._tell(f"{self.tally.pictures} pictures are there already")

    def take(self, album: Album) -> None:
        """Take what is missing: on the stage, then in the hand."""
        on_stage = any(one.stage_mm is not None for one in self.sighted)
        if self.request.on_stage and not on_stage:
            self._take_on_stage(album)
        if self._in_hand() < self.request.most_pictures:
            self._take_in_hand(album)

    def solved(self, choices: SolveChoices | None = None) -> Calibration:
        """Solve with what there is."""
        if not self.sighted and self.tally.last is not None:
            raise TargetError(
                f"calibration of {self.profile.name} asked for, the target is in none of "
                f"{self.tally.pictures} pictures, the last one: {self.tally.last.found}",
                advice=self.tally.last.advice,
                reason=self.tally.last.reason,
            )
        return solve(self.profile, self.target, self.sighted, choices or self.request.choices)

    def _in_hand(self) -> int:
        return sum(one.stage_mm is None for one in self.sighted)

    def _take_on_stage(self, album: Album) -> None:
        config = sweep_setup(self.profile).config
        positions_mm = stage_positions_mm(config)
        self._tell(f"the stage carries the target to {len(positions_mm)} positions")
        with open_hardware(self.profile) as hardware:
            self.devices["stage"] = dict(hardware.stage.identity)
            for picture in stage_pictures(
                hardware,
                positions_mm,
                config,
                first=self.tally.pictures,
                timeout_s=self.profile.camera.timeout_s,
                held=self._interrupts.held,
            ):
                album.keep(picture)
                self.add(picture)
                self._report(self.tally.pictures, f"stage at {picture.stage_mm:.1f} mm")

    def _take_in_hand(self, album: Album) -> None:
        solves: list[Calibration] = []
        advice = "hold the target still in view of all cameras"
        self._tell("take the target in your hand: hold it still, then somewhere else, tilted")

        def watch(sighted: PictureSightings, *, moving: bool) -> None:
            seen = f"target in {len(sighted.views)} of {len(self.names)} views"
            self._report(len(self.sighted), f"{seen}{', moving' if moving else ''}; {advice}")

        with open_camera(self.profile, target_in_hand=True) as (camera, clock):
            self.devices["camera"] = dict(camera.identity)
            for picture, sighted in held_pictures(
                camera,
                clock,
                self.target,
                self.sighted,
                first=self.tally.pictures,
                timeout_s=self.profile.camera.timeout_s,
                patience_s=PATIENCE_S,
                watch=watch,
                held=self._interrupts.held,
            ):
                album.keep(picture)
                self.add(picture, sighted)
                advice = self._next(solves)
                if enough(solves) or self._in_hand() >= self.request.most_pictures:
                    return
        self._tell(f"nothing new was shown for {PATIENCE_S:.0f} s; solving with what there is")

    def _next(self, solves: list[Calibration]) -> str:
        """Say what to show next; solve again where it is time to."""
        coverage = coverage_of(self.sighted, self.target, len(self.names))
        advice = advise(coverage, self.names, self.profile.reference)
        count = self._in_hand()
        if count < FEWEST_PICTURES or count % SOLVE_EVERY:
            return advice.text
        self._tell(coverage.line(self.names))
        try:
            solves.append(self.solved(SolveChoices(lens="brown5")))
        except CalibrationError as error:
            self._tell(f"{count} pictures do not do yet: {error}")
            return advice.text
        errors = solves[-1].depth_error
        self._tell(
            f"{count} pictures: depth error "
            + ", ".join(f"{e.picture_pct:.3f} % at {e.distance_mm / 1000:g} m" for e in errors)
            + f" (k=2); {solves[-1].verdict}"
        )
        return (next_pose(solves[-1]) if advice.covered else None) or advice.text


def _store(
    session: _Session, calibration: Calibration, album: Album, store: Store
) -> CalibrationResult:
    profile, verdict = session.profile, calibration.verdict
    reference = calibration.geometry.cameras[calibration.geometry.reference]
    number = store.save_calibration(
        rig=profile.name,
        geometry=geometry_to_json(calibration.geometry),
        quality={
            **quality_of(calibration),
            "verdict": str(verdict),
            "good": verdict.good,
            "folder": str(album.folder),
        },
        profile=profile.model_dump(mode="json"),
        versions=software_versions(),
        devices=session.devices,
        temperature_degc=session.temperature_degc,
        image_size_px=(reference.width_px, reference.height_px),
        active=verdict.good,
    )
    shown = ShownCalibration(
        profile.name,
        calibration,
        images=dict(_images(session, calibration, album)),
        facts={
            "calibration": number,
            "taken": datetime.now(UTC).isoformat(timespec="seconds"),
            "temperature": session.temperature_degc,
            **session.devices,
        },
    )
    page = write_calibration_page(album.folder / "calibration.html", shown)
    file = album.write(SOLVED, calibration.to_json())
    return CalibrationResult(
        number, profile.name, calibration, session.tally, store.database, file, Path(page)
    )


def _images(
    session: _Session, calibration: Calibration, album: Album
) -> Iterator[tuple[tuple[int, int], GreyImage]]:
    """The pictures that the page shows: the first, the middle and the last one used."""
    numbers = calibration.pictures
    wanted = {numbers[0], numbers[len(numbers) // 2], numbers[-1]}
    if isinstance(session.profile.camera, FolderCameraConfig):
        with open_camera(session.profile) as (camera, _clock):
            yield from _chosen(recorded_pictures(camera), wanted)
    else:
        yield from _chosen(album.pictures(), wanted)


def _chosen(
    pictures: Iterator[Picture], wanted: set[int]
) -> Iterator[tuple[tuple[int, int], GreyImage]]:
    for picture in pictures:
        if picture.number in wanted:
            for view, frame in enumerate(picture.multiview.frames):
                yield (picture.number, view), frame.image
