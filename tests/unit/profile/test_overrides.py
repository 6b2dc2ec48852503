"""Single values put into plain data, and refusals with their numbers."""

from pathlib import Path
from typing import Any

import pytest

from rig.errors import ConfigError, OptionError
from rig.profile.doubts import doubts
from rig.profile.load import find_profile, load_profile, parse_profile
from rig.profile.overrides import apply_overrides, plain_path, read_override


def data() -> dict[str, Any]:
    return {
        "name": "it",
        "camera": {"kind": "a", "gain": 1, "own": 2},
        "views": [{"name": "left", "x": 0}, {"name": "right", "x": 1}],
        "plain": [1, 2, 3],
    }


def applied(*texts: str) -> dict[str, Any]:
    """The data with these overrides; of kind `b` only `kind` and `gain` are known."""
    changed = data()
    overrides = [read_override(text) for text in texts]
    apply_overrides(
        changed,
        overrides,
        lambda section, kind: ("kind", "gain") if (section, kind) == ("camera", "b") else None,
    )
    return changed


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("a.b=1", ("a", "b"), 1),
        (" a . b = 1.5 ", ("a", "b"), 1.5),
        ("a=x=y", ("a",), "x=y"),
        ("a=[1, 2]", ("a",), [1, 2]),
        ("a=", ("a",), ""),
        ("a=plain words", ("a",), "plain words"),
    ],
)
def test_an_override_is_a_path_and_a_value(text: str, path: tuple[str, ...], value: object):
    override = read_override(text)
    assert (override.text, override.path, override.value) == (text, path, value)


@pytest.mark.parametrize("text", ["a", "=1", "a..b=1", ".a=1", "a.=1"])
def test_what_names_no_key_and_value_is_refused(text: str):
    with pytest.raises(OptionError, match="names no key and value"):
        read_override(text)


@pytest.mark.parametrize("text", ["a\nb", "a\nb=1", "a.\r=1", "a\x1b[2J=1", "a\u2028b.c=1"])
def test_a_key_that_no_line_can_show_is_refused_in_one_line(text: str):
    with pytest.raises(OptionError, match="names no key and value") as refused:
        read_override(text)
    assert str(refused.value).isprintable()


def test_a_value_of_several_lines_is_shown_in_one():
    override = read_override("a=[1,\n2]")
    assert (override.text, override.value) == ("a=[1, 2]", [1, 2])


def test_values_reach_their_place():
    assert applied("views.right.x=7")["views"] == [
        {"name": "left", "x": 0}, {"name": "right", "x": 7},
    ]  # fmt: skip
    assert applied("views.1.x=7")["views"][1]["x"] == 7
    assert applied("views.0.x=7")["views"][0]["x"] == 7
    assert applied("plain.2=9")["plain"] == [1, 2, 9]
    assert applied("new.below.it=9")["new"] == {"below": {"it": 9}}
    assert applied("camera.gain=9")["camera"] == {"kind": "a", "gain": 9, "own": 2}


def test_a_new_kind_makes_room_before_all_other_values():
    assert applied("camera.own=5", "camera.kind=b")["camera"] == {"kind": "b", "gain": 1, "own": 5}
    assert applied("camera.kind=c")["camera"] == {"kind": "c", "gain": 1, "own": 2}
    # Only the kind of a section itself is one.
    assert applied("camera.deep.kind=b")["camera"]["own"] == 2
    assert applied("kind=b")["camera"]["own"] == 2
    assert applied("views.left.kind=b")["views"][0] == {"name": "left", "x": 0, "kind": "b"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("views.top.x=1", "views has no top; there are: left, right"),
        ("views.2.x=1", "views has no 2; there are: left, right"),
        ("plain.3=1", "plain has no 3; there are: 0..2"),
        ("plain.-1=1", "plain has no -1"),
        ("plain.0.x=1", "plain.0 has no keys below it; shorten the path"),
        ("name.x=1", "name has no keys below it"),
    ],
)
def test_a_place_that_is_not_there_is_named(text: str, says: str):
    with pytest.raises(OptionError) as caught:
        applied(text)
    assert says in str(caught.value)


