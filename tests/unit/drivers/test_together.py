"""Devices opened side by side, and closed again when one of them does not open."""

import threading
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self

import pytest
from rig_drivers.together import close_together, open_together

from rig.errors import DeviceNotFoundError
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


def test_of_a_rig_without_stage_and_camera_both_are_told():
    profile = load_profile(
        "v4l2-pair-grbl", ("stage.port=/dev/no-stage", "camera.devices.left=/dev/no-camera")
    )
    with (
        pytest.raises(DeviceNotFoundError, match=r"2 of 2 did not open: .*no-stage"),
        open_hardware(profile),
    ):
        pass
