"""Recordings that are damaged, cut off or made to hurt: one line each, in little memory."""

import json
import struct
import tracemalloc
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from rig.errors import StoreError
from rig.recording import reader, recorded, recorded_views
from tests.support.recordings import VIEWS, assert_same, taken, written

MAGIC = b"\x89MCAP0\r\n"
GOLDEN = Path(__file__).parents[2] / "data" / "recording_of_old.mcap"
FACTS = {
    "view": "a",
    "timestamp_s": 1.0,
    "sequence": 0,
    "exposure_s": None,
    "bits": None,
    "uncertainty_s": 0.0,
}
PICTURE = {"width": 2, "height": 1, "encoding": "mono8", "data": "AAE="}


def old_file(path: Path, index: object, picture: object = PICTURE, *, packed: str = "ZSTD") -> Path:
    """A recording as they were: JSON, one message a chunk."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1, compression=CompressionType[packed])
        writer.start(profile="epirig")
        schema = writer.register_schema("any", "jsonschema", b"{}")
        image = writer.register_channel("/a/image", "json", schema)
        multiview = writer.register_channel("/multi_view", "json", schema)
        writer.add_message(image, 0, json.dumps(picture).encode(), 0)
        writer.add_message(multiview, 0, json.dumps(index).encode(), 0)
        writer.finish()
    return path


def index(temperature_degc: object = None, **changed: object) -> dict[str, object]:
    return {"temperature_degc": temperature_degc, "frames": [FACTS | changed]}


def test_a_recording_of_old_comes_back_exactly():
    found = list(recorded(GOLDEN))
    assert recorded_views(GOLDEN) == VIEWS
    assert [one.time_ns for one in found] == [None, None]
    for number, one in enumerate(found):
        assert_same(one.views, taken(number))


@pytest.mark.parametrize("packed", ["ZSTD", "LZ4", "NONE"])
def test_recordings_that_other_programs_packed_are_read(tmp_path: Path, packed: str):
    (found,) = recorded(old_file(tmp_path / "r.mcap", index(bits=7), packed=packed))
    assert found.views.frames[0].image.tolist() == [[0, 1]]
    assert found.views.frames[0].bits == 7


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (index(timestamp_s=float("nan")), "timestamp_s"),
        (index(timestamp_s=float("inf")), "timestamp_s"),
        (index(timestamp_s=1e12), "less than or equal to 1"),
        (index(timestamp_s=1 << 63), "less than or equal to 1"),
        (index(timestamp_s="1.0"), "valid number"),
        (index(uncertainty_s="rgb8"), "uncertainty_s"),
        (index(uncertainty_s=-1.0), "uncertainty_s"),
        (index(exposure_s=61.0), "exposure_s"),
        (index(sequence=1 << 70), "sequence"),
        (index(sequence=True), "sequence"),
        (index(bits=0), "bits"),
        (index(bits=9), "9 bits in a picture of uint8"),
        (index(temperature_degc=True), "temperature_degc"),
        (index(view="b"), "no picture of b"),
        (index(more=1), "more"),
        ({"temperature_degc": None, "frames": []}, "frames"),
        ({"temperature_degc": None, "frames": {}}, "frames"),
        ({"frames": [FACTS]}, "temperature_degc"),
        ({"temperature_degc": None, "frames": [FACTS, FACTS]}, "a view twice"),
        (
            {"temperature_degc": None, "frames": [FACTS, FACTS | {"view": "b", "timestamp_s": 62}]},
            "61 s apart",
        ),
        ([], "dictionary|object"),
    ],
)
def test_an_index_of_nonsense_is_told(tmp_path: Path, content: object, told: str):
    path = old_file(tmp_path / "r.mcap", content)
    with pytest.raises(StoreError, match=told) as caught:
        list(recorded(path))
    assert str(caught.value).startswith(f"{path}: is damaged: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("picture", "told"),
    [
        (PICTURE | {"width": -1}, "width"),
        (PICTURE | {"width": 3}, "2 bytes for 3 x 1 px, mono8"),
        (PICTURE | {"height": 0}, "height"),
        (PICTURE | {"encoding": "bgr8"}, "encoding 'bgr8'"),
        (PICTURE | {"data": "?"}, "base64|padding|character"),
        (PICTURE | {"data": 7}, "data"),
        ({}, "encoding"),
    ],
)
def test_a_picture_of_nonsense_is_told(tmp_path: Path, picture: object, told: str):
    with pytest.raises(StoreError, match=told):
        list(recorded(old_file(tmp_path / "r.mcap", index(), picture)))


def test_pictures_that_are_never_used_do_not_pile_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "r.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1, compression=CompressionType.ZSTD)
        writer.start(profile="epirig")
        schema = writer.register_schema("any", "jsonschema", b"{}")
        for number in range(4):
            image = writer.register_channel(f"/{number}/image", "json", schema)
            writer.add_message(image, 0, bytes(50_000), 0)
        writer.finish()
    size = path.stat().st_size
    monkeypatch.setattr(reader, "_MOST_UNPACKED", 200_000 - size)
    with pytest.raises(StoreError, match="holds no whole multi-view"):
        list(recorded(path))
    monkeypatch.setattr(reader, "_MOST_UNPACKED", 199_999 - size)
    with pytest.raises(StoreError, match="of 200000 bytes, most are 199999"):
        list(recorded(path))


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def chunk(records: bytes, *, size: int | None = None, packing: bytes = b"") -> bytes:
    size = len(records) if size is None else size
    head = struct.pack("<QQQII", 0, 0, size, 0, len(packing)) + packing
    return record(Opcode.CHUNK, head + struct.pack("<Q", len(records)) + records)


ZEROS = zstandard.ZstdCompressor().compress(bytes(1 << 20))
BOMB = zstandard.ZstdCompressor().compress(bytes(65 << 20))
UNSIZED = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(65 << 20))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "is empty"),
        (b"\x89MC", "is no MCAP file"),
        (b"text of somebody", "is no MCAP file"),
        (MAGIC, "holds no whole multi-view"),
        (MAGIC + struct.pack("<BQ", 1, 1 << 62), "a record 1 of 4611686018427387904 bytes"),
        (MAGIC + struct.pack("<BQ", 6, 1 << 29), "holds no whole multi-view"),
        (MAGIC + bytes(90), "a record 0 of 0 bytes"),
        (MAGIC + record(Opcode.CHANNEL, b"\x01"), "is damaged"),
        (MAGIC + record(Opcode.CHANNEL, struct.pack("<HHI", 1, 1, 0xFFFFFFFF)), "is damaged"),
        (MAGIC + record(Opcode.SCHEMA, struct.pack("<HI", 1, 2) + b"\xff\xff"), "is damaged"),
        (MAGIC + record(Opcode.MESSAGE, bytes(22)), "is damaged: KeyError 0"),
        (MAGIC + record(Opcode.MESSAGE, b""), "is damaged"),
        (MAGIC + record(Opcode.CHUNK, b"\x00"), "is damaged"),
        (MAGIC + chunk(bytes(9)), "a record 0 of 0 bytes where 0 are"),
        (MAGIC + chunk(struct.pack("<BQ", 5, 1 << 60)), "bytes where 0 are"),
        (MAGIC + chunk(b"\x05"), "is damaged"),
        (MAGIC + chunk(b"", packing=b"snappy"), "compression b'snappy' is not known"),
        (MAGIC + chunk(BOMB, size=65 << 20, packing=b"zstd"), "unpacks to 68157440 bytes"),
        (MAGIC + chunk(BOMB, size=1000, packing=b"zstd"), "1000 bytes that unpacks to 68157440"),
        (MAGIC + chunk(UNSIZED, size=1000, packing=b"zstd"), "is damaged"),
        (MAGIC + chunk(ZEROS, size=1 << 20, packing=b"zstd"), "a record 0 of 0 bytes"),
        (MAGIC + chunk(b"rubbish", size=10, packing=b"zstd"), "is damaged"),
        (MAGIC + chunk(b"rubbish", size=10, packing=b"lz4"), "is damaged"),
        (
            MAGIC + chunk(lz4.frame.compress(bytes(65 << 20)), size=1000, packing=b"lz4"),
            "a record 0 of 0 bytes",
        ),
        (MAGIC + chunk(b"", size=1), "checksum or size of a chunk"),
    ],
    ids=[f"file{number}" for number in range(25)],
)
def test_a_file_of_nonsense_is_told_in_little_memory(tmp_path: Path, content: bytes, told: str):
    path = tmp_path / "r.mcap"
    path.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(StoreError, match=told) as caught:
            list(recorded(path))
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert str(caught.value).startswith(f"{path}: ")
    assert most < 20 << 20, f"{most} bytes at most"


def test_views_that_change_are_told(tmp_path: Path):
    one, other = tmp_path / "one.mcap", tmp_path / "other.mcap"
    written(one, 1)
    old_file(other, index(), packed="NONE")
    joined = tmp_path / "joined.mcap"
    # Records of the second file behind those of the first, without its magic.
    joined.write_bytes(data_of(one) + data_of(other)[len(MAGIC) :])
    with pytest.raises(StoreError, match="views a after left, right"):
        list(recorded(joined))


def data_of(path: Path) -> bytes:
    """The file up to its end of data."""
    content, at = path.read_bytes(), len(MAGIC)
    while content[at] != Opcode.DATA_END:
        at += 9 + struct.unpack_from("<Q", content, at + 1)[0]
    return content[:at]


def any_change(content: bytes) -> st.SearchStrategy[bytes]:
    """A file with some bytes replaced, or cut off."""

    def changed(places: list[tuple[int, bytes]], cut: int) -> bytes:
        spoilt = bytearray(content)
        for at, new in places:
            spoilt[at : at + len(new)] = new
        return bytes(spoilt[:cut])

    place = st.tuples(st.integers(0, len(content)), st.binary(min_size=1, max_size=9))
    return st.builds(changed, st.lists(place, max_size=4), st.integers(0, len(content) + 50))


@pytest.fixture(scope="module", params=["now", "old"])
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A recording that is not damaged."""
    if request.param == "old":
        return GOLDEN.read_bytes()
    path = tmp_path_factory.mktemp("whole") / "r.mcap"
    written(path, 2)
    return path.read_bytes()


@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_any_file_is_read_or_refused(
    whole: bytes, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
):
    folder = tmp_path_factory.getbasetemp() / "any_recording"
    folder.mkdir(exist_ok=True)
    path = folder / "spoilt.mcap"
    path.write_bytes(data.draw(any_change(whole)))
    try:
        found = [one.views for one in recorded(path)]
    except StoreError as error:
        assert str(path) in error.found
        return
    assert 1 <= len(found) <= 3
    assert all(frame.image.shape == (6, 9) for views in found for frame in views.frames)
