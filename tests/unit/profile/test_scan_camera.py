"""A camera that moves, in a profile: positions, views, stages."""

from typing import Any

import pytest

from rig.bounded_text import parse_toml
from rig.errors import ConfigError
from rig.profile import GrblStageConfig, ScanCameraConfig
from rig.profile.load import load_profile, parse_profile
from rig.profile.scan_camera import REFERENCE, ScanPathConfig

TEXT = """
name = "slider"
pitch_mm = 20.0
[camera]
kind = "scan"
[camera.row]
at_mm = [-30.0, 0.0, 10.0]
[camera.inner]
kind = "sim"
width_px = 64
height_px = 48
[stages.camera]
kind = "grbl"
carries = "camera"
port = "/dev/ttyACM0"
travel_mm = [-50.0, 50.0]
distance_at_machine_zero_mm = 60.0
[slopes]
range_px = [1.0, 9.0]
[world.optics]
focal_px = 100.0
focus_mm = 700.0
[world.carriage]
board_at_machine_zero_mm = 1000.0
"""
COLUMN = """
[camera.column]
from_mm = 95.0
to_mm = 105.0
count = 3
reference_mm = 100.0
[stages.column]
kind = "manual"
carries = "camera"
travel_mm = [90.0, 110.0]
"""


def profile(more: str = "", **camera: Any):
    data = parse_toml(TEXT + more)
    data["camera"].update(camera)
    return parse_profile(data, source="test")


def test_views_follow_from_the_positions_of_the_row():
    views = profile().views
    assert [(v.name, v.x_steps, v.y_steps) for v in views] == [
        (REFERENCE, 0.0, 0.0),
        ("h0", -1.5, 0.0),
        ("h2", 0.5, 0.0),
    ]


SERIAL = 'kind = "grbl"\nport = "{}"\ndistance_at_machine_zero_mm = 60.0'
BOARD = "\n[stages.board]\n" + SERIAL + "\ntravel_mm = [400.0, 900.0]\n"


def test_two_stages_of_the_camera_behind_one_port_are_told():
    says = r"stages\.camera and stages\.column are both at /dev/ttyACM0; .* port of its own"
    with pytest.raises(ConfigError, match=says):
        profile(COLUMN.replace('kind = "manual"', SERIAL.format("/dev/ttyACM0")))
    other = profile(COLUMN.replace('kind = "manual"', SERIAL.format("/dev/ttyACM1")))
    assert list(other.stages.carriers) == ["camera", "column"]


def test_a_board_behind_the_port_of_the_camera_is_told():
    says = r"stages\.board and stages\.camera are both at /dev/ttyACM0"
    with pytest.raises(ConfigError, match=says):
        profile(BOARD.format("/dev/ttyACM0"))
    assert profile(BOARD.format("/dev/ttyACM1")).stage is not None


def test_a_column_has_its_own_stage_and_its_own_reference():
    rig = profile(COLUMN)
    assert [(v.name, v.x_steps, v.y_steps) for v in rig.views[3:]] == [
        ("v0", 0.0, -0.25),
        ("v2", 0.0, 0.25),
    ]
    assert list(rig.stages.carriers) == ["camera", "column"]
    assert rig.reference == 0


def test_an_even_path_has_both_ends():
    path = ScanPathConfig(from_mm=-2.0, to_mm=4.0, count=4)
    assert path.positions_mm == (-2.0, 0.0, 2.0, 4.0)
    assert path.named("h") == (("h0", -2.0), (REFERENCE, 0.0), ("h2", 2.0), ("h3", 4.0))


def test_a_stored_profile_comes_back_with_its_views_written_out():
    rig = profile(COLUMN)
    assert parse_profile(rig.model_dump(mode="json"), source="stored") == rig


def test_the_camera_that_is_carried_has_one_view_of_its_own_name():
    inner = {"kind": "v4l2", "devices": {"eye": "/dev/video0"}, "width_px": 64, "height_px": 48}
    inner |= {"exposure_s": 0.01, "rate_hz": 10.0, "pixel_format": "GREY"}
    camera = profile().camera
    assert isinstance(camera, ScanCameraConfig)
    assert camera.inner_view.name == "camera"
    assert camera.is_scan
    assert camera.is_simulated
    assert camera.size_px == (64, 48)
    assert (
        ScanCameraConfig.model_validate(
            {"kind": "scan", "row": {"at_mm": [0, 1]}, "inner": inner}
        ).inner_view.name
        == "eye"
    )


def test_the_stage_of_the_board_has_two_names():
    board = '[stages.board]\nkind = "manual"\ntravel_mm = [400.0, 900.0]\n'
    rig = profile(board)
    assert rig.stage is not None
    assert rig.stage.kind == "manual"
    assert rig.stage.carries == "board"
    both = board + board.replace("stages.board", "stage")
    with pytest.raises(ConfigError, match=r"stage and stages\.board are both given"):
        profile(both)


def test_the_shipped_profile_has_a_slider_of_its_own():
    rig = load_profile("sim-scan")
    carrier = rig.stages.carriers["camera"]
    assert isinstance(carrier, GrblStageConfig)
    assert carrier.port == "sim://slider"
    assert rig.is_simulated(with_stage=False)
    assert len(rig.views) == 9


@pytest.mark.parametrize(
    ("camera", "more", "says"),
    [
        (
            {"row": {"at_mm": [-30.0, 10.0]}},
            "",
            "reference_mm = 0 is none of the positions -30, 10",
        ),
        ({"row": {"at_mm": [0.0, 10.0, 5.0]}}, "", "positions must grow"),
        ({"row": {"at_mm": [0.0]}}, "", "positions must grow, at least two, found 0"),
        ({"row": {"from_mm": 0.0, "to_mm": 5.0}}, "", "give at_mm, or from_mm, to_mm and count"),
        ({"row": {"at_mm": [0, 1], "count": 2}}, "", "give at_mm, or from_mm, to_mm and count"),
        ({"row": {}}, "", "give at_mm, or from_mm, to_mm and count"),
        ({"row": {"at_mm": [0.0, 51.0]}}, "", "positions 0..51 mm leave stages.camera.travel_mm"),
        ({"inner": {"kind": "folder", "folder": "x", "files": {"a": "b"}}}, "", "stored pictures"),
        ({"inner": {"kind": "scan"}}, "", "a scan cannot stand within another camera"),
        ({}, COLUMN.partition("[stages")[0], "along 2 axes needs stages.camera and stages.column"),
    ],
)
def test_a_scan_that_cannot_be_is_told(camera: dict[str, Any], more: str, says: str):
    with pytest.raises(ConfigError, match=says):
        profile(more, **camera)


def test_what_is_wrong_with_a_scan_is_told_at_its_key():
    with pytest.raises(ConfigError, match=r"^test: camera\.row: positions must grow") as caught:
        profile(row={"at_mm": [0.0]})
    assert "views" not in str(caught.value)


def test_a_stage_that_carries_the_board_is_told_at_the_camera():
    data = parse_toml(TEXT)
    del data["stages"]["camera"]["carries"]
    with pytest.raises(ConfigError, match=r'stages.camera moves the camera; write carries = "cam'):
        parse_profile(data, source="test")


def test_other_views_than_those_of_the_positions_are_told():
    data = parse_toml(TEXT)
    data["views"] = [{"name": REFERENCE, "x_steps": 0.0, "y_steps": 0.0}]
    data["views"] += [{"name": n, "x_steps": x, "y_steps": 0.0} for n, x in (("h0", 1), ("h2", 2))]
    with pytest.raises(ConfigError, match="views are not those of the positions"):
        parse_profile(data, source="test")
