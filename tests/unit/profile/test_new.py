"""New profiles load as they are, say what is plugged in, and never replace a file."""

import itertools
import tomllib
from pathlib import Path

import pytest

from rig.discovery import Findings, FoundDevice
from rig.errors import ConfigError
from rig.profile import GrblStageConfig, OakCameraConfig, V4l2CameraConfig
from rig.profile.load import load_profile, parse_profile
from rig.profile.new import copied_text, write_new
from rig.profile.plugged import recipe_for, told_views
from rig.profile.template import Recipe, new_cameras, new_stages, profile_text
from tests.support.command import Command

CAMERAS = new_cameras()
STAGES: tuple[str | None, ...] = (*new_stages(), None)


def found(kind: str, *names: str, description: str = "a thing") -> Findings:
    return Findings(kind, "key", tuple(FoundDevice(name, description) for name in names))


@pytest.mark.parametrize(
    ("camera", "views", "stage"), list(itertools.product(CAMERAS, (2, 3, 4, 5), STAGES))
)
def test_every_recipe_makes_a_profile(camera: str, views: int, stage: str | None):
    text = profile_text(Recipe("bench", camera, views, stage))
    profile = parse_profile(tomllib.loads(text), source="new")
    assert profile.camera.kind == camera
    assert len(profile.views) == views
    assert (None if profile.stage is None else profile.stage.kind) == stage
    assert profile.stage is None or not profile.stage.may_move  # guesses must not move anything
    assert "MEASURE" in text
    assert max(map(len, text.splitlines())) <= 100


def test_what_is_plugged_in_is_named():
    cameras = [f"/dev/v4l/by-path/usb-{n}" for n in range(3)]
    ports = found("serial", "/dev/ttyS0", "/dev/serial/by-id/usb-A", "/dev/serial/by-id/usb-B")
    recipe = recipe_for("b", [found("v4l2", *cameras), ports], camera=None, views=None, stage=None)
    text = profile_text(recipe)
    profile = parse_profile(tomllib.loads(text), source="new")
    assert isinstance(profile.camera, V4l2CameraConfig)
    assert list(profile.camera.devices.values()) == cameras
    assert isinstance(profile.stage, GrblStageConfig)
    assert profile.stage.port == "/dev/serial/by-id/usb-A"
    assert "# also plugged in: /dev/serial/by-id/usb-B" in text
    assert "/dev/ttyS0" not in text


def test_an_oak_is_named_by_its_id_and_a_zaber_by_its_adapter():
    findings = [found("oak", "18443010"), found("serial", "usb-serial:A1", description="Zaber X")]
    recipe = recipe_for("b", findings, camera=None, views=None, stage=None)
    profile = parse_profile(tomllib.loads(profile_text(recipe)), source="new")
    assert isinstance(profile.camera, OakCameraConfig)
    assert profile.camera.device == "18443010"
    assert profile.stage is not None
    assert profile.stage.kind == "zaber"


def test_an_oak_of_two_is_its_pair_that_knows_itself_and_looks_for_distances():
    recipe = recipe_for("b", [found("oak", "18443010")], camera=None, views=None, stage=None)
    profile = parse_profile(tomllib.loads(profile_text(recipe)), source="new")
    assert isinstance(profile.camera, OakCameraConfig)
    assert profile.camera.sockets == {"left": "CAM_B", "right": "CAM_C"}
    assert profile.camera.may_hold_calibration
    assert profile.pitch_mm == 75.0
    assert [(view.x_steps, view.y_steps) for view in profile.views] == [(0.0, 0.0), (1.0, 0.0)]
    assert profile.slopes.range_mm == (400.0, 4000.0)
    assert profile.quality.depth_sigma_pct == 3.0
    assert "--views 3 describes all three" in profile_text(recipe)


def test_an_oak_of_three_has_the_colour_camera_between_its_pair():
    recipe = recipe_for("b", [found("oak", "18443010")], camera=None, views=3, stage=None)
    profile = parse_profile(tomllib.loads(profile_text(recipe)), source="new")
    assert isinstance(profile.camera, OakCameraConfig)
    assert profile.camera.sockets == {"colour": "CAM_A", "left": "CAM_B", "right": "CAM_C"}
    assert profile.camera.size_of("colour") == (1920, 1080)
    assert profile.camera.size_of("left") == (1280, 800)
    assert profile.camera.max_skew_s == 0.045
    assert profile.camera.may_hold_calibration
    assert profile.pitch_mm == 37.5
    assert [(view.x_steps, view.y_steps) for view in profile.views] == [(0, 0), (-1, 0), (1, 0)]
    assert profile.slopes.range_mm == (400.0, 4000.0)


