"""When a camera on a slider rests, and what its light does: against rings in closed form."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from rig_sim.clock import VirtualClock

from rig.check.items import Item
from rig.check.scans import (
    Ringing,
    judge_blur,
    judge_rest,
    judge_scans,
    judge_settle,
    watch_arrival,
)
from rig.errors import DeviceLostError
from rig.frames import Frame, MultiView
from rig.profile import ScanCameraConfig
from rig.profile.load import load_profile
from rig.scan import Scan, ScanFacts, Take

EXPOSURE_S = 0.01


def config(settle_s: float = 2.0) -> ScanCameraConfig:
    found = load_profile("sim-scan", [f"camera.settle_s={settle_s}"]).camera
    assert isinstance(found, ScanCameraConfig)
    return found


class Shaken:
    """A camera whose picture is a wave that lies elsewhere at every time."""

    views = ("camera",)
    identity: Mapping[str, str] = {}
    dropped: Mapping[str, int] = {}

    def __init__(
        self, right_px: Callable[[float], float], exposure_s: float | None = EXPOSURE_S
    ) -> None:
        self.clock = VirtualClock()
        self._right_px = right_px
        self._exposure_s = exposure_s

    def grab(self, timeout_s: float) -> MultiView:
        del timeout_s
        self.clock.sleep_s(0.01)
        at_s = self.clock.now_s()
        y, x = np.mgrid[0:60, 0:80].astype(np.float64)
        light = 120 + 90 * np.sin((x - self._right_px(at_s)) / 5.0) * np.cos(y / 7.0)
        image = np.rint(50.0 * light).astype(np.uint16)
        return MultiView((Frame("camera", image, at_s, 0, self._exposure_s),))


def ringing(times_s: list[float], right_px: list[float]) -> Ringing:
    shift = np.stack([np.array(right_px), np.zeros(len(right_px))], axis=1)
    return Ringing(np.array(times_s), shift, np.array([0.5, *[1.0] * (len(times_s) - 1)]))


def test_rest_begins_after_the_last_picture_beyond_the_limit():
    found = ringing([0.1, 0.2, 0.3, 0.4], [0.5, 0.01, -0.2, 0.05])
    assert found.rest_s(0.1) == 0.4
    assert found.rest_s(0.6) == 0.0
    assert found.rest_s(0.04) is None


def test_speed_is_that_between_pictures_from_a_time_on():
    found = ringing([0.1, 0.2, 0.3, 0.5], [9.0, 1.0, 1.5, 1.9])
    assert found.speed_px_s(0.2) == pytest.approx(5.0)
    assert found.speed_px_s(0.3) == pytest.approx(2.0)
    assert found.speed_px_s(0.5) == 0.0


def test_a_ring_is_followed_to_a_hundredth_of_a_pixel():
    def right_px(at_s: float) -> float:
        return 0.4 * np.exp(-at_s / 0.5) * np.sin(2 * np.pi * 3.0 * at_s)

    camera = Shaken(right_px)
    found = watch_arrival(camera, camera.clock, 6.0, 1.0)  # pyright: ignore[reportArgumentType]
    expected = [right_px(t) for t in found.times_s]
    np.testing.assert_allclose(found.shift_px[:, 0], expected, atol=0.01)
    np.testing.assert_allclose(found.shift_px[:, 1], 0.0, atol=0.01)
    # 0.4 exp(-t / 0.5) is 0.025 at 1.39 s; the last beat before it is seen.
    rest_s = found.rest_s(0.025)
    assert rest_s is not None
    assert 1.0 < rest_s < 1.39 + 0.1


@pytest.mark.parametrize(
    ("settle_s", "status", "advice"),
    [
        (2.0, "pass", ""),
        (1.4, "pass", ""),
        (1.3, "warn", "set camera.settle_s = 1.4"),
        (1.0, "warn", "set camera.settle_s = 1.4"),
        (0.9, "fail", "set camera.settle_s = 1.4"),
    ],
)
def test_settling_is_judged_with_a_margin(settle_s: float, status: str, advice: str):
    item = judge_settle(config(settle_s), ringing([0.5, 1.0, 1.5], [0.3, 0.0, 0.0]))
    assert (item.name, item.status, item.advice) == ("settle", status, advice)
    assert item.numbers["rest_s"] == 1.0
    assert item.numbers["needed_s"] == pytest.approx(1.0 / 0.75)
    assert item.numbers["sharpness"] == 0.5


def test_a_picture_that_never_rests_fails():
    item = judge_settle(config(), ringing([0.5, 1.0], [0.3, 0.3]))
    assert item.status == "fail"
    assert "does not come to rest within 0.025 px in 1.0 s" in item.found


@pytest.mark.parametrize(("step_px", "status"), [(0.4, "pass"), (0.6, "warn"), (1.2, "fail")])
def test_blur_is_speed_times_exposure(step_px: float, status: str):
    item = judge_blur(config(1.0), ringing([1.0, 1.1], [0.0, step_px]), EXPOSURE_S)
    assert item.numbers["speed_px_s"] == pytest.approx(step_px / 0.1)
    assert item.numbers["blur_px"] == pytest.approx(step_px / 0.1 * EXPOSURE_S)
    assert item.status == status


class Moved(Shaken):
    """The same on a stage that notes where it went."""

    def __init__(self, fails: bool = False, exposure_s: float | None = EXPOSURE_S) -> None:
        super().__init__(lambda at_s: 0.0, exposure_s)
        self.went: list[tuple[float, ...]] = []
        self.row_mm = ((-40.0,), (0.0,), (30.0,))
        self.carried = self
        self._fails = fails

    def go(self, places_mm: tuple[float, ...]) -> tuple[float, ...]:
        if self._fails:
            raise DeviceLostError("stage test", "gone", advice="look for it")
        self.went.append(places_mm)
        return places_mm


def judged(camera: Moved) -> list[Item]:
    return list(judge_rest(config(), camera, camera.clock))  # pyright: ignore[reportArgumentType]


def test_the_longest_move_is_watched():
    camera = Moved()
    assert [(item.name, item.status) for item in judged(camera)] == [
        ("settle", "pass"),
        ("blur", "pass"),
    ]
    assert camera.went == [(-40.0,), (0.0,)]


def test_a_camera_without_exposure_times_leaves_blur_open():
    assert [item.status for item in judged(Moved(exposure_s=None))] == ["pass", "skip"]


def test_a_stage_that_fails_is_told():
    (item,) = judged(Moved(fails=True))
    assert (item.name, item.status, item.advice) == ("settle", "fail", "look for it")


@pytest.mark.parametrize(("gain", "status"), [(1.01, "pass"), (1.05, "warn"), (1.2, "fail")])
def test_light_is_judged_by_its_largest_change(gain: float, status: str):
    takes = tuple(Take("a", "view", 0.0, None, 0.0, 0, None, g) for g in (1.0, gain))
    multiview = MultiView((), scan=Scan(ScanFacts(takes)))
    items = list(judge_scans([multiview]))
    assert [item.name for item in items] == ["light", "skew", "rate", "drops"]
    assert items[0].status == status
    assert items[0].numbers["drift_pct"] == pytest.approx(100.0 * (gain - 1.0))
    assert [item.name for item in judge_scans([])] == ["skew", "rate", "drops"]
