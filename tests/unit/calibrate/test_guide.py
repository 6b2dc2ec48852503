"""What a calibration still lacks, and which live pictures are worth keeping."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from rig_sim.clock import VirtualClock

from rig.calibrate.coverage import coverage_of
from rig.calibrate.guide import advise, coverage_text
from rig.calibrate.in_hand import motion_px, pictures_in_hand
from rig.calibrate.pictures import Picture
from rig.calibrate.sight import PictureSightings, Tally, sight
from rig.cli.calibration_result import tally_lines
from rig.errors import TargetError
from rig.frames import Frame, MultiView
from rig.targets import Detection
from rig.targets.checkerboard import Checkerboard
from tests.support.board_images import BoardScene

BOARD = Checkerboard(9, 6, 25.0)
SIZES = ((640, 400), (640, 400))
NAMES = ("left", "right")
FOCAL_PX = 560.0


def seen(
    number: int, *, tilt_deg: Sequence[float] = (0, 0, 0), at_mm: Sequence[float] = (0, 0, 600)
) -> PictureSightings:
    """A board before two cameras 60 mm apart, without any picture."""
    points = BOARD.points_mm.reshape(-1, 3) - BOARD.points_mm.reshape(-1, 3).mean(axis=0)
    turn = np.asarray(cv2.Rodrigues(np.radians(np.array(tilt_deg, np.float64)))[0])
    found: list[Detection | TargetError] = []
    for view in range(2):
        places = points @ turn.T + np.array(at_mm, np.float64) - (60.0 * view, 0.0, 0.0)
        xy_px = places[:, :2] / places[:, 2:] * FOCAL_PX + (320.0, 200.0)
        ids = np.arange(len(points), dtype=np.intp)
        found.append(Detection(ids, xy_px, np.full(len(points), 0.02), 0.9, 150.0))
    return PictureSightings(number, None, SIZES, tuple(found))


def test_coverage_counts_area_pairs_tilts_and_distances():
    sightings = [seen(0), seen(1, tilt_deg=(20, 0, 0)), seen(2, tilt_deg=(0, -25, 0))]
    sightings.append(
        replace(seen(3), by_view=(seen(3).by_view[0], TargetError("", reason="clipped")))
    )
    coverage = coverage_of(sightings, BOARD, 2)
    assert coverage.shared.tolist() == [[4, 3], [3, 3]]
    assert 0.2 < coverage.area_share[0] < 0.9
    assert coverage.tilts_deg[:, 0].max() > 12.0
    assert np.abs(coverage.tilts_deg[:, 1]).max() > 15.0
    assert 300.0 < np.median(coverage.distances_mm) < 1000.0
    assert "left-right 3" in coverage_text(coverage, NAMES)


def test_a_corner_on_the_border_belongs_to_the_part_beside_it():
    one = seen(0)
    detection = one.by_view[0]
    assert isinstance(detection, Detection)
    xy_px = detection.xy_px.copy()
    xy_px[:4] = [(640.0, 400.0), (0.0, 400.0), (640.0, 0.0), (-0.4, -0.4)]
    moved = replace(one, by_view=(replace(detection, xy_px=xy_px), one.by_view[1]))
    cells = coverage_of([moved], BOARD, 2).cells[0]
    assert cells.sum() == len(xy_px)
    assert [cells[-1, -1], cells[-1, 0], cells[0, -1], cells[0, 0]] == [1, 1, 1, 1]


def test_advice_names_what_is_missing_and_ends_when_nothing_is():
    sightings = [seen(0)]
    assert "left and right both see it" in advise(coverage_of(sightings, BOARD, 2), NAMES, 0).text
    sightings += [seen(n) for n in range(1, 7)]
    assert "away from the camera" in advise(coverage_of(sightings, BOARD, 2), NAMES, 0).text
    tilts = [(30, 0, 0), (-30, 0, 0), (0, 30, 0), (0, -30, 0)]
    sightings += [seen(10 + n, tilt_deg=tilt) for n, tilt in enumerate(tilts)]
    sightings.append(seen(20, at_mm=(0, 0, 350)))
    advice = advise(coverage_of(sightings, BOARD, 2), NAMES, 0)
    if not advice.covered:
        assert "of the picture of" in advice.text
    corners = [(x, y, 600.0) for x in (-230, 0, 200) for y in (-140, 0, 140)]
    sightings += [seen(30 + n, at_mm=at) for n, at in enumerate(corners)]
    done = advise(coverage_of(sightings, BOARD, 2), NAMES, 0)
    assert done.covered, done.text


def test_a_tilt_is_told_about_the_axis_it_is_about():
    sightings = [seen(n, tilt_deg=(25, 0, 0)) for n in range(4)]
    tilts_deg = coverage_of(sightings, BOARD, 2).tilts_deg
    assert (np.abs(tilts_deg[:, 0]) > 3 * np.abs(tilts_deg[:, 1])).all()


class Shown:
    """A camera that looks at what is put before it, one scene per grab."""

    def __init__(self, scenes: Sequence[BoardScene | None]) -> None:
        self._images = [
            np.full((200, 320), 90, np.uint8) if s is None else s.clean().astype(np.uint8)
            for s in scenes
        ]
        self._next = 0

    def grab(self, timeout_s: float) -> MultiView:
        image = self._images[min(self._next, len(self._images) - 1)]
        self._next += 1
        return MultiView((Frame("left", image, float(self._next), self._next),))


def test_a_picture_is_kept_when_the_target_rests_where_it_has_not_been():
    here = BoardScene(width=320, height=200, focal_px=305.0, distance_mm=700.0)
    there = here.with_changes(offset_mm=(60.0, 0.0))
    scenes = [None, here, here, here, there, there, here, here]
    heard: list[bool] = []
    looked: list[tuple[int, int, bool]] = []
    kept = [
        picture.number
        for picture, _ in pictures_in_hand(
            Shown(scenes),  # pyright: ignore[reportArgumentType]
            VirtualClock(),
            BOARD,
            (),
            first=5,
            timeout_s=1.0,
            patience_s=3.0,
            progress=lambda _, text: heard.append("moving" in text),
            watch=lambda picture, now, moving: looked.append(
                (picture.number, len(now.views), moving)
            ),
        )
    ]
    assert [moving for _, _, moving in looked] == heard
    assert looked[:4] == [(5, 0, True), (5, 1, True), (5, 1, False), (6, 1, False)]
    assert kept == [5, 6]  # here once, there once; back at the old place nothing is new
    assert heard[:6] == [True, True, False, False, True, False]


def test_motion_is_infinite_where_the_target_is_not_seen():
    lost = PictureSightings(
        0, None, SIZES, (TargetError("", reason="x"), TargetError("", reason="x"))
    )
    assert motion_px(seen(0), lost) == float("inf")
    assert motion_px(seen(0), seen(1)) == 0.0


def test_the_tally_says_where_and_why():
    image = np.full((400, 640), 90, np.uint8)
    picture = Picture(0, MultiView((Frame("left", image, 0.0, 0),)))
    tally = Tally(("left",))
    tally.add(sight(picture, BOARD))
    assert tally_lines(tally) == ["left: target in 0 of 1 pictures, 1 not-found"]
