"""AprilGrids and circles through a calibration: truth from closed forms and rendered pictures."""

import cv2
import numpy as np
import pytest
from rig_sim.april_print import april_print, april_texel_mm

from rig.arrays import Float
from rig.calibrate.sight import PictureSightings
from rig.calibrate.solve import SolveChoices, solve
from rig.errors import CalibrationError, ConfigError
from rig.geometry.bundle import Calibration
from rig.optics.target import target_of
from rig.profile import Profile
from rig.profile.load import parse_profile
from rig.sweep.request import sweep_setup
from rig.targets import AprilGrid, CircleGrid, Detection, find_target
from tests.support.april_images import AprilScene
from tests.support.board_images import digitised
from tests.support.circle_images import CircleScene

CIRCLES: dict[str, object] = {
    "kind": "asymmetric_circles", "columns": 4, "rows": 7, "spacing_mm": 30.0, "diameter_mm": 34.0,
}  # fmt: skip
TAGS: dict[str, object] = {
    "kind": "aprilgrid",
    "tag_columns": 3,
    "tag_rows": 2,
    "tag_mm": 45.0,
    "spacing": 0.3,
}
POSES = [
    ((-70, -50, 560), (25, 10, 3)), ((70, -50, 560), (-25, 15, -8)), ((-70, 50, 540), (10, -28, 5)),
    ((70, 50, 560), (-12, 30, 0)), ((0, 0, 480), (20, 20, 10)), ((0, 0, 900), (-40, 5, 90)),
    ((-40, 0, 600), (5, 42, -12)), ((40, 10, 620), (-30, -25, 20)), ((0, -30, 500), (35, 0, 0)),
    ((-60, 20, 700), (40, -30, 0)),
]  # fmt: skip
FOCAL_PX = 600.0
SIZE = (480, 320)


def a_profile(target: dict[str, object], **parts: object) -> Profile:
    return parse_profile(
        {
            "name": "eye",
            "views": [{"name": "eye"}],
            "camera": {"kind": "folder", "folder": "/nowhere", "files": {"eye": "*.png"}},
            "target": target,
            **parts,
        },
        source="test",
    )


def of_picture(number: int, found: Detection) -> PictureSightings:
    return PictureSightings(number, None, (SIZE,), (found,))


def solved(profile: Profile, found: list[Detection]) -> Calibration:
    assert profile.target is not None
    pictures = [of_picture(number, one) for number, one in enumerate(found)]
    return solve(profile, target_of(profile.target), pictures, SolveChoices(lens="none"))


def detection(xy_px: Float, sigma_px: float) -> Detection:
    count = len(xy_px)
    return Detection(np.arange(count, dtype=np.intp), xy_px, np.full(count, sigma_px), 0.8, 150.0)


@pytest.mark.slow
def test_centres_of_circles_are_corrected_and_middles_alone_are_off():
    profile = a_profile(CIRCLES)
    scene = CircleScene(rows=7, spacing_mm=30.0, diameter_mm=34.0, focal_px=FOCAL_PX)
    rng = np.random.default_rng(3)
    seen: list[Detection] = []
    for (x, y, z), turned in POSES:
        pose = scene.with_changes(offset_mm=(x, y), distance_mm=float(z), tilt_deg=turned)
        noise = 0.002 * rng.standard_normal((28, 2))
        seen.append(detection(pose.middles() + noise, 0.002))
    corrected = solved(profile, seen)
    assert corrected.rms_px < 0.004
    assert corrected.geometry.cameras[0].fx_px == pytest.approx(FOCAL_PX, abs=0.05)
    # Circles of no size are points, whose middles are their centres.
    tiny = solved(a_profile({**CIRCLES, "diameter_mm": 1e-3}), seen)
    assert tiny.geometry.cameras[0].fx_px == pytest.approx(599.38, abs=0.1)  # by no residual:
    assert tiny.rms_px < 0.004


@pytest.mark.slow
def test_pictures_of_an_aprilgrid_give_the_focal_length():
    profile = a_profile(TAGS)
    scene = AprilScene(
        tag_columns=3, tag_rows=2, tag_mm=45.0, width=SIZE[0], height=SIZE[1], focal_px=FOCAL_PX
    )
    rng = np.random.default_rng(4)
    seen: list[Detection] = []
    for (x, y, z), turned in POSES:
        pose = scene.with_changes(offset_mm=(x, y), distance_mm=float(z), tilt_deg=turned)
        image = digitised(pose.clean(), noise=1.5, rng=rng)
        seen.append(find_target(image, AprilGrid(3, 2, 45.0, 0.3)))
    found = solved(profile, seen)
    assert found.geometry.covariance is not None
    sigma = np.sqrt(np.diag(found.geometry.covariance))
    (camera,) = found.geometry.cameras
    assert abs(camera.fx_px - FOCAL_PX) < 3.5 * sigma[0]
    assert abs(camera.cx_px - 239.5) < 3.5 * sigma[2]
    assert sigma[0] < 0.5
    assert found.rms_px < 0.03


