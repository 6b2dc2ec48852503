"""A profile that was shown can be saved, and is the same rig."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.places import profile_files
from rig.profile.load import load_profile, parse_profile
from rig.profile.toml_text import toml_text
from tests.support.command import Command

FILES = [path for path in profile_files() if "calib_profiles" in path.parts]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
@pytest.mark.parametrize(
    "overrides", [(), ("views.0.y_steps=0.0", "slopes.range_px=[-1e-7, 1e22]")]
)
def test_a_shown_profile_is_saved_and_used(
    rig: Command, tmp_path: Path, path: Path, overrides: tuple[str, ...]
):
    if "[[views]]" not in path.read_text():  # they follow from the positions of a scan
        overrides = overrides[1:]
    options = [word for override in overrides for word in ("--set", override)]
    answer = rig("profile", "show", path, *options)
    saved = tmp_path / "saved.toml"
    saved.write_text(answer.out, encoding="utf-8")
    assert load_profile(str(saved)) == load_profile(str(path), overrides)
    assert "None" not in answer.out
    assert "null" not in answer.out


scalars = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.text(max_size=12)


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@given(
    st.text(st.characters(codec="utf-8"), max_size=20),
    st.dictionaries(st.text(st.characters(codec="utf-8"), max_size=6), scalars, max_size=4),
    st.floats(1e-300, 1e300),
)
def test_any_text_key_and_number_comes_back(
    description: str, controls: dict[str, bool | int | str], pitch_mm: float
):
    data = load_profile("v4l2-pair-grbl").model_dump(mode="json")
    data |= {"description": description, "pitch_mm": pitch_mm}
    data["camera"]["controls"] = controls
    data["camera"]["view_controls"] = {"left": controls}
    profile = parse_profile(data, source="it")
    assert parse_profile(tomllib.loads(toml_text(profile)), source="again") == profile
