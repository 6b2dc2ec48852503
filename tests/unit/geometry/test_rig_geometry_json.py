"""A geometry survives JSON to the last digit, and nothing else gets in."""

import json
from typing import Any

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.geometry.camera_model import CameraModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry, StageGeometry
from rig.geometry.rig_geometry_json import geometry_from_json, geometry_to_json


def geometry(*, bare: bool = False) -> RigGeometry:
    size = 4 + 5 + 4 + 4 + 6
    numbers = np.random.default_rng(3)
    root = numbers.normal(size=(size, size))
    return RigGeometry(
        names=("centre", "left"),
        reference=0,
        cameras=(
            CameraModel(640, 400, 610.1, 609.7, 319.2, 200.4, "brown5", (-0.06, 0.02, 1e-4, 0, 0)),
            CameraModel(640, 400, 0.1 + 0.2, 611.0, 1 / 3, 199.0, "fisheye", (0.01, 0, 0, -1e-9)),
        ),
        cam_from_reference=(
            Pose.identity(),
            Pose.from_vectors(np.array([0.01, -0.02, 1 / 3]), np.array([40.1, -0.5, 0.6])),
        ),
        covariance=None if bare else root @ root.T,
        stage=None
        if bare
        else StageGeometry(np.array([0.006, -0.005, 0.99997]), 1.0015, 0.3, np.eye(4) * 1e-6),
    )


@pytest.mark.parametrize("bare", [False, True])
def test_a_geometry_comes_back_to_the_last_bit(bare: bool) -> None:
    before = geometry(bare=bare)
    content = json.loads(json.dumps(geometry_to_json(before), allow_nan=False))
    after = geometry_from_json(content)
    assert (after.names, after.reference, after.cameras) == (
        before.names,
        before.reference,
        before.cameras,
    )
    for one, other in zip(after.cam_from_reference, before.cam_from_reference, strict=True):
        assert np.array_equal(one.rotation, other.rotation)
        assert np.array_equal(one.translation_mm, other.translation_mm)
    assert geometry_to_json(after) == geometry_to_json(before)
    assert (after.covariance is None) == bare
    assert (after.stage is None) == bare


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"version": 2}, "version 2, this program reads 1"),
        ({"extra": 1}, "extra is unknown; calibrate again"),
        ({"names": "centre"}, "names: a list wanted, found 'centre'"),
        ({"names": ["centre"]}, "geometry of 1 views with 2 cameras"),
        ({"names": [1, 2]}, r"names\[0\]: a text wanted, found 1, "),
        ({"reference": 0.0}, "reference: a whole number wanted, found 0.0"),
        ({"reference": 2}, "reference view 2 asked for, views are 0..1"),
        ({"cameras": [{}]}, r"cameras\[0\].width_px is missing, .* and 3 more"),
        ({"poses": None}, "poses: a list wanted, found None"),
        ({"covariance": [[1.0]]}, r"covariance \(1, 1\) given for 23 parameters"),
        ({"covariance": [1.0]}, r"covariance \(1,\) given for 23 parameters"),
        ({"covariance": [["1.0"]]}, r"covariance: lists of numbers wanted, found \[\['1.0'\]\]"),
        ({"covariance": [[float("nan")]]}, "covariance: lists of numbers, finite ones wanted"),
        (
            {"stage": {"axis": [0, 0], "scale": 1, "zero_mm": 0, "covariance": [[1]]}},
            r"stage: stage with an axis of shape \(2,\)",
        ),
    ],
)
def test_what_is_no_geometry_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        geometry_from_json({**geometry_to_json(geometry()), **change})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"lens": "mirror"},
            "lens: 'none', 'brown5', 'brown8' or 'fisheye' wanted, found 'mirror'",
        ),
        ({"fx_px": -1.0}, "must be positive"),
        ({"fx_px": "610"}, "fx_px: a finite number wanted, found '610'"),
        ({"fx_px": True}, "fx_px: a finite number wanted, found True"),
        ({"cx_px": float("inf")}, "cx_px: a finite number wanted, found inf"),
        ({"coefficients": [0.0]}, "brown5 with 1 coefficients"),
    ],
)
def test_what_is_no_camera_is_refused(change: dict[str, Any], message: str) -> None:
    content = geometry_to_json(geometry())
    content["cameras"][0] |= change
    with pytest.raises(ConfigError, match=message):
        geometry_from_json(content)
