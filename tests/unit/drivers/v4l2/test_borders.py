"""Controls and modes of a node at the borders of what is taken."""

from pathlib import Path

import numpy as np
import pytest
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.controls import Control, Controls
from rig_drivers.v4l2.formats import Mode, SizeOffer, Steps, nearest_size, set_mode
from rig_drivers.v4l2.node import Node
from rig_drivers.v4l2.pixels import DECODERS, PixelError, to_grey
from rig_sim.clock import VirtualClock

from rig.errors import ConfigError, DeviceLostError
from tests.support.video_kernel import FakeControl, FakeDevice, FakeVideoKernel


def control(kind: int, least: int, most: int, step: int = 1, **changes: object) -> Control:
    values: dict[str, object] = {"flags": 0, **changes}
    return Control(1, "it", kind, least, most, step, least, **values)  # pyright: ignore[reportArgumentType]


def opened(*controls: FakeControl, **changes: object) -> Node:
    device = FakeDevice(controls=list(controls), **changes)  # pyright: ignore[reportArgumentType]
    return Node(Path("/dev/video0"), FakeVideoKernel({"/dev/video0": device}, VirtualClock()))


NUMBER, SWITCH, BITS = abi.CTRL_TYPE_INTEGER, abi.CTRL_TYPE_BOOLEAN, abi.CTRL_TYPE_BITMASK
MENU = {0: "Off", 2: "50 Hz"}


@pytest.mark.parametrize(
    ("found", "limits"),
    [
        (control(NUMBER, -3, 9), "-3..9"),
        (control(NUMBER, -3, 9, 2), "-3..9 in steps of 2"),
        (control(NUMBER, -3, 9, 0), "-3..9"),
        (control(SWITCH, 0, 1), "true, false"),
        (control(BITS, 0, 0x1F), "bits of 0x1f"),
        (control(BITS, 0, -1), "bits of 0xffffffff"),
        (control(abi.CTRL_TYPE_MENU, 0, 2, menu=MENU), "0 (Off), 2 (50 Hz)"),
    ],
)
def test_limits_are_told_as_they_are_written_in_a_profile(found: Control, limits: str):
    assert found.limits == limits


@pytest.mark.parametrize(
    ("found", "taken", "refused"),
    [
        (control(NUMBER, -3, 9), (-3, 0, 9), (-4, 10, "9")),
        (control(NUMBER, -3, 9, 4), (-3, 1, 5, 9), (-2, 0, 2, 8)),
        (control(NUMBER, -3, 9, 0), (-3, -2, 9), (10,)),
        (control(SWITCH, 0, 1), (0, 1, True, False), (2, -1)),
        (control(BITS, 0, 0b1011), (0, 0b1011, 0b1000), (0b100, 0b1111, -1)),
        (control(BITS, 0, -1), (0, 0xFFFF_FFFF), (1 << 32, -1)),
        (control(abi.CTRL_TYPE_MENU, 0, 2, menu=MENU), (0, 2, "Off", " 50  hz"), (1, 3, "60 Hz")),
        (control(abi.CTRL_TYPE_BUTTON, 0, 0), (7, 0, True), ("press",)),
    ],
)
def test_values_are_taken_up_to_the_limits(
    found: Control, taken: tuple[object, ...], refused: tuple[object, ...]
):
    for value in taken:
        assert isinstance(value, int | str)
        number = found.number_of(value)
        by_name = {"off": 0, "50 hz": 2}.get(" ".join(str(value).lower().split()))
        expected = 0 if found.kind == abi.CTRL_TYPE_BUTTON else by_name
        assert number == (int(value) if expected is None else expected)
    for value in refused:
        assert isinstance(value, int | str)
        with pytest.raises(ConfigError, match="may be"):
            found.number_of(value)


@pytest.mark.parametrize(
    ("kind", "stored", "read"),
    [
        (NUMBER, 5, 5),
        (NUMBER, -5, -5),
        (NUMBER, 2**31 - 1, 2**31 - 1),
        (NUMBER, -(2**31), -(2**31)),
        (BITS, 0x8000_0001, 0x8000_0001),
        (abi.CTRL_TYPE_INTEGER64, 0x8000_0001, 0x8000_0001),
    ],
)
def test_numbers_have_a_sign_and_bits_have_none(kind: int, stored: int, read: int):
    with opened(FakeControl(0x0098_0900, "It", -(2**31), 2**31 - 1, stored, kind=kind)) as node:
        found = Controls(node)
        assert found.read(found.named("it")) == read


