"""What looks wrong in a profile, without any hardware."""

import re
from pathlib import Path

import pytest

from rig.profile.doubts import doubts
from rig.profile.load import load_profile
from rig.profile.template import Recipe, profile_text
from tests.support.command import Command


@pytest.mark.parametrize(
    ("override", "key", "says"),
    [
        ("sweep.to_mm=1300.0", "sweep.to_mm", "1300 mm is outside stage.travel_mm, 400..1200 mm"),
        ("sweep.from_mm=399.0", "sweep.from_mm", "399 mm is outside"),
        ("sweep.to_mm=450.0", "sweep.to_mm", "is also sweep.from_mm"),
        ("target.square_mm=0.025", "target.square_mm", "write 25 if these are metres"),
        ("pitch_mm=0.04", "pitch_mm", "write 40 if"),
        ("stage.port='/dev/serial/by-id/REPLACE-BY-YOURS'", "stage.port", "placeholder"),
        ("camera={kind='recording', file='/no/where.mcap'}", "camera.file", "is no file"),
    ],
)
def test_a_value_that_no_rig_has_is_doubted(override: str, key: str, says: str):
    profile = load_profile("sim", ["sweep.from_mm=450.0", override])
    found = {doubt.key: str(doubt) for doubt in doubts(profile, "")}
    assert list(found) == [key]
    assert says in found[key]


def test_metres_in_a_whole_sweep_are_doubted():
    profile = load_profile("sim", ["sweep.from_mm=0.4", "sweep.to_mm=1.2"])
    assert any("write 1200 if" in str(doubt) for doubt in doubts(profile, ""))


def test_images_that_are_not_there_are_named(tmp_path: Path):
    files = "{centre='c*.png', left='l*.png', right='r.png', top='t.png', bottom='b.png'}"
    override = f"camera={{kind='folder', folder='{tmp_path}', files={files}}}"
    for name in ("c1.png", "l2.png", "r.png", "t.png"):
        (tmp_path / name).touch()
    found = doubts(load_profile("sim", [override]), "")
    assert [doubt.key for doubt in found] == ["camera.files.bottom"]
    gone = doubts(load_profile("sim", [override.replace(str(tmp_path), "/no/where")]), "")
    assert [doubt.key for doubt in gone] == ["camera.folder"]


def test_a_new_profile_is_not_settled(rig: Command, tmp_path: Path):
    path = tmp_path / "bench.toml"
    text = profile_text(Recipe("bench", "v4l2", 2, "grbl"))
    path.write_text(text)
    answer = rig("profile", "check", path, "sim")
    assert answer.code == 3
    assert "camera.devices" in answer.out
    assert "stage.port: /dev/serial/by-id/REPLACE-BY-YOURS is a placeholder" in answer.out
    numbers = [n for n, line in enumerate(text.splitlines(), 1) if re.search(r"MEASURE\b", line)]
    told = ", ".join(map(str, numbers[1:]))  # the first line only says what the word means
    assert f"lines {told}: MEASURE stands there" in answer.out
    assert "sim: good; 5 views, camera sim" in answer.out
    settled = text.replace("MEASURE", "measured").replace("REPLACE-BY-YOURS", "usb")
    path.write_text(settled)
    assert rig("profile", "check", path).code == 0


@pytest.mark.parametrize("name", ["sim", "sim-real", "sim-oak"])
def test_shipped_simulated_rigs_are_settled(name: str):
    path = Path(__file__).parents[3] / "calib_profiles" / f"{name}.toml"
    assert doubts(load_profile(str(path)), path.read_text()) == ()
