"""Small and steep boards: the part of a picture that is looked at once more at twice its size."""

import numpy as np
import pytest

from rig.arrays import Float
from rig.targets import CharucoBoard, find_target
from rig.targets.magnified import densest_part
from tests.support.board_images import digitised
from tests.support.charuco_images import CharucoScene

PICTURE = np.add.outer(2.0 * np.arange(800.0), np.arange(1280.0)).astype(np.float32)


def crowd(x: float, y: float, count: int = 12) -> Float:
    return np.array([x, y]) + np.stack(np.divmod(np.arange(count), 4), axis=1)


def test_the_part_with_most_points_is_shown_at_twice_its_size() -> None:
    few, many = crowd(100.0, 100.0), crowd(900.0, 400.0, 20)
    found = densest_part(PICTURE, np.concatenate([few, many]))
    assert found is not None
    part, first_px = found
    assert part.shape == (768, 768)
    # Of all windows that hold them, the middle one: they are not at its border.
    assert np.abs(first_px + 192 - (901, 402)).max() <= 32
    # A place p of the part lies at p / 2 - 1 / 4 from the first pixel.
    place = first_px + 101.0 / 2 - 0.25
    assert part[101, 101] == pytest.approx(2 * place[1] + place[0], abs=0.2)


def test_a_small_picture_is_shown_whole() -> None:
    found = densest_part(PICTURE[:100, :140], crowd(20.0, 30.0))
    assert found is not None
    assert found[0].shape == (200, 280)
    assert found[1].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("count", "is_shown"), [(11, False), (12, True)])
def test_few_points_are_nothing_small(count: int, is_shown: bool) -> None:
    assert (densest_part(PICTURE, crowd(50.0, 60.0, count)) is not None) is is_shown


@pytest.mark.slow
def test_a_small_steep_charuco_board_is_found_corner_by_corner() -> None:
    """Squares of 17 px, 9 px across: margins of a pixel."""
    scene = CharucoScene(
        columns=9, rows=6, square_mm=30.0, width=360, height=300, focal_px=880.0,
        distance_mm=1420.0, tilt_deg=(38.0, -38.0, 20.0), blur_px=0.6,
    )  # fmt: skip
    image = digitised(scene.clean(), noise=1.5, rng=np.random.default_rng(3))
    found = find_target(image, CharucoBoard(10, 7, 30.0, 22.5, "4X4_50"))
    error_px = found.xy_px - scene.corners().reshape(-1, 2)[found.ids]
    assert len(found) > 45
    assert float(np.sqrt(np.mean(error_px**2))) < 0.05