def test_a_button_is_pressed_and_not_read_and_what_cannot_be_read_neither():
    pressed: list[int] = []

    def press(value: int) -> int:
        pressed.append(value)
        return 99

    button = FakeControl(0x0098_0901, "Reset", 0, 0, 0, kind=abi.CTRL_TYPE_BUTTON, stored=press)
    mute = FakeControl(0x0098_0902, "Mute", 0, 9, 0, flags=abi.CTRL_FLAG_WRITE_ONLY, stored=press)
    with opened(button, mute) as node:
        assert Controls(node).apply({"reset": True, "mute": 4}) == {}
    assert pressed == [0, 4]


def test_only_what_can_be_set_is_listed():
    there = [
        FakeControl(0x0098_0900, "Brightness", 0, 9, 0),
        FakeControl(0x0098_0001, "User Controls", 0, 0, 0, kind=abi.CTRL_TYPE_CLASS),
        FakeControl(0x0098_0903, "Name", 0, 9, 0, kind=abi.CTRL_TYPE_STRING),
        FakeControl(0x0098_0904, "Gone", 0, 9, 0, flags=abi.CTRL_FLAG_DISABLED),
        FakeControl(0x0098_0905, "Area", 0, 9, 0, flags=abi.CTRL_FLAG_HAS_PAYLOAD),
        FakeControl(0x0098_0906, "Told", 0, 9, 3, flags=abi.CTRL_FLAG_READ_ONLY),
        FakeControl(0x0098_0907, "Mode", 1, 3, 1, kind=abi.CTRL_TYPE_MENU, menu={1: "A", 3: "B"}),
    ]
    with opened(*there) as node:
        found = Controls(node)
        assert [one.name for one in found] == ["brightness", "told", "mode"]
        assert found.named("mode").menu == {1: "A", 3: "B"}
        assert "name" not in found
        brightness = found.with_number(0x0098_0900)
        assert brightness is not None
        assert brightness == Control(0x0098_0900, "brightness", NUMBER, 0, 9, 1, 0, 0)
        assert found.with_number(0x0098_0903) is None


@pytest.mark.parametrize(("number", "is_error"), [(22, False), (25, False), (5, True)])
def test_a_node_without_controls_has_none_and_one_that_fails_is_no_such(
    number: int, is_error: bool
):
    with opened(refused={abi.VIDIOC_QUERY_EXT_CTRL: number}) as node:
        if is_error:
            with pytest.raises(OSError, match="refused"):
                Controls(node)
        else:
            assert list(Controls(node)) == []


@pytest.mark.parametrize(
    ("number", "error"), [(34, ConfigError), (22, ConfigError), (13, DeviceLostError)]
)
def test_out_of_range_is_a_wrong_profile_and_all_else_a_lost_camera(
    number: int, error: type[Exception]
):
    gain = FakeControl(abi.CID_GAIN, "Gain", 0, 9, 1)
    refusing = opened(gain, refused={abi.VIDIOC_S_EXT_CTRLS: number})
    with refusing as node, pytest.raises(error, match="control gain"):
        Controls(node).apply({"gain": 3})
    silent = opened(gain, refused={abi.VIDIOC_G_EXT_CTRLS: number})
    with silent as node, pytest.raises(DeviceLostError, match="does not tell control gain: ref"):
        Controls(node).apply({"gain": 3})


def one(name: str, width_px: int, height_px: int) -> SizeOffer:
    return SizeOffer(name, Steps(width_px, width_px), Steps(height_px, height_px))


@pytest.mark.parametrize(
    ("wanted", "offers", "nearest"),
    [
        # The ratio of sizes counts, not their difference ...
        ((100, 201), [(100, 100), (100, 400)], (100, 400)),
        ((201, 100), [(100, 100), (400, 100)], (400, 100)),
        ((100, 199), [(100, 100), (100, 400)], (100, 100)),
        # ... and those of width and height are added, whatever their signs.
        ((100, 100), [(130, 130), (160, 100)], (160, 100)),
        ((100, 100), [(130, 78), (160, 100)], (160, 100)),
        ((100, 100), [(100, 100), (101, 100)], (100, 100)),
    ],
)
def test_the_nearest_size_is_the_one_of_the_least_scaling(
    wanted: tuple[int, int], offers: list[tuple[int, int]], nearest: tuple[int, int]
):
    for listed in (offers, offers[::-1]):
        sizes = [one("GREY", *size) for size in listed]
        assert nearest_size(sizes, Mode("GREY", *wanted)) == Mode("GREY", *nearest)


