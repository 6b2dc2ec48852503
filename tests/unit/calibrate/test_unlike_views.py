"""`rig calibrate` on folders of unlike views: another size, on its side, upside down, mirrored."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.calibrate.collection import Collection
from rig.calibrate.solve import SolveChoices
from rig.calibrate.take import Operator, read_stored
from rig.errors import CalibrationError
from rig.geometry.bundle import Calibration
from rig.interrupts import Interrupts
from rig.optics.target import target_of
from rig.profile import FolderCameraConfig, Profile, SimCameraConfig
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry

UNLIKE = (
    "world.renderer=analytic",
    "camera.sizes_px.left=[400,250]",
    "camera.sizes_px.middle=[480,300]",
    "camera.sizes_px.right=[250,400]",
    "world.optics.focal_px=370.0",
    "world.view_errors.left.focal_px=270.0",
    "world.view_errors.left.rotation_deg=[0.3,-0.2,180.0]",
    "world.view_errors.right.focal_px=280.0",
    "world.view_errors.right.rotation_deg=[0.2,0.3,90.0]",
    "world.hand.nearest_mm=500.0",
    "world.sensor.read_noise_levels=0.5",
    "target.columns=8",
)
PICTURES, HELD_S = 18, 1.2


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Profile, World]:
    """A folder for every view, of a board with as many corners as fit either way up."""
    rig = load_profile("sim-mixed", UNLIKE)
    clock = VirtualClock()
    world = World(rig, clock=clock, carriage=Slide(), scene="board", in_hand=True)
    root = tmp_path_factory.mktemp("taken")
    files = {view.name: f"{view.name}_*.png" for view in rig.views}
    assert isinstance(rig.camera, SimCameraConfig)
    with SimCamera(rig.camera, world) as camera:
        for number in range(PICTURES):
            clock.sleep_s(HELD_S * (number + 1) - 0.3 - clock.now_s())
            for frame in camera.grab(1.0).frames:
                cv2.imwrite(str(root / f"{frame.view}_{number}.png"), frame.image)
    folder = FolderCameraConfig(kind="folder", folder=str(root), files=files)
    return rig.model_copy(update={"camera": folder, "world": None, "stage": None}), world


def calibrated(profile: Profile) -> Calibration:
    assert profile.target is not None
    collection = Collection(profile, target_of(profile.target))
    with Interrupts() as interrupts:
        read_stored(collection, Operator(interrupts, lambda *_: None, lambda *_: None))
    return collection.solved(SolveChoices(lens="brown5"))


@pytest.mark.slow
def test_views_of_any_size_and_way_up_are_calibrated(taken: tuple[Profile, World]) -> None:
    profile, world = taken
    found = calibrated(profile)
    truth = true_geometry(load_profile("sim-mixed", UNLIKE), world.moment(0.0))
    for camera, true in zip(found.geometry.cameras, truth.cameras, strict=True):
        assert (camera.width_px, camera.height_px) == (true.width_px, true.height_px)
        assert camera.fx_px == pytest.approx(true.fx_px, rel=0.01)
    assert found.geometry.centres_mm() == pytest.approx(truth.centres_mm(), abs=1.0)
    for pose, true in zip(found.geometry.cam_from_reference, truth.cam_from_reference, strict=True):
        assert pose.rotation == pytest.approx(true.rotation, abs=0.01)
    assert found.rms_px < 0.1
    assert not {"swapped", "moved", "unsynchronised", "bumped"} & {
        reason.code for reason in found.verdict.reasons
    }


@pytest.mark.slow
def test_a_view_with_mirrored_pictures_is_named(
    taken: tuple[Profile, World], tmp_path: Path
) -> None:
    profile, _ = taken
    assert isinstance(profile.camera, FolderCameraConfig)
    for file in Path(profile.camera.folder).iterdir():
        picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        assert picture is not None
        mirrored = picture[:, ::-1] if file.name.startswith("right") else picture
        cv2.imwrite(str(tmp_path / file.name), np.ascontiguousarray(mirrored))
    camera = profile.camera.model_copy(update={"folder": str(tmp_path)})
    with pytest.raises(CalibrationError, match=r"^view right: the pictures are mirrored"):
        calibrated(profile.model_copy(update={"camera": camera}))


@pytest.mark.slow
def test_the_same_picture_twelve_times_is_named(
    taken: tuple[Profile, World], tmp_path: Path
) -> None:
    profile, _ = taken
    assert isinstance(profile.camera, FolderCameraConfig)
    for view in profile.views:
        content = (Path(profile.camera.folder) / f"{view.name}_2.png").read_bytes()
        for number in range(12):
            (tmp_path / f"{view.name}_{number}.png").write_bytes(content)
    camera = profile.camera.model_copy(update={"folder": str(tmp_path)})
    with pytest.raises(CalibrationError, match="12 pictures show the board at 1 place only"):
        calibrated(profile.model_copy(update={"camera": camera}))
