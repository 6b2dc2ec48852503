from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rig.epipolar import Label
from rig.optics.nominal import nominal_optics
from rig.plan import Stop
from rig.profile import Profile
from rig.records import Sample
from rig.report import epi as epi_module
from rig.report.epi import EdgeLine, Epi, board_epis
from rig.report.evidence import Picture
from tests.support.board_images import BoardScene, digitised
from tests.support.sweeps import SCENE, bench_profile


def range_of(profile: Profile) -> tuple[float, float]:
    assert profile.slopes.range_px is not None
    return profile.slopes.range_px


def picture_of(scene: BoardScene, profile: Profile) -> Picture:
    rng = np.random.default_rng(3)
    images = [
        digitised(scene.clean(view.x_steps, view.y_steps), noise=1.0, rng=rng)
        for view in profile.views
    ]
    corners = scene.corners()
    low, right, bottom = -0.9, scene.columns - 0.1, scene.rows - 0.1
    ends = np.array([[low, low, 1], [right, low, 1], [right, bottom, 1], [low, bottom, 1]])
    outline = ends @ scene.pixel_from_board().T
    a, b, c = scene.plane().tolist()
    u, v = scene.centre().tolist()
    stop = Stop(0, scene.distance_mm, "fit", "forward")
    sample = Sample(1, stop, 0, scene.distance_mm, datetime(2026, 1, 1, tzinfo=UTC), None,
                    Path("nowhere"), ())  # fmt: skip
    stack = np.stack(images)
    return Picture(
        sample=sample,
        images=stack,
        views=nominal_optics(profile).views(stack),
        centre_px=(u, v),
        plane=(a, b, c),
        corners_px=corners,
        outline_px=outline[:, :2] / outline[:, 2:],
    )


def edges_px(grey: np.ndarray) -> np.ndarray:
    """Where a line of pixels crosses the middle between black and white."""
    above = grey - (float(grey.min()) + float(grey.max())) / 2.0
    i = np.flatnonzero(np.signbit(above[:-1]) != np.signbit(above[1:]))
    return i + above[i] / (above[i] - above[i + 1])


def misses_px(epi: Epi, edges: list[EdgeLine]) -> list[float]:
    """How far from a real edge each line passes in every view."""
    found: list[float] = []
    for step, grey in zip(epi.steps, epi.grey, strict=True):
        real = edges_px(grey.astype(np.float64)) + epi.first_px
        for edge in edges:
            place = edge.at_px - edge.slope_px * step
            if epi.first_px < place < epi.first_px + grey.size - 1:
                found.append(float(np.abs(real - place).min()))
    return found


@pytest.mark.parametrize(("distance_mm", "label"), [(450.0, Label.NEARER), (1100.0, Label.BEYOND)])
def test_lines_follow_the_edges_of_a_tilted_board_through_all_views(
    distance_mm: float, label: Label
) -> None:
    profile = bench_profile()
    scene = SCENE.with_changes(distance_mm=distance_mm, tilt_deg=(4.0, -9.0, 1.0))
    picture = picture_of(scene, profile)
    horizontal, vertical = board_epis(range_of(profile), picture)
    assert (horizontal.kind, vertical.kind) == ("H", "V")
    assert horizontal.steps == (-1.06, 0.0, 0.93)
    assert vertical.steps == (-0.95, 0.0, 1.08)
    for epi, axis, squares in ((horizontal, 0, scene.columns + 1), (vertical, 1, scene.rows + 1)):
        ends_px = picture.outline_px[:, axis]
        room_px = 0.25 * picture.square_px
        printed = [
            edge
            for edge in epi.edges
            if ends_px.min() - room_px < edge.at_px < ends_px.max() + room_px
        ]
        # White squares at the ends merge with the paper.
        assert squares - 1 <= len(printed) <= squares + 1
        assert {edge.label for edge in printed} == {label}
        misses = misses_px(epi, printed)
        assert np.median(misses) < 0.1
        assert max(misses) < 0.5


def test_a_column_that_runs_along_an_edge_is_avoided() -> None:
    # Nine corners across: the middle of the board lies on a corner line.
    profile = bench_profile()
    scene = SCENE.with_changes(distance_mm=500.0)
    _, vertical = board_epis(range_of(profile), picture_of(scene, profile))
    side_px = SCENE.focal_px * SCENE.square_mm / 500.0
    away_px = abs(vertical.line_px - scene.centre()[0])
    assert 0.1 * side_px < away_px < 0.9 * side_px


def test_one_view_makes_no_epi() -> None:
    profile = bench_profile()
    row = profile.model_copy(update={"views": profile.views[:3]})
    scene = SCENE.with_changes(distance_mm=600.0)
    assert [epi.kind for epi in board_epis(range_of(row), picture_of(scene, row))] == ["H"]


def test_the_board_reaches_a_third_of_a_square_beyond_its_outline() -> None:
    profile = bench_profile()
    picture = picture_of(SCENE.with_changes(distance_mm=600.0), profile)
    height, width = picture.images[0].shape
    inside, slope_px = epi_module._board(picture, (height, width))
    u, v = (round(x) for x in picture.centre_px)
    left_px, right_px = np.flatnonzero(inside[v])[[0, -1]]
    ends_px = np.round(picture.outline_px[:, 0])
    more_px = round(epi_module.OUTER_SHARE * picture.square_px)
    assert (left_px, right_px) == (ends_px.min() - more_px, ends_px.max() + more_px)
    a, b, c = picture.plane
    expected = a + b * (u - picture.centre_px[0]) + c * (v - picture.centre_px[1])
    assert slope_px[v, u] == pytest.approx(expected)