def test_targets_of_a_profile_are_those_of_the_finder():
    tags, circles = a_profile(TAGS).target, a_profile(CIRCLES).target
    assert tags is not None
    assert circles is not None
    assert target_of(tags) == AprilGrid(3, 2, 45.0, 0.3)
    assert target_of(circles) == CircleGrid(4, 7, 30.0, 34.0)


@pytest.mark.parametrize("target", [TAGS, CIRCLES], ids=["aprilgrid", "circles"])
def test_a_sweep_of_a_target_without_squares_is_refused(target: dict[str, object]):
    two = [
        {"name": name, "x_steps": x, "y_steps": 0.0} for name, x in (("left", 0.0), ("right", 1.0))
    ]
    profile = a_profile(
        target,
        views=two,
        camera={"kind": "folder", "folder": "/", "files": {"left": "l*.png", "right": "r*.png"}},
        pitch_mm=50.0,
        slopes={"range_px": [0.0, 40.0]},
        stage={
            "kind": "manual", "travel_mm": [100.0, 900.0],
        },
        sweep={"from_mm": 300.0, "to_mm": 800.0},
    )  # fmt: skip
    with pytest.raises(ConfigError, match=f"a target of kind {target['kind']} has none"):
        sweep_setup(profile)


def test_the_simulated_aprilgrid_is_the_one_that_is_looked_for():
    config = a_profile(TAGS).target
    assert config is not None
    assert config.kind == "aprilgrid"
    texels = april_print(config)
    assert april_texel_mm(config) == pytest.approx(4.5)
    assert (len(texels), len(texels[0])) == (2 * 13 + 3, 3 * 13 + 3)
    grey = np.array([[40 if texel == "#" else 200 for texel in row] for row in texels], np.uint8)
    scale, margin = 6, 30
    large = np.kron(grey, np.ones((scale, scale), np.uint8))
    paper = cv2.copyMakeBorder(
        large, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=(200,)
    )
    found = find_target(
        np.asarray(cv2.GaussianBlur(paper, (0, 0), 1.0), np.uint8), AprilGrid(3, 2, 45.0, 0.3)
    )
    wanted = AprilGrid(3, 2, 45.0, 0.3).points_mm.reshape(-1, 3)[:, :2] / 4.5 * scale
    assert found.ids.tolist() == list(range(24))
    assert found.xy_px == pytest.approx(wanted + margin + 3 * scale - 0.5, abs=0.02)
    with pytest.raises(ConfigError, match="share no grid"):
        april_print(config.model_copy(update={"spacing": 0.2813}))
    with pytest.raises(ConfigError, match="there are 587"):
        april_print(config.model_copy(update={"first_tag": 585}))


def of_scene(scene: CircleScene, off: dict[tuple[int, int], float]) -> list[Detection]:
    """Centres of points, some of them moved to the right by so many px."""
    rng = np.random.default_rng(3)
    seen: list[Detection] = []
    for number, ((x, y, z), turned) in enumerate(POSES):
        pose = scene.with_changes(offset_mm=(x, y), distance_mm=float(z), tilt_deg=turned)
        xy_px = pose.centres() + 0.01 * rng.standard_normal((28, 2))
        for (picture, point), moved_px in off.items():
            if picture == number:
                xy_px[point, 0] += moved_px
        seen.append(detection(xy_px, 0.01))
    return seen


POINTS: dict[str, object] = {**CIRCLES, "diameter_mm": 1e-3}
MOVED = {(2, 5): 0.3, (2, 6): -0.3, (7, 0): 0.045}


def solved_to(outlier_px: float | None) -> Calibration:
    scene = CircleScene(rows=7, spacing_mm=30.0, focal_px=FOCAL_PX)
    pictures = [of_picture(number, one) for number, one in enumerate(of_scene(scene, MOVED))]
    profile = a_profile(POINTS)
    assert profile.target is not None
    choices = SolveChoices("none", outlier_px=outlier_px)
    return solve(profile, target_of(profile.target), pictures, choices)


@pytest.mark.slow
def test_points_beyond_a_limit_are_left_out_and_all_is_solved_again():
    found = solved_to(0.04)
    shown = {r.picture: set(r.ids.tolist()) for r in found.residuals}
    assert set(range(28)) - shown[2] == {5, 6}
    assert 0 not in shown[7]
    assert all(np.linalg.norm(r.residual_px, axis=1).max() <= 0.04 for r in found.residuals)
    left_out = 28 * len(POSES) - sum(len(ids) for ids in shown.values())
    assert 3 <= left_out < 10
    told = f"{left_out} of 280 points were left out, further than 0.04 px"
    assert any(note.startswith(told) for note in found.verdict.notes)


def test_a_limit_that_leaves_half_of_the_points_is_refused():
    with pytest.raises(CalibrationError, match=r"beyond 0.004 px .* of 280") as told:
        solved_to(0.004)
    assert "--outlier-px" in str(told.value)
