"""rig-genicam installed beside rig: listed, in the schema, a profile of its own, its suite."""

import json
from pathlib import Path

import pytest

pytest.importorskip("hatchling")

from tests.packaging.environments import ROOT, Environment, built_wheel, requirements
from tests.support.gige.camera import GigeCamera
from tests.support.gige.library import aravis_library

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("gige")]
ADDRESSES = ("127.0.0.51", "127.0.0.52")


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    folder = tmp_path_factory.mktemp("genicam")
    package = ROOT / "drivers" / "rig-genicam"
    wheels = [built_wheel(ROOT, folder / "rig"), built_wheel(package, folder / "genicam")]
    needs = requirements("epirig", "pytest", "hypothesis") - {"epirig"}
    return Environment(folder / "venv", wheels, needs)


def test_it_is_a_kind_of_camera_without_aravis_too(environment: Environment, tmp_path: Path):
    found = json.loads(environment.rig("devices", "--json", "--timeout-s", "20", folder=tmp_path))
    assert "genicam" in found
    assert "broken_plugins" not in found
    environment.rig(
        "profile", "new", "mine", "--camera", "genicam", "--views", "3", folder=tmp_path
    )
    text = (tmp_path / "calib_profiles" / "mine.toml").read_text()
    assert 'kind = "genicam"' in text
    assert "GenicamCameraConfig" in environment.rig("profile", "schema", folder=tmp_path)


def test_two_cameras_are_found_named_by_a_new_profile_and_tried_by_the_suite(
    environment: Environment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    aravis_library()
    with GigeCamera(ADDRESSES[0], serial="P1"), GigeCamera(ADDRESSES[1], serial="P2"):
        found = json.loads(
            environment.rig("devices", "--json", "--timeout-s", "20", folder=tmp_path)
        )
        assert {"P1", "P2"} <= {device["name"] for device in found["genicam"]["devices"]}
        environment.rig(
            "profile", "new", "pair", "--camera", "genicam", "--views", "2", folder=tmp_path
        )
        profile = tmp_path / "calib_profiles" / "pair.toml"
        text = profile.read_text()
        profile.write_text(
            text.replace("width_px = 1280", "width_px = 64").replace(
                "height_px = 800", "height_px = 48"
            )
        )
        checked = json.loads(
            environment.rig("check", "pair", "--no-move", "--json", folder=tmp_path, codes=(0, 3))
        )
        monkeypatch.setenv("RIG_GENICAM_PROFILE", str(profile))
        suite = ("--pyargs", "rig.testing.test_camera", "-p", "rig_genicam.testing", "-k", "order")
        told = environment.python(
            "-m", "pytest", "-q", "-p", "no:cacheprovider", *suite, folder=tmp_path
        )
        assert "1 passed" in told
    items = {item["item"]: item for item in checked["items"]}
    assert items["camera"]["status"] == "pass"
    assert "2 x genicam" in items["camera"]["found"]
