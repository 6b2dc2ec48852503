"""The rig of the sweep: what the host, which renders, and the guest, which captures, agree on."""

import itertools
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from rig_sim.carriage import Carriage

from rig.plan import Stop
from rig.profile import GrblStageConfig, Profile
from rig.profile.load import load_profile, parse_profile
from rig.sweep.request import SweepRequest, plan_of
from tests.hardware.vivid.output import VideoOutput

VIEWS: Final = ("centre", "right")
SIZE_PX: Final = (640, 480)
VARIANTS: Final = 2
"""Pictures of the same place with other noise."""
_OVERRIDES: Final = (
    "camera.width_px=640",
    "camera.height_px=480",
    "world.renderer=analytic",
    "world.carriage.backlash_mm=0.0",
    "world.carriage.ring_mm=0.0",
    "world.firmware.boot_s=0.5",
    "world.firmware.max_rate_mm_s=400.0",
    "world.firmware.acceleration_mm_s2=4000.0",
    "world.firmware.homing_mm_s=400.0",
    "world.firmware.homing_locate_mm_s=50.0",
    "world.firmware.homing_pause_s=0.05",
    "stage.speed_mm_s=400.0",
    "stage.acceleration_mm_s2=4000.0",
    "sweep.from_mm=450.0",
    "sweep.to_mm=1150.0",
    "sweep.count=8",
    "sweep.samples=2",
    "sweep.backward_every=0",
    "sweep.settle_s=0.1",
)

Pictures = NDArray[np.uint8]
"""(stops, variants, views, H, W)."""


def simulated_profile() -> Profile:
    """Return the rig with simulated cameras: the truth."""
    data = _with_views(load_profile("sim", _OVERRIDES))
    return parse_profile(data, source="simulated")


def camera_profile(port: str, devices: dict[str, str]) -> Profile:
    """Return the same rig with V4L2 cameras, and its stage behind a serial port."""
    data = _with_views(load_profile("sim", _OVERRIDES))
    data["stage"]["port"] = port
    data["world"] = None
    data["camera"] = {
        "kind": "v4l2",
        "devices": devices,
        "width_px": SIZE_PX[0],
        "height_px": SIZE_PX[1],
        "rate_hz": 59.94,
        "pixel_format": "GREY",
        "max_skew_s": 0.1,
        "timeout_s": 40.0,
    }
    return parse_profile(data, source="cameras")


def stops() -> tuple[Stop, ...]:
    """Return where the sweep halts."""
    return plan_of(simulated_profile(), SweepRequest())[0]


class Screens:
    """Shows every camera what it would see of the board where the stage has come to rest.

    Args:
        outputs: open output nodes, one per view.
        pictures: (stops, variants, views, H, W).
        carriage: tells where the board is.
        places_mm: the board's displacement at each stop.
    """

    def __init__(
        self,
        outputs: Sequence[VideoOutput],
        pictures: Pictures,
        carriage: Carriage,
        places_mm: Sequence[float],
    ) -> None:
        self._outputs = outputs
        self._pictures = pictures
        self._carriage = carriage
        self._places_mm = np.asarray(places_mm)
        self._variants = itertools.cycle(range(VARIANTS))
        self._show(0)

    @contextmanager
    def deferred(self) -> Generator[None]:
        """Change to the next picture of this place, and keep it while a sample is taken."""
        away_mm = np.abs(self._places_mm - self._carriage.travelled_mm(time.monotonic()))
        assert away_mm.min() < 0.01, f"the board rests {away_mm.min()} mm beside the next stop"
        self._show(int(away_mm.argmin()))
        yield

    def _show(self, stop: int) -> None:
        shown = self._pictures[stop, next(self._variants)]
        for output, picture in zip(self._outputs, shown, strict=True):
            output.write(picture)


def places_mm(profile: Profile, halts: Sequence[Stop]) -> list[float]:
    """Return the board's displacement from machine zero at each stop."""
    assert isinstance(profile.stage, GrblStageConfig)
    zero_mm = profile.stage.distance_at_machine_zero_mm
    return [stop.distance_mm - zero_mm for stop in halts]


def load_pictures(folder: Path) -> Pictures:
    """Return what the host rendered."""
    return np.load(folder / "sweep.npy")


def _with_views(profile: Profile) -> dict[str, Any]:
    data = profile.model_dump(mode="json", exclude_unset=True)
    data["views"] = [view for view in data["views"] if view["name"] in VIEWS]
    errors = data["world"]["view_errors"]
    data["world"]["view_errors"] = {name: errors[name] for name in errors if name in VIEWS}
    return data
