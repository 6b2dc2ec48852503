"""Depth maps of slope maps, and the files that keep them."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from rig.curve import Curve, fit_curve
from rig.depth import (
    depth_from_slopes,
    read_pfm,
    write_bytes,
    write_depth_png,
    write_label_png,
    write_pfm,
)
from rig.epipolar import Label, SlopeMap
from rig.errors import StoreError
from tests.support.curve_points import noisy_sweep, physical_px


@pytest.fixture(scope="module")
def curve() -> Curve:
    return fit_curve(noisy_sweep(seed=1), models=["physical"]).best


def test_depth_follows_the_curve_and_ends_with_it(curve: Curve) -> None:
    slope_px = np.array([[physical_px(500.0), physical_px(1000.0), 100.0, np.nan]], np.float32)
    sigma_px = np.array([[0.01, 0.02, 0.02, np.nan]], np.float32)
    label = np.array([[Label.NEARER, Label.OCCLUSION, Label.NEARER, Label.NONE]], np.uint8)
    depth = depth_from_slopes(SlopeMap(slope_px, sigma_px, label), curve, max_sigma_pct=1.0)
    assert depth.depth_mm.dtype == depth.sigma_mm.dtype == np.float32
    assert depth.label.dtype == np.uint8
    np.testing.assert_allclose(depth.depth_mm, [[500.0, 1000.0, np.nan, np.nan]], rtol=1e-3)
    assert depth.label.tolist() == [[Label.NEARER, Label.OCCLUSION, Label.NONE, Label.NONE]]
    expected_mm = curve.depth_sigma_mm(slope_px, sigma_px)
    np.testing.assert_array_equal(depth.sigma_mm, expected_mm)
    assert np.isnan(depth.sigma_mm[0, 2:]).all()


def test_a_slope_that_is_not_known_well_enough_gives_no_depth(curve: Curve) -> None:
    slope_px = np.full((1, 3), physical_px(800.0), np.float32)
    per_px_pct = 100.0 * curve.depth_sigma_mm(slope_px, np.ones_like(slope_px)) / 800.0
    sigma_px = (np.array([[0.5, 0.9, 1.1]]) / per_px_pct).astype(np.float32)
    slopes = SlopeMap(slope_px, sigma_px, np.full((1, 3), Label.NEARER, np.uint8))
    depth = depth_from_slopes(slopes, curve, max_sigma_pct=1.0)
    assert depth.label.tolist() == [[Label.NEARER, Label.NEARER, Label.NONE]]
    assert np.isnan(depth.depth_mm).tolist() == [[False, False, True]]
    assert np.isnan(depth.sigma_mm).tolist() == [[False, False, True]]


MAPS = npst.arrays(
    np.float32,
    npst.array_shapes(min_dims=2, max_dims=2, max_side=6),
    elements=st.floats(width=32, allow_nan=True, allow_infinity=True),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@settings(deadline=None, max_examples=60)
@given(values=MAPS)
def test_pfm_round_trip_keeps_every_bit(values: np.ndarray, folder: Path) -> None:
    path = folder / "map.pfm"
    write_pfm(path, values)
    back = read_pfm(path)
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, values)


@settings(deadline=None, max_examples=60)
@given(values=MAPS)
def test_big_endian_pfm_is_read(values: np.ndarray, folder: Path) -> None:
    path = folder / "big.pfm"
    head = f"Pf\n{values.shape[1]} {values.shape[0]}\n1.0\n".encode()
    path.write_bytes(head + values[::-1].astype(">f4").tobytes())
    np.testing.assert_array_equal(read_pfm(path), values)


def test_pfm_is_little_endian_and_bottom_up(tmp_path: Path) -> None:
    write_pfm(tmp_path / "a.pfm", np.array([[1.0, 2.0], [3.0, 4.0]], np.float32))
    content = (tmp_path / "a.pfm").read_bytes()
    assert content.startswith(b"Pf\n2 2\n-1.0\n")
    assert np.frombuffer(content[-16:], "<f4").tolist() == [3.0, 4.0, 1.0, 2.0]


def test_opencv_reads_our_pfm(tmp_path: Path) -> None:
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    write_pfm(tmp_path / "a.pfm", values)
    theirs = cv2.imread(str(tmp_path / "a.pfm"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(theirs, values)


@settings(deadline=None, max_examples=150)
@given(
    content=st.binary(max_size=40)
    | st.builds(
        lambda kind, size, scale, data: b"%s\n%s\n%s\n%s" % (kind, size, scale, data),
        st.sampled_from([b"Pf", b"PF", b"P5", b"pf", b""]),
        st.sampled_from([b"1 1", b"0 1", b"1 0", b"-1 1", b"1", b"1.5 1", b"999999999 999999999"]),
        st.sampled_from([b"-1.0", b"1", b"0", b"nan", b"inf", b"1e999", b"x", b"1e-999"]),
        st.binary(max_size=8),
    )
)
def test_malformed_pfm_is_refused_or_a_map(content: bytes, folder: Path) -> None:
    path = folder / "odd.pfm"
    path.write_bytes(content)
    try:
        values = read_pfm(path)
    except StoreError as error:
        assert str(path) in str(error)  # either outcome is right
        return
    assert (values.ndim, values.dtype) == (2, np.float32)
    assert content.startswith(b"Pf")
    assert content.endswith(values[::-1].tobytes()) or content.endswith(
        values[::-1].astype(">f4").tobytes()
    )


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "expected a PFM header"),
        (b"P5\n1 1\n255\n\0", "expected a PFM header"),
        (b"PF\n1 1\n-1\n" + bytes(12), "colour PFM"),
        (b"Pf\n2 1\n-1\n" + bytes(4), "2 x 1 px need 8 bytes, found 4"),
        (b"Pf\n1 1\n-1\n" + bytes(5), "need 4 bytes, found 5"),
        (b"Pf\n1 1\n0\n" + bytes(4), "none may be 0"),
        (b"Pf\n0 1\n-1\n", "none may be 0"),
        (b"Pf\n1 1\n1e999\n" + bytes(4), "none may be 0"),
    ],
)
def test_each_fault_of_a_pfm_is_named(content: bytes, says: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.pfm"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=says):
        read_pfm(path)


def test_a_missing_pfm_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"none\.pfm: cannot be read: No such file"):
        read_pfm(tmp_path / "none.pfm")


@pytest.mark.parametrize(
    "values",
    [np.zeros((2, 2)), np.zeros((2, 2, 3), np.float32), np.zeros((0, 2), np.float32)],
)
def test_pfm_of_another_shape_or_type_is_refused(values: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"a grey PFM holds \(H, W\) of float32"):
        write_pfm(tmp_path / "a.pfm", values)
    assert not list(tmp_path.iterdir())


def test_depth_png_holds_whole_millimetres_and_0_for_none(tmp_path: Path) -> None:
    path = tmp_path / "depth.png"
    write_depth_png(path, np.array([[400.4, 65535.0], [np.nan, 1.0]], np.float32))
    back = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert back is not None
    assert back.dtype == np.uint16
    assert back.tolist() == [[400, 65535], [0, 1]]


@pytest.mark.parametrize("wrong_mm", [65536.0, 0.3, -5.0, np.inf])
def test_depth_that_a_png_cannot_hold_is_refused(wrong_mm: float, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"1 depths, .* do not fit a 16-bit PNG"):
        write_depth_png(tmp_path / "depth.png", np.array([[500.0, wrong_mm]], np.float32))
    assert not list(tmp_path.iterdir())


def test_label_png_holds_the_labels(tmp_path: Path) -> None:
    label = np.array([[0, 1], [2, 3]], np.uint8)
    write_label_png(tmp_path / "label.png", label)
    back = cv2.imread(str(tmp_path / "label.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(back, label)


def test_writing_replaces_and_leaves_nothing_beside(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_bytes(path, b"old")
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "taken"
    (path / "inside").mkdir(parents=True)
    with pytest.raises(StoreError, match=r"taken: 3 bytes cannot be written: .*make room"):
        write_bytes(path, b"new")
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="No such file or directory"):
        write_bytes(tmp_path / "nowhere" / "a.bin", b"x")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, which Linux has")
def test_a_full_disk_is_named(tmp_path: Path) -> None:
    # The temporary name leads to a device that has no room, as a full disk does.
    (tmp_path / f".a.bin.{os.getpid()}.tmp").symlink_to("/dev/full")
    with pytest.raises(StoreError, match="No space left on device"):
        write_bytes(tmp_path / "a.bin", b"x" * 100)
    assert not list(tmp_path.iterdir())
