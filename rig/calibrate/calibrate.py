"""A calibration with its effects: devices, pictures on disk, database and report."""

import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

from rig.calibrate.album import SOLVED, Album
from rig.calibrate.collection import Collection
from rig.calibrate.conclude import CalibrationResult, quality_of
from rig.calibrate.on_sliders import on_sliders
from rig.calibrate.pictures import Picture, recorded_pictures
from rig.calibrate.solve import SolveChoices, readouts_of
from rig.calibrate.take import Operator, read_album, read_stored, take_in_hand, take_on_stage
from rig.database import Store, software_versions, this_program
from rig.errors import ConfigError, StoreError
from rig.frames import GreyImage
from rig.geometry.bundle import Calibration
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.geometry.slider import Sliders
from rig.hardware.opening import open_camera
from rig.interrupts import saying
from rig.optics.target import target_of
from rig.profile import Profile
from rig.report.calibration.shown import ShownCalibration
from rig.report.write import write_calibration_page
from rig.sweep.request import sweep_setup
from rig.unit import unit_of


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
    note: str = ""
    """Free text of the user."""
    tags: tuple[str, ...] = ()
    """Words to find it again by."""


def run_calibration(
    request: CalibrateRequest, store: Store, operator: Operator
) -> CalibrationResult:
    """Take pictures, solve, store.

    Every picture is on the disk before the next is taken. A recording is not copied.

    Args:
        request: what is asked for.
        store: where the calibration goes.
        operator: hears of progress, and may interrupt.

    Raises:
        CalibrationError: the pictures do not determine the geometry.
        TargetError: the target was hardly seen; says why.
        OwnedError: another program works on the calibration that is to go on.
        RigError: devices, profile, database.
    """
    profile = request.profile
    if profile.target is None:
        raise ConfigError(f"profile {profile.name}: a calibration needs [target]", advice="add it")
    if request.on_stage:
        sweep_setup(profile)
    if profile.camera.is_stored and (request.resume or request.on_stage):
        raise ConfigError(
            f"profile {profile.name}: stored pictures are read from the start and know no stage",
            advice="leave out --resume and --stage",
        )
    collection = Collection(profile, target_of(profile.target))
    if profile.camera.is_stored:
        read_stored(collection, operator)
        album = Album.new(store.frames, profile, store.modes)
        return _solve_and_store(collection, request, album, store, operator)
    return _take(collection, request, store, operator)


def _take(
    collection: Collection, request: CalibrateRequest, store: Store, operator: Operator
) -> CalibrationResult:
    """Take pictures into an album that belongs to this program, and solve."""
    profile = collection.profile
    album = (Album.unfinished if request.resume else Album.new)(store.frames, profile, store.modes)
    asked = f"asked to {'resume' if request.resume else 'take'} the calibration {album.folder.name}"
    with ExitStack() as ending:
        if not request.resume:
            ending.callback(_discard_if_empty, album)
        ending.enter_context(store.owned(album.lease, album.folder, asked))
        ending.enter_context(saying(lambda: _kept(collection)))
        read_album(collection, album, operator)
        if request.on_stage:
            take_on_stage(collection, album, operator)
        take_in_hand(collection, album, operator, request.most_pictures)
        return _solve_and_store(collection, request, album, store, operator)


def _discard_if_empty(album: Album) -> None:
    with suppress(StoreError):  # where the disk is gone the first error is the one
        album.discard_if_empty()


def _kept(collection: Collection) -> str:
    count, rig = collection.tally.pictures, collection.profile.name
    if not count:
        return "no picture was taken yet"
    return f"{count} pictures are kept; go on with: rig calibrate {rig} --resume"


def _solve_and_store(
    collection: Collection,
    request: CalibrateRequest,
    album: Album,
    store: Store,
    operator: Operator,
) -> CalibrationResult:
    operator.progress(len(collection.sightings), "solving")
    calibration = collection.solved(request.choices)
    sliders: Sliders | None = None
    if collection.profile.camera.is_scan:
        calibration, sliders = on_sliders(collection, calibration)
    return _store(collection, calibration, request, album, store, sliders)


def _unit(collection: Collection) -> str:
    camera = collection.devices.get("camera")
    identity = cast("dict[str, str]", camera) if isinstance(camera, dict) else {}
    return unit_of(collection.profile, identity)


def _store(
    collection: Collection,
    calibration: Calibration,
    request: CalibrateRequest,
    album: Album,
    store: Store,
    sliders: Sliders | None,
) -> CalibrationResult:
    profile, verdict = collection.profile, calibration.verdict
    reference = calibration.geometry.cameras[calibration.geometry.reference]
    geometry = geometry_to_json(calibration.geometry)
    number = _stored_before(store, profile, album, geometry) or store.save_calibration(
        rig=profile.name,
        geometry=geometry,
        quality={
            **quality_of(calibration, sliders),
            "verdict": str(verdict),
            "good": verdict.good,
            "folder": str(album.folder),
        },
        profile=profile.model_dump(mode="json"),
        versions=software_versions(),
        devices=collection.devices,
        temperature_degc=collection.temperature_degc,
        image_size_px=(reference.width_px, reference.height_px),
        active=verdict.good,
        unit=_unit(collection),
        note=request.note,
        provenance=this_program(request.tags),
    )
    shown = ShownCalibration(
        profile.name,
        calibration,
        images=dict(_images(collection, calibration, album)),
        facts={
            "calibration": number,
            "taken": datetime.now(UTC).isoformat(timespec="seconds"),
            "temperature": collection.temperature_degc,
            "unit": _unit(collection) or "not known",
            **({"note": request.note} if request.note else {}),
            "command": this_program().command,
            **collection.devices,
        },
    )
    page = write_calibration_page(album.folder / "calibration.html", shown)
    file = album.write(SOLVED, calibration.to_json())
    return CalibrationResult(
        number,
        profile.name,
        calibration,
        collection.tally,
        store.database,
        file,
        Path(page),
        sliders,
        readouts_of(profile, collection.sightings, calibration),
    )


def _stored_before(
    store: Store, profile: Profile, album: Album, geometry: Mapping[str, object]
) -> int | None:
    """Return the calibration of a program that was ended before its album said so.

    The same pictures give the same numbers, to the last digit.
    """
    text = json.dumps(geometry, sort_keys=True)
    for stored in store.calibrations(profile.name):
        is_of_album = stored.quality.get("folder") == str(album.folder)
        if is_of_album and json.dumps(stored.geometry, sort_keys=True) == text:
            return stored.id
    return None


def _images(
    collection: Collection, calibration: Calibration, album: Album
) -> Iterator[tuple[tuple[int, int], GreyImage]]:
    """The pictures that the page shows: the first, the middle and the last one used."""
    numbers = calibration.pictures
    wanted = {numbers[0], numbers[len(numbers) // 2], numbers[-1]}
    if collection.profile.camera.is_stored:
        with open_camera(collection.profile) as (camera, _clock):
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
