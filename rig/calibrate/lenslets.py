"""The calibration of a lenslet array: from a white picture to a stored calibration."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.arrays import Float
from rig.calibrate.album import SOLVED, Album
from rig.database import Store, software_versions
from rig.devices import Camera
from rig.errors import CalibrationError, ConfigError
from rig.hardware.opening import open_raw_camera
from rig.lenslet.array import ARRAY_JSON, LensletArray, fit_array
from rig.lenslet.fit import FittedLattice
from rig.lenslet.plan import plan_views
from rig.lenslet.views import view_size_px
from rig.lenslet.white import RawFormat
from rig.profile import RAW_VIEW, FolderCameraConfig, LensletCameraConfig, Profile
from rig.progress import Tell
from rig.records import Json
from rig.report.calibration.lenslets import ShownLenslets
from rig.report.write import write_lenslet_page
from rig.stored import LENSLETS

WHITE_PICTURES = 16
"""Taken with the camera and averaged: the fit then has a quarter of their noise."""


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """What a white picture gave."""

    array: LensletArray
    fitted: FittedLattice
    view_size_px: tuple[int, int]
    """Width and height of the views of the profile."""


@dataclass(frozen=True, slots=True)
class LensletResult:
    """A calibration of lenslets that has been stored."""

    calibration_id: int
    rig: str
    quality: Json
    """What it is worth, see `quality_of_lenslets`."""
    pictures: int
    """White pictures that were averaged."""
    database: str
    file: Path
    """The whole calibration as JSON."""
    report: Path
    """The fit over the white picture, one HTML file."""


@dataclass(frozen=True, slots=True, eq=False)
class _White:
    """Pictures of one white surface."""

    image: Float
    """(H, W) their mean, grey values."""
    full_scale: int
    pictures: int
    identity: dict[str, str]


def calibrate_lenslets(
    profile: Profile, store: Store, tell: Tell, white: Path | None = None
) -> LensletResult:
    """Calibrate the lenslets of a rig and store what was found.

    Args:
        profile: of a rig with a lenslet camera.
        store: where the calibration goes.
        tell: told what is happening.
        white: picture of an evenly lit white surface; None takes that of the profile, or pictures
            with the camera.

    Raises:
        CalibrationError: the white picture is none of this array.
        ConfigError: the camera has no lenslets.
        RigError: device, files, database.
    """
    camera = profile.camera
    if not isinstance(camera, LensletCameraConfig):
        raise ConfigError(
            f"a white picture is given, camera.kind of {profile.name} is {camera.kind}",
            advice='leave out --white; only kind "lenslet" has lenslets',
        )
    seen = _white(profile, camera, white, tell)
    dark = None if camera.dark is None else _stored(profile, Path(camera.dark)).image
    array, fitted = fit_array(
        seen.image, _format(camera, seen), camera.lattice, camera.spacing_px, dark
    )
    places = np.array([(view.x_steps, view.y_steps) for view in profile.views])
    size_px = view_size_px(array, plan_views(array, places * camera.step_px))
    return _store(profile, store, seen, _Found(array, fitted, size_px))


def quality_of_lenslets(found: _Found) -> dict[str, object]:
    """Return the numbers that judge a calibration of lenslets, as plain data."""
    array, lattice = found.array, found.array.lattice
    inside = array.gains[array.gains > 0.0]
    return {
        "lattice": lattice.kind,
        "spacing_px": lattice.spacing_px,
        "rotation_deg": math.degrees(lattice.rotation_rad),
        "lenslets": int(inside.size),
        "missing": array.missing,
        "dirty": array.dirty,
        "residual_px": lattice.residual_px,
        "corner_sigma_px": lattice.sigma_px,
        "gain_rms_pct": 100.0 * float(np.std(inside)),
        "white_rms_pct": 100.0 * array.white_rms,
        "view_size_px": list(found.view_size_px),
    }


def _white(profile: Profile, camera: LensletCameraConfig, white: Path | None, tell: Tell) -> _White:
    file = white if white is not None else None if camera.white is None else Path(camera.white)
    if file is not None:
        return _stored(profile, file)
    if camera.is_stored:
        raise CalibrationError(
            f"profile {profile.name}: its raw pictures are stored ones, none is known to be white",
            advice="give one with --white, or set camera.white",
        )
    tell(f"taking {WHITE_PICTURES} pictures: hold a diffuser before the lens, evenly lit")
    with open_raw_camera(profile, camera.raw) as opened:
        return _mean(opened, camera.timeout_s, WHITE_PICTURES)


def _stored(profile: Profile, file: Path) -> _White:
    file = file.expanduser().absolute()
    folder = FolderCameraConfig(
        kind="folder", folder=str(file.parent), files={RAW_VIEW.name: file.name}
    )
    with open_raw_camera(profile, folder) as camera:
        return _mean(camera, 1.0, 1)


def _mean(camera: Camera, timeout_s: float, count: int) -> _White:
    frames = [camera.grab(timeout_s).frames[0] for _ in range(count)]
    image = np.stack([frame.image for frame in frames]).mean(axis=0, dtype=np.float64)
    return _White(image, frames[0].full_scale, count, dict(camera.identity))


def _format(camera: LensletCameraConfig, seen: _White) -> RawFormat:
    full_scale = seen.full_scale if camera.bits is None else (1 << camera.bits) - 1
    return RawFormat(full_scale, camera.is_bayer, camera.dark_levels)


def _store(profile: Profile, store: Store, seen: _White, found: _Found) -> LensletResult:
    album = Album.new(store.frames, profile, store.modes)
    content, quality = ARRAY_JSON.to_json(found.array), quality_of_lenslets(found)
    number = store.save_calibration(
        rig=profile.name,
        geometry={LENSLETS: content},
        quality={**quality, "good": True, "folder": str(album.folder)},
        profile=profile.model_dump(mode="json"),
        versions=software_versions(),
        devices={"camera": seen.identity},
        temperature_degc=None,
        image_size_px=found.array.vignetting.size_px,
    )
    shown = ShownLenslets(profile.name, number, found.array, found.fitted, seen.image, quality)
    page = write_lenslet_page(album.folder / "calibration.html", shown)
    file = album.write(SOLVED, json.dumps(content))
    return LensletResult(number, profile.name, quality, seen.pictures, store.database, file, page)
