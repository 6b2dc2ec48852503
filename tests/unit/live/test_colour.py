"""Colour from the camera to the depth frame."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.errors import SlopeError
from rig.frames import Frame, MultiView
from rig.live.frame import DepthFrame
from rig.live.measure import DepthMeter, rectified
from rig.live.taking import Taken
from rig.optics.calibrated import CalibratedOptics, calibrated_optics
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.stored import Run
from tests.support.cameras import SMALL, SmallRig
from tests.support.geometry import true_geometry
from tests.support.lightfield import (
    Array,
    Surface,
    everywhere,
    expose,
    noise_texture,
    plane,
    render_views,
)

SHAPE = (64, 96)


def taken(multiview: MultiView) -> Taken:
    return Taken(multiview, age_s=0.0, time_ns=5, handed_over_s=0.0)


def measure(run: Run, multiview: MultiView) -> DepthFrame:
    return DepthMeter(run).measure(rectified(run, taken(multiview)), follows=False)


@cache
def red_against_green(slope_px: float) -> MultiView:
    """A plane whose texture is of one luminance: what red gains, green loses."""
    profile = load_profile("sim")
    x = np.array([view.x_steps for view in profile.views])
    y = np.array([view.y_steps for view in profile.views])
    grey = noise_texture(1, mean=0.0, contrast=25.0, finest_px=2.0)
    shares = ((120.0, 1.0), (110.0, -0.299 / 0.587), (90.0, 0.0))
    channels: list[np.ndarray] = []
    for number, (mean, share) in enumerate(shares):

        def paint(u: Array, v: Array, mean: float = mean, share: float = share) -> Array:
            return mean + share * grey(u, v)

        surface = Surface(plane(slope_px), paint, everywhere)
        exact = render_views([surface], SHAPE, x, y, supersample=2)
        channels.append(expose(exact, noise=1.0, gain_spread=0.0, seed=number))
    colours = np.stack(channels, axis=-1).astype(np.uint8)
    greys = np.rint(colours @ np.array([0.299, 0.587, 0.114])).astype(np.uint8)
    return MultiView(
        tuple(
            Frame(view.name, image, 1.0, 1, colour=colour)
            for view, image, colour in zip(profile.views, greys, colours, strict=True)
        )
    )


def right_share(frame: DepthFrame, slope_px: float) -> float:
    return float(np.mean(np.abs(frame.slopes.slope_px - slope_px) < 0.3))


@pytest.mark.slow
def test_slopes_of_colour_see_texture_that_is_of_one_brightness():
    multiview = red_against_green(2.0)
    found: dict[bool, DepthFrame] = {}
    for is_wanted in (False, True):
        wanted = f"slopes.colour={str(is_wanted).lower()}"
        profile = load_profile("sim", ["slopes.range_px=[-4.0, 6.0]", wanted])
        found[is_wanted] = measure(Run(profile, nominal_optics(profile)), multiview)
    assert right_share(found[True], 2.0) > 0.95
    assert right_share(found[False], 2.0) < 0.5
    reference = multiview.frames[load_profile("sim").reference]
    for frame in found.values():
        assert frame.colour is not None
        assert reference.colour is not None
        assert np.array_equal(frame.colour, reference.colour)
        assert np.array_equal(frame.image, reference.image)
        assert not frame.colour.flags.writeable


def test_slopes_of_colour_are_refused_where_a_view_is_grey():
    profile = load_profile("sim", ["slopes.colour=true"])
    multiview = red_against_green(2.0)
    grey = replace(multiview.frames[1], colour=None)
    some = replace(multiview, frames=(multiview.frames[0], grey, *multiview.frames[2:]))
    with pytest.raises(SlopeError, match=rf"{grey.view} of 5 views came in grey") as told:
        rectified(Run(profile, nominal_optics(profile)), taken(some))
    assert "remove slopes.colour" in told.value.advice


def test_rectified_colour_lies_on_the_rectified_picture():
    small = SmallRig(name="sim-real", overrides=(*SMALL, "camera.colour=true"))
    geometry = true_geometry(small.profile, small.world.moment(0.0))
    optics = calibrated_optics(small.profile, geometry, 3)
    with small.camera() as camera:
        multiview = camera.grab(5.0)
    reference = small.profile.reference
    # Each channel is the grey picture at a share of its light, so that it must come to lie on it.
    grey = multiview.frames[reference].image
    colour = np.stack([grey, grey // 2, 255 - grey], axis=-1)
    moved = optics.reference_picture(colour)
    assert moved.dtype == np.uint8
    assert moved.shape == (*optics.rectification.shape, 3)
    exact = optics.pictures(multiview.images)[reference].astype(int)
    off = np.abs(moved[..., 0].astype(int) - exact)
    assert off.max() == 0
    assert np.array_equal(optics.reference_picture(grey), moved[..., 0])
    assert np.abs(255 - moved[..., 0].astype(int) - moved[..., 2]).max() <= 1
    with pytest.raises(SlopeError, match="16 x 9 px given, the calibration is of 160 x 100 px"):
        optics.reference_picture(np.zeros((9, 16, 3), np.uint8))
    run = Run(small.profile, optics)
    given = rectified(run, taken(multiview))
    assert given.colour is not None
    taken_colour = multiview.frames[reference].colour
    assert taken_colour is not None
    assert np.array_equal(given.colour, optics.reference_picture(taken_colour))


def test_rectified_views_of_colour_are_the_channels_each_by_itself():
    small = SmallRig(name="sim-real", overrides=(*SMALL, "camera.colour=true"))
    geometry = true_geometry(small.profile, small.world.moment(0.0))
    optics: CalibratedOptics = calibrated_optics(small.profile, geometry, None)
    with small.camera() as camera:
        colours = [frame.colour for frame in camera.grab(5.0).frames]
    pictures = [colour for colour in colours if colour is not None]
    assert len(pictures) == 5
    views = optics.views(pictures)
    assert views.is_colour
    for channel in range(3):
        alone = optics.views([picture[..., channel] for picture in pictures])
        assert np.array_equal(views.images[..., channel], alone.images)
    assert views.noise is not None
    assert views.noise.read_noise_levels < 3.0


def test_the_noise_of_the_profile_is_that_of_grey_values():
    told = ["camera.noise.read_noise_levels=0.8", "camera.noise.electrons_per_level=30.0"]
    profile = load_profile("sim", told)
    multiview = red_against_green(2.0)
    optics = nominal_optics(profile)
    assert optics.views(multiview.images).noise is not None
    colours = [frame.colour for frame in multiview.frames if frame.colour is not None]
    assert optics.views(colours).noise is None


def test_a_region_and_coarser_maps_have_their_part_of_the_colour():
    multiview = red_against_green(2.0)
    wanted = ["slopes.range_px=[-4.0, 6.0]", "processing.decimation=2"]
    profile = load_profile("sim", [*wanted, "processing.roi_px=[8, 4, 40, 32]"])
    frame = measure(Run(profile, nominal_optics(profile)), multiview)
    assert frame.colour is not None
    assert frame.colour.shape == (16, 20, 3)
    whole = multiview.frames[profile.reference].colour
    assert whole is not None
    squares = whole[4:36, 8:48].reshape(16, 2, 20, 2, 3).astype(np.float64)
    assert np.array_equal(frame.colour, np.rint(squares.mean(axis=(1, 3))))


def test_the_simulated_camera_is_grey_unless_it_is_asked():
    plain, tinted = (
        SmallRig(overrides=(*SMALL, f"camera.colour={wanted}")) for wanted in ("false", "true")
    )
    with plain.camera() as camera:
        grey = camera.grab(5.0)
    with tinted.camera() as camera:
        colour = camera.grab(5.0)
    for one, other in zip(grey.frames, colour.frames, strict=True):
        assert one.colour is None
        assert other.colour is not None
        assert np.array_equal(one.image, other.image), "colour changes nothing that is measured"
        red, green, blue = (float(other.colour[..., c].mean()) for c in range(3))
        black = small_black(plain)
        assert red == pytest.approx(float(one.image.mean()), abs=0.5)
        assert (green - black) / (red - black) == pytest.approx(0.8, abs=0.02)
        assert (blue - black) / (red - black) == pytest.approx(0.5, abs=0.02)


def small_black(rig: SmallRig) -> float:
    return rig.world.config.sensor.black_level