def test_a_name_in_a_list_is_its_index():
    assert plain_path(data(), ("views", "right", "x")) == ("views", "1", "x")
    assert plain_path(data(), ("views", "0", "x")) == ("views", "0", "x")
    assert plain_path(data(), ("views", "9", "x")) == ("views", "9", "x")
    assert plain_path(data(), ("views", "nobody", "x")) == ("views", "nobody", "x")
    assert plain_path(data(), ("name", "x", "y")) == ("name", "x", "y")


# --- refusals


@pytest.mark.parametrize(
    ("wrong", "more"), [(2, ""), (3, ""), (4, "; and 1 more"), (5, "; and 2 more")]
)
def test_three_errors_are_told_and_the_others_counted(wrong: int, more: str):
    good = load_profile("sim").model_dump(mode="json")
    keys = ("aaa", "bbb", "ccc", "ddd", "eee")
    with pytest.raises(ConfigError) as caught:
        parse_profile(good | dict.fromkeys(keys[:wrong], 1), source="it")
    text = str(caught.value)
    assert text.startswith("it: aaa: unknown key")
    assert text.count(": unknown key") == min(wrong, 3)
    assert text.endswith(more) if more else " more" not in text


@pytest.mark.parametrize(
    ("length", "shown"), [(58, "'" + "x" * 58 + "'"), (59, "'" + "x" * 59 + "...")]
)
def test_a_long_value_is_cut_after_sixty_characters(length: int, shown: str):
    with pytest.raises(ConfigError) as caught:
        load_profile("sim", [f"sweep.count='{'x' * length}'"])
    assert str(caught.value).endswith(f"found {shown}")


def test_a_profile_is_found_by_name_or_by_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    file = tmp_path / "calib_profiles" / "mine.toml"
    file.parent.mkdir()
    file.write_text("")
    monkeypatch.chdir(tmp_path)
    assert find_profile("mine") == file
    assert find_profile("calib_profiles/mine.toml") == Path("calib_profiles/mine.toml")
    (tmp_path / "here.toml").write_text("")
    assert find_profile("here.toml") == Path("here.toml")
    (tmp_path / "folder").mkdir()
    for lost in ("there.toml", "folder/mine", str(tmp_path / "folder")):
        with pytest.raises(ConfigError, match="no such file"):
            find_profile(lost)
    with pytest.raises(ConfigError) as caught:
        find_profile("qqqqqq")
    assert "there are: " in str(caught.value)
    assert "mine" in str(caught.value)


# --- doubts


def doubted(*overrides: str, text: str = "") -> dict[str, str]:
    return {one.key: str(one) for one in doubts(load_profile("sim", overrides), text)}


@pytest.mark.parametrize(
    ("override", "key"),
    [
        ("pitch_mm=0.2", None),
        ("pitch_mm=0.19", "pitch_mm"),
        ("target.square_mm=0.5", None),
        ("target.square_mm=0.49", "target.square_mm"),
        ("sweep.from_mm=400", None),
        ("sweep.from_mm=399", "sweep.from_mm"),
        ("sweep.to_mm=1200", None),
        ("sweep.to_mm=1201", "sweep.to_mm"),
    ],
)
def test_a_value_is_doubted_from_its_limit_on(override: str, key: str | None):
    base = ("sweep.from_mm=500", "sweep.to_mm=1000", "stage.travel_mm=[400, 1200]")
    assert list(doubted(*base, override)) == ([] if key is None else [key])


def test_metres_are_told_in_millimetres():
    assert doubted("pitch_mm=0.04")["pitch_mm"] == (
        "pitch_mm: 0.04 mm, less than 0.2 mm; lengths are in mm: write 40 if these are metres"
    )


def test_lines_to_measure_are_counted_from_one():
    one = doubted(text="a = 1\nb = 2 # measure this\n")
    assert list(one) == ["line 2"]
    two = doubted(text="# MEASURE\nb\nc # what to MEASURE\n# lines that say MEASURE\n")
    assert list(two) == ["lines 1, 3"]
    assert doubted(text="measure = 1 # remeasured\n") == {}


def test_a_range_replaces_the_other_kind_of_range():
    profile = load_profile("sim", ["slopes.range_mm=[400, 1200]"])
    assert (profile.slopes.range_px, profile.slopes.range_mm) == (None, (400.0, 1200.0))
    back = load_profile("sim", ["slopes.range_mm=[400, 1200]", "slopes.range_px=[-3, 4]"])
    assert (back.slopes.range_px, back.slopes.range_mm) == ((-3.0, 4.0), None)
