from pathlib import Path

import cv2
import numpy as np
import pytest
from rig_drivers.stored.folder import FolderCamera

from rig.devices import SystemClock
from rig.errors import ConfigError, DeviceError, DeviceLostError, DeviceNotFoundError
from rig.profile import FolderCameraConfig, ViewConfig

VIEWS = [
    ViewConfig(name="left", x_steps=0.0, y_steps=0.0),
    ViewConfig(name="right", x_steps=1.0, y_steps=0.0),
]


def camera(folder: Path, left: str, right: str) -> FolderCamera:
    config = FolderCameraConfig(
        kind="folder", folder=str(folder), files={"left": left, "right": right}
    )
    return FolderCamera(config, VIEWS, root=folder, clock=SystemClock())


def image(level: int, *, dtype: type = np.uint8, shape: tuple[int, ...] = (6, 8)) -> np.ndarray:
    return np.full(shape, level, dtype)


def save(path: Path, pixels: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), pixels)


def levels(taken: FolderCamera) -> list[int]:
    return [int(multiview.frames[0].image[0, 0]) for multiview in taken.stream()]


@pytest.mark.parametrize("suffix", ["png", "tiff", "pgm"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_grey_images_come_as_they_were_stored(tmp_path: Path, suffix: str, dtype: type):
    stored = np.arange(48).reshape(6, 8).astype(dtype) * (200 if dtype == np.uint16 else 5)
    save(tmp_path / f"a.{suffix}", stored)
    save(tmp_path / f"b.{suffix}", stored)
    with camera(tmp_path, f"a.{suffix}", f"b.{suffix}") as opened:
        np.testing.assert_array_equal(opened.grab(1.0).frames[0].image, stored)


@pytest.mark.parametrize("channels", [3, 4])
def test_colour_becomes_grey(tmp_path: Path, channels: int):
    pixels = image(0, shape=(6, 8, channels))
    pixels[..., 1] = 100  # green counts for 0.587
    pixels[..., 3:] = 255
    save(tmp_path / "a.png", pixels)
    save(tmp_path / "b.png", pixels)
    with camera(tmp_path, "a.png", "b.png") as opened:
        assert (opened.grab(1.0).frames[0].image == 59).all()


@pytest.mark.parametrize(("dtype", "scale"), [(np.uint8, 1), (np.uint16, 256)])
@pytest.mark.parametrize("channels", [3, 4])
def test_colour_stays_beside_the_grey(tmp_path: Path, dtype: type, scale: int, channels: int):
    pixels = np.zeros((6, 8, channels), dtype)
    pixels[:] = (10 * scale, 20 * scale, 200 * scale, 255 * scale)[:channels]  # blue first
    save(tmp_path / "a.png", pixels)
    save(tmp_path / "b.png", pixels)
    with camera(tmp_path, "a.png", "b.png") as opened:
        colour = opened.grab(1.0).frames[1].colour
    assert colour is not None
    assert colour.shape == (6, 8, 3)
    assert (colour == (200, 20, 10)).all()


def test_a_grey_file_has_no_colour(tmp_path: Path):
    save(tmp_path / "a.png", image(7))
    save(tmp_path / "b.png", image(7))
    with camera(tmp_path, "a.png", "b.png") as opened:
        assert opened.grab(1.0).frames[0].colour is None


def test_numbers_in_names_sort_as_numbers(tmp_path: Path):
    for number in (1, 2, 10):
        save(tmp_path / f"left{number}.png", image(number))
        save(tmp_path / f"right{number}.png", image(number))
    with camera(tmp_path, "left*.png", "right*.png") as opened:
        assert levels(opened) == [1, 2, 10]


@pytest.mark.parametrize("pattern", ["stop_*/sample_*/{}.png", "**/{}.png"])
def test_the_frames_of_a_sweep_can_be_replayed(tmp_path: Path, pattern: str):
    level = 0
    for stop in ("stop_000_0400.0mm_forward", "stop_001_0450.0mm_forward"):
        for sample in ("sample_00", "sample_01"):
            level += 1
            for view in ("left", "right"):
                save(tmp_path / stop / sample / f"{view}.png", image(level))
    with camera(tmp_path, pattern.format("left"), pattern.format("right")) as opened:
        assert levels(opened) == [1, 2, 3, 4]


def test_after_the_last_image_a_grab_says_so(tmp_path: Path):
    save(tmp_path / "a.png", image(1))
    save(tmp_path / "b.png", image(1))
    with camera(tmp_path, "a.png", "b.png") as opened:
        opened.grab(1.0)
        with pytest.raises(DeviceLostError, match=r"asked for multi-view 2, .* holds 1"):
            opened.grab(1.0)


def refused(folder: Path, left: str, right: str) -> str:
    with pytest.raises(DeviceError) as caught, camera(folder, left, right) as opened:
        list(opened.stream())
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_what_is_missing_is_named(tmp_path: Path):
    save(tmp_path / "a.png", image(1))
    assert "view right: 'b.png' matches nothing" in refused(tmp_path, "a.png", "b.png")
    assert "is no folder" in refused(tmp_path / "nowhere", "a.png", "b.png")


def test_views_of_different_count_are_refused(tmp_path: Path):
    for name in ("left1", "left2", "right1"):
        save(tmp_path / f"{name}.png", image(1))
    assert "left 2, right 1" in refused(tmp_path, "left*.png", "right*.png")


def test_every_view_keeps_its_own_size(tmp_path: Path):
    save(tmp_path / "a.png", image(1))
    save(tmp_path / "b.png", image(2, shape=(9, 4)))
    with camera(tmp_path, "a.png", "b.png") as opened:
        taken = opened.grab(1.0).images
    assert [one.shape for one in taken] == [(6, 8), (9, 4)]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (image(1, shape=(6, 9)), "9 x 6 px, 8 bit, the first image of view right is 8 x 6 px, 8"),
        (image(1, dtype=np.uint16), "8 x 6 px, 16 bit, the first image of view right is 8 x 6 px"),
    ],
)
def test_a_view_whose_images_differ_is_refused(tmp_path: Path, other: np.ndarray, said: str):
    for name in ("a1", "a2", "b1"):
        save(tmp_path / f"{name}.png", image(1))
    save(tmp_path / "b2.png", other)
    message = refused(tmp_path, "a*.png", "b*.png")
    assert "b2.png" in message
    assert said in message


