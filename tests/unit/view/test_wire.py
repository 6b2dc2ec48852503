"""One message: header and arrays, there and back; whatever else comes is an error of rig's."""

import json
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from rig.errors import FormatError
from rig.view.wire import TYPES, decode, encode

arrays = st.dictionaries(
    st.text("abcdefg", min_size=1, max_size=4),
    st.sampled_from(TYPES).flatmap(
        lambda name: hnp.arrays(name, hnp.array_shapes(min_dims=1, max_dims=3, max_side=5))
    ),
    max_size=4,
)


@pytest.mark.slow
@given(arrays, st.dictionaries(st.text(max_size=5), st.integers() | st.text(), max_size=3))
def test_what_was_encoded_comes_back(given_arrays: dict[str, NDArray[Any]], header: dict[str, Any]):
    header.pop("arrays", None)
    message = encode(header, given_arrays)
    found, back = decode(message)
    assert found == header
    assert list(back) == list(given_arrays)
    for name, array in given_arrays.items():
        assert back[name].dtype == array.dtype
        np.testing.assert_array_equal(back[name], array)


def test_arrays_lie_where_the_header_says_at_multiples_of_eight():
    message = encode({"a": 1}, {"x": np.array([7, 8, 9], np.uint8), "y": np.array([2.5], "f4")})
    (length,) = struct.unpack_from("<I", message)
    assert (4 + length) % 8 == 0
    header = json.loads(message[4 : 4 + length])
    assert header["arrays"] == [
        {"name": "x", "type": "uint8", "shape": [3], "start": 0},
        {"name": "y", "type": "float32", "shape": [1], "start": 8},
    ]
    assert message[4 + length :] == b"\7\x08\x09" + bytes(5) + struct.pack("<f", 2.5) + bytes(4)


def test_rows_that_do_not_lie_together_are_sent_in_their_order():
    _, back = decode(encode({}, {"x": np.arange(6, dtype=np.uint16).reshape(2, 3).T}))
    assert back["x"].tolist() == [[0, 3], [1, 4], [2, 5]]


def test_other_types_and_nan_in_the_header_are_refused():
    with pytest.raises(FormatError, match="array depth of float64"):
        encode({}, {"depth": np.zeros(2)})
    with pytest.raises(FormatError, match="no JSON"):
        encode({"fps": float("nan")}, {})


@given(st.binary(max_size=200))
def test_rubbish_is_one_error(message: bytes):
    with pytest.raises(FormatError, match="no message of the live page"):
        decode(message)


@given(st.integers(0, 200))
def test_a_message_that_is_cut_off_is_one_error(length: int):
    message = encode({"a": 1}, {"x": np.arange(30, dtype=np.float32)})
    with pytest.raises(FormatError):
        decode(message[: min(length, len(message) - 1)])


@pytest.mark.parametrize(
    "entry",
    [
        {"name": "x", "type": "float64", "shape": [1], "start": 0},
        {"name": "x", "type": "uint8", "shape": [1], "start": -8},
        {"name": "x", "type": "uint8", "shape": [-1], "start": 0},
        {"name": "x", "type": "uint8", "shape": [99], "start": 0},
    ],
)
def test_an_array_that_is_not_there_is_one_error(entry: dict[str, object]):
    text = json.dumps({"arrays": [entry]}).encode()
    with pytest.raises(FormatError, match="no message"):
        decode(struct.pack("<I", len(text)) + text + bytes(8))
