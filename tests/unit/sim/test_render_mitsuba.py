"""mitsuba against closed forms: pictures of the board, depth of the desk."""

import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from rig_sim.board import Board
from rig_sim.optics import Array, TrueCamera
from rig_sim.render_analytic import AnalyticRenderer
from rig_sim.render_mitsuba import MitsubaRenderer
from rig_sim.scenes.catalogue import static_surfaces

from rig.errors import ConfigError
from tests.support.cameras import SMALL, Slide, SmallRig


@pytest.mark.slow
def test_mitsuba_is_not_loaded_before_it_is_needed():
    program = (
        "import sys; from tests.support.cameras import SmallRig; SmallRig().camera();"
        "sys.exit('mitsuba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_without_mitsuba_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(ConfigError, match=r"pip install 'epirig\[sim\]'"):
        MitsubaRenderer(samples_per_px=4, seed=1)


def corner_shifts_px(
    of: np.ndarray, against: np.ndarray, camera: TrueCamera, board: Board
) -> Array:
    """Shift of a picture around every inner corner, (N, 2), by least squares on its gradients."""
    sharp, other = (cv2.GaussianBlur(p, (0, 0), 0.8).astype(float) for p in (against, of))
    y_gradient, x_gradient = np.gradient(sharp)
    reach = int(0.4 * board.square_mm * camera.focal_px / board.centre_mm[2])
    shifts = []
    for x_px, y_px in np.rint(camera.pixels(board.in_world_mm(board.corners_mm()))).astype(int):
        around = (slice(y_px - reach, y_px + reach + 1), slice(x_px - reach, x_px + reach + 1))
        gradients = np.stack([x_gradient[around].ravel(), y_gradient[around].ravel()], axis=-1)
        shifts.append(np.linalg.lstsq(gradients, (sharp - other)[around].ravel())[0])
    return np.array(shifts)


@pytest.mark.slow
@pytest.mark.parametrize(("travelled_mm", "samples"), [(-803.0, 64), (-403.0, 144), (-3.0, 144)])
@pytest.mark.parametrize("profile", ["sim", "sim-real"])
def test_both_renderers_put_every_corner_at_the_same_place(
    profile: str, travelled_mm: float, samples: int
):
    rig = SmallRig(("world.board_tilt_deg=[3.0, -5.0]",), profile, slide=Slide(travelled_mm))
    moment = replace(rig.world.moment(0.0), cameras=rig.world.moment(0.0).cameras[1:2])
    assert moment.board is not None
    traced = MitsubaRenderer(samples_per_px=samples, seed=1).render(moment)
    drawn = AnalyticRenderer().render(moment)
    for camera, one, two in zip(moment.cameras, traced, drawn, strict=True):
        shifts_px = corner_shifts_px(one, two, camera, moment.board)
        assert np.sqrt(np.mean(shifts_px**2)) < 0.004
        assert np.abs(shifts_px).max() < 0.01
        assert np.abs(shifts_px.mean(axis=0)).max() < 0.002


@pytest.mark.slow
def test_a_shift_of_a_twentieth_of_a_pixel_would_be_seen():
    rig = SmallRig()
    moment = rig.world.moment(0.0)
    assert moment.board is not None
    camera = moment.cameras[0]
    moved = replace(camera, centre_px=(camera.centre_px[0] + 0.05, camera.centre_px[1]))
    one, two = AnalyticRenderer().render(replace(moment, cameras=(moved, camera)))
    assert corner_shifts_px(one, two, camera, moment.board).mean(axis=0) == pytest.approx(
        [0.05, 0.0],
        abs=0.006,  # a linear fit of a curved edge
    )


@pytest.mark.slow
def test_the_depth_truth_of_the_desk_is_where_mitsuba_meets_it():
    rig = SmallRig(scene="desk")
    renderer = MitsubaRenderer(samples_per_px=1, seed=1)
    mi = renderer._mi
    traced = renderer._load([renderer._emit(surface) for surface in static_surfaces("desk")])
    truth_mm = rig.world.true_depth_mm()
    camera = rig.world.moment(0.0).cameras[0]
    random = np.random.default_rng(2)
    y_px, x_px = random.integers(0, 400, 3000), random.integers(0, 640, 3000)
    rays = camera.directions(x_px.astype(float), y_px.astype(float)).reshape(-1, 3)
    met_mm = np.empty(len(rays))
    for number, direction in enumerate(rays):
        length = float(np.linalg.norm(direction))
        ray = mi.Ray3f(mi.Point3f(0.0), mi.Vector3f(*(direction / length)))
        met_mm[number] = float(traced.ray_intersect_preliminary(ray).t)
        met_mm[number] *= 1e3 / length
    error_mm = np.abs(met_mm - truth_mm[y_px, x_px])
    # float32 against float64 may disagree on which side of a silhouette a ray passes.
    assert np.quantile(error_mm, 0.998) < 1e-3
    assert np.mean(error_mm > 1.0) < 0.002


@pytest.mark.slow
def test_the_desk_is_well_exposed_and_textured_everywhere():
    rig = SmallRig(
        ("camera.width_px=320", "camera.height_px=200", "world.optics.focal_px=305.0"),
        scene="desk",
    )
    moment = rig.world.moment(0.0)
    moment = replace(moment, cameras=moment.cameras[:1])
    picture = MitsubaRenderer(samples_per_px=16, seed=1).render(moment)[0]
    assert np.mean(picture > 0.95) == 0.0
    assert np.mean(picture < 0.04) < 0.005
    assert 0.3 < np.median(picture) < 0.6
    detail = np.abs(np.diff(picture, axis=1))
    blocks = detail[:, :312].reshape(25, 8, 39, 8).mean(axis=(1, 3))
    assert np.mean(blocks > 0.004) > 0.97


@pytest.mark.slow
def test_one_seed_renders_the_same_picture_bit_by_bit():
    moment = SmallRig(SMALL).world.moment(0.0)
    one, two = (MitsubaRenderer(samples_per_px=4, seed=1).render(moment) for _ in range(2))
    np.testing.assert_array_equal(one, two)
