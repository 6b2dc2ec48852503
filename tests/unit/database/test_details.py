"""The JSON column of a measurement: columns of older versions read on, others are refused."""

import json

import pytest

from rig.database.details import details_json, read_details
from rig.errors import StoreError
from rig.geometry.epipolar_error import EpipolarError
from rig.measurement import Failure, Measurement

WRITTEN_BEFORE = json.loads(
    '{"corners_px":[[[10.5,20.25],[30.0,20.0]],[[10.0,40.0],[30.125,40.0]]],"edge_pixels":4711,'
    '"epipolar_px":[0.01,0.02,0.30000000000000004],'
    '"outline_px":[[1.0,2.0],[3.0,4.0],[5.0,6.0],[7.0,8.0]],"plane_sigma":[0.001,1e-06,2e-06],'
    '"residual_levels":1.25,"track_residual_px":0.011,"views":["centre","left"]}'
)
"""A column as it was written before its fields had types."""


def test_a_column_written_before_reads_and_is_written_as_before():
    details = read_details(WRITTEN_BEFORE)
    assert details.corners_px == (((10.5, 20.25), (30.0, 20.0)), ((10.0, 40.0), (30.125, 40.0)))
    assert details.epipolar == EpipolarError(0.01, 0.02, 0.1 + 0.2)
    assert (details.edge_pixels, details.views) == (4711, ("centre", "left"))
    again = Measurement(
        plane_sigma=details.plane_sigma,
        corners_px=details.corners_px,
        outline_px=details.outline_px,
        epipolar=details.epipolar,
        track_residual_px=details.track_residual_px,
        residual_levels=details.residual_levels,
        edge_pixels=details.edge_pixels,
        views=details.views,
    )
    assert details_json(again) == WRITTEN_BEFORE


def test_columns_of_the_first_versions_know_less():
    first: dict[str, object] = {
        "edge_pixels": 9,
        "residual_levels": 2,
        "views": ["left"],
        "corners_px": [],
    }
    details = read_details(first)
    assert (details.epipolar, details.plane_sigma, details.outline_px) == (None, None, None)
    assert (details.corners_px, details.residual_levels) == ((), 2.0)


def test_a_failure_has_an_empty_column():
    assert details_json(Measurement(failure=Failure("blurred", "too soft"))) == {}
    assert read_details({}).views == ()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"pixels": 9}, "pixels is unknown; run rig fit on its sweep"),
        ({"corners_px": [[1.0, 2.0]]}, r"corners_px\[0\]\[0\]: a list wanted, found 1.0"),
        ({"epipolar_px": [0.1, 0.2]}, r"epipolar_px\[2\] is missing"),
        ({"track_residual_px": "small"}, "track_residual_px: a finite number wanted"),
        ({"views": "left"}, "views: a list wanted, found 'left'"),
    ],
)
def test_another_column_is_refused(change: dict[str, object], says: str):
    with pytest.raises(StoreError, match=says):
        read_details(WRITTEN_BEFORE | change)
