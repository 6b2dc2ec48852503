"""A calibration from ordinary scenes, with its effects: pictures, solve, store."""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.calibrate.album import SOLVED, Album
from rig.calibrate.pictures import Picture, recorded_pictures
from rig.calibrate.scene_start import SceneStart, scene_start
from rig.calibrate.take import Operator
from rig.database import Store, software_versions, this_program
from rig.devices import Camera, Clock
from rig.epipolar.scene.found import FoundGeometry, LensTerms, find_geometry
from rig.epipolar.scene.verdict import judge_scene, rows_sigma_of
from rig.errors import ConfigError, StoreError
from rig.frames import MultiView
from rig.geometry.bundle.depth_error import depth_errors
from rig.geometry.bundle.result import DepthError, Verdict
from rig.geometry.rig_geometry_json import geometry_to_json
from rig.hardware.opening import open_camera
from rig.profile import Profile
from rig.records import Json
from rig.run import FROM_SCENE
from rig.unit import unit_of

MOST_SCENES = 12
"""Multi-views that are used; more of an ordinary room add little."""
_EVERY_S, _PATIENCE = 1.0, 8
"""A live camera is looked through so often, and given up after so many looks at the same scene."""
_THUMB_PX = (40, 25)
_OTHER = 0.15
"""Scenes differ where their small pictures differ by this part of their own contrast, rms."""


@dataclass(frozen=True, slots=True)
class SceneRequest:
    """What is asked for."""

    profile: Profile
    start: int | None = None
    """Calibration whose intrinsics and places are the start; None: see `scene_start`."""
    lens_terms: LensTerms = "auto"
    most_scenes: int = MOST_SCENES
    note: str = ""
    tags: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SceneResult:
    """A calibration from scenes that has been stored."""

    calibration_id: int
    rig: str
    found: FoundGeometry
    verdict: Verdict
    source: str
    """Where the focal lengths come from."""
    scenes: int
    """Multi-views that were used."""
    quality: Json
    depth_error: tuple[DepthError, ...]
    database: str
    file: Path


def calibrate_from_scene(request: SceneRequest, store: Store, operator: Operator) -> SceneResult:
    """Take pictures of whatever is there, solve, store.

    Args:
        request: what is asked for.
        store: where the calibration goes.
        operator: hears of progress, and may interrupt.

    Raises:
        CalibrationError: the views share too few features.
        ConfigError: nobody knows a focal length.
        RigError: device, files, database.
    """
    profile = request.profile
    if profile.camera.is_scan:
        raise ConfigError(
            f"calibration of {profile.name} from a scene asked for, its one camera moves",
            advice="show a board: rig calibrate without --from-scene",
        )
    chosen = None if request.start is None else store.calibration(request.start)
    stored = store.active_calibration(profile.name, profile.unit)
    album = Album.new(store.frames, profile, store.modes)
    asked = f"asked to take the calibration {album.folder.name}"
    try:
        with (
            store.owned(album.lease, album.folder, asked),
            open_camera(profile) as (camera, clock),
        ):
            pictures = _taken(camera, clock, request, album, operator)
            sizes_px = [(i.shape[1], i.shape[0]) for i in pictures[0].multiview.images]
            start = scene_start(profile, sizes_px, chosen, stored, camera)
            operator.progress(len(pictures), "solving")
            found = find_geometry(
                [picture.multiview.images for picture in pictures],
                pictures[0].multiview.frames[0].full_scale,
                start.geometry,
                start.sure,
                request.lens_terms,
            )
            taken = _Taken(pictures[-1].multiview, dict(camera.identity), len(pictures))
            return _stored(request, store, album, found, start, taken)
    except BaseException:
        with suppress(StoreError):  # where the disk is gone the first error is the one
            album.discard_if_empty()
        raise


@dataclass(frozen=True, slots=True)
class _Taken:
    """What the pictures were taken with."""

    last: MultiView
    identity: dict[str, str]
    scenes: int


def quality_of_scene(
    found: FoundGeometry,
    start: SceneStart,
    verdict: Verdict,
    errors: Sequence[DepthError],
) -> dict[str, object]:
    """Return the numbers that judge a calibration from scenes, as plain data."""
    fit, geometry = found.fit, found.fit.geometry
    fields = {
        name: {"smooth_rms": field.rms_px, "scatter": field.scatter_px}
        for name, field in zip(geometry.names, found.fields, strict=True)
        if field is not None
    }
    return {
        FROM_SCENE: {
            "focal_from": start.source,
            "lengths": "by the profile's pitch_mm, not measured",
            "features": int(fit.fits.sum()),
            "fitting_pct": 100.0 * float(fit.fits.mean()),
            "rows_px": fields,
            "rows_sigma_px": rows_sigma_of(found),
            "lens_terms": geometry.cameras[geometry.reference].lens != "none",
        },
        "lens": geometry.cameras[geometry.reference].lens,
        "depth_error": [
            {"distance_mm": error.distance_mm, "picture_pct": error.picture_pct} for error in errors
        ],
        "verdict": str(verdict),
        "good": verdict.good,
    }


