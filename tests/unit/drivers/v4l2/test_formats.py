"""Modes: the one asked for, or an error that names the nearest."""

from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.formats import Mode, RateOffer, SizeOffer, Steps, nearest_size, set_mode
from rig_drivers.v4l2.node import Node
from rig_sim.clock import VirtualClock

from rig.errors import ConfigError, DeviceLostError
from tests.support.video_kernel import FakeDevice, FakeVideoKernel


def opened(device: FakeDevice) -> Node:
    return Node(Path("/dev/video0"), FakeVideoKernel({"/dev/video0": device}, VirtualClock()))


def webcam() -> FakeDevice:
    return FakeDevice(
        modes=(("GREY", 1280, 800), ("GREY", 640, 400), ("YUYV", 640, 480), ("H264", 641, 401)),
        intervals=((1, 30), (1001, 60000), (1, 10)),
    )


@pytest.mark.parametrize(
    ("wanted", "rate_hz"),
    [
        (Mode("GREY", 640, 400, 30.0), 30.0),
        (Mode("GREY", 1280, 800, 60.0), 60000 / 1001),
        (Mode("YUYV", 640, 480, 10.0), 10.0),
    ],
)
def test_what_is_offered_is_set_and_read_back(wanted: Mode, rate_hz: float):
    with opened(webcam()) as node:
        applied = set_mode(node, wanted)
    assert applied.mode.rate_hz == pytest.approx(rate_hz)
    assert (applied.mode.width_px, applied.mode.height_px) == (wanted.width_px, wanted.height_px)


@pytest.mark.parametrize(
    ("wanted", "nearest"),
    [
        (Mode("GREY", 640, 480, 30.0), "GREY 640 x 400 at 30 Hz"),
        (Mode("GREY", 1920, 1080, 30.0), "GREY 1280 x 800 at 30 Hz"),
        (Mode("GREY", 640, 400, 25.0), "GREY 640 x 400 at 30 Hz"),
        (Mode("NV12", 641, 401, 30.0), "GREY 640 x 400 at 30 Hz"),
    ],
)
def test_what_is_not_offered_is_refused_with_the_nearest_offer(wanted: Mode, nearest: str):
    with opened(webcam()) as node, pytest.raises(ConfigError) as caught:
        set_mode(node, wanted)
    assert f"asked for {wanted}" in str(caught.value)
    assert f"nearest it offers is {nearest}" in str(caught.value)


def test_a_device_without_a_readable_format_says_what_it_has():
    device = FakeDevice(modes=(("H264", 640, 400),))
    with (
        opened(device) as node,
        pytest.raises(ConfigError, match=r"found H264\); readable are GREY"),
    ):
        set_mode(node, Mode("GREY", 640, 400, 30.0))


def test_a_format_that_rig_cannot_read_is_refused():
    with opened(FakeDevice()) as node, pytest.raises(ConfigError, match="H264 cannot be read"):
        set_mode(node, Mode("H264", 640, 400, 30.0))


def test_a_driver_that_refuses_its_own_offer_is_told_from_a_wrong_profile():
    device = FakeDevice(refused={abi.VIDIOC_S_FMT: 16})
    with opened(device) as node, pytest.raises(DeviceLostError, match="offers GREY 64 x 48"):
        set_mode(node, Mode("GREY", 64, 48, 10.0))


counts = st.integers(1, 10_000)


@given(
    least=st.integers(1, 60),
    span=st.integers(0, 90),
    step=st.integers(0, 16),
    asked=st.integers(1, 200),
)
def test_the_nearest_of_steps_is_one_of_them(least: int, span: int, step: int, asked: int):
    steps = Steps(least, least + span, step)
    found = steps.nearest(asked)
    assert least <= found <= least + span
    assert (found - least) % max(1, step) == 0
    allowed = range(least, least + span + 1, max(1, step))
    assert abs(found - asked) == min(abs(number - asked) for number in allowed)


offers = st.lists(
    st.builds(
        SizeOffer,
        st.sampled_from(["GREY", "YUYV", "MJPG", "H264"]),
        st.builds(lambda a: Steps(a, a), counts),
        st.builds(lambda a: Steps(a, a), counts),
    )
)


@given(offers=offers, width=counts, height=counts)
def test_an_exact_offer_is_always_found(offers: list[SizeOffer], width: int, height: int):
    wanted = Mode("GREY", width, height)
    exact = SizeOffer("GREY", Steps(width, width), Steps(height, height))
    assert nearest_size([*offers, exact], wanted) == wanted
    nearest = nearest_size(offers, wanted)
    assert nearest is None or nearest.pixel_format != "H264"


@given(st.fractions(min_value="1/1000", max_value=10))
def test_a_range_of_rates_offers_what_is_inside(interval_s: Fraction):
    offer = RateOffer(Fraction(1, 100), Fraction(1, 2))
    found = offer.nearest(interval_s)
    assert offer.shortest_s <= found <= offer.longest_s
    if offer.shortest_s <= interval_s <= offer.longest_s:
        assert found == interval_s
