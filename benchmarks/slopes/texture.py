"""Where a slope can be told at all: gradient along the baselines, and no second slope as good."""

import hashlib
import sys

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.scenes import Scene
from benchmarks.slopes.stored import stored

Map = NDArray[np.float32]

_WINDOW_PX = 17
_GRADIENT_TO_NOISE = 3.0
_ROUNDING_LEVELS = 1.0 / np.sqrt(12.0)
"""Noise of grey values without any other."""
_STEP_PX, _APART_PX = 0.25, 1.0
"""Distance of the hypotheses, and that from which a slope is a second one, in the outermost
view."""
_SEEN_SHARE = 0.25
"""Share of the samples of a window that must lie within the pictures."""
_STRIDE_PX = 2
"""Every second pixel of every second row is judged."""


def textured(scene: Scene) -> NDArray[np.bool_]:
    """Pixels (H, W) with texture.

    That is an rms gradient along a baseline of at least three times the noise in 17 x 17 px, and no
    second slope in the range that leaves a mean square difference within noise^2 of the true one's.
    Both are taken from the clean views, warped by the true slopes plus an offset common to the
    window, so that slanted surfaces and edges do not count as misfits.
    """
    views = scene.clean
    if views is None:
        views = scene.views.images.astype(np.float32)
    noise = max(scene.noise_levels, float(_ROUNDING_LEVELS))

    def judge() -> Map:
        strong = _gradient(views[scene.views.reference], scene) >= _GRADIENT_TO_NOISE * noise
        return (strong & ~_is_ambiguous(views, scene, noise)).astype(np.float32)

    given = hashlib.sha256(views.tobytes() + scene.slope_px.tobytes()).hexdigest()
    steps = scene.views.x_steps.tolist(), scene.views.y_steps.tolist()
    return stored(judge, f"{given} {steps} {scene.range_px} {noise}", sys.modules[__name__]) > 0.5


def _gradient(grey: Map, scene: Scene) -> Map:
    """Rms gradient in the window along the baseline that has most of it, levels per px."""
    down, along = np.gradient(grey)
    most = np.zeros_like(grey)
    for x, y in zip(scene.views.x_steps, scene.views.y_steps, strict=True):
        length = float(np.hypot(x, y))
        if length > 0.0:
            towards = (x * along + y * down) / np.float32(length)
            power = cv2.boxFilter(np.square(towards, dtype=np.float32), -1, (_WINDOW_PX,) * 2)
            most = np.maximum(most, np.sqrt(power))
    return most.astype(np.float32)


def _is_ambiguous(views: Map, scene: Scene, noise: float) -> NDArray[np.bool_]:
    stride = _STRIDE_PX
    low, high = scene.range_px
    true_px = scene.slope_px[::stride, ::stride].astype(np.float32)
    step_px = _STEP_PX / float(np.hypot(scene.views.x_steps, scene.views.y_steps).max())
    best, seen = _difference(views, scene, 0.0)
    found = seen < _SEEN_SHARE
    limit = best + np.float32(noise**2)
    count = int((high - low) / step_px) + 1
    apart = round(_APART_PX / _STEP_PX)
    for side in (-1, 1):
        last: list[Map] = []
        for k in range(apart, count):
            offset_px = np.float32(side * k * step_px)
            inside = (true_px + offset_px >= low) & (true_px + offset_px <= high)
            if not inside.any():
                break
            now, seen = _difference(views, scene, float(offset_px))
            now[~inside | (seen < _SEEN_SHARE)] = np.inf
            last = [*last[-2:], now]
            if len(last) == 3:
                found |= _least(*last) <= limit
            found |= now <= limit
    found = np.repeat(np.repeat(found, stride, axis=0), stride, axis=1)
    return found[: views.shape[1], : views.shape[2]]


def _least(before: Map, at: Map, after: Map) -> Map:
    """Smallest difference between the hypotheses, by a parabola where the middle one is least."""
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = before - 2.0 * at + after
        vertex = at - (after - before) ** 2 / (8.0 * bend)
        is_least = (at <= before) & (at <= after) & np.isfinite(bend) & (bend > 0.0)
    return np.where(is_least, vertex, at).astype(np.float32)


def _difference(views: Map, scene: Scene, offset_px: float) -> tuple[Map, Map]:
    """Mean square difference from the reference in the window, and the share of samples in it."""
    height, width = views.shape[1:]
    stride = _STRIDE_PX
    rows, columns = np.mgrid[0:height:stride, 0:width:stride].astype(np.float32)
    slope = scene.slope_px[::stride, ::stride].astype(np.float32) + np.float32(offset_px)
    reference = scene.views.reference
    grey = views[reference][::stride, ::stride]
    known = np.isfinite(slope)
    slope = np.where(known, slope, np.float32(0.0))
    total, weight = np.zeros_like(grey), np.zeros_like(grey)
    for view, image in enumerate(views):
        if view == reference:
            continue
        u = columns - slope * np.float32(scene.views.x_steps[view])
        v = rows - slope * np.float32(scene.views.y_steps[view])
        there = cv2.remap(image, u, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        inside = known & (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
        total += np.where(inside, (there - grey) ** 2, np.float32(0.0))
        weight += inside.astype(np.float32)
    size = (_WINDOW_PX // stride | 1,) * 2
    total = cv2.boxFilter(total, -1, size)
    weight = cv2.boxFilter(weight, -1, size)
    share = weight / np.float32(len(views) - 1)
    return total / np.maximum(weight, np.float32(1e-6)), share
