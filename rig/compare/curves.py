"""The curve of a sweep beside that of its calibration alone, on the board of the sweep."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.calibration_alone import curve_alone
from rig.errors import CurveError
from rig.measurement import Measurement
from rig.optics.calibrated import CalibratedOptics
from rig.records import Sample, SampleKey
from rig.stored import Run, RunCurve


@dataclass(frozen=True, slots=True)
class CurvesAt:
    """What both curves say of the board at one distance, less what the stage says."""

    distance_mm: float
    """Of the stage, read back."""
    swept_mm: float
    """Error of the curve of the sweep; NaN where it is not valid."""
    alone_mm: float
    """Error of the curve of the calibration alone; NaN where it is not valid."""
    alone_k2_mm: float
    """What that curve itself takes for possible, k=2."""


def compare_curves(
    run: Run,
    curve: RunCurve,
    samples: Sequence[Sample],
    measurements: Mapping[SampleKey, Measurement],
) -> tuple[CurvesAt, ...]:
    """Turn the slope of the board, by the line fit, into distance by either curve.

    Args:
        run: as the sweep was measured.
        curve: of the sweep.
        samples: of the sweep; the first with a board at each distance is used.
        measurements: of the samples.

    Returns:
        From near to far; nothing where the sweep was measured without a calibration, or where that
        calibration alone knows no depth.
    """
    if not isinstance(run.optics, CalibratedOptics) or run.calibration is None:
        return ()
    try:
        alone = curve_alone(run).curve
    except CurveError:
        return ()
    found: dict[float, CurvesAt] = {}
    for sample in samples:
        measured = measurements.get(sample.key)
        if sample.stop.distance_mm in found or measured is None or measured.plane is None:
            continue
        if measured.centre_px is None:
            continue
        distance_mm = run.optics.distance_mm(sample.reached_mm)
        slope_px = np.array([run.optics.axis_plane(measured.plane, measured.centre_px)[0]])
        field = curve.curve.field
        added_px = 0.0 if field is None else field.slope_px(*measured.centre_px)
        found[sample.stop.distance_mm] = CurvesAt(
            distance_mm,
            float(curve.curve.depth_mm(slope_px - added_px)[0]) - distance_mm,
            float(alone.depth_mm(slope_px)[0]) - distance_mm,
            2.0 * float(alone.depth_sigma_mm(slope_px, np.zeros(1))[0]),
        )
    return tuple(sorted(found.values(), key=lambda at: at.distance_mm))
