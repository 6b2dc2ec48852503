"""What is wrong with a profile, in words of a profile; never in those of the library below."""

import copy
import datetime
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.errors import ConfigError, OptionError
from rig.places import profile_files
from rig.profile.load import load_profile, parse_profile

LIBRARY = re.compile(
    r"Input should|Extra inputs|valid (dictionary|integer|number|string|boolean|list|tuple)|"
    r"Value error|value_error|instance of|Unable to|discriminator|pydantic|expected tags|"
    r"after validation|_type\b|Field required|Tuple|unable to parse|cannot be used, found"
)

FILES = [path for path in profile_files() if "calib_profiles" in path.parts]
DATA = {path.stem: tomllib.loads(path.read_text()) for path in FILES}


def places(node: Any, above: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    pairs = (
        node.items()
        if isinstance(node, dict)
        else enumerate(node)
        if isinstance(node, list)
        else ()
    )
    for key, value in pairs:
        yield (*above, key)
        yield from places(value, (*above, key))


values = (
    st.sampled_from([True, 0, -1, 2.5, 10**30, float("nan"), float("-inf"), "", "x", "a b", [], {}])
    | st.just(datetime.date(2026, 1, 1))
    | st.lists(st.integers() | st.text(max_size=3), max_size=3)
    | st.dictionaries(st.sampled_from(["kind", "name", "x", "bool"]), st.integers(), max_size=2)
)


@pytest.mark.slow
@settings(deadline=None, max_examples=400)
@given(st.data())
def test_no_refusal_of_a_wrong_value_speaks_the_language_of_the_library(data: st.DataObject):
    profile = copy.deepcopy(DATA[data.draw(st.sampled_from(sorted(DATA)))])
    *above, last = data.draw(st.sampled_from(list(places(profile))))
    node: Any = profile
    for key in above:
        node = node[key]
    if data.draw(st.booleans()):
        node[last] = data.draw(values)
    else:
        del node[last]
    try:
        parse_profile(profile, source="it")
    except ConfigError as error:
        assert not LIBRARY.search(str(error)), str(error)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("camera=3", "camera: must be a table with a kind"),
        ("camera={}", "camera.kind: missing; one of: sim, folder"),
        ("camera.kind=oax", "camera.kind: there is no camera 'oax', there are: folder"),
        ("views=[]", "views: needs a list of 1 or more, found a list of 0"),
        ("stage.baud=2.5", "stage.baud: needs a whole number, found 2.5"),
        ("stage.axis=W", "stage.axis: must be 'X', 'Y' or 'Z', found 'W'"),
        ("stage.travel_mm=5", "stage.travel_mm: needs a list, found 5"),
        ("pitch_mm=-1", "pitch_mm: must be above 0.0, found -1"),
        ("sweep.samples=0", "sweep.samples: must be at least 1, found 0"),
        ("stage.may_move=often", "stage.may_move: needs true or false, found 'often'"),
        ("stage.port=''", "stage.port: needs text of at least 1 characters, found ''"),
        ("description=1979-05-27", "description: needs text, found a date"),
        ("name='a b'", "name: needs text of the form"),
    ],
)
def test_a_wrong_value_is_told_with_what_is_needed_and_what_was_found(override: str, says: str):
    with pytest.raises(ConfigError) as caught:
        load_profile("sim", [override])
    assert says in str(caught.value)


def test_a_value_of_several_possible_types_is_refused_once():
    with pytest.raises(ConfigError) as caught:
        load_profile("v4l2-pair-grbl", ["camera.controls={sharpness=[1]}"])
    assert str(caught.value).endswith(
        "camera.controls.sharpness: needs true or false, a whole number or text, found a list of 1"
    )


def test_errors_of_the_file_name_the_file_and_those_of_an_override_the_override(tmp_path: Path):
    path = tmp_path / "bad.toml"
    path.write_text(FILES[0].read_text().replace("pitch_mm", "pitch_mmm"))
    with pytest.raises(ConfigError, match=r"bad\.toml: .*pitch_mm: missing"):
        load_profile(str(path), ["sweep.count=0"])
    with pytest.raises(OptionError, match=r"^--set sweep\.count=0: sweep\.count: must be at least"):
        load_profile("sim", ["sweep.samples=3", "sweep.count=0", "name=other"])
    with pytest.raises(
        ConfigError, match=r"^--set views\.left\.name=right: view names must differ"
    ):
        load_profile("sim", ["views.left.name=right"])


def test_a_new_kind_replaces_its_section():
    profile = load_profile(
        "sim",
        [
            "camera.files={centre='c', left='l', right='r', top='t', bottom='b'}",
            "camera.folder=pictures",
            "camera.timeout_s=7.0",
            "camera.kind=folder",
        ],
    )
    assert profile.camera.kind == "folder"
    assert profile.camera.timeout_s == 7.0
    zaber = load_profile("sim", ["stage.kind=zaber", "stage.microstep_mm=0.001"])
    assert zaber.stage is not None
    assert zaber.stage.kind == "zaber"
    assert zaber.stage.travel_mm == (400.0, 1200.0)  # a key that both kinds have stays
    with pytest.raises(
        ConfigError, match=r"^--set stage\.kind=zaber: stage\.microstep_mm: missing"
    ):
        load_profile("sim", ["stage.kind=zaber"])
    with pytest.raises(ConfigError, match=r"folder: missing"):
        load_profile("sim", ["camera.kind=folder"])
