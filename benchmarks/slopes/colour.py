"""Colour against luminance: texture of one luminance, tinted texture, and hci-dino in colour."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from rig_drivers.v4l2.colour import to_colour
from rig_drivers.v4l2.pixels import to_grey

from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.scenes import DENSE, Layout, Recipe, Scene, surfaces_of
from benchmarks.slopes.scores import score
from rig.epipolar import RectifiedViews, estimate_slopes
from tests.support.lightfield import (
    Field,
    Surface,
    expose,
    noise_texture,
    render_views,
    true_slope_px,
)

Pixels = NDArray[np.uint8]
Paint = Callable[[Field, int, int], Field]

_LUMINANCE = np.array([0.299, 0.587, 0.114])
_SMALL = Layout(DENSE.x_steps[::2], DENSE.y_steps[::2], (160, 160), DENSE.range_px)
_RECIPES = (
    Recipe("rich", 10, _SMALL),
    Recipe("weak texture", 13, _SMALL, contrast=6.0, finest_px=2.5),
)


def colour() -> None:
    """Print what colour brings over luminance: of three whole channels, and as cameras give it."""
    _head()
    for scene in _scenes():
        luminance = np.rint(scene.views.images @ _LUMINANCE).astype(np.uint8)
        _compare(scene, scene.name, luminance, scene.views.images)
    print("\nas cameras give it: grey and colour of one read-out")
    _head()
    for scene in _rendered():
        for kind, pixel_format, sent in (("mosaic", "RGGB", _mosaic), ("4:2:2", "YUYV", _yuyv)):
            frames = [_read(sent(picture), pixel_format) for picture in scene.views.images]
            grey, coloured = (np.stack(one) for one in zip(*frames, strict=True))
            _compare(scene, f"{kind}, {scene.name}", grey, coloured)


def _head() -> None:
    print(
        f"{'scene':40} {'frames':10} {'BP.01':>6} {'BP.03':>6} {'BP.07':>6} {'MSEx100':>8} "
        f"{'edge':>6} {'sigma':>6} {'CPU s':>6}"
    )


def _compare(
    scene: Scene, title: str, grey: NDArray[np.uint8], coloured: NDArray[np.generic]
) -> None:
    for name, images in (("grey", grey), ("colour", coloured)):
        views = replace(scene.views, images=images)
        began_s = time.process_time()
        found = estimate_slopes(views, scene.range_px)
        took_s = time.process_time() - began_s
        s = score(found.slope_px, found.sigma_px, scene.slope_px, scene.range_px, scene.border_px)
        print(
            f"{title:40} {name:10} {s.bad_001:6.2f} {s.bad_003:6.2f} {s.bad_007:6.2f} "
            f"{s.mse_100:8.3f} {s.edge_bad:6.2f} {s.sigma_ratio:6.2f} {took_s:6.2f}",
            flush=True,
        )


def _mosaic(picture: Pixels) -> Pixels:
    """What a sensor with a mosaic of colours counts of red, green and blue (H, W, 3)."""
    mosaic = picture[..., 1].copy()
    mosaic[::2, ::2], mosaic[1::2, 1::2] = picture[::2, ::2, 0], picture[1::2, 1::2, 2]
    return mosaic


def _yuyv(picture: Pixels) -> Pixels:
    """The picture as a webcam sends it: every two pixels share their colour (BT.601)."""
    whole = cv2.cvtColor(picture, cv2.COLOR_RGB2YUV_YUY2)
    return np.asarray(whole, np.uint8)


def _read(sent: Pixels, pixel_format: str) -> tuple[Pixels, Pixels]:
    """Grey and colour as the driver of V4L2 cameras reads them."""
    height, width = sent.shape[:2]
    data = np.ascontiguousarray(sent).reshape(-1)
    agreed = {"width_px": width, "height_px": height, "bytes_per_line": data.size // height}
    grey = to_grey(data, pixel_format, **agreed)
    coloured = to_colour(data, pixel_format, **agreed)
    if coloured is None:
        raise ValueError(f"{pixel_format} has no colour")
    return np.asarray(grey, np.uint8), coloured


def _scenes() -> Iterator[Scene]:
    yield from _rendered()
    folder = dino_folder()
    if folder is not None:
        for noise in (0.0, 3.0):
            yield load_dino(folder, noise, in_colour=True)


def _rendered() -> Iterator[Scene]:
    for recipe in _RECIPES:
        yield _render(recipe, "one luminance, ", _even)
        yield _render(recipe, "tinted, ", _tinted)


def _render(recipe: Recipe, kind: str, paint: Paint) -> Scene:
    layout, surfaces = recipe.layout, list(surfaces_of(recipe))
    frames: list[NDArray[np.uint8]] = []
    for channel in range(3):
        painted = [
            Surface(surface.slope_px, paint(surface.grey, k, channel), surface.covers)
            for k, surface in enumerate(surfaces)
        ]
        exact = render_views(painted, layout.shape, layout.x_steps, layout.y_steps, supersample=2)
        frames.append(expose(exact, noise=recipe.noise, gain_spread=0.02, seed=5 + channel))
    views = RectifiedViews(np.stack(frames, axis=-1), layout.x_steps, layout.y_steps, 0)
    truth = true_slope_px(surfaces, layout.shape)
    return Scene(kind + recipe.name, views, truth, layout.range_px, border_px=0)


def _even(grey: Field, surface: int, channel: int) -> Field:
    """Red against green, so that luminance is the same everywhere."""
    del surface
    mean = (120.0, 110.0, 90.0)[channel]
    share = (1.0, -_LUMINANCE[0] / _LUMINANCE[1], 0.0)[channel]
    return lambda u, v: mean + share * (grey(u, v) - 120.0)


def _tinted(grey: Field, surface: int, channel: int) -> Field:
    """The texture in a tint of the surface's own, and a little texture of each channel's own."""
    tint = np.random.default_rng(100 + surface).uniform(0.4, 1.05, 3)[channel]
    own = noise_texture(9000 + 10 * surface + channel, mean=0.0, contrast=6.0, finest_px=2.0)
    return lambda u, v: tint * grey(u, v) + own(u, v)
