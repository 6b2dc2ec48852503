"""A frame of a capture as a page gets it."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.drift_series import DriftSeries
from rig.frames import MultiView
from rig.live.frame import DepthFrame
from rig.stored import Run
from rig.view.packing import Packed, as_8_bit, packed
from rig.view.wire import encode

Arrays = dict[str, NDArray[Any]]
Drops = Callable[[], Mapping[str, int]]
"""Tells how many multi-views were dropped so far, by reason."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How the capture goes, at the moment of a frame."""

    frames_per_s: float | None
    dropped: Mapping[str, int]
    """By reason."""


@dataclass(frozen=True, slots=True)
class FrameMessage:
    """One frame; what a page does not ask for is never worked out."""

    frame: DepthFrame
    pace: Pace
    run: Run
    drift: DriftSeries | None = None
    """What looks at the cameras have told since their calibration; None where nobody looks."""

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        """Return header and arrays.

        Arrays: `depth` (mm), or without a curve `slope` (px per view step) in its place; `sigma`
        (of that), `label`, `slope`; `view_0`, `view_1`, ... as the cameras gave them (they may
        differ in size), `image` where the reference view at the pixels of the maps is another
        picture, `colour` (H, W, 3) where it has colour, `rectified` (V, H, W) where views are.
        Header `steps`: what the steps of each map
        mean, see `Packed`; `drift_looks`: how many looks there are, so that a page asks for their
        series, `drift`, only when there are more (see `DriftSeries.to_json`).
        """
        header = {**_facts(self.frame, self.run), **_pace(self.frame, self.pace)}
        header["drift_looks"] = None if self.drift is None else len(self.drift.looks)
        if "drift" in wants and self.drift is not None:
            header["drift"] = self.drift.to_json()
        arrays: Arrays = {}
        for part in (_maps(self.frame, wants), _pictures(self.frame, self.run, wants)):
            header.update(part[0])
            arrays.update(part[1])
        return encode({"mode": "capture", "number": number, **header}, arrays)


def _facts(frame: DepthFrame, run: Run) -> dict[str, Any]:
    optics, pinhole = run.optics, frame.pinhole
    curve = run.curve
    return {
        "rig": frame.rig,
        "frame": frame.index,
        "time_ms": frame.time_ns / 1e6,
        "unit": "px" if frame.depth is None else "mm",
        "reference": run.profile.reference,
        "pitch_mm": run.profile.pitch_mm,
        "range_px": list(run.range_px),
        "curve": None if curve is None else curve.title,
        "calibration": optics.calibration_id,
        "camera": None if pinhole is None else pinhole.to_json(),
        "grid": _grid(run),
        "x_steps": optics.x_steps.tolist(),
        "y_steps": optics.y_steps.tolist(),
        "warnings": list(frame.slopes.warnings),
    }


def _grid(run: Run) -> dict[str, int]:
    """Where the pixels of the maps lie in the rectified pictures: first one, and their distance."""
    processing = run.profile.processing
    x_px, y_px, *_ = processing.roi_px or (0, 0)
    return {"x_px": x_px, "y_px": y_px, "step": processing.decimation}


def _pace(frame: DepthFrame, pace: Pace) -> dict[str, Any]:
    return {
        "frames_per_s": pace.frames_per_s,
        "latency_ms": _ms(frame.latency_s),
        "measuring_ms": _ms(frame.measuring_s),
        "skew_ms": 1e3 * frame.views.skew_s,
        "temperature_degc": frame.views.temperature_degc,
        "dropped": dict(pace.dropped),
    }


def _ms(time_s: float) -> float | None:
    return 1e3 * time_s if math.isfinite(time_s) else None


def _maps(frame: DepthFrame, wants: frozenset[str]) -> tuple[dict[str, Any], Arrays]:
    found: dict[str, Packed] = {}
    if frame.depth is not None:
        found["depth"] = packed(frame.depth.depth_mm)
    if frame.depth is None or "slope" in wants:
        found["slope"] = packed(frame.slopes.slope_px, low=None)
    if "sigma" in wants:
        found["sigma"] = packed(
            frame.slopes.sigma_px if frame.depth is None else frame.depth.sigma_mm
        )
    arrays: Arrays = {name: one.steps for name, one in found.items()}
    if "label" in wants:
        arrays["label"] = frame.label
    steps = {name: {"step": one.step, "low": one.low} for name, one in found.items()}
    return {"steps": steps}, arrays


def _pictures(frame: DepthFrame, run: Run, wants: frozenset[str]) -> tuple[dict[str, Any], Arrays]:
    multiview = frame.views
    header = {
        "views": [
            {
                "name": one.view,
                "sequence": one.sequence,
                "exposure_ms": None if one.exposure_s is None else 1e3 * one.exposure_s,
                "bits": _bits(multiview, i),
            }
            for i, one in enumerate(multiview.frames)
        ]
    }
    arrays: Arrays = {}
    reference = run.profile.reference
    if "views" in wants:
        for i, one in enumerate(multiview.frames):
            arrays[f"view_{i}"] = as_8_bit(one.image, _bits(multiview, i))
    if "views" not in wants or not _is_shown_as_taken(frame, reference):
        arrays["image"] = as_8_bit(frame.image, _bits(multiview, reference))
    if "colour" in wants and frame.colour is not None:
        arrays["colour"] = frame.colour
    if "rectified" in wants and run.optics.calibration_id is not None:
        bits = _bits(multiview, reference)
        arrays["rectified"] = np.stack(
            [as_8_bit(one, bits) for one in run.optics.pictures(multiview.images)]
        )
    return header, arrays


def _is_shown_as_taken(frame: DepthFrame, reference: int) -> bool:
    taken = frame.views.frames[reference].image
    return frame.image.shape == taken.shape and np.shares_memory(frame.image, taken)


def _bits(multiview: MultiView, index: int) -> int:
    return multiview.frames[index].full_scale.bit_length()
