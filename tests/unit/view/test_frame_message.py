"""A frame as a page gets it: what the page shows is what the frame holds."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.drift_series import DriftSeries
from rig.epipolar import Label
from rig.frames import Frame, MultiView
from rig.live.frame import DepthFrame
from rig.view.frame_message import FrameMessage, Pace
from rig.view.wire import decode
from tests.support.shown_frames import scene

SCENE = scene()
PACE = Pace(19.5, {"skew": 2, "queue": 0})
ALL = frozenset({"views", "sigma", "label", "slope", "rectified"})


def message(frame: DepthFrame, wants: frozenset[str] = ALL):
    return decode(FrameMessage(frame, PACE, SCENE.run).encoded(7, wants))


def test_the_header_tells_what_a_person_asks():
    frame = SCENE.frame(3)
    header, _ = message(frame)
    assert header["mode"] == "capture"
    assert header["number"] == 7
    assert header["frame"] == 3
    assert header["rig"] == "simulated-rig"
    assert header["unit"] == "mm"
    assert header["curve"] == "the curve that was given"
    assert header["calibration"] is None
    assert header["time_ms"] == frame.time_ns / 1e6
    assert header["measuring_ms"] == 21.0
    assert header["latency_ms"] == 32.0
    assert header["skew_ms"] == 0.0
    assert header["temperature_degc"] == 36.5
    assert header["frames_per_s"] == 19.5
    assert header["dropped"] == {"skew": 2, "queue": 0}
    assert header["pitch_mm"] == 40.0
    assert header["range_px"] == [-9.0, 6.0]
    assert header["grid"] == {"x_px": 0, "y_px": 0, "step": 1}
    assert header["x_steps"] == [0.0, -1.06, 0.93, 0.0, 0.0]
    assert header["y_steps"] == [0.0, 0.0, 0.0, -0.95, 1.08]
    assert header["reference"] == 0
    assert header["camera"]["focal_px"] == pytest.approx(0.95 * 64)
    assert header["views"][2] == {
        "name": "right",
        "sequence": 3,
        "exposure_ms": 8.0,
        "bits": 8,
    }


def values(header: dict[str, Any], arrays: dict[str, NDArray[Any]], name: str):
    steps, meant = arrays[name], header["steps"][name]
    known = meant["low"] + (steps - 1.0) * meant["step"]
    return np.where(steps > 0, known, np.nan), meant["step"]


def test_the_maps_are_those_of_the_frame_to_half_a_step():
    frame = SCENE.frame(0)
    header, arrays = message(frame)
    assert header["steps"]["depth"] == {"step": pytest.approx(0.05), "low": 0.0}
    for name, wanted in (
        ("depth", frame.depth_mm),
        ("sigma", frame.sigma_mm),
        ("slope", frame.slopes.slope_px),
    ):
        found, step = values(header, arrays, name)
        np.testing.assert_array_equal(np.isnan(found), frame.label == 0)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=0.51 * step)
    np.testing.assert_array_equal(arrays["label"], frame.label)
    assert set(np.unique(frame.label)) == {Label.NONE, 1, 2, 3}


def test_what_nobody_measured_is_none():
    header, _ = message(replace(SCENE.frame(0), measuring_s=float("nan")))
    assert header["measuring_ms"] is None


def test_the_views_are_those_of_the_cameras():
    frame = SCENE.frame(0)
    _, arrays = message(frame)
    for view, picture in enumerate(frame.views.images):
        np.testing.assert_array_equal(arrays[f"view_{view}"], picture)
    assert "image" not in arrays, "the reference view is among them"
    assert "rectified" not in arrays, "nothing is resampled without a calibration"


def test_nothing_is_sent_that_is_not_asked_for():
    frame = SCENE.frame(0)
    header, arrays = message(frame, frozenset())
    assert set(arrays) == {"depth", "image"}
    np.testing.assert_array_equal(arrays["image"], frame.image)
    assert set(header["steps"]) == {"depth"}


def test_slopes_take_the_place_of_depth_where_there_is_no_curve():
    frame = SCENE.frame(0, has_depth=False)
    header, arrays = message(frame, frozenset({"sigma", "label"}))
    assert header["unit"] == "px"
    assert header["camera"] is None
    assert set(arrays) == {"slope", "sigma", "label", "image"}
    for name, wanted in (("slope", frame.slopes.slope_px), ("sigma", frame.slopes.sigma_px)):
        found, step = values(header, arrays, name)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=0.51 * step)


def test_a_resampled_reference_view_is_sent_beside_what_was_taken():
    frame = SCENE.frame(0)
    other = replace(frame, image=frame.image[:, ::-1].copy())
    _, arrays = message(other)
    np.testing.assert_array_equal(arrays["image"], other.image)
    np.testing.assert_array_equal(arrays["view_0"], frame.image)


def test_maps_of_a_region_or_coarser_ones_say_where_they_lie_in_the_pictures():
    frame = SCENE.frame(0)
    config = SCENE.run.profile.processing.model_copy(
        update={"roi_px": (8, 4, 20, 10), "decimation": 2}
    )
    profile = SCENE.run.profile.model_copy(update={"processing": config})
    part = replace(frame, image=frame.image[4:14, 8:28])
    shown = FrameMessage(part, PACE, replace(SCENE.run, profile=profile))
    header, arrays = decode(shown.encoded(0, ALL))
    assert header["grid"] == {"x_px": 8, "y_px": 4, "step": 2}
    # It shares its pixels with the reference view, but is not what the map lies on.
    np.testing.assert_array_equal(arrays["image"], part.image)


def test_sixteen_bits_are_shown_by_their_highest_eight():
    frame = SCENE.frame(0)
    deep = MultiView(
        tuple(
            Frame(
                one.view,
                np.left_shift(one.image, 2, dtype=np.uint16),
                one.timestamp_s,
                one.sequence,
                bits=10,
            )
            for one in frame.views.frames
        )
    )
    header, arrays = message(replace(frame, views=deep, image=deep.frames[0].image))
    for view, picture in enumerate(frame.views.images):
        np.testing.assert_array_equal(arrays[f"view_{view}"], picture)
    assert [one["bits"] for one in header["views"]] == [10] * 5
    assert header["views"][0]["exposure_ms"] is None
    assert header["temperature_degc"] is None


def test_looks_at_the_cameras_are_counted_and_come_when_asked_for():
    series = DriftSeries(3, datetime(2026, 11, 2, tzinfo=UTC), None, {}, ())
    told = FrameMessage(SCENE.frame(3), PACE, SCENE.run, series)
    counted, _ = decode(told.encoded(7, ALL))
    asked, _ = decode(told.encoded(7, ALL | {"drift"}))
    assert counted["drift_looks"] == 0
    assert "drift" not in counted
    assert asked["drift"] == series.to_json()
    nobody, _ = message(SCENE.frame(3), ALL | {"drift"})
    assert nobody["drift_looks"] is None
    assert "drift" not in nobody
