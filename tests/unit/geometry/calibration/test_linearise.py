"""Analytic derivatives against difference quotients, and projections against independent ones."""

import numpy as np
import pytest

from rig.geometry.bundle.linearise import Target, linearise
from rig.geometry.bundle.observations import Observations, observe
from rig.geometry.bundle.unknowns import Free, Unknowns, lay_out
from rig.geometry.lens import LensModel
from tests.support.calibration_scene import flat_board_mm, random_scene, turn

COEFFICIENTS: dict[LensModel, list[float]] = {
    "none": [],
    "brown5": [-0.1, 0.03, 1e-3, -2e-3, 0.01],
    "brown8": [0.3, 0.05, 1e-3, -2e-3, 0.01, 0.35, 0.1, 0.02],
    "fisheye": [-0.02, 0.01, -0.004, 0.001],
}


def setting(lenses: tuple[LensModel, ...]) -> tuple[Observations, Target, Unknowns]:
    """Sightings of three cameras, and a place in the space of unknowns near what they show."""
    scene = random_scene(5, 4)
    target = Target(flat_board_mm())
    observed = observe(scene.sightings(1), target.points_mm, 3)
    rng = np.random.default_rng(7)
    offset = np.array([*target.centre_mm, 0.0])
    rotations = [turn(pose.turned_deg) for pose in scene.poses]
    at = Unknowns(
        lenses=lenses,
        intrinsics=tuple(
            np.array([880.0, 884.0, 640.0, 400.0, *COEFFICIENTS[lens]]) for lens in lenses
        ),
        view_rotation=np.stack([turn(rng.uniform(-3, 3, 3)) for _ in lenses]),
        view_shift_mm=rng.uniform(-80, 80, (3, 3)),
        warp_mm=np.array([0.7, -0.4, 0.5]),
        board_rotation=np.stack(rotations),
        board_shift_mm=np.stack(
            [p.middle_mm - r @ offset for p, r in zip(scene.poses, rotations, strict=True)]
        ),
    )
    return observed, target, at


@pytest.mark.parametrize("lens", ["brown5", "brown8", "fisheye", "none"])
def test_every_derivative_agrees_with_a_difference_quotient(lens: LensModel):
    observed, target, at = setting(("brown5", lens, lens))
    layout = lay_out(at.lenses, 0, Free(), stage=False)
    linear = linearise(observed, target, at)
    sighting = observed.sighting_of_point
    columns = layout.sighting_columns[observed.view[sighting]]
    assert np.isfinite(linear.residual_px).all()

    def quotient(shared: np.ndarray, boards: np.ndarray) -> np.ndarray:
        ahead = linearise(observed, target, at.moved(layout, shared, boards)).residual_px
        back = linearise(observed, target, at.moved(layout, -shared, -boards)).residual_px
        return (back - ahead) / 2e-6

    still = np.zeros((len(observed.pictures), 6))
    for number in range(layout.count):
        step = np.zeros(layout.count)
        step[number] = 1e-6
        wanted = quotient(step, still)
        analytic = np.einsum("mac,mc->ma", linear.jacobian[:, :, :-6], columns == number)
        assert np.abs(analytic - wanted).max() < 2e-6 * max(np.abs(wanted).max(), 1.0), number
    for number in range(6):
        step = still.copy()
        step[:, number] = 1e-6
        wanted = quotient(np.zeros(layout.count), step)
        analytic = linear.jacobian[:, :, -6 + number]
        assert np.abs(analytic - wanted).max() < 2e-6 * np.abs(wanted).max(), number


def test_a_point_behind_the_camera_has_no_residual():
    observed, target, at = setting(("brown5",) * 3)
    at.board_shift_mm[0] = (0.0, 0.0, -500.0)
    linear = linearise(observed, target, at)
    behind = observed.picture[observed.sighting_of_point] == 0
    assert np.isinf(linear.residual_px[behind]).all()
    assert np.isfinite(linear.residual_px[~behind]).all()
    assert np.isfinite(linear.jacobian).all()


@pytest.mark.parametrize(("depth_mm", "is_seen"), [(0.0, False), (0.25, True)])
def test_whatever_is_before_the_camera_is_projected(depth_mm: float, is_seen: bool):
    observed, target, at = setting(("none",) * 3)
    at.view_rotation[:], at.view_shift_mm[:], at.warp_mm[:] = np.eye(3), 0.0, 0.0
    at.board_rotation[0], at.board_shift_mm[0] = np.eye(3), (0.0, 0.0, depth_mm)
    linear = linearise(observed, target, at)
    first = observed.picture[observed.sighting_of_point] == 0
    assert np.isfinite(linear.residual_px[first]).all() == is_seen
    assert np.isinf(linear.residual_px[first]).all() != is_seen