def test_an_oak_of_four_is_a_board_whose_places_must_be_measured():
    recipe = recipe_for("b", [found("oak", "18443010")], camera=None, views=4, stage=None)
    profile = parse_profile(tomllib.loads(profile_text(recipe)), source="new")
    assert isinstance(profile.camera, OakCameraConfig)
    assert list(profile.camera.sockets.values()) == ["CAM_A", "CAM_B", "CAM_C", "CAM_D"]
    assert profile.slopes.range_px == (41.0, 192.0)


def test_a_device_that_does_not_tell_is_guessed_and_the_head_says_so(
    monkeypatch: pytest.MonkeyPatch,
):
    """DepthAI is not where the process looks for it, as where the extra is missing."""
    monkeypatch.setattr("sys.executable", "/bin/false")
    told, notes = told_views([found("oak", "18443010")], camera=None)
    assert told is None
    recipe = recipe_for(
        "b", [found("oak", "18443010")], camera=None, views=None, stage=None, notes=notes
    )
    text = profile_text(recipe)
    assert "# 18443010 did not tell which sensors it has, so they are guessed: " in text
    assert len(parse_profile(tomllib.loads(text), source="new").views) == 2


def test_nobody_is_asked_who_is_not_there_or_cannot_be_opened():
    locked = Findings("oak", "key", (FoundDevice("1", "OAK", problem="may not be opened"),))
    assert told_views([locked], camera=None) == (None, ())
    assert told_views([], camera="oak") == (None, ())
    assert told_views([found("v4l2", "/dev/a", "/dev/b")], camera=None) == (None, ())


def test_cameras_that_are_too_many_are_named_in_a_comment():
    recipe = recipe_for(
        "b", [found("v4l2", "/dev/a", "/dev/b", "/dev/c")], camera=None, views=2, stage=None
    )
    assert "# also plugged in: /dev/c" in profile_text(recipe)


def test_what_is_said_counts_more_than_what_is_plugged_in():
    findings = [
        found("oak", "18443010"),
        found("v4l2", "/dev/a", "/dev/b", "/dev/c"),
        found("serial", "usb-serial:A1", description="Zaber X"),
    ]
    recipe = recipe_for("b", findings, camera="v4l2", views=2, stage="marlin")
    assert (recipe.camera, recipe.cameras) == ("v4l2", ("/dev/a", "/dev/b", "/dev/c"))
    assert (recipe.stage, recipe.stages) == ("marlin", ("usb-serial:A1",))
    assert recipe.views == 2
    without = recipe_for("b", findings, camera="v4l2", views=2, stage="marlin", has_stage=False)
    assert (without.stage, without.stages) == (None, ())


def test_views_are_as_many_as_are_plugged_in_up_to_the_places_there_are():
    def views(count: int) -> int:
        cameras = found("v4l2", *(f"/dev/{number}" for number in range(count)))
        return recipe_for("b", [cameras], camera=None, views=None, stage=None).views

    assert [views(count) for count in (2, 3, 5, 6)] == [2, 3, 5, 5]


def test_a_problem_of_today_is_at_the_head():
    locked = FoundDevice("/dev/a", "a camera", problem="may not be opened; join group video")
    findings = [Findings("v4l2", "key", (locked, FoundDevice("/dev/b", "another")))]
    text = profile_text(recipe_for("b", findings, camera=None, views=None, stage=None))
    assert "# /dev/a: may not be opened; join group video" in text
    assert "None" not in text


def test_only_problems_of_what_may_belong_to_a_rig_are_told():
    there = (
        FoundDevice("/dev/ttyS0", "a port", problem="may not be opened"),
        FoundDevice("/dev/ttyUSB0", "an adapter", problem="is in use"),
        FoundDevice("/dev/ttyUSB1", "another"),
    )
    cameras = found("v4l2", "/dev/a", "/dev/b")
    recipe = recipe_for(
        "b", [cameras, Findings("serial", "key", there)], camera=None, views=None, stage=None
    )
    assert recipe.notes == ("/dev/ttyUSB0: is in use",)


@pytest.mark.parametrize(
    ("findings", "told"),
    [
        ([], "--from sim"),
        ([found("oak", "1"), found("v4l2", "/dev/a", "/dev/b")], "--camera oak"),
        ([found("v4l2", "/dev/a")], "--views 2"),
    ],
)
def test_what_is_not_clear_is_asked(findings: list[Findings], told: str):
    with pytest.raises(ConfigError, match=told):
        recipe_for("b", findings, camera=None, views=None, stage=None)


def test_more_views_than_there_are_places_are_refused():
    with pytest.raises(ConfigError, match="1 to 5"):
        profile_text(Recipe("b", "v4l2", 6, None))