def _stored(
    request: SceneRequest,
    store: Store,
    album: Album,
    found: FoundGeometry,
    start: SceneStart,
    taken: _Taken,
) -> SceneResult:
    profile, geometry = request.profile, found.fit.geometry
    verdict = judge_scene(found, start.source)
    errors = depth_errors(geometry)
    quality = quality_of_scene(found, start, verdict, errors)
    content = geometry_to_json(geometry)
    reference = geometry.cameras[geometry.reference]
    number = store.save_calibration(
        rig=profile.name,
        geometry=content,
        quality={**quality, "folder": str(album.folder)},
        profile=profile.model_dump(mode="json"),
        versions=software_versions(),
        devices={"camera": taken.identity},
        temperature_degc=taken.last.temperature_degc,
        image_size_px=(reference.width_px, reference.height_px),
        active=verdict.good,
        unit=unit_of(profile, taken.identity),
        note=request.note,
        provenance=this_program(request.tags),
    )
    file = album.write(SOLVED, json.dumps({"geometry": content, **quality}))
    return SceneResult(
        number,
        profile.name,
        found,
        verdict,
        start.source,
        taken.scenes,
        quality,
        errors,
        store.database,
        file,
    )


def _taken(
    camera: Camera, clock: Clock, request: SceneRequest, album: Album, operator: Operator
) -> list[Picture]:
    """Pictures of scenes that differ; live ones are on the disk before the next is taken."""
    is_stored = request.profile.camera.is_stored
    if not is_stored:
        operator.tell("point the cameras at one scene after the other: near, far, all with texture")
    source = (
        recorded_pictures(camera)
        if is_stored
        else _live(camera, clock, request.profile.camera.timeout_s, operator)
    )
    kept: list[Picture] = []
    thumbs: list[Float] = []
    in_vain = 0
    for picture in source:
        thumb = _thumb(picture.multiview.images[request.profile.reference])
        if all(_differ(thumb, other) for other in thumbs):
            chosen = Picture(len(kept), picture.multiview)
            if not is_stored:
                album.keep(chosen)
            kept.append(chosen)
            thumbs.append(thumb)
            in_vain = 0
            operator.progress(len(kept), f"{len(kept)} scenes; now another one")
        else:
            in_vain += 1
        if len(kept) >= request.most_scenes or (not is_stored and in_vain >= _PATIENCE):
            break
    if not kept:
        raise ConfigError(
            f"calibration of {request.profile.name} from a scene asked for, no picture was found",
            advice="correct camera.folder or --frames",
        )
    return kept


def _live(camera: Camera, clock: Clock, timeout_s: float, operator: Operator) -> Iterator[Picture]:
    number = 0
    while True:
        with operator.interrupts.deferred():
            multiview = camera.grab(timeout_s)
        yield Picture(number, multiview)
        number += 1
        clock.sleep_s(_EVERY_S)


def _thumb(image: NDArray[np.generic]) -> Float:
    small = cv2.resize(image.astype(np.float32), _THUMB_PX, interpolation=cv2.INTER_AREA)
    level = np.asarray(small, np.float64)
    return (level - level.mean()) / max(float(level.std()), 1e-6)


def _differ(one: Float, other: Float) -> bool:
    return float(np.sqrt(np.mean((one - other) ** 2))) > _OTHER


def scene_lines(result: SceneResult) -> Sequence[str]:
    """Return the result for a person."""
    geometry, fit = result.found.fit.geometry, result.found.fit
    lines = [
        f"calibration {result.calibration_id} of {result.rig}, from {result.scenes} scenes: "
        f"{result.verdict}",
        f"{int(fit.fits.sum())} of {len(result.found.features)} features fit; rows are known to "
        f"{rows_sigma_of(result.found):.3f} px (1 sigma over the picture)",
    ]
    for name, field in zip(geometry.names, result.found.fields, strict=True):
        if field is not None:
            pose = geometry.cam_from_reference[geometry.names.index(name)]
            turned = ", ".join(f"{x:+.3f}" for x in np.degrees(pose.rotation_rad).tolist())
            lines.append(
                f"  {name}: turned by ({turned}) deg about x, y, z; rows miss by a smooth "
                f"{field.rms_px:.3f} px rms, single features scatter {field.scatter_px:.2f} px"
            )
    lines.append(
        "depth error from calibration alone, k=2 over the picture: "
        + ", ".join(
            f"{error.picture_pct:.2g} % at {error.distance_mm / 1000:g} m"
            for error in result.depth_error
        )
        + "; a scene hardly tells how views are turned towards each other, a board does"
    )
    lines += [f"note: {note}" for note in result.verdict.notes]
    return [*lines, f"stored in {result.database}", f"file {result.file}"]
