"""Devices opened side by side, and closed again when one of them does not open."""

import threading
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self

import pytest
from rig_drivers.together import close_together, open_together

from rig.check.items import failed
from rig.errors import DeviceError, DeviceLostError, DeviceNotFoundError, DevicesNotFoundError
from rig.hardware.opening import open_hardware
from rig.profile.load import load_profile
from tests.support.video_arrays import locked, video_array
from tests.support.video_kernel import FakeDevice

VIEWS = ("reference", "left", "right", "top", "bottom")


class Opened:
    """A device that only opens and closes."""

    identity: Mapping[str, str] = {}

    def __init__(self, on_open: Callable[[], object]) -> None:
        self._on_open = on_open
        self.is_open = False

    def __enter__(self) -> Self:
        self._on_open()
        self.is_open = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.is_open = False


def test_a_stage_and_five_cameras_are_opened_at_the_same_time():
    """Nobody gets past the barrier before all six are being opened."""
    all_there = threading.Barrier(len(VIEWS) + 1, timeout=20.0)

    def waiting(number: int) -> FakeDevice:
        device = locked(number)
        device.on_open = all_there.wait
        return device

    array, _, _ = video_array(VIEWS, waiting)
    stage = Opened(all_there.wait)
    open_together((stage, array), name="rig")
    try:
        assert stage.is_open
        assert not all_there.broken
    finally:
        close_together((stage, array))
    assert not stage.is_open


def test_an_interrupt_leaves_none_open():
    def interrupted() -> None:
        raise KeyboardInterrupt

    others = [Opened(lambda: None) for _ in range(3)]
    with pytest.raises(KeyboardInterrupt):
        open_together((*others, Opened(interrupted)), name="rig")
    assert not any(device.is_open for device in others)


def failing(error: DeviceError) -> Opened:
    def refuse() -> None:
        raise error

    return Opened(refuse)


def test_five_absent_cameras_are_one_line_with_one_advice():
    absent = [
        failing(DeviceNotFoundError(f"camera {view}", "is not there", advice="plug it in"))
        for view in VIEWS
    ]
    with pytest.raises(DevicesNotFoundError) as caught:
        open_together(absent, name="camera")
    named = ", ".join(f"camera {view}" for view in VIEWS)
    assert str(caught.value) == f"camera: 5 of 5 did not open: {named}: is not there; plug it in"
    assert [error.device for error in caught.value.errors] == [f"camera {v}" for v in VIEWS]


def test_devices_that_fail_for_different_reasons_keep_every_advice():
    error = DeviceLostError("stage", "does not answer", advice="check its supply; home it")
    devices = [
        failing(DeviceNotFoundError("camera", "is not there", advice="plug it in")),
        Opened(lambda: None),
        failing(error),
    ]
    with pytest.raises(DevicesNotFoundError) as caught:
        open_together(devices, name="rig")
    assert caught.value.advice == "plug it in; check its supply; home it"
    item = failed("devices", caught.value)
    assert item.found == ("rig: 2 of 3 did not open: camera: is not there; stage: does not answer")
    assert item.advice == caught.value.advice


def test_one_absent_camera_is_told_as_it_is():
    absent = failing(DeviceNotFoundError("camera a", "is not there", advice="plug it in"))
    with pytest.raises(DeviceNotFoundError) as caught:
        open_together([absent, Opened(lambda: None)], name="camera")
    assert str(caught.value) == "camera a: is not there; plug it in"


def test_of_a_rig_without_stage_and_camera_both_are_told():
    profile = load_profile(
        "v4l2-pair-grbl", ("stage.port=/dev/no-stage", "camera.devices.left=/dev/no-camera")
    )
    with (
        pytest.raises(DeviceNotFoundError, match=r"2 of 2 did not open: .*no-stage"),
        open_hardware(profile),
    ):
        pass
