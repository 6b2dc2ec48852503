"""Profiles from files: what is accepted, and what the refusals say."""

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.errors import ConfigError
from rig.places import profile_files
from rig.profile import FolderCameraConfig, Profile
from rig.profile.load import find_profile, load_profile, parse_profile


@pytest.mark.parametrize("path", list(profile_files()), ids=lambda path: path.stem)
def test_every_shipped_profile_loads_under_its_own_name(path: Path):
    assert load_profile(str(path)).name == path.stem


def test_sim_is_the_rig_that_the_docs_describe():
    profile = load_profile("sim")
    assert len(profile.views) == 5
    assert profile.views[profile.reference].name == "centre"
    assert profile.stage is not None
    assert profile.stage.travel_mm == (400.0, 1200.0)


@pytest.mark.parametrize(
    ("override", "key", "near"),
    [
        ("camera.widht_px=3", "camera.widht_px", "width_px"),
        ("stage.travel=3", "stage.travel", "travel_mm"),
        ("world.optics.focal=3", "world.optics.focal", "focal_px"),
        ("world.view_errors.left.gian=1.0", "world.view_errors.left.gian", "gain"),
        ("views.left.x_step=1", "views.1.x_step", "x_steps"),
        ("swep.count=4", "swep", "sweep"),
    ],
)
def test_a_typo_names_the_option_the_key_and_the_nearest_right_key(
    override: str, key: str, near: str
):
    with pytest.raises(ConfigError) as caught:
        load_profile("sim", [override])
    message = str(caught.value)
    assert message.startswith(f"--set {override}: ")
    assert "sim.toml" not in message
    assert f"{key}: unknown key; did you mean {near}?" in message


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("stage.travel_mm=[5, 3]", "runs from 5.0 to 3.0"),
        ("slopes.range_px=[2, 2]", "range_px runs from 2.0 to 2.0"),
        ("slopes.range_mm=[900, 400]", "range_mm runs from 900.0 to 400.0"),
        ("slopes.range_mm=[0, 400]", "slopes.range_mm.0"),
        ("slopes={}", "neither of range_px and range_mm given; give range_mm = [nearest"),
        ("slopes={range_px=[1, 2], range_mm=[1, 2]}", "both of range_px and range_mm given"),
        ("prior_sigma={focal_pct=0.1, baseline_pct=-1, turn_deg=0}", "prior_sigma.baseline_pct"),
        ("prior_sigma.focal_pct=0.1", "prior_sigma.baseline_pct: missing"),
        ("views.left.x_steps=0.0", "exactly one view must be at"),
        ("views.left.name='right'", "view names must differ"),
        ("world.view_errors.lift.gain=1.0", "names no view: lift"),
        ("sweep.count='many'", "sweep.count: needs a whole number, found 'many'"),
        ("sweep.count=10001", "sweep.count"),
        ("sweep.samples=1001", "sweep.samples"),
        ("camera.width_px=16385", "camera.width_px"),
        ("target.columns=1001", "target.columns"),
        ("world.samples_per_px=65537", "world.samples_per_px"),
        ("world.optics.focal_px=inf", "finite"),
        ("camera.kind='oax'", "camera.kind: there is no camera 'oax'"),
        ("camera.kind='oax'", "did you mean oak?"),
        ("camera.kind=3", "camera.kind: missing; one of: sim, folder"),
        ("camera=3", "camera: must be a table with a kind"),
        ("stage.kind='gbrl'", "did you mean grbl?"),
        ("views.middle.x_steps=0", "views has no middle; there are: centre, left"),
        ("sweep.count.more=1", "sweep.count has no keys below it"),
        ("no-equals-sign", "write it as key.path=value"),
        ("camera={kind='folder', folder='x', files={centre='a'}}", "camera.files must name"),
    ],
)
def test_what_makes_no_rig_is_refused_with_its_place(override: str, says: str):
    with pytest.raises(ConfigError) as caught:
        load_profile("sim", [override])
    assert says in str(caught.value)


def test_overrides_reach_nested_values_and_named_list_entries():
    profile = load_profile("sim", ["views.left.x_steps=-1.5", "sweep.count=3", "name=other"])
    assert profile.views[1].x_steps == -1.5
    assert profile.sweep is not None
    assert profile.sweep.count == 3
    assert profile.name == "other"


def test_an_unknown_name_suggests_the_nearest_one():
    with pytest.raises(ConfigError, match="did you mean sim"):
        find_profile("simm")
    with pytest.raises(ConfigError, match="no such file"):
        find_profile("nowhere/rig.toml")


def test_broken_toml_names_the_line(tmp_path: Path):
    path = tmp_path / "broken.toml"
    path.write_text("name = \n")
    with pytest.raises(ConfigError, match=r"broken\.toml: not valid TOML.*line 1"):
        load_profile(str(path))


def test_folder_paths_start_at_the_profile_file(tmp_path: Path):
    path = tmp_path / "rig.toml"
    path.write_text(
        'name = "r"\npitch_mm = 1.0\n'
        'views = [{name = "a", x_steps = 0.0, y_steps = 0.0}, '
        '{name = "b", x_steps = 1.0, y_steps = 0.0}]\n'
        '[camera]\nkind = "folder"\nfolder = "images"\nfiles = {a = "a.png", b = "b.png"}\n'
        "[slopes]\nrange_px = [-1.0, 1.0]\n"
    )
    camera = load_profile(str(path)).camera
    assert isinstance(camera, FolderCameraConfig)
    assert Path(camera.folder) == tmp_path / "images"


def test_every_field_is_described_in_the_schema():
    schema = Profile.model_json_schema()
    sections = [schema, *schema["$defs"].values()]
    undescribed = [
        f"{section['title']}.{key}"
        for section in sections
        for key, field in section.get("properties", {}).items()
        if not field.get("description")
    ]
    assert undescribed == []


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["name", "views", "camera", "kind", "stage", "sweep", "x"])
            | st.text(max_size=5),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)


@settings(deadline=None, max_examples=150)
@given(json_values)
def test_any_data_is_a_profile_or_a_config_error(data: object):
    with pytest.raises(ConfigError):
        parse_profile(data, source="generated")


@settings(deadline=None, max_examples=150)
@given(st.text(max_size=30))
def test_any_override_is_applied_or_a_config_error(text: str):
    try:
        load_profile("sim", [text])
    except ConfigError as error:
        assert str(error)


def test_a_profile_survives_the_way_through_json():
    profile = load_profile("sim-real")
    assert parse_profile(json.loads(profile.model_dump_json()), source="json") == profile
