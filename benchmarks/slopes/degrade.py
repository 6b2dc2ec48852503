"""What cameras and their files do to pictures, in the order in which it happens."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import Scene
from rig.epipolar import RectifiedViews

Views = NDArray[np.float32]
Random = np.random.Generator
Stage = Callable[[Views, Random], Views]


def unchanged(views: Views, rng: Random) -> Views:
    del rng
    return views


@dataclass(frozen=True)
class Degradation:
    """Light through a lens on a sensor, then what the camera and its file make of it."""

    name: str
    lens: Stage = unchanged
    """What changes the texture: defocus."""
    light: Stage = unchanged
    """What changes its brightness: vignette, exposure, tone curve."""
    noise_levels: float | None = None
    """White noise, grey levels, 1 sigma; None for that of the scene."""
    camera: Stage = unchanged
    """After noise and rounding, on values 0..255; rounded again."""
    place_error_steps: float = 0.0
    """Error of the positions told, 1 sigma in each direction."""


def degraded(scene: Scene, how: Degradation, seed: int = 5) -> Scene:
    """Expose a scene again, the worse way; same seed, same frames.

    Its clean views keep what the lens does to texture, for `textured`, but not how light differs.
    """
    rng = np.random.default_rng(seed)
    if scene.clean is None:
        light, gains = scene.views.images.astype(np.float32), np.ones(len(scene.views.images))
    else:
        gains = 1.0 + scene.gain_spread * rng.standard_normal(len(scene.clean))
        light = scene.clean
    clean = how.lens(light, rng)
    lit = (how.light(clean, rng) * gains[:, None, None]).astype(np.float32)
    noise = scene.noise_levels if how.noise_levels is None else how.noise_levels
    views = _rounded(lit + np.float32(noise) * rng.standard_normal(lit.shape, np.float32))
    frames = _rounded(how.camera(views, rng))
    reference = scene.views.reference
    told: list[NDArray[np.float64]] = []
    for steps in (scene.views.x_steps, scene.views.y_steps):
        errors = how.place_error_steps * rng.standard_normal(len(steps))
        errors[reference] = 0.0
        told.append(steps + errors)
    return replace(
        scene,
        views=RectifiedViews(frames.astype(np.uint8), told[0], told[1], reference),
        clean=clean,
        noise_levels=_noise_levels(frames[reference], lit[reference], clean[reference]),
    )


def _noise_levels(frame: Views, lit: Views, clean: Views) -> float:
    """What was added to a view, robustly, in the brightness of the clean one."""
    added = 1.4826 * float(np.median(np.abs(frame - lit)))
    return round(added * float(clean.std()) / max(float(lit.std()), 1e-3), 1)


def _rounded(views: NDArray[np.floating]) -> Views:
    return np.clip(np.rint(views), 0, 255).astype(np.float32)


def jpeg(quality: int) -> Stage:
    """The file format, at a quality of 0..100."""

    def stage(views: Views, rng: Random) -> Views:
        del rng
        out: list[NDArray[np.uint8]] = []
        for view in views.astype(np.uint8):
            _, coded = cv2.imencode(".jpg", view, [cv2.IMWRITE_JPEG_QUALITY, quality])
            out.append(np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8))
        return np.stack(out).astype(np.float32)

    return stage


def median(views: Views, rng: Random) -> Views:
    """The denoising of a camera: a median of 3 x 3 px."""
    del rng
    return np.stack([cv2.medianBlur(view.astype(np.uint8), 3) for view in views]).astype(np.float32)


def row_banding(levels: float) -> Stage:
    """An offset of its own for each row of each view, grey levels, 1 sigma."""

    def stage(views: Views, rng: Random) -> Views:
        rows = levels * rng.standard_normal((*views.shape[:2], 1), np.float32)
        return (views + rows).astype(np.float32)

    return stage


def hot_pixels(share: float) -> Stage:
    """Single pixels that are white."""

    def stage(views: Views, rng: Random) -> Views:
        return np.where(rng.random(views.shape) < share, np.float32(255.0), views)

    return stage


def defocus(sigma_px: float) -> Stage:
    """All views out of focus by a Gaussian."""

    def stage(views: Views, rng: Random) -> Views:
        del rng
        return np.stack([cv2.GaussianBlur(view, (0, 0), sigma_px) for view in views])

    return stage


def dark(levels: float) -> Stage:
    """An exposure so short that white is at so many levels."""
    return lambda views, _: (views * np.float32(levels / 255.0)).astype(np.float32)


def gamma(low: float, high: float) -> Stage:
    """A tone curve of its own for each view."""

    def stage(views: Views, rng: Random) -> Views:
        powers = rng.uniform(low, high, len(views)).astype(np.float32)[:, None, None]
        return (255.0 * np.power(np.clip(views, 0, None) / 255.0, powers)).astype(np.float32)

    return stage


def vignette(low: float, high: float, off_px: float, *, alike: bool = False) -> Stage:
    """Light that falls with the squared distance from a centre near that of the picture.

    Args:
        low: least share that is lost half a diagonal from the centre.
        high: largest.
        off_px: the centres lie at up to so much beside the middle, in both directions.
        alike: all views have the first one's.
    """

    def stage(views: Views, rng: Random) -> Views:
        height, width = views.shape[1:]
        rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
        lost = rng.uniform(low, high, len(views))
        centres = rng.uniform(-off_px, off_px, (len(views), 2))
        out = np.empty_like(views)
        for view, image in enumerate(views):
            k = 0 if alike else view
            u = columns - np.float32(0.5 * (width - 1) + centres[k, 0])
            v = rows - np.float32(0.5 * (height - 1) + centres[k, 1])
            share = np.float32(4.0 * lost[k] / (width**2 + height**2))
            out[view] = image * (1 - share * (u**2 + v**2))
        return out

    return stage


def without_view(kind: str) -> Stage:
    """The last view is `black`, `white`, a `copy` of the first, or `swapped` with the second."""

    def stage(views: Views, rng: Random) -> Views:
        del rng
        out = views.copy()
        match kind:
            case "black":
                out[-1] = 0.0
            case "white":
                out[-1] = 255.0
            case "swapped":
                out[[1, -1]] = out[[-1, 1]]
            case _:
                raise ValueError(f"no such fault of a view: {kind}")
        return out

    return stage


def copied(reference: int) -> Stage:
    """The last view shows what the reference view shows, to the bit."""

    def stage(views: Views, rng: Random) -> Views:
        del rng
        out = views.copy()
        out[-1] = out[reference]
        return out

    return stage
