"""Printed boards: found again, at true size, in every format."""

import re
import shutil
import struct
import subprocess
import zlib
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rig.errors import ConfigError
from rig.targets import AprilGrid, CharucoBoard, CircleGrid, Target, find_target
from rig.targets.checkerboard import Checkerboard
from rig.targets.printing.board_areas import board_areas
from rig.targets.printing.drawing import Area, Drawing, Rect
from rig.targets.printing.pdf import pdf_of
from rig.targets.printing.png import png_of
from rig.targets.printing.sheet import RULER_MM, draw_sheet, page_mm
from rig.targets.printing.svg import svg_of
from rig.targets.printing.write import write_sheet
from tests.support.command import Command

CHARUCO = CharucoBoard(7, 5, 30.0, 22.5, "4X4_50")
BOARDS = [
    Checkerboard(9, 6, 25.0),
    CHARUCO,
    CHARUCO.with_changes(inverted=True),
    CHARUCO.with_changes(legacy_pattern=True, squares_down=4),
    CHARUCO.with_changes(dictionary="APRILTAG_36H11", marker_mm=21.0),
    AprilGrid(5, 4, 35.0, 0.3),
    CircleGrid(4, 9, 22.0, 18.0),
]
DPI = 100.0
PX_PER_MM = DPI / 25.4


def sheet_of(target: Target) -> Drawing:
    return draw_sheet(target, page_mm("a3"), 5.0)


def decoded(data: bytes) -> NDArray[np.uint8]:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return np.asarray(picture, np.uint8)


def assert_true_size(
    picture: NDArray[np.uint8], target: Target, px_per_mm: float, *, within_px: float = 0.05
) -> None:
    # A camera blurs; edges along the pixel grid without any blur tell their place badly.
    blurred = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), 0.9)
    found = find_target(np.asarray(blurred, np.float32), target)
    points_mm = target.points_mm.reshape(-1, 3)[:, :2]
    assert len(found) == len(points_mm)
    expected_px = (points_mm - points_mm.mean(axis=0)) * px_per_mm
    apart_px = found.xy_px - found.xy_px.mean(axis=0) - expected_px
    assert np.abs(apart_px).max() < within_px


@pytest.mark.parametrize("target", BOARDS, ids=str)
def test_a_png_shows_the_board_at_its_size_and_says_its_resolution(target: Target):
    data = png_of(sheet_of(target), DPI)
    assert_true_size(decoded(data), target, PX_PER_MM)
    place = data.index(b"pHYs")
    x, y, unit = struct.unpack(">IIB", data[place + 4 : place + 13])
    assert (x, y, unit) == (3937, 3937, 1)
    stored = struct.unpack(">I", data[place + 13 : place + 17])[0]
    assert stored == zlib.crc32(data[place : place + 13])


def ink_runs(row: NDArray[np.float64]) -> tuple[float, float]:
    """First and last place of ink in a row of grey, to a part of a pixel."""
    ink = 1 - row / 255
    dark = np.flatnonzero(ink > 0.02)
    return dark[0] + 1 - ink[dark[0]], dark[-1] + ink[dark[-1]]


