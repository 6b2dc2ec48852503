"""Play of a slider from the picture, against play that is known."""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from rig_sim.clock import VirtualClock

from rig.check.items import Item
from rig.check.picture_shift import shift_px, smooth
from rig.check.slider_play import judge_play, returns
from rig.errors import DeviceLostError
from rig.frames import Frame, GreyImage, MultiView
from rig.profile import Profile
from rig.profile.load import load_profile

PX_PER_MM = -0.8


def waves(right_px: float, down_px: float = 0.0, gain: float = 1.0) -> GreyImage:
    y, x = np.mgrid[0:90, 0:120].astype(np.float64)
    light = 120 + 70 * np.sin((x - right_px) / 7.0) * np.cos((y - down_px) / 8.0)
    return np.rint(200.0 * gain * light).astype(np.uint16)


def frame(image: GreyImage) -> Frame:
    return Frame("camera", image, 0.0, 0, 0.01)


def test_a_shift_is_found_in_other_light():
    rest, moved = smooth(frame(waves(0.0))), smooth(frame(waves(0.3, -0.2, gain=1.03)))
    assert shift_px(moved, rest) == pytest.approx((0.3, -0.2), abs=0.005)
    assert shift_px(rest, rest) == (0.0, 0.0)


def test_shifts_become_mm():
    found = returns([0.0, 0.2, 0.1], [1.0, 1.2, 1.1], -2.0)
    assert found.play_mm == pytest.approx(-0.5)
    assert found.spread_mm == pytest.approx(0.05)
    # Of two means of three, with four degrees of freedom.
    assert found.play_sigma_mm == pytest.approx(0.05 * math.sqrt(2.0 / 3.0 * 2.0))
    assert returns([0.0] * 3, [0.0] * 4, 1.0).play_mm == 0.0


class Loose:
    """A camera on a slider that stands farther where it came from the far side."""

    views = ("camera",)
    identity: Mapping[str, str] = {}
    dropped: Mapping[str, int] = {}

    def __init__(self, play_mm: float, px_per_mm: float = PX_PER_MM) -> None:
        self.clock = VirtualClock()
        self.row_mm = ((-40.0,), (0.0,), (40.0,))
        self.carried = self
        self._play_mm = play_mm
        self._px_per_mm = px_per_mm
        self._at_mm = self._true_mm = 0.0

    def go(self, places_mm: tuple[float, ...]) -> tuple[float, ...]:
        (wanted_mm,) = places_mm
        self._true_mm = wanted_mm + (self._play_mm if wanted_mm < self._at_mm else 0.0)
        self._at_mm = wanted_mm
        return places_mm

    def grab(self, timeout_s: float) -> MultiView:
        del timeout_s
        return MultiView((frame(waves(self._px_per_mm * self._true_mm)),))


def judged(camera: Loose, *more: str) -> Item:
    profile: Profile = load_profile("sim-scan", more)
    return judge_play(profile, camera, camera.clock)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(("play_mm", "status"), [(0.02, "pass"), (0.04, "warn"), (0.1, "fail")])
def test_play_is_measured_and_judged_by_the_depth_that_it_costs(play_mm: float, status: str):
    item = judged(Loose(play_mm))  # 0.05 % of 80 mm: 40 um, for half the play
    assert (item.name, item.status) == ("play", status)
    assert item.numbers["play_mm"] == pytest.approx(play_mm, rel=0.03)
    assert "allowed 40 um" in item.found


def test_a_picture_that_does_not_shift_tells_nothing():
    assert judged(Loose(0.0, px_per_mm=0.0)).status == "skip"


def test_a_reference_at_the_end_of_the_row_has_one_side():
    camera = Loose(0.02)
    camera.row_mm = ((0.0,), (0.0,), (40.0,))
    assert judged(camera).status == "skip"


def test_a_slider_that_fails_is_told():
    class Gone(Loose):
        def go(self, places_mm: tuple[float, ...]) -> tuple[float, ...]:
            raise DeviceLostError("stage test", f"gone at {places_mm}", advice="look for it")

    item = judged(Gone(0.0))
    assert (item.name, item.status, item.advice) == ("play", "fail", "look for it")
