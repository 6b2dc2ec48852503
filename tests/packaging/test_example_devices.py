"""The example package of docs/, installed beside rig: a profile uses it, verbs list it."""

import json
from pathlib import Path

import pytest

pytest.importorskip("hatchling")

from tests.packaging.environments import ROOT, Environment, built_wheel, requirements

pytestmark = pytest.mark.slow

EXAMPLE = ROOT / "docs" / "examples" / "rig-example-devices"


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    folder = tmp_path_factory.mktemp("example")
    wheels = [built_wheel(ROOT, folder / "rig"), built_wheel(EXAMPLE, folder / "devices")]
    needs = requirements("epirig", "pytest", "hypothesis") - {"epirig"}
    return Environment(folder / "venv", wheels, needs)


def test_it_is_listed_and_begins_a_profile_that_runs(environment: Environment, tmp_path: Path):
    found = json.loads(environment.rig("devices", "--json", "--timeout-s", "20", folder=tmp_path))
    assert found["pattern"]["devices"][0]["name"] == "pattern-1"
    assert "broken_plugins" not in found
    environment.rig(
        "profile", "new", "mine", "--camera", "pattern", "--stage", "dummy", folder=tmp_path
    )
    text = (tmp_path / "calib_profiles" / "mine.toml").read_text()
    assert 'kind = "pattern"  # found: pattern-1' in text
    assert "PatternCameraConfig" in environment.rig("profile", "schema", folder=tmp_path)
    checked = json.loads(
        environment.rig("check", "mine", "--no-move", "--json", folder=tmp_path, codes=(0, 3))
    )
    found_items = {item["item"]: item for item in checked["items"]}
    assert found_items["camera"]["status"] == "pass"
    assert "drawn dots" in found_items["camera"]["found"]
    assert found_items["stage"]["status"] == "pass"
    assert "counts only" in found_items["stage"]["found"]


def suites(environment: Environment, folder: Path, what: str, devices: str) -> str:
    """Run suites of rig over the devices that a module names."""
    words = ("-m", "pytest", "--pyargs", what, "-p", devices, "-q", "-p", "no:cacheprovider")
    return environment.python(*words, folder=folder)


def test_it_passes_the_suites_of_rig(environment: Environment, tmp_path: Path):
    told = suites(environment, tmp_path, "rig.testing", "rig_example_devices.testing")
    assert " passed" in told
    assert "skipped" not in told


def test_a_stage_that_clips_is_noticed(environment: Environment, tmp_path: Path):
    (tmp_path / "clipping.py").write_text(
        "import pytest\n"
        "from rig.testing import StageCase\n"
        "from rig_example_devices.dummy_stage import DummyStage\n"
        "from rig_example_devices.kind import DummyStageConfig\n"
        "from rig_example_devices.testing import QuickClock\n"
        "class Clipping(DummyStage):\n"
        "    def move_to(self, position_mm, timeout_s):\n"
        "        return super().move_to(min(max(position_mm, 400.0), 1200.0), timeout_s)\n"
        "@pytest.fixture\n"
        "def stage_case():\n"
        "    clock = QuickClock()\n"
        "    config = DummyStageConfig(kind='dummy', travel_mm=(400.0, 1200.0))\n"
        "    return StageCase(Clipping(config, clock), clock, 0.001)\n"
    )
    with pytest.raises(AssertionError, match=r"FAILED .*test_outside_the_travel_nothing_moves"):
        suites(environment, tmp_path, "rig.testing.test_stage", "clipping")


def test_the_wheel_brings_the_fixture_and_the_rig_that_it_opens(
    environment: Environment, tmp_path: Path
):
    fixtures = ("-m", "pytest", "--fixtures", "-q", "-p", "no:cacheprovider")
    assert "rig_camera" in environment.python(*fixtures, folder=tmp_path)
    assert "rig_camera" not in environment.python(*fixtures, "-p", "no:epirig", folder=tmp_path)
    opened = (
        "from rig.testing.simulated import open_simulated_rig\n"
        "with open_simulated_rig() as camera:\n"
        "    print(camera.views)\n"
    )
    assert "'centre', 'left'" in environment.python("-c", opened, folder=tmp_path)
