"""Noise that files and denoisers make alike: between views, between pixels, in sums over windows.

What a codec leaves out is a part of the texture, and much the same part in all views. It moves the
edges of a whole window to one side although the noise of neighbouring pixels hardly correlates.
Frames less their clean ones are their noise: no estimate is used for it.
"""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.asked import Asked
from benchmarks.slopes.degrade import Degradation, degraded, jpeg, median
from benchmarks.slopes.dino import dino_folder, load_dino
from benchmarks.slopes.scenes import DENSE, Recipe, Scene, make_scene
from rig.epipolar import estimate_slopes

_WINDOWS_PX = (1, 5, 9, 13)
_TEXTURED_SHARE, _FIFTHS, _AWAY_PX, _BORDER_PX = 0.7, 5, 11, 20
_BAD_PX, _JUMP_PX = 0.07, 0.3
Map = NDArray[np.float32]


@dataclass(frozen=True)
class Alike:
    """Noise of the views of a row."""

    sigma_levels: float
    between_views: tuple[float, float]
    """Correlation at one point of the scene, of neighbouring and of the outermost views."""
    between_pixels: float
    """Correlation of neighbours in one view."""
    windows: tuple[float, ...]
    """Error of the slope of windows over what the views of a line disagree by, for independent
    noise: the factor by which sigma is too small."""


def alike(asked: Asked) -> None:
    """Print noise and its correlations, then error over sigma by texture, for each degradation."""
    print(
        f"{'scene: degradation':32} sigma  views next, outermost  pixels   "
        f"error of windows of {_WINDOWS_PX} px over independent noise"
    )
    for name, scene in _scenes(asked):
        clean = scene.views.images if scene.clean is None else scene.clean
        for how in _degradations():
            if not asked.wants(f"{name}: {how.name}"):
                continue
            worse = degraded(scene, how)
            found = measure_alike(worse, clean.astype(np.float32))
            print(
                f"{name + ': ' + how.name:32} {found.sigma_levels:5.2f}  "
                f"{found.between_views[0]:5.2f} {found.between_views[1]:5.2f}  "
                f"{found.between_pixels:5.2f}   {' '.join(f'{w:.2f}' for w in found.windows)}"
            )
            for line in _by_texture(worse, clean[scene.views.reference].astype(np.float32)):
                print(f"{'':32} {line}", flush=True)


def measure_alike(scene: Scene, clean: Map) -> Alike:
    """Measure the noise of a dense scene's row of views, whose clean views (V, H, W) are given."""
    views = scene.views
    row = [i for i in np.argsort(views.x_steps) if abs(views.y_steps[i]) < 1e-9]
    steps = views.x_steps[row]
    slope = np.nan_to_num(scene.slope_px).astype(np.float32)
    # Gains of the views are no noise.
    shown = [_noise(views.images[i].astype(np.float32), clean[i]) for i in row]
    along = np.stack(
        [_at_lines(n, slope, float(step)) for n, step in zip(shown, steps, strict=True)]
    )
    inner = along[:, _BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    likeness = np.asarray(np.corrcoef(inner.reshape(len(row), -1)))
    own = shown[row.index(views.reference)]
    beside = float(np.corrcoef(own[:, 1:].ravel(), own[:, :-1].ravel())[0, 1])
    centred = (steps - steps.mean()).astype(np.float32)
    turn = np.tensordot(centred, inner, (0, 0)) / float(centred @ centred)
    left = inner - inner.mean(axis=0) - centred[:, None, None] * turn
    tilt = cv2.Sobel(clean[views.reference], cv2.CV_32F, 1, 0, ksize=1, scale=0.5)
    tilt = np.asarray(tilt, np.float32)[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    power = np.asarray((left**2).sum(axis=0) / (len(row) - 2), np.float32)
    scatter = np.asarray(cv2.blur(power, (_AWAY_PX, _AWAY_PX)), np.float32)
    windows: list[float] = []
    for side in _WINDOWS_PX:
        power = _summed(tilt * tilt, side)
        told = _summed(tilt * turn, side) * float(centred @ centred) ** 0.5
        some = (power > np.quantile(power, 1.0 - _TEXTURED_SHARE)) & (scatter > 0)
        windows.append(_spread(told[some] / np.sqrt(power[some] * scatter[some])))
    return Alike(
        float(own.std()),
        (float(np.diag(likeness, 1).mean()), float(likeness[0, -1])),
        beside,
        tuple(windows),
    )


def _by_texture(scene: Scene, clean: Map) -> list[str]:
    """Bad pixels and error over sigma in fifths of texture, away from jumps."""
    found = estimate_slopes(scene.views, scene.range_px)
    true = scene.slope_px.astype(np.float32)
    error = found.slope_px - true
    down, right = np.gradient(clean)
    power = np.asarray(down * down + right * right, np.float32)
    texture = np.sqrt(np.asarray(cv2.blur(power, (13, 13)), np.float32))
    around = np.ones((_AWAY_PX, _AWAY_PX), np.uint8)
    used = (cv2.dilate(true, around) - cv2.erode(true, around)) < _JUMP_PX
    used[:_BORDER_PX] = used[-_BORDER_PX:] = False
    used[:, :_BORDER_PX] = used[:, -_BORDER_PX:] = False
    limits = np.quantile(texture[used], np.linspace(0, 1, _FIFTHS + 1))
    lines: list[str] = []
    for low, high in pairwise(limits.tolist()):
        here = used & (texture >= low) & (texture <= high)
        known = here & np.isfinite(error)
        bad = 100.0 * float(np.mean(~(np.abs(error[here]) <= _BAD_PX)))
        ratio = _spread(error[known] / found.sigma_px[known])
        lines.append(
            f"gradients of {low:4.1f}-{high:4.1f} levels/px: bad {bad:4.1f} %, z {ratio:.2f}"
        )
    return lines


def _noise(frame: Map, clean: Map) -> Map:
    gain, offset = np.polyfit(clean.ravel(), frame.ravel(), 1)
    return np.asarray(frame - (gain * clean + offset), np.float32)


def _at_lines(noise: Map, slope: Map, step: float) -> Map:
    """Noise of a view of the row where it shows the pixels of the reference."""
    places = np.indices(noise.shape).astype(np.float32)
    places[1] -= slope * np.float32(step)
    return np.asarray(cv2.remap(noise, places[1], places[0], cv2.INTER_CUBIC), np.float32)


def _summed(values: NDArray[np.floating], side_px: int) -> Map:
    single = np.asarray(values, np.float32)
    return np.asarray(cv2.boxFilter(single, -1, (side_px, side_px), normalize=False), np.float32)


def _spread(values: NDArray[np.floating]) -> float:
    return 1.4826 * float(np.median(np.abs(values)))


def _scenes(asked: Asked) -> list[tuple[str, Scene]]:
    folder = dino_folder()
    found = [("dense rich 0, chosen", make_scene(Recipe("dense rich", 0, DENSE)))]
    if folder is None:
        print("dino left out: it is not in the folder RIG_SHARED_DATA")
    else:
        found.insert(0, ("dino", load_dino(folder, 0.0)))
    names = [how.name for how in _degradations()]
    return [(n, s) for n, s in found if any(asked.wants(f"{n}: {name}") for name in names)]


def _degradations() -> tuple[Degradation, ...]:
    return (
        Degradation("noise 3", noise_levels=3.0),
        Degradation("noise 3, median 3 x 3", noise_levels=3.0, camera=median),
        *(Degradation(f"JPEG {quality}", camera=jpeg(quality)) for quality in (95, 90, 70, 40)),
    )