def test_a_copy_keeps_every_comment_and_changes_the_name():
    text = copied_text("sim", "bench")
    original = load_profile("sim")
    copy = parse_profile(tomllib.loads(text), source="copy")
    assert copy == original.model_copy(update={"name": "bench"})
    assert text.count("#") > 5


def test_a_profile_without_a_plain_name_cannot_be_copied(tmp_path: Path):
    (tmp_path / "odd.toml").write_text("name = 'odd'\n")
    with pytest.raises(ConfigError, match="by hand"):
        copied_text(str(tmp_path / "odd.toml"), "new")


def test_a_file_that_is_there_is_left_alone(tmp_path: Path):
    path = tmp_path / "deep" / "bench.toml"
    text = copied_text("sim", "bench")
    write_new(path, text)
    with pytest.raises(ConfigError, match="left alone"):
        write_new(path, profile_text(Recipe("bench", "v4l2", 2, None)))
    assert path.read_text() == text


@pytest.mark.parametrize("text", ["name = ", "name = 'x'"])
def test_what_is_no_profile_is_not_written(tmp_path: Path, text: str):
    with pytest.raises(ConfigError):
        write_new(tmp_path / "bench.toml", text)
    assert not (tmp_path / "bench.toml").exists()


def test_a_folder_that_cannot_be_made(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        write_new(tmp_path / "file" / "bench.toml", copied_text("sim", "bench"))


def test_the_verb_writes_what_other_verbs_find(
    rig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    made = rig("profile", "new", "mine", "--from", "sim")
    assert (made.code, made.out) == (0, "calib_profiles/mine.toml\n")
    assert rig("profile", "check", "mine").code == 0
    again = rig("profile", "new", "mine", "--from", "sim")
    assert again.code == 1
    assert "left alone" in again.err
    assert rig("profile", "new", "mine", "--from", "sim", "--views", 2).code == 2
    assert rig("profile", "new", "no/name", "--from", "sim").code == 1


def a_wide_one(layout: str | None = "side-by-side") -> list[Findings]:
    return [Findings("v4l2", "key", (FoundDevice("/dev/a", "a camera", layout=layout),))]


def test_one_device_gives_all_views_where_its_layout_is_said():
    recipe = recipe_for("b", a_wide_one(), camera=None, views=None, stage=None, layout="two-by-two")
    text = profile_text(recipe)
    camera = parse_profile(tomllib.loads(text), source="new").camera
    assert isinstance(camera, V4l2CameraConfig)
    assert len(camera.devices) == 4
    assert set(camera.devices.values()) == {"/dev/a"}
    assert (camera.width_px, camera.height_px, camera.size_px) == (2560, 1600, (1280, 800))
    assert [str(part.place) for part in camera.parts.values()] == ["1", "2", "3", "4"]
    assert "have the shape of" not in text  # the offer is taken
    assert max(map(len, text.splitlines())) <= 100


def test_a_layout_in_turn_counts_the_pixels_of_one_view():
    recipe = Recipe("b", "v4l2", 2, None, layout="interleaved")
    camera = parse_profile(tomllib.loads(profile_text(recipe)), source="new").camera
    assert isinstance(camera, V4l2CameraConfig)
    assert camera.pixel_format == "Y8I"
    assert (camera.width_px, camera.size_px) == (1280, (1280, 800))


def test_the_shape_of_a_picture_is_an_offer_and_never_a_fact():
    told = r"found 1 V4L2 cameras; .*/dev/a: .* the shape of 2 views; .* --layout side-by-side"
    with pytest.raises(ConfigError, match=told):
        recipe_for("b", a_wide_one(), camera=None, views=None, stage=None)
    recipe = recipe_for("b", a_wide_one(), camera=None, views=2, stage=None)
    camera = parse_profile(tomllib.loads(profile_text(recipe)), source="new").camera
    assert isinstance(camera, V4l2CameraConfig)
    assert camera.parts == {}
    assert len(set(camera.devices.values())) == 2
    assert "# /dev/a: its pictures have the shape of 2 views" in profile_text(recipe)
    assert recipe_for("b", a_wide_one(None), camera=None, views=2, stage=None).notes == ()


@pytest.mark.parametrize(
    ("recipe", "told"),
    [
        (Recipe("b", "v4l2", 3, None, layout="top-bottom"), "asked for 3 views .* which has 2"),
        (Recipe("b", "oak", 2, None, layout="top-bottom"), "leave --layout out"),
    ],
)
def test_a_layout_that_cannot_be_is_refused(recipe: Recipe, told: str):
    with pytest.raises(ConfigError, match=told):
        profile_text(recipe)
