"""Controls by name: set, read back, and refused where the device would do something else."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_drivers.v4l2 import abi
from rig_drivers.v4l2.controls import Control, Controls, ControlValue, control_name
from rig_drivers.v4l2.node import Node
from rig_drivers.v4l2.settings import exposure_of, settings_for
from rig_sim.clock import VirtualClock

from rig.errors import ConfigError, DeviceLostError
from rig.profile import V4l2CameraConfig
from tests.support.video_kernel import FakeControl, FakeDevice, FakeVideoKernel

PATH = "/dev/v4l/by-path/left"


def webcam_controls() -> list[FakeControl]:
    """Return controls as a USB camera has them, automatisms on."""
    exposure_menu = {1: "Manual Mode", 3: "Aperture Priority Mode"}
    return [
        FakeControl(abi.CID_EXPOSURE_AUTO, "Auto Exposure", 0, 3, 3, menu=exposure_menu,
                    kind=abi.CTRL_TYPE_MENU),
        FakeControl(abi.CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 3, 2047, 250,
                    ruled_by=(abi.CID_EXPOSURE_AUTO, 3)),
        FakeControl(abi.CID_AUTO_WHITE_BALANCE, "White Balance, Automatic", 0, 1, 1,
                    kind=abi.CTRL_TYPE_BOOLEAN),
        FakeControl(abi.CID_WHITE_BALANCE_TEMPERATURE, "White Balance Temperature", 2000, 6500,
                    4000, step=10, ruled_by=(abi.CID_AUTO_WHITE_BALANCE, 1)),
        FakeControl(abi.CID_GAIN, "Gain", 0, 255, 64),
        FakeControl(abi.CID_FOCUS_AUTO, "Focus, Automatic Continuous", 0, 1, 1,
                    kind=abi.CTRL_TYPE_BOOLEAN),
        FakeControl(abi.CID_FOCUS_ABSOLUTE, "Focus, Absolute", 0, 250, 0, step=5,
                    ruled_by=(abi.CID_FOCUS_AUTO, 1)),
        FakeControl(0x0098_0900, "Brightness", -64, 64, 0),
    ]  # fmt: skip


@contextmanager
def opened(controls: list[FakeControl]) -> Generator[Controls]:
    kernel = FakeVideoKernel({PATH: FakeDevice(controls=controls)}, VirtualClock())
    with Node(Path(PATH), kernel) as node:
        yield Controls(node)


def config(**values: object) -> V4l2CameraConfig:
    plain = {"kind": "v4l2", "devices": {"left": PATH}, "width_px": 64, "height_px": 48}
    return V4l2CameraConfig.model_validate(
        {**plain, "rate_hz": 10, "pixel_format": "GREY", **values}
    )


def applied(found: Controls, /, **values: object) -> dict[str, int]:
    return found.apply(settings_for(config(**values), "left", found, "camera left"))


def test_names_are_those_of_v4l2_ctl():
    assert control_name(b"Exposure Time, Absolute") == "exposure_time_absolute"
    assert control_name(b"White Balance, Automatic") == "white_balance_automatic"
    with opened(webcam_controls()) as controls:
        assert "focus_automatic_continuous" in controls


@pytest.mark.parametrize(
    ("there", "listed"),
    [
        ([], "it has none at all"),
        (
            [FakeControl(abi.CID_GAIN, "Gain", 0, 9, 1), FakeControl(0x0098_0900, "Blue", 0, 9, 1)],
            "it has blue, gain",
        ),
    ],
)
def test_a_device_without_a_control_is_told_with_those_it_has(
    there: list[FakeControl], listed: str
):
    with opened(there) as controls, pytest.raises(ConfigError) as caught:
        applied(controls, focus=35)
    assert "asked for camera.focus, has no control for it" in str(caught.value)
    assert listed in str(caught.value)


def test_exposure_gain_focus_and_white_balance_end_their_automatisms_first():
    with opened(webcam_controls()) as controls:
        assert exposure_of(controls) is None
        found = applied(controls, exposure_s=0.008, gain=16, focus=35, white_balance_k=4600)
        assert found == {
            "auto_exposure": 1,
            "exposure_time_absolute": 80,
            "gain": 16,
            "focus_automatic_continuous": 0,
            "focus_absolute": 35,
            "white_balance_automatic": 0,
            "white_balance_temperature": 4600,
        }
        assert exposure_of(controls) == pytest.approx(0.008)


def test_further_controls_come_by_name_and_per_view():
    views = {"left": {"brightness": -12}}
    with opened(webcam_controls()) as controls:
        found = applied(
            controls,
            controls={"brightness": 5, "auto_exposure": "manual mode"},
            view_controls=views,
            trigger={"gain": 3},
        )
    assert found == {"brightness": -12, "auto_exposure": 1, "gain": 3}
    assert list(found)[-1] == "gain"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"controls": {"brigthness": 3}}, "no control brigthness; did you mean brightness?"),
        ({"controls": {"trigger": 1}}, "no control trigger; it has auto_exposure, brightness"),
        ({"gain": 300}, r"gain: asked for 300, may be 0\.\.255"),
        ({"controls": {"brightness": -65}}, r"asked for -65, may be -64\.\.64"),
        ({"focus": 33}, r"asked for 33, may be 0\.\.250 in steps of 5"),
        ({"controls": {"auto_exposure": 2}}, r"may be 1 \(Manual Mode\), 3 \(Aperture"),
        ({"controls": {"auto_exposure": "Auto"}}, r"asked for Auto, may be 1 \(Manual Mode\)"),
        ({"controls": {"white_balance_automatic": 2}}, "asked for 2, may be true, false"),
        ({"controls": {"exposure_time_absolute": 80}}, "is inactive: an automatism rules it"),
        ({"exposure_s": 0.00123}, r"steps of 0\.0001 s; the nearest is 0\.0012 s"),
        ({"exposure_s": 0.5}, r"asked for 5000, may be 3\.\.2047"),
    ],
)
def test_what_cannot_be_set_is_refused_with_the_limits(values: dict[str, object], message: str):
    with opened(webcam_controls()) as controls, pytest.raises(ConfigError, match=message):
        applied(controls, **values)


@pytest.mark.parametrize("key", ["exposure_s", "gain", "focus", "white_balance_k"])
def test_an_absent_control_is_named(key: str):
    value = {"exposure_s": 0.01}.get(key, 5)
    only = [FakeControl(0x0098_0900, "Brightness", -64, 64, 0)]
    with opened(only) as controls, pytest.raises(ConfigError, match=f"camera.{key}, has no contro"):
        applied(controls, **{key: value})


def test_an_exposure_in_lines_of_the_sensor_is_told_apart():
    only = [FakeControl(abi.CID_EXPOSURE, "Exposure", 4, 1700, 1000)]
    with opened(only) as controls:
        with pytest.raises(
            ConfigError, match=r"counts in lines of the sensor: set camera\.control"
        ):
            applied(controls, exposure_s=0.01)
        assert applied(controls, controls={"exposure": 900}) == {"exposure": 900}
        assert exposure_of(controls) is None


def test_a_value_that_the_device_changes_is_an_error():
    def halved(value: int) -> int:
        return value // 2

    only = [FakeControl(abi.CID_GAIN, "Gain", 0, 255, 64, stored=halved)]
    with opened(only) as controls, pytest.raises(ConfigError, match="set to 100, reads 50"):
        applied(controls, gain=100)


def test_a_control_that_only_tells_cannot_be_set():
    only = [FakeControl(0x0098_0900, "Brightness", 0, 9, 0, flags=abi.CTRL_FLAG_READ_ONLY)]
    with opened(only) as controls, pytest.raises(ConfigError, match="can only be read"):
        applied(controls, controls={"brightness": 3})


@pytest.mark.parametrize(("number", "kind"), [(34, ConfigError), (5, DeviceLostError)])
def test_a_driver_that_refuses_is_believed(number: int, kind: type[Exception]):
    device = FakeDevice(controls=webcam_controls(), refused={abi.VIDIOC_S_EXT_CTRLS: number})
    kernel = FakeVideoKernel({PATH: device}, VirtualClock())
    with Node(Path(PATH), kernel) as node, pytest.raises(kind, match="refused"):
        Controls(node).apply({"gain": 3})


numbers = st.integers(-(2**31), 2**31 - 1)


@given(least=numbers, most=numbers, step=st.integers(0, 2**31), value=numbers | st.text())
def test_a_number_is_taken_exactly_or_refused(
    least: int, most: int, step: int, value: ControlValue
):
    control = Control(1, "any", abi.CTRL_TYPE_INTEGER, least, most, step, least, 0)
    try:
        number = control.number_of(value)
    except ConfigError:
        return
    assert number == value
    assert least <= number <= most


@given(st.binary(max_size=32))
def test_any_name_becomes_a_key(raw: bytes):
    name = control_name(raw)
    assert " " not in name
    assert control_name(name.encode()) == name
