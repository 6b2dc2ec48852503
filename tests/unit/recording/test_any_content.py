"""Messages of any content in a file that is whole: checksums do not stand before the parsers."""

import json
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.errors import StoreError
from rig.recording import recorded
from rig.recording.mcap_writer import McapWriter

PICTURE = RawImage(width=3, height=2, encoding="mono8", step=3, data=bytes(range(6)))
FACTS = {
    "view": "a",
    "timestamp_s": 1.0,
    "sequence": 0,
    "exposure_s": None,
    "bits": None,
    "uncertainty_s": 0.0,
}
GOOD = json.dumps({"temperature_degc": None, "frames": [FACTS]}).encode()
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
FRAME = st.dictionaries(st.sampled_from([*FACTS, "more"]), JSON, max_size=2).map(FACTS.__or__)
INDEX = st.fixed_dictionaries(
    {"temperature_degc": st.none() | JSON, "frames": st.lists(FRAME, max_size=2) | JSON},
    optional={"time_ns": st.integers() | JSON},
)


def spoilt(content: bytes) -> st.SearchStrategy[bytes]:
    """Bytes of a message with some of them replaced."""

    def change(at: int, new: bytes) -> bytes:
        return content[:at] + new + content[at + len(new) :]

    return st.builds(change, st.integers(0, len(content)), st.binary(max_size=4))


def file_of(path: Path, picture: bytes, index: bytes, encoding: str = "protobuf") -> Path:
    path.unlink(missing_ok=True)
    writer = McapWriter(path, "epirig")
    image = writer.add_channel(
        "/a/image", encoding, writer.add_schema("foxglove.RawImage", "", b"")
    )
    facts = writer.add_channel("/multi_view", "json", writer.add_schema("rig.MultiView", "", b""))
    writer.write([(image, (picture,)), (facts, (index,))], 7)
    writer.close()
    return path


def pictures_of(path: Path) -> list[tuple[int, ...]] | None:
    """Sizes of all pictures; None where the file is refused in one line."""
    try:
        found = list(recorded(path))
    except StoreError as error:
        assert error.found.startswith(f"{path}: ")
        assert "\n" not in error.found
        return None
    return [frame.image.shape for one in found for frame in one.views.frames]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("any_content") / "r.mcap"


def test_what_the_tests_spoil_is_read(path: Path):
    whole = file_of(path, PICTURE.SerializeToString(), GOOD)
    (found,) = recorded(whole)
    assert found.views.frames[0].image.tolist() == [[0, 1, 2], [3, 4, 5]]


@given(
    picture=spoilt(PICTURE.SerializeToString()) | st.binary(max_size=60),
    encoding=st.sampled_from(["protobuf", "json", "cdr"]),
)
@settings(max_examples=80, deadline=None)
def test_any_picture_is_read_or_refused(path: Path, picture: bytes, encoding: str):
    sizes = pictures_of(file_of(path, picture, GOOD, encoding))
    assert sizes is None or all(height * width <= 60 for height, width in sizes)


@given(index=INDEX.map(lambda value: json.dumps(value).encode()) | st.binary(max_size=40))
@settings(max_examples=80, deadline=None)
def test_any_index_is_read_or_refused(path: Path, index: bytes):
    sizes = pictures_of(file_of(path, PICTURE.SerializeToString(), index))
    assert sizes is None or sizes == [(2, 3)]
