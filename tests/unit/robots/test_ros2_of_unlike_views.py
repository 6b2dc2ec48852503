"""A bag of cameras of three sizes, one upside down and one on its side, by two readers."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rig_sim.optics import TrueCamera
from rosbags.highlevel import AnyReader

from rig.calibration_alone import curve_alone
from rig.capture.capture import CaptureRequest, capture_depth
from rig.live.opening import depth_camera
from rig.optics.calibrated import calibrated_optics
from rig.stored import Run
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry

UNLIKE = (
    "camera.sizes_px.left=[200,125]",
    "camera.sizes_px.middle=[240,150]",
    "camera.sizes_px.right=[125,200]",
    "world.capture_scene=board",
    "world.optics.focal_px=185.0",
    "world.view_errors.left.focal_px=135.0",
    "world.view_errors.left.rotation_deg=[0.3,-0.2,180.0]",
    "world.view_errors.right.focal_px=140.0",
    "world.view_errors.right.rotation_deg=[0.2,0.3,90.0]",
    "slopes.range_px=[-12.0,12.0]",
    "quality.depth_sigma_pct=10.0",
)
VIEWS = ("left", "middle", "right")
Reader = Callable[[Path], Iterator[tuple[str, Any]]]


def by_rosbags(path: Path) -> Iterator[tuple[str, Any]]:
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            yield connection.topic, reader.deserialize(raw, connection.msgtype)


def by_mcap(path: Path) -> Iterator[tuple[str, Any]]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, content in reader.iter_decoded_messages():
            yield channel.topic, content


@pytest.fixture(scope="module")
def small() -> SmallRig:
    return SmallRig(UNLIKE, name="sim-mixed")


@pytest.fixture(scope="module")
def recorded(small: SmallRig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    geometry = true_geometry(small.profile, small.world.moment(0.0))
    run = Run(small.profile, calibrated_optics(small.profile, geometry, None))
    run = replace(run, curve=curve_alone(run).within(run.profile))
    path = tmp_path_factory.mktemp("ros2") / "unlike.mcap"
    request = CaptureRequest(1, None, None, recording=path, recorded_as="ros2", points=True)
    with depth_camera(run) as camera:
        assert capture_depth(camera, request, lambda *_: None).failure is None
    return path


@pytest.mark.slow
@pytest.mark.parametrize("read", [by_rosbags, by_mcap])
def test_every_camera_fits_the_picture_beside_it(recorded: Path, read: Reader) -> None:
    found = dict(read(recorded))
    assert len(found) == 2 * len(VIEWS) + 5 + 1
    for name in (*VIEWS, "depth"):
        info = found[f"/{name}/camera_info"]
        picture = found[f"/{name}/{'image' if name == 'depth' else 'image_rect'}"]
        assert (info.width, info.height) == (picture.width, picture.height) == (240, 150)
        assert len(picture.data) == picture.step * picture.height
        times = [(m.header.stamp.sec, m.header.stamp.nanosec) for m in (info, picture)]
        assert times[0] == times[1]
    middle = found["/middle/camera_info"]
    assert (middle.k[0], middle.k[2], middle.k[5]) == (185.0, 119.5, 74.5)
    assert middle.d[0] == 0.08
    for name in ("left", "right"):
        info = found[f"/{name}/camera_info"]
        assert list(info.r) == [1, 0, 0, 0, 1, 0, 0, 0, 1]
        assert list(info.d) == [0.0] * 5
        assert np.array(info.k).reshape(3, 3) == pytest.approx(np.reshape(info.p, (3, 4))[:, :3])


@pytest.mark.slow
@pytest.mark.parametrize("read", [by_rosbags, by_mcap])
@pytest.mark.parametrize("name", ["left", "right"])
def test_p_leads_to_where_the_other_picture_looks_alike(
    recorded: Path, read: Reader, name: str
) -> None:
    found = dict(read(recorded))
    middle, other = (image_of(found[f"/{view}/image_rect"]) for view in ("middle", name))
    cloud = np.frombuffer(bytes(found["/depth/points"].data), "<f4").reshape(-1, 4)
    points_m = cloud[cloud[:, 3] < 0.02 * cloud[:, 2], :3]
    here = projected(found["/depth/camera_info"], points_m)
    there = projected(found[f"/{name}/camera_info"], points_m)
    inside = ((here > 6.0) & (here < 143.0)).all(axis=1)
    inside &= ((there > 6.0) & (there < 143.0)).all(axis=1)
    assert inside.sum() > 500
    wanted, there = grey_at(middle, here[inside]), there[inside]
    assert alike(wanted, grey_at(other, there)) > 0.95
    for aside_px in ((3.0, 0.0), (-3.0, 0.0), (0.0, 3.0), (0.0, -3.0)):
        assert alike(wanted, grey_at(other, there + aside_px)) < 0.9


@pytest.mark.slow
def test_frames_stand_where_the_cameras_do(recorded: Path, small: SmallRig) -> None:
    placed = {
        t.child_frame_id: t.transform for t in dict(by_rosbags(recorded))["/tf_static"].transforms
    }
    centres = dict(zip(VIEWS, map(centre_mm, small.world.moment(0.0).cameras), strict=True))
    for name in VIEWS:
        at = placed[f"{name}_optical_frame"].translation
        apart_mm = np.linalg.norm(centres[name] - centres["middle"])
        assert 1000.0 * np.linalg.norm([at.x, at.y, at.z]) == pytest.approx(apart_mm, abs=1e-6)


def centre_mm(camera: TrueCamera) -> np.ndarray:
    return np.asarray(camera.position_mm)


def image_of(message: Any) -> np.ndarray:
    return np.frombuffer(bytes(message.data), "u1").reshape(message.height, message.width)


def projected(info: Any, points_m: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) of points (N, 3) of the rectified reference, by P alone."""
    homogeneous = np.column_stack([points_m, np.ones(len(points_m))])
    at = homogeneous @ np.reshape(info.p, (3, 4)).T
    return at[:, :2] / at[:, 2:]


def grey_at(image: np.ndarray, at_px: np.ndarray) -> np.ndarray:
    columns, rows = np.rint(at_px).astype(int).T
    return image[rows, columns].astype(np.float64)


def alike(one: np.ndarray, other: np.ndarray) -> float:
    """Correlation of grey values, which lens and gain of a camera do not change."""
    return float(np.corrcoef(np.stack([one, other]))[0, 1])
