"""The picture for a person: read back, and looked at pixel by pixel."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.capture.picture import write_picture
from rig.depth import DepthMap
from rig.epipolar import SlopeMap
from rig.frames import Frame, MultiView
from rig.live.frame import DepthFrame
from rig.profile.load import load_profile

PROFILE = load_profile("sim")
STRIP_PX = 34
BAR_PX = 200


def measured(values: np.ndarray, *, is_depth: bool, bits: int = 8) -> DepthFrame:
    grey = np.arange(values.size).reshape(values.shape) * (2**bits - 1) // (values.size - 1)
    image = grey.astype(np.uint8 if bits == 8 else np.uint16)
    frames = tuple(Frame(view.name, image, timestamp_s=0.0, sequence=0) for view in PROFILE.views)
    values = values.astype(np.float32)
    label = np.where(np.isfinite(values), 2, 0).astype(np.uint8)
    slopes = SlopeMap(values, np.ones_like(values), label)
    depth = DepthMap(values, np.ones_like(values), label) if is_depth else None
    return DepthFrame(
        index=0,
        views=MultiView(frames),
        slopes=slopes,
        image=image,
        time_ns=0,
        latency_s=0.1,
        rig="sim",
        depth=depth,
        pinhole=None,
    )


def picture_of(path: Path, values: np.ndarray, *, is_depth: bool = True) -> np.ndarray:
    """The PNG as (H, W, 3), blue first."""
    written = write_picture(path / "it.png", measured(values, is_depth=is_depth), PROFILE.reference)
    picture = cv2.imread(str(written))
    assert picture is not None
    return picture.astype(int)


def ramp(low: float, high: float, width: int = 300) -> np.ndarray:
    return np.tile(np.linspace(low, high, width), (60, 1))


def warmth(colours: np.ndarray) -> np.ndarray:
    """Red less blue: rises along the colours from cool to warm, but for their dark ends."""
    return colours[..., 2] - colours[..., 0]


def bar_of(picture: np.ndarray, width: int) -> np.ndarray:
    """Colours of the scale: the run of coloured pixels in the strip below, right of the image."""
    row = picture[-STRIP_PX + 17, width:]
    coloured = np.flatnonzero(np.ptp(row, axis=-1) > 20)
    return row[coloured[0] : coloured[-1] + 1]


@pytest.mark.parametrize("width", [16, 40, 160, 300, 1280])
def test_pictures_of_any_width_have_a_whole_scale(tmp_path: Path, width: int):
    picture = picture_of(tmp_path, ramp(500.0, 900.0, width))
    assert picture.shape[0] == 60 + STRIP_PX
    assert picture.shape[1] >= 2 * width
    assert len(bar_of(picture, width)) == pytest.approx(BAR_PX, abs=2)
    assert np.all(picture[-STRIP_PX:, -8:] == 255)  # the last word ends before the picture does


def test_the_reference_image_is_on_the_left_as_it_is(tmp_path: Path):
    values = ramp(500.0, 900.0)
    picture = picture_of(tmp_path, values)
    grey = np.arange(values.size).reshape(values.shape) * 255 // (values.size - 1)
    assert np.array_equal(picture[:60, :300], np.repeat(grey[..., None], 3, axis=-1))


def test_more_bits_are_brought_to_the_range_of_a_screen(tmp_path: Path):
    deep = measured(ramp(500.0, 900.0), is_depth=True, bits=16)
    picture = cv2.imread(str(write_picture(tmp_path / "it.png", deep, PROFILE.reference)))
    assert picture is not None
    assert picture[0, 0].tolist() == [0, 0, 0]
    assert picture[59, 299].tolist() == [255, 255, 255]
    for_screen = deep.image.astype(float) * 255.0 / 65535.0
    assert np.abs(picture[:60, :300].astype(float) - for_screen[..., None]).max() < 0.51


@pytest.mark.parametrize("is_depth", [True, False])
def test_near_is_warm_and_far_is_cool(tmp_path: Path, is_depth: bool):
    # Small depths are near, and so are large slopes.
    values = ramp(500.0, 900.0) if is_depth else ramp(6.0, -6.0)
    colours = picture_of(tmp_path, values, is_depth=is_depth)[30, 300:600]
    assert warmth(colours[60]) > 150 > -150 > warmth(colours[-60])


@pytest.mark.parametrize("is_depth", [True, False])
def test_the_scale_runs_from_the_lowest_value_to_the_highest(tmp_path: Path, is_depth: bool):
    values = ramp(500.0, 900.0) if is_depth else ramp(-6.0, 6.0)
    picture = picture_of(tmp_path, values, is_depth=is_depth)
    bar, colours = bar_of(picture, 300), picture[30, 300:600]
    for share in (0.2, 0.4, 0.6, 0.8):
        of_bar = bar[round(share * (len(bar) - 1))]
        assert np.abs(of_bar - colours[round(share * 299)]).max() < 25


def test_where_there_is_no_answer_it_is_grey(tmp_path: Path):
    values = ramp(500.0, 900.0)
    values[10:20, 100:120] = np.nan
    picture = picture_of(tmp_path, values)
    assert np.all(picture[10:20, 400:420] == 128)
    assert np.ptp(picture[9, 400:420], axis=-1).min() > 0


def test_a_picture_without_any_answer_is_all_grey(tmp_path: Path):
    picture = picture_of(tmp_path, np.full((60, 300), np.nan))
    assert np.all(picture[:60, 300:600] == 128)


def test_one_pixel_far_off_does_not_take_the_colours_of_all_others(tmp_path: Path):
    values = ramp(500.0, 900.0)
    plain = picture_of(tmp_path, values)[:60, 300:]
    values[0, 0] = 1e6
    assert np.abs(picture_of(tmp_path, values)[:60, 300:] - plain)[1:].max() < 25


def words_px(text: str) -> int:
    return cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.48, 1)[0][0]


def turbo(levels: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.applyColorMap(levels.astype(np.uint8), cv2.COLORMAP_TURBO), int)


@pytest.mark.parametrize("width", [30, 300])
@pytest.mark.parametrize(
    ("low", "high", "is_depth", "first", "last"),
    [
        (500.0, 900.0, True, "500", "900 mm"),
        (500.0, 550.0, True, "500.00", "550.00 mm"),
        (500.0, 551.0, True, "500", "551 mm"),
        (-6.0, 6.0, False, "-6.00", "6.00 px per view step"),
    ],
)
def test_every_pixel_of_the_picture_is_where_it_belongs(
    tmp_path: Path, width: int, low: float, high: float, is_depth: bool, first: str, last: str
):
    """Image and colours side by side; below them the words, 8 px apart, and a bar of 200 px."""
    values = np.full((60, width), 0.3 * low + 0.7 * high)
    values[:2], values[-2:] = low, high
    picture = picture_of(tmp_path, values, is_depth=is_depth)
    grey = np.arange(values.size).reshape(values.shape) * 255 // (values.size - 1)
    share = (values.astype(np.float32) - low) / (high - low)
    at_px = max(width, words_px("reference view") + 8) + 8
    bar_px = at_px + words_px(first) + 8
    end_px = bar_px + BAR_PX + 8 + words_px(last) + 8
    whole = np.full((60 + STRIP_PX, max(2 * width, end_px), 3), 255, np.uint8)
    whole[:60, :width] = grey[..., None]
    whole[:60, width : 2 * width] = turbo(255.0 * ((1.0 - share) if is_depth else share))
    ramp = turbo(np.linspace(0.0, 255.0, BAR_PX).astype(np.uint8)[None])
    whole[70:84, bar_px : bar_px + BAR_PX] = ramp[:, ::-1] if is_depth else ramp
    for text, x_px in (("reference view", 8), (first, at_px), (last, bar_px + BAR_PX + 8)):
        cv2.putText(whole, text, (x_px, 82), cv2.FONT_HERSHEY_SIMPLEX, 0.48, (40, 40, 40), 1,
                    cv2.LINE_AA)  # fmt: skip
    assert np.abs(picture - whole).max() == 0