def test_the_format_counts_before_the_size():
    offers = [one("YUYV", 100, 100), one("GREY", 300, 300), one("H264", 100, 100)]
    assert nearest_size(offers, Mode("GREY", 100, 100)) == Mode("GREY", 300, 300)
    assert nearest_size(offers, Mode("MJPG", 100, 100)) == Mode("YUYV", 100, 100)
    assert nearest_size(offers[2:], Mode("GREY", 100, 100)) is None


@pytest.mark.parametrize(
    ("rate_hz", "found_hz"), [(30.0, 30.0), (29.9, 30.0), (30.1, 30.0), (9.96, 10.0), (None, None)]
)
def test_a_rate_may_miss_by_half_a_percent(rate_hz: float | None, found_hz: float | None):
    with opened(intervals=((1, 10), (1, 30))) as node:
        applied = set_mode(node, Mode("GREY", 64, 48, rate_hz))
    assert applied.mode == Mode("GREY", 64, 48, found_hz)
    assert applied.bytes_per_line == 64


@pytest.mark.parametrize(
    ("rate_hz", "nearest"),
    [(29.8, "30 Hz"), (30.2, "30 Hz"), (17.0, "10 Hz"), (18.0, "30 Hz"), (0.5, "10 Hz")],
)
def test_another_rate_is_refused_with_the_nearest_by_ratio(rate_hz: float, nearest: str):
    with opened(intervals=((1, 10), (1, 30))) as node, pytest.raises(ConfigError) as caught:
        set_mode(node, Mode("GREY", 64, 48, rate_hz))
    assert f"the nearest it offers is GREY 64 x 48 at {nearest}" in str(caught.value)


def test_a_node_that_lists_no_rates_has_the_one_it_runs_at():
    no_list = {abi.VIDIOC_ENUM_FRAMEINTERVALS: 25}
    with opened(intervals=((1, 15),), refused=no_list) as node:
        assert set_mode(node, Mode("GREY", 64, 48, 15.0)).mode.rate_hz == 15.0
        with pytest.raises(ConfigError, match="nearest it offers is GREY 64 x 48 at 15 Hz"):
            set_mode(node, Mode("GREY", 64, 48, 20.0))


@pytest.mark.parametrize(
    ("name", "used"), [("GREY", 10), ("Y10", 20), ("Y16", 20), ("YUYV", 20), ("NV12", 10)]
)
def test_a_picture_may_be_as_short_as_its_last_line_and_no_shorter(name: str, used: int):
    stride = used + 3
    whole = np.zeros(2 * stride + used, np.uint8)
    image = to_grey(whole, name, width_px=10, height_px=3, bytes_per_line=stride)
    assert image.shape == (3, 10)
    with pytest.raises(PixelError, match=f"{2 * stride + used} needed for 3 lines of {stride} by"):
        to_grey(whole[:-1], name, width_px=10, height_px=3, bytes_per_line=stride)
    exact = to_grey(whole, name, width_px=10, height_px=3, bytes_per_line=used)
    assert exact.shape == (3, 10)
    with pytest.raises(PixelError, match=f"lines of {used - 1} bytes"):
        to_grey(whole, name, width_px=10, height_px=3, bytes_per_line=used - 1)


def test_every_format_has_its_depth():
    bits = {name: depth for name, (_, depth) in DECODERS.items()}
    by_depth = {
        8: "GREY YUYV YVYU UYVY VYUY NV12 NV21 NV16 NV61 YU12 YV12 MJPG JPEG RGB3 BGR3 "
        "BA81 GBRG GRBG RGGB Y8I",
        10: "Y10 Y10P BG10 GB10 BA10 RG10 pBAA pGAA pgAA pRAA",
        12: "Y12 Y12P BG12 GB12 BA12 RG12 pBCC pGCC pgCC pRCC Y12I",
        14: "Y14 BG14 GB14 GR14 RG14",
        16: "Y16 BYR2 GB16 GR16 RG16",
    }
    assert bits == {name: depth for depth, names in by_depth.items() for name in names.split()}
