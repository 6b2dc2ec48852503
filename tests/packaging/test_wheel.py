"""The wheel in a fresh environment without extras: names, files, and the main verbs."""

import json
from pathlib import Path
from zipfile import ZipFile

import pytest

pytest.importorskip("hatchling")

from tests.packaging.environments import ROOT, Environment, built_wheel, requirements

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built_wheel(ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def fresh(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    folder = tmp_path_factory.mktemp("fresh") / "venv"
    return Environment(folder, [wheel], requirements("epirig") - {"epirig"})


def test_it_adds_only_names_that_begin_with_rig(wheel: Path):
    with ZipFile(wheel) as files:
        tops = {name.partition("/")[0] for name in files.namelist()}
    (about,) = (top for top in tops if top.endswith(".dist-info"))
    assert about.startswith("epirig-")
    assert tops - {about} == {"rig", "rig_drivers", "rig_sim"}


def test_it_holds_what_messages_point_to(wheel: Path):
    with ZipFile(wheel) as files:
        names = set(files.namelist())
    assert {"rig/py.typed", "rig_drivers/py.typed", "rig_sim/py.typed"} <= names
    assert "rig/calib_profiles/sim.toml" in names
    assert "rig_drivers/udev/80-oak.rules" in names


def test_the_main_verbs_run_without_extras(fresh: Environment, tmp_path: Path):
    assert "sweep" in fresh.rig("--help", folder=tmp_path)
    profiles = json.loads(fresh.rig("profile", "list", "--json", folder=tmp_path))["profiles"]
    assert "sim" in [profile["name"] for profile in profiles]
    assert not [p for p in profiles if "cannot be used" in p["description"]]
    found = json.loads(fresh.rig("devices", "--json", "--timeout-s", "20", folder=tmp_path))
    assert "pip install" in found["oak"]["note"]
    assert "03e7" in fresh.rig("devices", "--udev-rules", folder=tmp_path)
    assert "--protocol" in fresh.rig("sim", "stage", "--help", folder=tmp_path)
    assert "oak" in fresh.rig("profile", "schema", folder=tmp_path)
    board = tmp_path / "board.svg"
    fresh.rig("target", "sim", "--out", str(board), folder=tmp_path)
    assert board.stat().st_size > 1000


def test_a_script_beside_folders_of_the_same_names_works(fresh: Environment, tmp_path: Path):
    (tmp_path / "drivers").mkdir()
    (tmp_path / "drivers" / "__init__.py").write_text("raise RuntimeError('the user s own')\n")
    (tmp_path / "sim.py").write_text("raise RuntimeError('the user s own')\n")
    script = tmp_path / "script.py"
    script.write_text(
        "from rig.hardware.opening import open_camera\n"
        "from rig.profile.load import load_profile\n"
        "with open_camera(load_profile('sim', ['world.renderer=analytic'])"
        ", target_in_hand=True) as (camera, clock):\n"
        "    print(len(camera.grab(5.0).frames))\n"
    )
    assert fresh.python(str(script), folder=tmp_path) == "5\n"
