"""The frames of a capture in other programs' formats, read back by readers that are not ours."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.capture.capture import CaptureRequest, capture_depth
from rig.depth import write_pfm, write_picture_png
from rig.errors import ConfigError, StoreError
from rig.export.formats import capture_formats
from rig.export.frame_choice import FrameChoice
from rig.live.captured import CapturedFrame, read_capture
from rig.live.opening import open_depth_camera
from rig.testing.simulated import PROFILE, open_simulated_rig
from tests.support.command import Command

FRAMES = 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exports") / "maps"
    request = CaptureRequest(
        frames=FRAMES, duration_s=None, folder=folder, recording=folder.parent / "all.mcap"
    )
    with open_simulated_rig() as camera:
        capture_depth(camera, request, lambda *_: None)
    return folder


@pytest.fixture(scope="module")
def recording(folder: Path) -> Path:
    return folder.parent / "all.mcap"


@pytest.fixture(scope="module")
def slopes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exports") / "slopes"
    request = CaptureRequest(frames=1, duration_s=None, folder=folder)
    with open_depth_camera(PROFILE, curve="none", calibration="none") as camera:
        capture_depth(camera, request, lambda *_: None)
    return folder


@pytest.fixture(scope="module")
def frame(folder: Path) -> CapturedFrame:
    return list(read_capture(folder))[1]


def exported(rig: Command, source: Path, target: str, out: Path, *more: str) -> dict[str, Any]:
    answer = rig("export", source, "--format", target, "--out", out, *more, "--json")
    assert answer.code == 0, answer.err
    return answer.json


def test_npz_holds_every_map_with_both_times(
    rig: Command, folder: Path, frame: CapturedFrame, tmp_path: Path
):
    told = exported(rig, folder, "npz", tmp_path)
    assert told == {
        "capture": str(folder),
        "format": "npz",
        "out": str(tmp_path),
        "frames": FRAMES,
        "points": None,
    }
    assert len(list(tmp_path.iterdir())) == FRAMES
    with np.load(tmp_path / "frame_00001.npz", allow_pickle=False) as archive:
        for name in ("depth_mm", "sigma_mm", "slope_px", "label", "image"):
            assert np.array_equal(archive[name], getattr(frame, name), equal_nan=True), name
            assert archive[name].dtype == getattr(frame, name).dtype
        assert int(archive["frame"]) == 1
        assert int(archive["time_ns"]) == frame.time_ns
        assert float(archive["timestamp_s"]) == frame.timestamp_s
        assert (archive["camera_matrix"] == frame.camera.matrix).all()
        assert (archive["common_from_reference"] == np.eye(3)).all()
        assert json.loads(str(archive["facts"])) == frame.facts
        assert "colour" not in archive
        assert "sigma_px" not in archive


def test_virtual_depth_of_a_lenslet_camera_goes_along(rig: Command, slopes: Path, tmp_path: Path):
    box, out = tmp_path / "box", tmp_path / "out"
    shutil.copytree(slopes, box)
    (frame,) = read_capture(box)
    assert frame.virtual_depth is None
    write_pfm(box / "virtual_depth_00000.pfm", 2.5 * frame.slope_px)

    exported(rig, box, "npz", out)
    exported(rig, box, "tiff", out)

    with np.load(out / "frame_00000.npz") as archive:
        virtual = archive["virtual_depth"]
    assert np.array_equal(virtual, 2.5 * frame.slope_px, equal_nan=True)
    read = cv2.imread(str(out / "virtual_depth_00000.tiff"), cv2.IMREAD_UNCHANGED)
    assert read is not None
    assert np.array_equal(read, virtual, equal_nan=True)
    said = (out / "virtual_depth_00000.tiff").read_bytes()
    assert b'"unit": "distances from lenslets to sensor"' in said


def test_the_picture_of_a_capture_is_that_of_its_frames(frame: CapturedFrame):
    with open_simulated_rig() as camera:
        _, live = (one for one, _ in zip(camera, range(2), strict=False))
    assert frame.image is not None
    assert frame.image.dtype == np.uint8
    assert (frame.image == live.image).all()
    assert frame.facts["image_full_scale"] == 255
    assert frame.colour is None


def test_tiff_is_read_by_two_other_programs(
    rig: Command, folder: Path, frame: CapturedFrame, tmp_path: Path
):
    image = pytest.importorskip("PIL.Image", reason="the extra `report` is missing")
    assert exported(rig, folder, "tiff", tmp_path)["points"] is None
    assert len(list(tmp_path.iterdir())) == 2 * FRAMES
    for kind, values in (("depth", frame.depth_mm), ("sigma", frame.sigma_mm)):
        path = tmp_path / f"{kind}_00001.tiff"
        with image.open(path) as opened:
            assert opened.mode == "F"
            assert np.array_equal(np.asarray(opened), values, equal_nan=True)
            told = json.loads(opened.tag_v2[270])
        by_opencv = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
        assert np.array_equal(by_opencv, values, equal_nan=True)
        assert (told["map"], told["unit"], told["frame"]) == (kind, "mm", 1)
        assert (told["time_ns"], told["timestamp_s"]) == (frame.time_ns, frame.timestamp_s)
        assert ("from" in told) == (kind == "depth")


def points_of(frame: CapturedFrame) -> np.ndarray:
    """x and y by the law of a pinhole, in our own words."""
    depth_mm = frame.depth_mm.astype(float)
    (focal_px, _, x_px), (_, _, y_px), _ = frame.camera.matrix
    y, x = np.indices(depth_mm.shape)
    ray = ((x - x_px) / focal_px, (y - y_px) / focal_px, np.ones_like(depth_mm))
    return np.stack(ray, axis=-1) * depth_mm[..., None]


def test_ply_is_grey_by_the_picture(
    rig: Command, folder: Path, frame: CapturedFrame, tmp_path: Path
):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    told = exported(rig, folder, "ply", tmp_path, "--frames", "1-1")
    known = np.isfinite(frame.depth_mm)
    assert (told["frames"], told["points"]) == (1, known.sum())
    assert [path.name for path in tmp_path.iterdir()] == ["points_00001.ply"]
    cloud = trimesh.load(tmp_path / "points_00001.ply", process=False)
    assert np.asarray(cloud.vertices) == pytest.approx(points_of(frame)[known], rel=1e-6)
    assert frame.image is not None
    assert (np.asarray(cloud.colors)[:, :3] == frame.image[known][:, None]).all()
    data = cloud.metadata["_ply_raw"]["vertex"]["data"]
    assert (data["sigma_mm"].ravel() == frame.sigma_mm[known]).all()
    assert (data["label"].ravel() == frame.label[known]).all()
    header = (tmp_path / "points_00001.ply").read_bytes()[:600].decode("ascii", "replace")
    assert f'"time_ns": {frame.time_ns}, "timestamp_s": {frame.timestamp_s}' in header


def test_ply_has_the_colours_of_a_capture_that_has_some(
    rig: Command, folder: Path, frame: CapturedFrame, tmp_path: Path
):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    rgb = np.random.default_rng(2).integers(0, 256, (*frame.depth_mm.shape, 3), np.uint8)
    path = folder / "colour_00001.png"
    write_picture_png(path, rgb)
    try:
        assert (frame.colour == rgb).all()
        exported(rig, folder, "ply", tmp_path, "--frames", "1")
    finally:
        path.unlink()
    cloud = trimesh.load(tmp_path / "points_00001.ply", process=False)
    assert (np.asarray(cloud.colors)[:, :3] == rgb[np.isfinite(frame.depth_mm)]).all()


def read_pcd(content: bytes) -> tuple[dict[str, str], np.ndarray]:
    """A reader of PCD files as their specification tells: header of words, then packed points."""
    header, words = b"", {}
    while not header.startswith(b"DATA"):
        header, _, content = content.partition(b"\n")
        if not header.startswith(b"#"):
            key, _, value = header.decode("ascii").partition(" ")
            words[key] = value
    kinds = [
        {"F": "<f", "U": "<u", "I": "<i"}[kind] + size
        for kind, size in zip(words["TYPE"].split(), words["SIZE"].split(), strict=True)
    ]
    dtype = np.dtype(list(zip(words["FIELDS"].split(), kinds, strict=True)))
    return words, np.frombuffer(content, dtype).reshape(int(words["HEIGHT"]), int(words["WIDTH"]))


def test_pcd_is_organised_and_packs_colour(
    rig: Command, folder: Path, frame: CapturedFrame, tmp_path: Path
):
    known = np.isfinite(frame.depth_mm)
    assert exported(rig, folder, "pcd", tmp_path)["frames"] == FRAMES
    words, points = read_pcd((tmp_path / "points_00001.pcd").read_bytes())
    assert words["VERSION"] == "0.7"
    assert words["FIELDS"] == "x y z rgb sigma_mm label"
    assert words["DATA"] == "binary"
    assert int(words["POINTS"]) == known.size
    assert points.shape == known.shape
    xyz = np.stack([points[axis] for axis in "xyz"], axis=-1)
    assert xyz == pytest.approx(points_of(frame), rel=1e-6, nan_ok=True)
    assert np.array_equal(points["sigma_mm"], frame.sigma_mm, equal_nan=True)
    assert (points["label"] == frame.label).all()
    packed = points["rgb"].view("<u4")
    assert frame.image is not None
    for shift in (16, 8, 0):
        assert (((packed >> shift) & 255) == frame.image).all()
    text = (tmp_path / "points_00001.pcd").read_bytes()[:400].decode("ascii", "replace")
    assert f'# {{"frame": 1, "time_ns": {frame.time_ns}, ' in text


def test_slopes_alone_have_maps_and_no_points(rig: Command, slopes: Path, tmp_path: Path):
    (frame,) = read_capture(slopes)
    exported(rig, slopes, "npz", tmp_path)
    with np.load(tmp_path / "frame_00000.npz") as archive:
        assert np.array_equal(archive["sigma_px"], frame.sigma_px, equal_nan=True)
        assert "depth_mm" not in archive
        assert "camera_matrix" not in archive
    exported(rig, slopes, "tiff", tmp_path)
    assert {path.name for path in tmp_path.glob("*.tiff")} == {
        "slope_00000.tiff", "sigma_00000.tiff"
    }  # fmt: skip
    path = tmp_path / "slope_00000.tiff"
    by_opencv = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
    assert np.array_equal(by_opencv, frame.slope_px, equal_nan=True)
    for target in ("ply", "pcd"):
        refused = rig("export", slopes, "--format", target, "--out", tmp_path)
        assert refused.code == 1
        assert "run `rig calibrate simulated-rig`" in refused.err
    assert not list(tmp_path.glob("*.p[lc][yd]"))


def test_the_sigma_of_another_map_is_refused(folder: Path, frame: CapturedFrame):
    with pytest.raises(StoreError, match="holds the sigma of the depth, asked for that of the"):
        _ = frame.sigma_px


def test_a_grey_value_of_ten_bits_fills_the_colours(folder: Path, frame: CapturedFrame):
    from dataclasses import replace

    from rig.export.cloud import cloud_of

    path = folder / "image_00001.png"
    before = path.read_bytes()
    image = np.full(frame.depth_mm.shape, 1023, np.uint16)
    image[0] = 512
    write_picture_png(path, image)
    try:
        rgb = cloud_of(replace(frame, facts={**frame.facts, "image_full_scale": 1023})).rgb
        without = cloud_of(replace(frame, facts={"sigma_unit": "mm"})).rgb
    finally:
        path.write_bytes(before)
    assert rgb is not None
    assert without is not None
    assert (rgb[0] == 128).all()  # 512 / 1023 of 255, rounded
    assert (rgb[1:] == 255).all()
    assert (without == np.where(image == 512, 2, 4)[..., None]).all()  # of all 16 bits


def test_damaged_pictures_are_refused(folder: Path, frame: CapturedFrame):
    image, colour = folder / "image_00001.png", folder / "colour_00001.png"
    before = image.read_bytes()
    try:
        image.write_bytes(b"")
        with pytest.raises(StoreError, match=r"image_00001\.png: is no grey picture"):
            _ = frame.image
        colour.write_bytes(before)  # grey
        with pytest.raises(StoreError, match="is no 8-bit picture in colour"):
            _ = frame.colour
        image.unlink()
        assert frame.image is None
    finally:
        image.write_bytes(before)
        colour.unlink()


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("gone", "--format", "npz"), 1, "no such capture"),
        (("FOLDER", "--format", "ros"), 2, "holds no captures; those that do are ply, npz"),
        (("1", "--format", "pcd"), 2, "give the folder of `rig capture --out`"),
        (("0", "--format", "ros"), 2, "numbers begin with 1"),
        (("FOLDER", "--format", "npz", "--refit"), 2, "--format npz does not know --refit"),
        (("1", "--format", "ply", "--frames", "1"), 2, "does not know --frames"),
        (("FOLDER", "--format", "npz", "--frames", "2-1"), 2, "2-1 runs backward; write 1-2"),
        (("FOLDER", "--format", "npz", "--frames", ""), 2, "expected a number or a span"),
        (("FOLDER", "--format", "npz", "--frames", "3"), 1, "asked for frame 3 of a capture that"),
        (("FOLDER", "--format", "npz", "--frames", "0,4-7"), 1, "frames 4-7 of a capture that has"),
        (("FOLDER", "--format", "npz", "--out", "FOLDER/camera.json"), 1, "cannot be made"),
    ],
)
def test_what_cannot_be_exported_is_one_line(
    rig: Command, folder: Path, tmp_path: Path, arguments: tuple[str, ...], code: int, says: str
):
    words = [word.replace("FOLDER", str(folder)) for word in arguments]
    out = () if "--out" in words else ("--out", tmp_path)
    answer = rig("export", *words, *out)
    assert answer.code == code
    assert says in " ".join(answer.err.replace("│", " ").split())


@pytest.mark.parametrize("target", ["pcd", "ply", "tiff", "npz"])
def test_a_recording_has_no_maps_yet_and_no_folder_is_left(
    rig: Command, recording: Path, tmp_path: Path, target: str
):
    out = tmp_path / "out"
    answer = rig("export", recording, "--format", target, "--out", out)
    assert answer.code == 1
    assert "a recording holds pictures" in answer.err
    assert "rig capture PROFILE --set camera.kind=recording" in answer.err
    assert not out.exists()


def test_a_folder_without_frames_is_refused(rig: Command, tmp_path: Path):
    (tmp_path / "frames.jsonl").write_text("")
    answer = rig("export", tmp_path, "--format", "npz")
    assert answer.code == 1
    assert "has no frames" in answer.err


def test_without_out_a_name_is_made_of_both(
    rig: Command, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    answer = rig("export", folder, "--format", "npz", "--frames", "2")
    assert answer.code == 0, answer.err
    assert answer.out == f"maps_npz: npz, 1 frame of {folder}\n"
    assert [path.name for path in (tmp_path / "maps_npz").iterdir()] == ["frame_00002.npz"]


def captured(indices: list[int]) -> Iterator[CapturedFrame]:
    return (CapturedFrame(i, 0.0, None, None, {}, Path()) for i in indices)


@settings(deadline=None)
@given(
    spans=st.lists(st.tuples(st.integers(0, 40), st.integers(0, 5)), min_size=1, max_size=4),
    there=st.sets(st.integers(0, 50)).map(sorted),
)
def test_chosen_are_those_that_were_written_down_and_captured(
    spans: list[tuple[int, int]], there: list[int]
):
    text = ",".join(f"{a}-{a + n}" if n else f" {a} " for a, n in spans)
    wanted = {i for a, n in spans for i in range(a, a + n + 1)}
    missing = any(not set(range(a, a + n + 1)) & set(there) for a, n in spans)
    chosen: list[int] = []
    try:
        chosen.extend(frame.index for frame in FrameChoice.parse(text).of(captured(there)))
    except StoreError:
        assert missing
    else:
        assert not missing
    assert chosen == sorted(wanted & set(there))


@settings(deadline=None)
@given(text=st.text(max_size=12) | st.text("0123456789,- ", max_size=12))
def test_a_choice_is_read_or_refused(text: str):
    try:
        choice = FrameChoice.parse(text)
    except ConfigError as error:
        assert repr(text) in error.found
        return
    assert all(0 <= first <= last for first, last in choice.spans)


def test_captures_go_out_in_these_formats():
    assert set(capture_formats()) >= {"npz", "tiff", "pcd", "ply"}