@pytest.mark.slow
def test_the_ruler_is_a_hundred_mm_long():
    drawing = sheet_of(CHARUCO)
    ruler = drawing.areas[-1]
    assert min(r.x_mm for r in ruler.rects) + RULER_MM == pytest.approx(
        max(r.x_mm + r.width_mm for r in ruler.rects)
    )
    picture = decoded(png_of(drawing, 600.0)).astype(np.float64)
    row = round((ruler.rects[1].y_mm + 0.1) * 600 / 25.4)
    low, high = ink_runs(picture[row])
    assert (high - low) * 25.4 / 600 == pytest.approx(RULER_MM, abs=0.05)


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="no pdftoppm (poppler-utils)")
@pytest.mark.parametrize("target", [BOARDS[0], BOARDS[2]], ids=str)
def test_a_pdf_shows_the_board_at_its_size(target: Target, tmp_path: Path):
    write_sheet(tmp_path / "board.pdf", sheet_of(target), DPI)
    subprocess.run(
        ["pdftoppm", "-r", f"{DPI:g}", "-gray", "board.pdf", "out"], cwd=tmp_path, check=True
    )
    picture = cv2.imread(str(next(tmp_path.glob("out*.pgm"))), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    # The rasteriser puts edges on a quarter of a pixel.
    assert_true_size(np.asarray(picture, np.uint8), target, PX_PER_MM, within_px=0.26)


def test_every_object_of_a_pdf_is_where_its_table_says():
    data = pdf_of(sheet_of(CHARUCO))
    table = int(data.rsplit(b"startxref\n", 1)[1].split()[0])
    entries = re.findall(rb"(\d{10}) 00000 n", data[table:])
    assert len(entries) == 6
    for number, entry in enumerate(entries, start=1):
        assert data[int(entry) :].startswith(b"%d 0 obj" % number)
    assert b"/PrintScaling /None" in data


@pytest.mark.parametrize("target", BOARDS, ids=str)
def test_an_svg_holds_the_same_rectangles_in_mm(target: Target):
    drawing = sheet_of(target)
    root = ElementTree.fromstring(svg_of(drawing))  # noqa: S314 (written by us)
    assert root.get("width") == f"{drawing.width_mm:g}mm"
    assert root.get("viewBox") == f"0 0 {drawing.width_mm:g} {drawing.height_mm:g}"
    paths = root.findall("{http://www.w3.org/2000/svg}path")
    assert len(paths) == len(drawing.areas)
    for path, area in zip(paths, drawing.areas, strict=True):
        assert path.get("fill") == area.ink
        numbers = re.findall(r"M([\d.]+) ([\d.]+)h([\d.]+)v([\d.]+)", path.get("d") or "")
        rects = [Rect(*map(float, found)) for found in numbers]
        for one, other in zip(rects, area.rects, strict=True):
            assert (one.x_mm, one.y_mm) == pytest.approx((other.x_mm, other.y_mm), abs=1e-5)


def test_rectangles_of_an_area_touch_without_a_seam():
    rects = tuple(Rect(1.03 + 0.5 * n, 2.0, 0.5, 5.0) for n in range(8))
    drawing = Drawing(10.0, 10.0, (Area("black", rects),), (), "seams")
    picture = decoded(png_of(drawing, 254.0))
    assert picture[40, 12:50].max() == 0


def test_boards_that_do_not_fit_are_refused_with_what_would():
    with pytest.raises(ConfigError, match=r"needs a page of 310 x 252 mm"):
        draw_sheet(Checkerboard(11, 8, 25.0), page_mm("a4"), 5.0)
    assert draw_sheet(Checkerboard(9, 6, 25.0), page_mm("270x210"), 5.0).width_mm == 270.0
    with pytest.raises(ConfigError, match="letter"):
        page_mm("legal")
    with pytest.raises(ConfigError, match="at most"):
        png_of(sheet_of(CHARUCO), 50_000.0)


def test_the_ink_of_a_board_is_half_of_its_squares():
    areas = board_areas(Checkerboard(9, 6, 25.0), 0.0, 0.0)
    assert sum(r.width_mm * r.height_mm for r in areas[0].rects) == 35 * 25.0**2


def test_the_verb_draws_the_target_of_a_profile_or_one_asked_for(rig: Command, tmp_path: Path):
    answer = rig("target", "sim", "--page", "a3", "--out", tmp_path / "a.svg", "--json")
    assert answer.code == 0
    assert answer.json["board_mm"] == [250.0, 175.0]
    out = tmp_path / "b.png"
    asked = ("--kind", "charuco", "--size", "7x5", "--square-mm", 30, "--page", "a4")
    assert rig("target", *asked, "--border-mm", 3, "--dpi", DPI, "--out", out).code == 0
    assert_true_size(decoded(out.read_bytes()), CHARUCO, PX_PER_MM)
    assert rig("target", "--out", out).code == 2
    assert rig("target", *asked, "--size", "7", "--out", out).code == 2
    assert rig("target", "hci-dino", "--out", out).code == 1
    assert "use .pdf" in rig("target", "sim", "--page", "a3", "--out", tmp_path / "a.doc").err
