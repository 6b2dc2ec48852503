"""The search of a pair, and what its sigma bears."""

from dataclasses import replace
from itertools import product

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.slopes.scenes import PAIR as PAIR_LAYOUT
from benchmarks.slopes.scenes import Recipe, make_scene
from rig.epipolar import Label, RectifiedViews, estimate_slopes
from rig.epipolar.plain import has_coarse_texture
from rig.epipolar.scales import Scales
from rig.epipolar.search.aggregate import add_diagonals
from rig.epipolar.search.census import join_census
from rig.epipolar.search.window import Cameras
from tests.support.lightfield import noise_texture

PAIR = Cameras(np.array([0.0, 1.0]), np.zeros(2), 0)
SHAPE = (72, 110)


def picture(seed: int, shape: tuple[int, int] = SHAPE) -> NDArray[np.float32]:
    rows, columns = np.mgrid[0 : shape[0], 0 : shape[1]].astype(float)
    texture = noise_texture(seed, mean=120.0, contrast=28.0, finest_px=2.0)
    return np.asarray(texture(columns, rows), np.float32)


def moved(image: NDArray[np.float32], shift_px: int) -> NDArray[np.float32]:
    """What the right view shows of a wall at this slope."""
    return np.roll(image, -shift_px, axis=1)


@pytest.mark.parametrize("height", [6, 7])
def test_diagonal_paths_that_meet_add_up_as_if_each_walked_alone(height: int) -> None:
    rng = np.random.default_rng(4)
    labels, width, step = 4, 9, 6
    costs = rng.integers(0, 200, (height, labels, width)).astype(np.uint8)
    jump_x, jump_y = rng.integers(10, 60, (2, height, width)).astype(np.int16)
    total = np.zeros(costs.shape, np.int16)
    add_diagonals(costs, jump_x, jump_y, step, total)
    jump = np.minimum(jump_x, jump_y)
    expected = np.zeros(costs.shape, int)
    for down, side in product((True, False), (-1, 1)):
        path = np.zeros((labels, width + 2), int)
        for k in range(height):
            v = k if down else height - 1 - k
            edge = jump[v if down else min(v + 1, height - 1)]
            came = path[:, 1 + side : 1 + side + width]
            lowest = came.min(axis=0)
            near = np.pad(came, ((1, 1), (0, 0)), constant_values=8000)
            ways = [came, near[:-2] + step, near[2:] + step, np.tile(lowest + edge, (labels, 1))]
            path = np.zeros_like(path)
            path[:, 1:-1] = costs[v] + np.min(ways, axis=0) - lowest
            expected[v] += path[:, 1:-1]
    assert np.array_equal(total, expected)


def test_neighbourhoods_tell_the_slope_whatever_the_light() -> None:
    left = picture(1)
    right = 0.4 * moved(left, 5) + 70.0
    labels = np.arange(0, 12, dtype=np.float32)
    costs = np.zeros((SHAPE[0], len(labels), SHAPE[1]), np.uint8)
    join_census(
        costs, np.stack([left, right]).astype(np.float32), PAIR, labels, noise_levels=0.1, share=0.5
    )
    inner = costs[4:-4, :, 16:-4].astype(int)
    assert np.mean(inner.argmin(axis=1) == 5) > 0.99
    assert np.median(inner[:, 5]) < 0.1 * np.median(inner[:, 9])


def test_neighbourhoods_of_a_plain_wall_cost_nothing() -> None:
    rng = np.random.default_rng(2)
    walls = (120.0 + rng.normal(0.0, 1.0, (2, *SHAPE))).astype(np.float32)
    costs = np.zeros((SHAPE[0], 3, SHAPE[1]), np.uint8)
    join_census(costs, walls, PAIR, np.arange(3, dtype=np.float32), noise_levels=1.0, share=0.5)
    textured = np.zeros_like(costs)
    pictures = np.stack([picture(3), picture(7)])
    join_census(
        textured, pictures, PAIR, np.arange(3, dtype=np.float32), noise_levels=1.0, share=0.5
    )
    assert costs[:, :, 8:].mean() < 0.35 * textured[:, :, 8:].mean()


def test_faint_wide_structure_is_texture_and_noise_is_not() -> None:
    scales = Scales(noise=2.0, texture=1.0)
    rng = np.random.default_rng(5)
    noise = rng.normal(0.0, 2.0, (96, 128)).astype(np.float32)
    columns = np.arange(128)
    waves = (noise + 9.0 * np.sin(2 * np.pi * columns / 24)).astype(np.float32)
    assert has_coarse_texture(noise, scales, is_row=True).mean() < 0.02
    assert has_coarse_texture(waves, scales, is_row=True).mean() > 0.9
    assert has_coarse_texture(waves, scales, is_row=False).mean() < 0.05
    assert not has_coarse_texture(noise[:3, :3], scales, is_row=True).any()


def test_sigma_of_a_pair_bears_what_its_views_miss_each_other_by() -> None:
    rng = np.random.default_rng(8)
    rows, columns = np.mgrid[0:140, 0:220].astype(float)
    texture, slope_px = noise_texture(9, mean=120.0, contrast=28.0, finest_px=2.0), 6.3
    miss_px = cv2.GaussianBlur(rng.normal(size=rows.shape), (0, 0), 1.5)
    miss_px *= 0.4 / miss_px.std()
    exact = np.stack([texture(columns, rows), texture(columns + slope_px + miss_px, rows)])
    frames = (exact + rng.normal(0.0, 1.0, exact.shape)).astype(np.float32)
    views = RectifiedViews(frames, PAIR.x_steps, PAIR.y_steps, 0)
    found = estimate_slopes(views, (0.0, 20.0))
    answered = (found.label != Label.NONE) & (found.sigma_px < 1.0)
    assert answered[:, 20:].mean() > 0.95
    z = np.abs(found.slope_px - slope_px)[answered] / found.sigma_px[answered]
    assert 0.7 < 1.4826 * np.median(z) < 1.3


def test_stitching_takes_no_answered_slope_of_a_pair_to_another_surface() -> None:
    wrong = []
    for seed in (32, 33):
        scene = make_scene(Recipe("pair", seed, PAIR_LAYOUT))
        views = replace(scene.views, images=np.ascontiguousarray(scene.views.images[:, :200, :400]))
        found = estimate_slopes(views, scene.range_px)
        answered = (found.label != Label.NONE) & (found.sigma_px < 5.0)
        assert answered.mean() > 0.82
        wrong.append(np.abs(found.slope_px - scene.slope_px[:200, :400])[answered] > 1.0)
    assert np.concatenate(wrong).mean() < 0.0011


@pytest.mark.slow
def test_a_pair_too_large_for_one_search_is_searched_at_half_size_and_told_as_well() -> None:
    rows, columns = np.mgrid[0:400, 0:700].astype(float)
    texture = noise_texture(4, mean=120.0, contrast=28.0, finest_px=3.0)
    # A slanted wall: what the reference shows at u, the other view shows at u - 60 - 0.03 u.
    slope_px = 60.0 + 0.03 * columns
    frames = np.stack([texture(columns, rows), texture((columns + 60.0) / 0.97, rows)])
    noise = np.random.default_rng(3).normal(0.0, 1.0, frames.shape)
    views = RectifiedViews((frames + noise).astype(np.float32), PAIR.x_steps, PAIR.y_steps, 0)
    found = estimate_slopes(views, (0.0, 470.0))
    seen = np.s_[:, 80:]
    error = np.abs(found.slope_px - slope_px)[seen]
    assert np.nanmedian(error) < 0.05
    assert np.mean(error < 1.0) > 0.95
