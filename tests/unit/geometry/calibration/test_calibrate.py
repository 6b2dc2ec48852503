"""From sightings to the geometry, against the truth of a synthetic rig."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rig.errors import CalibrationError, ConfigError
from rig.geometry.bundle import Calibration, solve_rig
from rig.geometry.bundle.geometry_of import rodrigues_by_shared
from rig.geometry.sighting import Sighting
from tests.support.calibration_scene import (
    HEIGHT,
    WIDTH,
    Scene,
    TrueCamera,
    flat_board_mm,
    on_stage,
    random_scene,
    turn,
)

SIZES_PX = [(WIDTH, HEIGHT)] * 3
NAMES = ("centre", "right", "low")
AXIS = np.array([0.007, -0.005, 1.0]) / np.sqrt(1 + 0.007**2 + 0.005**2)
POSITIONS_MM = np.linspace(0.0, 550.0, 12)


def solve(scene: Scene, seed: int = 2, **options: object) -> Calibration:
    given = {"lens": "brown5", **options}
    return solve_rig(scene.sightings(seed), flat_board_mm(), SIZES_PX, NAMES, 0, **given)  # pyright: ignore[reportArgumentType]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return random_scene(3, 25)


@pytest.fixture(scope="module")
def found(scene: Scene) -> Calibration:
    return solve(scene)


def errors_of(found: Calibration, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """(P,) every parameter's error, and the covariance (P, P) that is told of it."""
    geometry = found.geometry
    assert geometry.covariance is not None
    numbers = [
        np.array([c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.coefficients]) - t.numbers
        for c, t in zip(geometry.cameras, scene.cameras, strict=True)
        if isinstance(t, TrueCamera)
    ]
    places: list[float] = []
    for place, true in list(zip(geometry.cam_from_reference, scene.cameras, strict=True))[1:]:
        rotation = turn(true.turned_deg)
        small = place.rotation @ rotation.T
        places += [small[2, 1], small[0, 2], small[1, 0]]
        places += list(place.translation_mm + rotation @ true.centre_mm)
    # The covariance is of Rodrigues vectors, the difference above a turn.
    errors = rodrigues_by_shared(geometry) @ np.concatenate([*numbers, places])
    return errors, geometry.covariance


@pytest.mark.slow
def test_every_parameter_is_as_near_the_truth_as_its_sigma_says(found: Calibration, scene: Scene):
    errors, covariance = errors_of(found, scene)
    assert errors.size == 3 * 9 + 2 * 6
    assert np.abs(errors / np.sqrt(np.diag(covariance))).max() < 4.0
    # Chi-squared of 39 together, a thousandth left out on each side.
    assert 17.3 < errors @ np.linalg.solve(covariance, errors) < 72.1
    assert np.abs(found.warp.height_mm - scene.bend_mm).max() < 4 * found.warp.sigma_mm.max()


def test_residuals_are_the_noise_and_unseen_pictures_have_a_little_more(found: Calibration):
    noise_px = 0.02 * np.sqrt(2)
    assert found.rms_px == pytest.approx(noise_px, rel=0.05)
    assert found.rms_px < found.held_out_rms_px < 1.1 * noise_px
    assert found.epipolar.mean_px < found.epipolar.p95_px < found.epipolar.max_px < 0.2
    assert 0.7 < found.error_scale < 1.6
    sigma_px = np.concatenate([residuals.sigma_px for residuals in found.residuals])
    assert np.median(sigma_px) == pytest.approx(0.02, rel=0.1)


@pytest.mark.slow
def test_gross_corners_are_left_out_and_change_nothing(found: Calibration, scene: Scene):
    sightings = scene.sightings(2)
    xy_px = sightings[7].xy_px.copy()
    xy_px[3] += (3.0, -1.0)
    sightings[7] = replace(sightings[7], xy_px=xy_px)
    again = solve_rig(sightings, flat_board_mm(), SIZES_PX, NAMES, 0, lens="brown5")
    outliers = [(i, np.flatnonzero(r.outlier).tolist()) for i, r in enumerate(again.residuals)]
    assert [(i, where) for i, where in outliers if where] == [(7, [3])]
    assert again.geometry.centres_mm() == pytest.approx(found.geometry.centres_mm(), abs=5e-3)


