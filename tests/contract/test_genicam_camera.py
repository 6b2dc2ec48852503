"""GenICam cameras keep the suite of `rig.testing`, over Aravis and the loopback interface."""

import shutil
import subprocess
import threading
import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from rig_genicam.config import GenicamCameraConfig
from rig_genicam.kind import GENICAM

from rig.devices import SystemClock
from rig.profile import ViewConfig
from rig.profile.kinds import Surroundings
from rig.testing import CameraCase
from rig.testing.test_camera import *  # noqa: F403 - the suite itself
from tests.support.gige.camera import GigeCamera
from tests.support.gige.library import aravis_library

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("gige")]

VIEWS = ("left", "right")
ADDRESSES = ("127.0.0.41", "127.0.0.42")
PERIOD_S = 0.04
FAKE = "arv-fake-gv-camera-0.8"


def case_of(devices: tuple[str, str], **more: Any) -> CameraCase:
    config = GenicamCameraConfig.model_validate(
        {
            **{"kind": "genicam", "devices": dict(zip(VIEWS, devices, strict=True))},
            **{"width_px": 64, "height_px": 48, "rate_hz": 1.0 / PERIOD_S, "exposure_s": 0.002},
            **more,
        }
    )
    views = tuple(ViewConfig(name=view, x_steps=i, y_steps=0.0) for i, view in enumerate(VIEWS))
    clock = SystemClock()
    camera = GENICAM.open(config, Surroundings("bench", views, clock))
    return CameraCase(camera, clock, may_drop=True)


@contextmanager
def pulses(cameras: list[GigeCamera]) -> Generator[None]:
    """A generator whose edges reach both cameras at one moment."""
    stopping = threading.Event()

    def run() -> None:
        due_s = time.monotonic()
        while not stopping.wait(max(0.0, due_s - time.monotonic())):
            for camera in cameras:
                camera.pulse(due_s)
            due_s += PERIOD_S

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    yield
    stopping.set()
    thread.join()


@pytest.fixture(scope="module")
def aravis_own_camera() -> Iterator[str]:
    """Address of the fake camera of the Aravis project, which nobody here wrote."""
    aravis_library()
    if shutil.which(FAKE) is None:
        pytest.skip(f"{FAKE} is not installed: apt install aravis-tools")
    with subprocess.Popen([FAKE, "-i", "127.0.0.1", "-s", "RIGOWN"]) as running:
        try:
            deadline_s = time.monotonic() + 20.0
            while not any(offer.serial == "RIGOWN" for offer in aravis_library().offers()):
                assert time.monotonic() < deadline_s
            yield "127.0.0.1"
        finally:
            running.kill()


@pytest.fixture(params=["hardware trigger", "software trigger", "beside Aravis' own"])
def camera_case(request: pytest.FixtureRequest) -> Iterator[CameraCase]:
    aravis_library()
    with ExitStack() as stack:
        if request.param == "beside Aravis' own":
            own: str = request.getfixturevalue("aravis_own_camera")
            stack.enter_context(GigeCamera(ADDRESSES[1], serial="W42"))
            yield case_of(
                (own, ADDRESSES[1])
            )  # both at whole multiples of the period, by the clock
            return
        cameras = [stack.enter_context(GigeCamera(a, serial=f"W{a[-2:]}")) for a in ADDRESSES]
        if request.param == "software trigger":
            yield case_of(ADDRESSES, trigger={"source": "Software"})
            return
        stack.enter_context(pulses(cameras))
        trigger = {"source": "Line1", "activation": "RisingEdge"}
        yield case_of(ADDRESSES, trigger=trigger)
