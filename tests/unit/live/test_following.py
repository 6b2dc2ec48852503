"""The live loop: each multi-view is the hypothesis for the next."""

from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from types import TracebackType
from typing import Self

import numpy as np
import pytest
from rig_sim.clock import VirtualClock

from rig.errors import SlopeError
from rig.frames import Frame, MultiView
from rig.live.camera import DepthCamera
from rig.live.frame import DepthFrame
from rig.optics.nominal import nominal_optics
from rig.profile import Profile
from rig.profile.load import load_profile
from rig.stored import Run
from tests.support.lightfield import (
    Surface,
    disc,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
    true_slope_px,
)

SHAPE = (120, 160)


def depth_camera(profile: Profile, multiviews: list[MultiView]) -> DepthCamera:
    """A camera without a curve that streams given multi-views once."""
    names = tuple(view.name for view in profile.views)
    device = Sequence(names, multiviews)
    run = Run(profile, nominal_optics(profile))
    return DepthCamera(run, lambda: nullcontext((device, VirtualClock())))


def measured(profile: Profile, multiviews: list[MultiView]) -> list[DepthFrame]:
    with depth_camera(profile, multiviews) as camera:
        return list(camera)


class Sequence:
    """A camera that streams given multi-views once."""

    def __init__(self, views: tuple[str, ...], multiviews: list[MultiView]) -> None:
        self.views = views
        self._multiviews = multiviews

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass

    @property
    def identity(self) -> Mapping[str, str]:
        return {}

    @property
    def dropped(self) -> Mapping[str, int]:
        return {}

    def grab(self, timeout_s: float) -> MultiView:
        return self._multiviews[0]

    def stream(self) -> Iterator[MultiView]:
        yield from self._multiviews


def scene(wall_px: float, ball_px: float, left: bool) -> list[Surface]:
    centre = (50.0, 60.0) if left else (110.0, 60.0)
    wall, ball = (noise_texture(seed, mean=120.0, contrast=25.0, finest_px=2.0) for seed in (1, 2))
    return [
        Surface(plane(wall_px, per_u=0.005), wall, everywhere),
        Surface(plane(ball_px), ball, disc(centre, 30.0)),
    ]


def multiview(profile: Profile, surfaces: list[Surface], number: int) -> MultiView:
    x = np.array([view.x_steps for view in profile.views])
    y = np.array([view.y_steps for view in profile.views])
    images = expose(
        render_views(surfaces, SHAPE, x, y, supersample=2), noise=1.0, gain_spread=0.0, seed=number
    )
    return MultiView(
        tuple(
            Frame(view.name, image, timestamp_s=0.1 * number, sequence=number)
            for view, image in zip(profile.views, images, strict=True)
        )
    )


@pytest.mark.slow
def test_a_still_scene_stays_right_and_a_jump_is_right_again_in_the_second_frame():
    profile = load_profile("sim", ["slopes.range_px=[-8.0, 12.0]"])
    before, after = scene(-4.0, 6.0, left=True), scene(-2.0, 8.0, left=False)
    stream = [multiview(profile, before, n) for n in range(3)]
    stream += [multiview(profile, after, n) for n in range(3, 6)]
    frames = measured(profile, stream)
    bad = [
        float(np.mean(~(np.abs(m.slopes.slope_px - true_slope_px(truth, SHAPE)) <= 0.5)))
        for m, truth in zip(frames, [before] * 3 + [after] * 3, strict=True)
    ]
    assert max(bad[:3]) < 0.08
    assert bad[4] < 0.12
    assert bad[5] < 0.10
    assert [m.index for m in frames] == list(range(6))
    assert np.mean([m.valid_share for m in frames]) > 0.95


def test_a_frozen_view_is_left_out_and_named():
    profile = load_profile("sim", ["slopes.range_px=[-8.0, 12.0]"])
    before, after = scene(-4.0, 6.0, left=True), scene(-4.4, 5.5, left=True)
    stream = [multiview(profile, before, 0), multiview(profile, after, 1)]
    frozen = next(i for i in range(len(profile.views)) if i != profile.reference)
    frames = list(stream[1].frames)
    frames[frozen] = replace(frames[frozen], image=stream[0].frames[frozen].image)
    stream[1] = MultiView(tuple(frames))
    _, second = measured(profile, stream)
    assert [w for w in second.slopes.warnings if f"view {frozen} " in w and "repeats" in w]
    error = np.abs(second.slopes.slope_px - true_slope_px(after, SHAPE))
    assert float(np.mean(~(error <= 0.5))) < 0.12


@pytest.mark.slow
def test_a_view_off_its_place_is_named_once_and_followed():
    wide = "slopes.range_px=[-8.0, 12.0]"
    right, told = (
        load_profile("sim", [wide]),
        load_profile("sim", [wide, "views.left.y_steps=0.04"]),
    )
    still = scene(-4.0, 6.0, left=True)
    stream = [multiview(right, still, n) for n in range(3)]
    names = tuple(view.name for view in right.views)
    wrong = measured(told, stream)
    left = names.index("left")
    first, *others = (m.slopes for m in wrong)
    assert first.placement is not None
    assert first.placement.misplaced.tolist() == [name == "left" for name in names]
    assert first.placement.steps[left, 1] == pytest.approx(-0.04, abs=0.01)
    assert any(f"view {left} " in warning for warning in first.warnings)
    assert all(slopes.placement is None and not slopes.warnings for slopes in others)
    truth = true_slope_px(still, SHAPE)
    errors = [
        float(np.nanmedian(np.abs(run[-1].slopes.slope_px - truth)))
        for run in (wrong, measured(right, stream))
    ]
    assert errors[0] < 1.3 * errors[1]


@pytest.mark.slow
def test_a_frozen_reference_is_refused():
    profile = load_profile("sim", ["slopes.range_px=[-8.0, 12.0]"])
    stream = [multiview(profile, scene(-4.0, 6.0, left=True), n) for n in range(2)]
    frames = list(stream[1].frames)
    old = stream[0].frames[profile.reference].image
    frames[profile.reference] = replace(frames[profile.reference], image=old)
    stream[1] = MultiView(tuple(frames))
    with pytest.raises(SlopeError, match="bit for bit"):
        measured(profile, stream)


def test_skewed_multiviews_are_left_out_and_counted():
    profile = load_profile("sim", ["slopes.range_px=[-8.0, 12.0]"])
    good = multiview(profile, scene(-4.0, 6.0, left=True), 0)
    late = Frame("left", good.frames[1].image, timestamp_s=1.0, sequence=0)
    skewed = MultiView((good.frames[0], late, *good.frames[2:]))
    with depth_camera(profile, [good, skewed, good]) as camera:
        assert [frame.index for frame in camera] == [0, 1]
        assert camera.dropped == {"skew": 1}
    assert camera.dropped == {"skew": 1}
