"""Motion JPEG: damage is refused with its reason, whatever only fills up is not."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
from rig_drivers.jpeg.grey import JpegDamageError, ShiftedPictureError, grey_of_jpeg
from rig_drivers.jpeg.header import code_table, read_header
from rig_drivers.jpeg.scan import walk_scan
from rig_drivers.jpeg.seams import shifted_from
from rig_drivers.v4l2.camera import V4l2Camera
from rig_sim.clock import VirtualClock

from benchmarks.mjpg import KINDS, campaign, coded, scene
from rig.profile import V4l2CameraConfig
from tests.support.video_kernel import FakeDevice, FakeVideoKernel

WIDTH_PX, HEIGHT_PX = 640, 480


def picture(kind: int = 0, seed: int = 5) -> np.ndarray:
    return coded(scene(seed), *KINDS[kind][1:])


def decoded(data: np.ndarray) -> np.ndarray:
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
    assert image is not None
    return image


def read(data: np.ndarray) -> np.ndarray:
    return grey_of_jpeg(data, width_px=WIDTH_PX, height_px=HEIGHT_PX)


@pytest.mark.parametrize("kind", range(len(KINDS)))
def test_a_whole_picture_is_what_the_decoder_makes_of_it(kind: int):
    data = picture(kind)
    assert np.array_equal(read(data), decoded(data))
    assert walk_scan(data, read_header(data.tobytes())) == data.size - 2


@pytest.mark.parametrize(
    "tail",
    [b"\xff\xd9", b"\xff\xd9\x12\x34\x56", b"", b"\0" * 900, b"\xff" * 7, b"\x12\xd9", b"\xff\x12"],
    ids=["as it should", "junk behind", "none", "zeros", "fill", "first broken", "second broken"],
)
def test_what_stands_in_place_of_the_end_mark_is_harmless(tail: bytes):
    data = picture()
    changed = np.concatenate([data[:-2], np.frombuffer(tail, np.uint8)])
    assert np.array_equal(read(changed), read(data))


def test_motion_jpeg_without_huffman_tables_uses_the_standard_ones():
    data = picture().tobytes()
    at, lean = 2, b"\xff\xd8"
    while data[at + 1] != 0xDA:
        end = at + 2 + int.from_bytes(data[at + 2 : at + 4])
        lean += b"" if data[at + 1] == 0xC4 else data[at:end]
        at = end
    lean = np.frombuffer(lean + data[at:], np.uint8)
    assert lean.size < len(data) - 400
    assert np.array_equal(read(lean), read(picture()))


def test_standard_tables_leave_only_the_code_of_all_ones_free():
    header = read_header(picture().tobytes())
    for table in header.codes.reshape(-1, 1 << 16):
        lengths = table >> 8
        assert lengths[0] == 2
        assert np.all(np.diff(np.flatnonzero(lengths == 0)) == 1)
        assert lengths[-1] == 0


def test_codes_are_counted_up_length_by_length():
    table = code_table(bytes([1, 1, 1] + [0] * 13) + b"\x07\x08\x09")
    assert table[0x0000] == table[0x7FFF] == 1 << 8 | 7
    assert table[0x8000] == table[0xBFFF] == 2 << 8 | 8
    assert table[0xC000] == table[0xDFFF] == 3 << 8 | 9
    assert table[0xE000] == table[0xFFFF] == 0


def cut(data: bytes) -> bytes:
    return data[:-200]


def repeated(data: bytes) -> bytes:
    return data[:-2] + data[-40:]


def strange_marker(data: bytes) -> bytes:
    return data[: len(data) // 2] + b"\xff\xc8" + data[len(data) // 2 :]


def bright(data: bytes) -> bytes:
    at = data.index(b"\xff\xdb") + 5
    return data[:at] + b"\xff" + data[at + 1 :]


def without_step(data: bytes) -> bytes:
    at = data.index(b"\xff\xdb") + 6
    return data[:at] + b"\0" + data[at + 1 :]


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (cut, "pixels are missing"),
        (repeated, "more coded bits than pixels"),
        (strange_marker, "a marker that does not belong there"),
        (without_step, "brighter, darker or rougher than 8 bits allow"),
        (bright, "brighter, darker or rougher than 8 bits allow"),
        (lambda data: data[1:], "no start mark"),
        (lambda data: data[:300], "a segment is cut off"),
        (lambda data: data[:2], "no scan"),
        (lambda data: data.replace(b"\xff\xc0", b"\xff\xc2", 1), "none that cameras send"),
        (lambda data: data.replace(b"\xff\xdb", b"\xff\xfe"), "a table is missing"),
        (lambda data: data.replace(b"\xff\xc0", b"\xff\xfe", 1), "a scan without a frame"),
    ],
)
def test_damage_is_told_by_its_kind(damage, told: str):  # noqa: ANN001
    with pytest.raises(JpegDamageError, match=told):
        read(np.frombuffer(damage(picture().tobytes()), np.uint8))


def test_another_size_is_told_with_both():
    with pytest.raises(JpegDamageError, match="640 x 480 px, agreed were 320 x 240 px"):
        grey_of_jpeg(picture(), width_px=320, height_px=240)


def test_a_restart_marker_out_of_turn_is_damage():
    data = picture(3)
    marks = [at for at, pair in enumerate(pairwise(data)) if pair == (0xFF, 0xD2)]
    data[marks[0] + 1] = 0xD3
    with pytest.raises(JpegDamageError, match="a marker that does not belong"):
        read(data)


def shifted(unit: int, step: float, by_row: bool = False) -> np.ndarray:
    image = decoded(picture(1)).astype(np.float64)
    row, column = divmod(unit, 40)
    image = 60.0 + 0.5 * image
    image[8 * row : 8 * row + 8, 16 * column :] += step
    if not by_row:
        image[8 * row + 8 :] += step
    return image.astype(np.uint8)


@pytest.mark.parametrize("step", [12.0, -12.0])
@pytest.mark.parametrize(("by_row", "restart"), [(False, 0), (True, 40)])
def test_a_shift_of_all_that_follows_is_found_where_it_begins(
    step: float, by_row: bool, restart: int
):
    image = shifted(217, step, by_row)
    found = shifted_from(image, unit_px=(16, 8), units_per_restart=restart)
    assert found is not None
    assert found // 40 == 5
    assert shifted_from(shifted(217, 0.0), unit_px=(16, 8), units_per_restart=restart) is None


def test_a_step_along_a_whole_row_is_the_scenes():
    assert shifted_from(shifted(200, 12.0), unit_px=(16, 8), units_per_restart=0) is None


def test_a_short_restart_interval_hides_no_shift():
    image = shifted(217, 12.0)
    assert shifted_from(image, unit_px=(16, 8), units_per_restart=4) is None


def test_a_picture_that_looks_shifted_is_dropped_once_and_then_the_scene():
    good = picture(1)
    doubtful = coded(np.dstack([shifted(217, 12.0)] * 3), *KINDS[1][1:])
    with pytest.raises(ShiftedPictureError, match="brightness jumps at unit"):
        read(doubtful)
    device = FakeDevice(
        modes=(("MJPG", WIDTH_PX, HEIGHT_PX),),
        paint=lambda number: (good if number < 2 else doubtful).tobytes(),
    )
    clock = VirtualClock()
    config = V4l2CameraConfig(
        kind="v4l2",
        devices={"left": "/dev/video0"},
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        rate_hz=10.0,
        pixel_format="MJPG",
    )
    kernel = FakeVideoKernel({"/dev/video0": device}, clock)
    with V4l2Camera(config, "left", kernel=kernel, clock=clock) as camera:
        frames = [camera.grab(3.0).frames[0].sequence for _ in range(3)]
        assert camera.dropped == {"damaged": 1}
    assert frames[-1] > 2


@pytest.mark.slow
def test_random_damage_is_noticed():
    tally = campaign(100, 3)
    assert sum(counts["counting"] for counts in tally.values()) > 80
    assert sum(counts["noticed"] - counts["counting"] for counts in tally.values()) >= -3
    assert not any(counts["harmless refused"] for counts in tally.values())