@pytest.mark.slow
def test_the_stage_is_found_with_the_cameras(scene: Scene):
    staged = on_stage(scene, AXIS, 1.0015 * POSITIONS_MM, 420.0)
    driver = {len(scene.poses) + i: 420.0 + s for i, s in enumerate(POSITIONS_MM.tolist())}
    stage = solve(staged, stage_mm=driver).geometry.stage
    assert stage is not None
    truth = np.array([AXIS[0], AXIS[1], 1.0015, 420.0 - 1.0015 * AXIS[2] * 420.0])
    error = np.array([*stage.axis[:2], stage.scale, stage.zero_mm]) - truth
    sigma = np.sqrt(np.diag(stage.covariance))
    assert (np.abs(error) < 4 * sigma).all()
    assert np.degrees(sigma[:2]).max() < 0.01
    assert sigma[2] < 1e-4
    assert sigma[3] < 0.1


def test_a_calibration_comes_back_from_json_to_the_bit(found: Calibration):
    text = found.to_json()
    again = Calibration.from_json(text)
    assert again.to_json() == text


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("{", "no JSON"),
        ("[]", "found version None"),
        ('{"version": 99, "calibration": {}}', "found version 99"),
        ('{"version": 3, "calibration": {}}', "geometry is missing"),
    ],
)
def test_other_texts_are_refused(change: str, says: str):
    with pytest.raises(ConfigError, match=says):
        Calibration.from_json(change)


def test_a_field_too_many_or_of_another_type_is_refused(found: Calibration):
    data = json.loads(found.to_json())
    data["calibration"]["extra"] = 1
    with pytest.raises(ConfigError, match=r"extra is unknown"):
        Calibration.from_json(json.dumps(data))
    data["calibration"].pop("extra")
    data["calibration"]["error_scale"] = "much"
    with pytest.raises(ConfigError, match=r"error_scale: a finite number wanted, found 'much'"):
        Calibration.from_json(json.dumps(data))


def one_sighting(**changes: object) -> Sighting:
    board = flat_board_mm()
    values = {"picture": 0, "view": 0, "ids": np.arange(len(board)), **changes}
    ids = values["ids"]
    xy_px = board[: len(ids), :2] + 100.0  # pyright: ignore[reportArgumentType]
    return Sighting(**values, xy_px=xy_px, sigma_px=np.ones(len(xy_px)))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("sightings", "error", "says"),
    [
        ([], CalibrationError, "0 sightings given"),
        ([one_sighting(ids=np.arange(10))], CalibrationError, "two rows"),
        ([one_sighting()], CalibrationError, "right, low asked for in the frame of centre"),
        ([one_sighting(view=3)], ConfigError, "views are 0..2"),
        ([one_sighting(ids=np.arange(69, 139))], ConfigError, "points 0..69"),
        ([one_sighting(), one_sighting()], ConfigError, "given twice"),
        ([one_sighting(view=v) for v in range(3)], CalibrationError, "in 1 pictures"),
    ],
)
def test_sightings_that_determine_nothing_are_refused(
    sightings: list[Sighting], error: type[Exception], says: str
):
    with pytest.raises(error, match=says):
        solve_rig(sightings, flat_board_mm(), SIZES_PX, NAMES, 0)


def test_arguments_that_contradict_each_other_are_refused(scene: Scene):
    with pytest.raises(ConfigError, match="off its plane"):
        solve_rig([], np.ones((4, 3)), SIZES_PX, NAMES, 0)
    with pytest.raises(ConfigError, match="reference 3 given"):
        solve_rig([], flat_board_mm(), SIZES_PX, NAMES, 3)
    with pytest.raises(ConfigError, match="without a geometry"):
        solve_rig([], flat_board_mm(), SIZES_PX, NAMES, 0, fixed="all")
    with pytest.raises(ConfigError, match="found at 2 different ones"):
        solve(scene, stage_mm={0: 1.0, 1: 2.0})
