"""A pinhole picture through a lens, against pictures that are linear in the plane z = 1."""

from dataclasses import replace

import numpy as np
import pytest
from rig_sim.optics import TrueCamera, distorted, undistorted
from rig_sim.resample import FINER, Lens, Pinhole
from rig_sim.window import Window

BARREL = (-0.2, 0.05, 0.001, -0.002, 0.01)
CAMERA = TrueCamera(
    view="it",
    width_px=80,
    height_px=60,
    focal_px=70.0,
    centre_px=(41.3, 28.6),
    position_mm=(0.0, 0.0, 0.0),
    rotation_deg=(0.0, 0.0, 0.0),
    distortion=BARREL,
)


def plane_of(pinhole: Pinhole) -> tuple[np.ndarray, np.ndarray]:
    """(x, y) in the plane z = 1 of every pixel of a pinhole picture."""
    x, y = np.meshgrid(np.arange(pinhole.width_px), np.arange(pinhole.height_px))
    return (
        (x - pinhole.centre_px[0]) / pinhole.focal_px,
        (y - pinhole.centre_px[1]) / pinhole.focal_px,
    )


def parts_of(window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Places of the four quarters of every pixel, (4, H, W) each."""
    columns, rows = np.meshgrid(
        np.arange(window.x0, window.x1, dtype=float), np.arange(window.y0, window.y1, dtype=float)
    )
    quarters = [(dx, dy) for dy in (-0.25, 0.25) for dx in (-0.25, 0.25)]
    return (
        np.stack([columns + dx for dx, _ in quarters]),
        np.stack([rows + dy for _, dy in quarters]),
    )


@pytest.mark.parametrize("window", [Window(0, 0, 80, 60), Window(13, 7, 50, 41)])
def test_light_that_is_linear_in_the_scene_comes_through_the_lens_where_it_should(window: Window):
    lens = Lens(CAMERA, window)
    x, y = plane_of(lens.pinhole)
    picture = np.stack([0.5 + 0.3 * x - 0.2 * y, 0.1 * x + 0.4 * y], axis=-1).astype(np.float32)
    seen = lens.through(picture)
    assert seen.shape == (window.height, window.width, 2)
    columns, rows = parts_of(window)
    x_free, y_free = undistorted(
        (columns - CAMERA.centre_px[0]) / CAMERA.focal_px,
        (rows - CAMERA.centre_px[1]) / CAMERA.focal_px,
        BARREL,
    )
    expected = np.stack([0.5 + 0.3 * x_free - 0.2 * y_free, 0.1 * x_free + 0.4 * y_free], axis=-1)
    assert seen == pytest.approx(expected.mean(axis=0), abs=2e-6)


def test_what_a_lens_undoes_it_also_does():
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.4, 0.4, 7))
    x_free, y_free = undistorted(x, y, BARREL)
    again = distorted(x_free, y_free, BARREL)
    assert again[0] == pytest.approx(x, abs=1e-9)
    assert again[1] == pytest.approx(y, abs=1e-9)


def test_the_pinhole_picture_is_as_large_as_it_must_be():
    window = Window(0, 0, 80, 60)
    lens = Lens(CAMERA, window)
    columns, rows = parts_of(window)
    x_free, y_free = undistorted(
        (columns - CAMERA.centre_px[0]) / CAMERA.focal_px,
        (rows - CAMERA.centre_px[1]) / CAMERA.focal_px,
        BARREL,
    )
    focal_px = FINER * CAMERA.focal_px
    assert lens.pinhole.focal_px == focal_px
    left, top = (-place for place in lens.pinhole.centre_px)
    # One pixel to spare on the near sides, one to two on the far ones, where two are blended.
    assert left == np.floor(focal_px * x_free.min()) - 1
    assert top == np.floor(focal_px * y_free.min()) - 1
    assert left + lens.pinhole.width_px == np.ceil(focal_px * x_free.max()) + 2
    assert top + lens.pinhole.height_px == np.ceil(focal_px * y_free.max()) + 2


def test_a_camera_without_distortion_is_its_own_pinhole():
    plain = replace(CAMERA, distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
    lens = Lens(plain, Window(10, 20, 50, 45))
    assert lens.pinhole == Pinhole(40, 25, 70.0, (41.3 - 10, 28.6 - 20))
    picture = np.zeros((25, 40, 2), np.float32)
    assert lens.through(picture) is picture
