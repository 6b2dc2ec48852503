"""The example package of docs/, installed beside rig: a profile uses it, verbs list it."""

import json
import shutil
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
    narrow = ("--set", "slopes.range_px=[-6, 6]", "--set", "pitch_mm=60")
    ended = json.loads(
        environment.rig(
            *("capture", "mine", "--slopes-only", "--frames", "2", "--out", "out", "--json"),
            *narrow,
            folder=tmp_path,
        )
    )
    assert ended["frames"] == 2


def test_it_passes_the_suites_of_rig(environment: Environment, tmp_path: Path):
    shutil.copy(EXAMPLE / "conftest.py", tmp_path)
    told = environment.python(
        *("-m", "pytest", "--pyargs", "rig.testing", "-q", "-p", "no:cacheprovider"),
        folder=tmp_path,
    )
    assert " passed" in told
    assert "skipped" not in told


def test_the_suites_can_fail(environment: Environment, tmp_path: Path):
    """A camera that gives writable pixels, or a stage that clips, would be noticed."""
    conftest = (EXAMPLE / "conftest.py").read_text()
    clipping = conftest.replace(
        "return StageCase(DummyStage(config, clock)", "return StageCase(Clipping(config, clock)"
    ) + (
        "\n\nclass Clipping(DummyStage):\n"
        "    def move_to(self, position_mm, timeout_s):\n"
        "        return super().move_to(min(max(position_mm, 400.0), 1200.0), timeout_s)\n"
    )
    (tmp_path / "conftest.py").write_text(clipping)
    with pytest.raises(AssertionError, match="test_outside_the_travel_nothing_moves"):
        environment.python(
            *("-m", "pytest", "--pyargs", "rig.testing.test_stage", "-q", "-p", "no:cacheprovider"),
            folder=tmp_path,
        )
