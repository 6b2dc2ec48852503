"""Stored values come back to the last digit, and JSON that older versions wrote reads as before."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.arrays import Flags, Float, Index, Number
from rig.curve import Curve
from rig.errors import ConfigError
from rig.geometry.bundle.result import Calibration
from rig.geometry.rig_geometry_json import geometry_from_json, geometry_to_json
from rig.json_codec import Codec

WRITTEN_BEFORE = Path(__file__).parent / "stored_json"
"""Files that rig wrote when each kind of value had a codec of its own."""


@dataclass(frozen=True, slots=True)
class Part:
    score: Number
    places_px: Float


@dataclass(frozen=True, slots=True)
class Whole:
    name: str
    kind: Literal["one", "other"]
    count: int
    pair_mm: tuple[float, float]
    parts: tuple[Part, ...]
    ids: Index
    flags: Flags
    later: float | None = None


OPEN = Codec(Whole, name="thing", error=ConfigError, advice="make it again", finite=False)
FINITE = Codec(Whole, name="thing", error=ConfigError, advice="make it again")
WHOLE = Whole(
    name="nan",
    kind="one",
    count=3,
    pair_mm=(0.1 + 0.2, -1e-300),
    parts=(Part(float("nan"), np.array([[1 / 3, np.nan], [np.inf, -np.inf]])),),
    ids=np.array([4, 2**60]),
    flags=np.array([[True, False]]),
)


def through_text(content: dict[str, Any]) -> Any:
    return json.loads(json.dumps(content, allow_nan=False))


def test_a_value_comes_back_with_what_is_not_finite():
    content = OPEN.to_json(WHOLE)
    back = OPEN.from_json(through_text(content))
    assert (back.name, back.kind, back.count, back.pair_mm) == ("nan", "one", 3, WHOLE.pair_mm)
    assert np.isnan(back.parts[0].score)
    for one, other in (
        (back.parts[0].places_px, WHOLE.parts[0].places_px),
        (back.ids, WHOLE.ids),
        (back.flags, WHOLE.flags),
    ):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    assert OPEN.to_json(back) == content


@given(numbers=st.lists(st.floats(), max_size=5), score=st.floats())
def test_numbers_keep_every_digit(numbers: list[float], score: float):
    before = replace(WHOLE, parts=(Part(score, np.array(numbers)),))
    (part,) = OPEN.from_json(through_text(OPEN.to_json(before))).parts
    np.testing.assert_array_equal([part.score, *part.places_px], [score, *numbers])


def test_a_field_with_a_default_may_be_missing():
    content = OPEN.to_json(WHOLE)
    del content["later"]
    assert OPEN.from_json(content).later is None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"extra": 1}, "a stored thing is ill-formed: extra is unknown; make it again"),
        ({"name": 1}, "name: a text wanted, found 1"),
        ({"kind": "third"}, "kind: 'one' or 'other' wanted, found 'third'"),
        ({"count": 1.0}, "count: a whole number wanted, found 1.0"),
        ({"count": True}, "count: a whole number wanted, found True"),
        ({"pair_mm": [1.0]}, r"pair_mm\[1\] is missing"),
        ({"pair_mm": [1.0, 2.0, 3.0]}, "pair_mm: a shorter list wanted"),
        ({"pair_mm": [1.0, "2"]}, r"pair_mm\[1\]: a finite number wanted, found '2'"),
        ({"parts": {}}, "parts: a list wanted, found {}"),
        ({"parts": [5]}, r"parts\[0\]: an object wanted, found 5"),
        ({"parts": [{"score": "big", "places_px": []}]}, r"parts\[0\]\.score: .* found 'big'"),
        ({"parts": [{"score": 1, "places_px": 5}]}, "places_px: lists of numbers wanted, found 5"),
        ({"parts": [{"score": 1, "places_px": [[1], [1, 2]]}]}, "places_px: lists of numbers"),
        ({"parts": [{"score": 1, "places_px": [True]}]}, "places_px: lists of numbers"),
        ({"parts": [{"score": 1, "places_px": ["1"]}]}, "places_px: lists of numbers"),
        ({"ids": [1.5]}, "ids: lists of whole numbers wanted"),
        ({"ids": [2**70]}, "ids: lists of whole numbers wanted"),
        ({"flags": [1]}, "flags: lists of true and false wanted"),
        ({"later": "x" * 99}, r"later: a finite number wanted, found 'x{36}\.\.\.; make"),
    ],
)
def test_json_of_another_kind_is_refused(change: dict[str, Any], says: str):
    with pytest.raises(ConfigError, match=says):
        OPEN.from_json(OPEN.to_json(WHOLE) | change)


def test_finite_arrays_are_asked_for():
    with pytest.raises(ConfigError, match=r"places_px: lists of numbers, finite ones wanted"):
        FINITE.from_json(OPEN.to_json(WHOLE))


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
        max_leaves=6,
    ),
    st.sampled_from(["all", "name", "kind", "count", "pair_mm", "parts", "ids", "flags"]),
)
def test_any_json_makes_a_value_or_says_why_not(data: object, field: str):
    content = data if field == "all" else OPEN.to_json(WHOLE) | {field: data}
    try:
        value = OPEN.from_json(content)
    except ConfigError as error:
        assert str(error).startswith("a stored thing is ill-formed: ")
    else:
        assert OPEN.to_json(value).keys() == OPEN.to_json(WHOLE).keys()


@pytest.mark.parametrize("file", sorted(WRITTEN_BEFORE.glob("*.json")), ids=lambda file: file.stem)
def test_what_older_versions_wrote_reads_and_is_written_as_before(file: Path):
    text = file.read_text()
    kind = file.stem.partition("_")[0]
    content = json.loads(text)
    if kind == "curve":
        again = Curve.from_json(content).to_json()
    elif kind == "geometry":
        again = geometry_to_json(geometry_from_json(content))
    else:
        again = json.loads(Calibration.from_json(text).to_json())
    assert again == content
