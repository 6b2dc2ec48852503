"""Scenes that are hard to look at, before cameras that have not turned: no drift is told."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from rig_sim.optics import TrueCamera
from rig_sim.scenes.place import rectangle
from rig_sim.surface import Surface

from rig.epipolar.scene.drift import scene_drift
from rig.epipolar.scene.look import look
from rig.epipolar.scene.motion import Before, before, standing
from rig.errors import CalibrationError
from tests.support.scene_pictures import cards, geometry_of, photographs, true_camera

LEFT = true_camera("left", (0.0, 0.0, 0.0))
RIGHT = true_camera("right", (75.0, 0.0, 0.0))
RIG = geometry_of([LEFT, RIGHT])
SURE = np.diag(
    np.array([*2 * [0.05, 0.05, 3e-3, 3e-3], *3 * [np.radians(3e-4)], *3 * [0.005]]) ** 2
)
CHANCE = 1e-4
"""The most that a check takes for no chance; a capture is stricter."""
Pictures = Sequence[NDArray[np.uint8]]


def probability(pictures: Pictures, earlier: Before | None = None) -> float:
    """Of rows that lie so far off by chance; 1 where the scene is refused, which tells no drift."""
    try:
        features = look(RIG, [pictures], 255, [earlier])
        return scene_drift(RIG, SURE, features).probability
    except CalibrationError:
        return 1.0


def pitched(camera: TrueCamera, pitch_deg: float) -> TrueCamera:
    return replace(camera, rotation_deg=(pitch_deg, 0.0, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_rig_that_moves_while_its_views_are_exposed_apart_is_not_looked_at(seed: int):
    # It pitches by 0.9 deg/s; 0.1 s pass from picture to picture, 0.1 s between the views.
    there = cards(seed)
    (was,) = photographs([pitched(LEFT, -0.09)], there, 3)
    pictures = photographs([LEFT, pitched(RIGHT, 0.09)], there, seed)
    assert probability(pictures) < CHANCE
    earlier = before(was, passed_s=0.1, skew_s=0.1)
    with pytest.raises(CalibrationError, match=r"shares \d+ features with left that stand still"):
        look(RIG, [pictures], 255, [earlier])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_things_that_move_are_left_out_and_the_rest_tells(seed: int):
    random = np.random.default_rng(seed)
    grain = cv2.GaussianBlur(random.standard_normal((400, 400)).astype(np.float32), (0, 0), 2.0)
    texture = np.clip(0.5 + 0.2 * grain / grain.std(), 0.0, 1.0)

    def with_thing(down_mm: float) -> tuple[Surface, ...]:
        place = rectangle(
            (0.0, 40.0 + down_mm, 450.0), np.array([170.0, 0.0, 0.0]), np.array([0.0, 90.0, 0.0])
        )
        return (Surface(place, texture), *cards(seed))

    (was,) = photographs([LEFT], with_thing(-2.0), 3)
    (left,) = photographs([LEFT], with_thing(0.0), 4)
    (right,) = photographs([RIGHT], with_thing(2.0), 5)
    earlier = before(was, passed_s=0.1, skew_s=0.1)
    assert earlier is not None
    assert probability([left, right], earlier) > CHANCE
    (turned,) = photographs([pitched(RIGHT, 0.05)], with_thing(2.0), 5)
    assert probability([left, turned], earlier) < CHANCE


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.3])
def test_little_texture_tells_no_drift(share: float):
    for seed in (1, 2, 3):
        plain = cards(seed)[0]
        wall = Surface(plain.shape, np.full_like(plain.texture, 0.5))
        few = cards(seed)[1 : 1 + round(14 * share)]
        assert probability(photographs([LEFT, RIGHT], (wall, *few), seed)) > CHANCE


@pytest.mark.slow
@pytest.mark.parametrize("period_px", [5.0, 9.0, 23.0])
def test_a_texture_that_repeats_itself_tells_no_drift(period_px: float):
    for seed in (1, 2):
        far_mm = 1500.0 + 300.0 * seed
        side_mm, count = 1.6 * far_mm, 1600
        # Tiles with joints that all look alike, as seen so many pixels apart.
        period = count * period_px * far_mm / 260.0 / side_mm
        y, x = np.indices((count, count), np.float32) / period
        joints = np.maximum(np.cos(2 * np.pi * x), np.cos(2 * np.pi * y)) ** 8
        tiles = (0.7 - 0.4 * joints).astype(np.float32)
        right, down = np.array([side_mm / 2, 0.0, 60.0]), np.array([0.0, side_mm / 2, 90.0])
        wall = Surface(rectangle((0.0, 0.0, far_mm), right, down), tiles)
        assert probability(photographs([LEFT, RIGHT], (wall,), seed)) > CHANCE


@pytest.mark.slow
@pytest.mark.parametrize("light", ["gain", "side", "mains"])
def test_light_that_differs_from_view_to_view_tells_no_drift(light: str):
    y, x = np.indices((240, 320), np.float32)
    shade = {
        "gain": np.full_like(x, 0.6),
        "side": 0.5 + x / 640.0 + y / 480.0,
        # A lamp on the mains, through a rolling shutter, at another moment.
        "mains": 1.0 - 0.15 * (1.0 + np.sin(2.0 * np.pi * y / 96.0)),
    }[light]
    for seed in (1, 2, 3):
        left, right = photographs([LEFT, RIGHT], cards(seed), seed)
        lit = np.clip(np.rint(right * shade), 0, 255).astype(np.uint8)
        assert probability([left, lit]) > CHANCE


def test_views_of_one_instant_need_no_look_at_motion():
    picture = np.zeros((4, 4), np.uint8)
    assert before(picture, passed_s=0.1, skew_s=0.0) is None
    assert before(picture, passed_s=0.1, skew_s=20e-6) is None
    late = before(picture, passed_s=0.1, skew_s=1e-3)
    assert late is not None
    # 2 px in 0.1 s are 0.02 px in 1 ms.
    assert late.allowed_px == pytest.approx(2.0)


def test_motion_is_told_feature_by_feature():
    random = np.random.default_rng(1)
    rough = cv2.GaussianBlur(random.standard_normal((90, 120)).astype(np.float32), (0, 0), 2.0)
    now = np.clip(128.0 + 40.0 * rough / rough.std(), 0, 255).astype(np.uint8)
    was = now.copy()
    was[:, 60:] = np.roll(now, 3, axis=0)[:, 60:]
    places = np.array([[20.0, 45.0], [40.0, 30.0], [85.0, 45.0], [100.0, 60.0]])
    assert standing(Before(was, 1.0), now, places, 255).tolist() == [True, True, False, False]
    assert standing(Before(was, 5.0), now, places, 255).all()
    assert standing(Before(was, 5.0), now, places[:0], 255).shape == (0,)
