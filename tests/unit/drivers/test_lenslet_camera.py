"""The lenslet camera around stored raw pictures."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from rig.calibrate.lenslets import calibrate_lenslets
from rig.database import open_store
from rig.errors import CalibrationError, ConfigError, DeviceLostError, DeviceNotFoundError
from rig.frames import GreyImage
from rig.hardware.opening import open_camera
from rig.lenslet.array import ARRAY_JSON
from rig.profile import LensletCameraConfig
from rig.profile.load import load_profile, parse_profile
from rig.stored import open_run
from tests.support.lenslet_raw import DARK, FULL, exposed, fitted

VIEWS = [("centre", 0.0, 0.0), ("left", -1.0, 0.0), ("right", 1.0, 0.0), ("top", 0.0, -1.0)]


def profile(folder: Path, lenslets: dict[str, Any] | None = None, **camera: object):
    """A rig whose raw pictures lie in a folder."""
    return parse_profile(
        {
            "name": "box",
            "pitch_mm": 1.0,
            "views": [{"name": n, "x_steps": x, "y_steps": y} for n, x, y in VIEWS],
            "slopes": {"range_px": [-1.0, 1.0]},
            "camera": {
                "kind": "lenslet",
                "lattice": "square",
                "spacing_px": 14.0,
                "step_px": 3.0,
                "bits": 12,
                "dark_levels": float(DARK),
                "raw": {"kind": "folder", "folder": str(folder), "files": {"raw": "raw_*.png"}},
                "lenslets": lenslets,
                **camera,
            },
        },
        source="test",
    )


@pytest.fixture(scope="module")
def lenslets():
    return ARRAY_JSON.to_json(fitted("square")[1])


def keep(folder: Path, *images: GreyImage):
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"raw_{number}.png"), image)


def test_a_raw_picture_becomes_the_views_of_the_profile(tmp_path: Path, lenslets: dict[str, Any]):
    keep(tmp_path, exposed(0.5 * fitted("square")[0].white()))

    with open_camera(profile(tmp_path, lenslets)) as (camera, _):
        multiview = camera.grab(1.0)
        assert list(camera.stream()) == []
        assert camera.identity["raw"] == "folder"

    assert [frame.view for frame in multiview.frames] == [name for name, *_ in VIEWS]
    stacked = np.stack(multiview.images)
    assert stacked.dtype == np.uint16
    means = stacked.mean(axis=(1, 2)) / 65535 * (FULL - DARK)
    assert means == pytest.approx(1500.0, rel=0.01)
    assert multiview.skew_s == 0.0


def test_a_camera_that_was_not_calibrated_says_how(tmp_path: Path):
    with (
        pytest.raises(DeviceNotFoundError, match="run `rig calibrate box --white FILE` first"),
        open_camera(profile(tmp_path)),
    ):
        pass


def test_a_picture_of_another_size_or_depth_is_told_with_both(
    tmp_path: Path, lenslets: dict[str, Any]
):
    keep(tmp_path, np.zeros((100, 200), np.uint16))
    with (
        open_camera(profile(tmp_path, lenslets)) as (camera, _),
        pytest.raises(DeviceLostError, match="200 x 100 px up to grey value 4095"),
    ):
        camera.grab(1.0)


def test_a_picture_whose_lattice_lies_elsewhere_is_told(tmp_path: Path, lenslets: dict[str, Any]):
    raw = exposed(0.5 * fitted("square")[0].white())
    keep(tmp_path, np.roll(raw, (7, 7), axis=(0, 1)))
    with (
        open_camera(profile(tmp_path, lenslets)) as (camera, _),
        pytest.raises(DeviceLostError, match="its lattice lies elsewhere"),
    ):
        camera.grab(1.0)


def test_frames_outside_of_with_are_refused(tmp_path: Path, lenslets: dict[str, Any]):
    keep(tmp_path, exposed(fitted("square")[0].white()))
    with open_camera(profile(tmp_path, lenslets)) as (camera, _):
        pass
    with pytest.raises(DeviceLostError, match="not open"):
        camera.grab(1.0)
    with pytest.raises(DeviceLostError, match="not open"):
        next(iter(camera.stream()))


@pytest.mark.slow
def test_a_white_picture_is_calibrated_stored_and_used(tmp_path: Path):
    truth, array = fitted("square")
    white = tmp_path / "white.png"
    cv2.imwrite(str(white), exposed(truth.white()))
    keep(tmp_path, exposed(0.5 * truth.white()))
    told: list[str] = []
    with open_store(f"sqlite:///{tmp_path}/rig.db") as store:
        result = calibrate_lenslets(profile(tmp_path), store, told.append, white)
        run = open_run(store, profile(tmp_path), None, "none")
        none = open_run(store, profile(tmp_path), "none", "none")

    assert result.quality["spacing_px"] == pytest.approx(14.0, abs=0.001)
    assert result.quality["missing"] == result.quality["dirty"] == 0
    assert told == []
    assert run.optics.calibration_id == result.calibration_id
    camera = run.profile.camera
    assert isinstance(camera, LensletCameraConfig)
    stored = ARRAY_JSON.from_json(camera.lenslets).lattice
    places = np.array([-5.0, 0.0, 6.0]), np.array([4.0, 0.0, -3.0])
    assert stored.centres_px(*places) == pytest.approx(array.lattice.centres_px(*places), abs=1e-3)
    assert "lenslets" not in run.profile.model_dump()["camera"]
    assert none.profile.camera == profile(tmp_path).camera
    page = result.report.read_text()
    assert "14.000 px apart" in page
    assert page.count("<svg") == 2


def test_white_is_asked_for_where_pictures_are_stored(tmp_path: Path):
    with (
        open_store(f"sqlite:///{tmp_path}/rig.db") as store,
        pytest.raises(CalibrationError, match="none is known to be white; give one with"),
    ):
        calibrate_lenslets(profile(tmp_path), store, print)


def test_a_camera_without_lenslets_has_no_white_picture(tmp_path: Path):
    with (
        open_store(f"sqlite:///{tmp_path}/rig.db") as store,
        pytest.raises(ConfigError, match=r"camera\.kind of sim is sim; leave out --white"),
    ):
        calibrate_lenslets(load_profile("sim"), store, print, tmp_path / "white.png")
