"""A camera whose one picture holds all views is as good as one with a picture for each.

Both look at the same simulated world. The one renders its views as always; the other one's are set
side by side into one picture, which is taken apart again as that of a stereo webcam is.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from rig_drivers.split import SplitCamera
from rig_sim.camera import SimCamera
from rig_sim.world import World

from rig.frames import MultiView
from rig.profile import PartConfig, SimCameraConfig, regions_in
from rig.profile.parts import picture_of
from tests.support.command import Command
from tests.support.small_sim import SMALL_PAIR, as_options
from tests.support.stores import sqlite_url

BY_HAND = as_options((*SMALL_PAIR, "world.hand.hold_s=0.7", "world.hand.move_s=0.05"))
SHORT = ("--at-mm", "450,520,600,700,850,1000", "--samples", "1", *as_options(SMALL_PAIR))
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


class SideBySide:
    """All views of the simulated camera in one picture, as one view."""

    def __init__(self, camera: SimCamera) -> None:
        self._camera = camera
        self.pictures = 0

    def __enter__(self) -> Self:
        self._camera.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.__exit__()

    @property
    def identity(self) -> Mapping[str, str]:
        return self._camera.identity

    @property
    def views(self) -> tuple[str, ...]:
        return ("all",)

    @property
    def dropped(self) -> Mapping[str, int]:
        return self._camera.dropped

    def grab(self, timeout_s: float) -> MultiView:
        return self._together(self._camera.grab(timeout_s))

    def stream(self) -> Iterator[MultiView]:
        return map(self._together, self._camera.stream())

    def _together(self, multiview: MultiView) -> MultiView:
        self.pictures += 1
        whole = np.hstack([frame.image for frame in multiview.frames])
        return replace(multiview, frames=(replace(multiview.frames[0], view="all", image=whole),))


@pytest.fixture
def stereo_webcam(monkeypatch: pytest.MonkeyPatch) -> list[SideBySide]:
    """From here on every simulated camera is one device with one picture."""
    made: list[SideBySide] = []

    def one_device(config: SimCameraConfig, world: World) -> SplitCamera:
        camera = SimCamera(config, world)
        made.append(SideBySide(camera))
        parts = {
            view: PartConfig(layout="side-by-side", place=place)
            for place, view in enumerate(camera.views, start=1)
        }
        return SplitCamera(made[-1], regions_in(parts, picture_of("side-by-side", config.size_px)))

    monkeypatch.setattr("rig_sim.camera.SimCamera", one_device)
    return made


def swept(rig: Command, folder: Path) -> dict[str, Any]:
    folder.mkdir()
    database = ("--db", sqlite_url(folder))
    calibrated = rig("calibrate", "sim", "--pictures", 4, "--lens", "none", *BY_HAND, *database)
    assert calibrated.code in (0, 3), calibrated.err
    answer = rig("sweep", "sim", *SHORT, "--calibration", "1", *database, "--json")
    assert answer.code in (0, 3), answer.err
    return answer.json


@pytest.fixture
def by_two_devices(rig: Command, tmp_path: Path) -> dict[str, Any]:
    """What a camera with a picture for each view gives."""
    return swept(rig, tmp_path / "apart")


def test_it_calibrates_and_sweeps_to_the_very_same_curve(
    rig: Command,
    tmp_path: Path,
    by_two_devices: dict[str, Any],
    stereo_webcam: list[SideBySide],
):
    together = swept(rig, tmp_path / "together")
    assert sum(camera.pictures for camera in stereo_webcam) >= 10
    for key in ("points", "holdout"):
        assert together[key] == by_two_devices[key]
    assert together["curve"]["params"] == by_two_devices["curve"]["params"]
    assert together["holdout"]["max_pct"] < 0.3