def test_views_of_different_depth_are_refused(tmp_path: Path):
    save(tmp_path / "a.png", image(1))
    save(tmp_path / "b.png", image(1, dtype=np.uint16))
    message = refused(tmp_path, "a.png", "b.png")
    assert "differ in depth: left 8 x 6 px, 8 bit, right 8 x 6 px, 16 bit" in message


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\nbroken"])
def test_a_damaged_file_is_named(tmp_path: Path, content: bytes):
    save(tmp_path / "a.png", image(1))
    (tmp_path / "b.png").write_bytes(content)
    assert "b.png is no image or is damaged" in refused(tmp_path, "a.png", "b.png")


def test_floating_point_images_are_refused(tmp_path: Path):
    save(tmp_path / "a.tiff", image(1, dtype=np.float32))
    assert "holds float32; 8 or 16 bit" in refused(tmp_path, "a.tiff", "a.t*")


@pytest.mark.parametrize("pattern", ["/etc/*", ""])
def test_a_pattern_outside_the_folder_is_a_mistake_in_the_profile(tmp_path: Path, pattern: str):
    with pytest.raises(ConfigError, match=r"camera\.files\.left"), camera(tmp_path, pattern, "b"):
        pass


def test_missing_files_are_found_at_opening(tmp_path: Path):
    with pytest.raises(DeviceNotFoundError), camera(tmp_path, "a.png", "b.png"):
        pass


def parted(folder: Path, parts: dict[str, object], file: str = "pair_*.png") -> FolderCamera:
    config = FolderCameraConfig.model_validate(
        {
            "kind": "folder",
            "folder": str(folder),
            "files": {"left": file, "right": file},
            "parts": parts,
        }
    )
    return FolderCamera(config, VIEWS, root=folder, clock=SystemClock())


HALVES: dict[str, object] = {"left": "side-by-side:1", "right": "side-by-side:2"}


def test_pictures_that_hold_both_views_are_taken_apart(tmp_path: Path):
    for number in range(2):
        both = np.hstack([image(number, shape=(16, 16)), image(100 + number, shape=(16, 16))])
        save(tmp_path / f"pair_{number}.png", both)
    with parted(tmp_path, HALVES) as opened:
        seen = list(opened.stream())
    assert [[int(f.image[0, 0]) for f in m.frames] for m in seen] == [[0, 100], [1, 101]]
    assert {f.image.shape for m in seen for f in m.frames} == {(16, 16)}
    assert [m.skew_s for m in seen] == [0.0, 0.0]


def test_a_video_of_both_views_is_read_once_per_picture(tmp_path: Path):
    writer = cv2.VideoWriter(
        str(tmp_path / "pair.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 32)
    )
    for level in (10, 60):
        both = np.hstack([image(level, shape=(32, 32, 3)), image(200 - level, shape=(32, 32, 3))])
        writer.write(both)
    writer.release()
    with parted(tmp_path, HALVES, "pair.avi") as opened:
        seen = [[int(np.median(f.image)) for f in m.frames] for m in opened.stream()]
    assert np.abs(np.array(seen) - [[10, 190], [60, 140]]).max() <= 3


def test_parts_that_a_stored_picture_has_not_are_refused(tmp_path: Path):
    save(tmp_path / "pair_0.png", image(1, shape=(16, 33)))
    told = r"camera\.parts\.left: layout side-by-side needs .* found 33 x 16 px.*pair_0"
    with parted(tmp_path, HALVES) as opened, pytest.raises(ConfigError, match=told):
        opened.grab(1.0)


def test_parts_may_differ_in_size(tmp_path: Path):
    save(tmp_path / "pair_0.png", image(1, shape=(16, 33)))
    unequal: dict[str, object] = {"left": {"width_px": 16}, "right": {"x_px": 16}}
    with parted(tmp_path, unequal) as opened:
        shapes = [picture.shape for picture in opened.grab(1.0).images]
    assert shapes == [(16, 16), (16, 17)]


def test_views_of_the_same_pictures_without_parts_are_refused(tmp_path: Path):
    with pytest.raises(ValueError, match=r"files names pair_\*\.png for 2 views"):
        parted(tmp_path, {})


def test_two_files_of_two_views_each_need_not_be_of_one_size(tmp_path: Path):
    save(tmp_path / "front.png", image(1, shape=(16, 32)))
    save(tmp_path / "back.png", image(2, shape=(16, 64)))
    views = tuple(ViewConfig(name=n, x_steps=i, y_steps=0.0) for i, n in enumerate("abcd"))
    config = FolderCameraConfig.model_validate(
        {
            "kind": "folder",
            "folder": str(tmp_path),
            "files": {"a": "front.png", "b": "front.png", "c": "back.png", "d": "back.png"},
            "parts": {
                **{"a": {"width_px": 16}, "b": {"x_px": 16}},
                **{"c": {"width_px": 40}, "d": {"x_px": 40}},
            },
        }
    )
    with FolderCamera(config, views, root=tmp_path, clock=SystemClock()) as opened:
        shapes = [picture.shape for picture in opened.grab(1.0).images]
    assert shapes == [(16, 16), (16, 16), (16, 40), (16, 24)]
