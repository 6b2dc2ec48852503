"""The curve of a sweep beside that of its calibration alone."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from rig.calibration_alone import curve_alone
from rig.compare.curves import compare_curves
from rig.curve import Curve
from rig.curve.physical import Physical
from rig.measurement import Measurement
from rig.optics.calibrated import calibrated_optics
from rig.optics.nominal import nominal_optics
from rig.optics.prior import PRIOR_SIGMAS, prior_covariance
from rig.plan import Stop
from rig.records import Sample, StoredCalibration
from rig.run import Run, RunCurve
from tests.support.cameras import SmallRig
from tests.support.geometry import true_geometry

SMALL = SmallRig(name="sim-real")
BARE = replace(true_geometry(SMALL.profile, SMALL.world.moment(0.0)), stage=None)
GEOMETRY = replace(BARE, covariance=prior_covariance(BARE, PRIOR_SIGMAS["kalibr"]))
STORED = StoredCalibration(
    3, "sim-real", datetime.now(UTC), {}, {}, {}, {}, {}, None, (160, 100), active=True
)
RUN = Run(SMALL.profile, calibrated_optics(SMALL.profile, GEOMETRY, 3), None, STORED)
LAW = curve_alone(RUN).curve.law
SHIFT_PX = 0.05
"""What the sweep has found the slope at infinity to be off by."""


def swept() -> RunCurve:
    assert isinstance(LAW, Physical)
    law = replace(LAW, m_inf_px=LAW.m_inf_px + SHIFT_PX)
    none = ((0.0, 0.0, 0.0),) * 3
    return RunCurve(4, Curve(law, none, (400.0, 1200.0), 0.0), 7)


def sample(index: int, distance_mm: float, number: int = 0) -> Sample:
    stop = Stop(index, distance_mm, "fit", "forward")
    return Sample(7, stop, number, distance_mm, datetime.now(UTC), None, Path(), ())


def measured(distance_mm: float) -> Measurement:
    """A flat board on the axis, where the true slopes are those of the sweep."""
    slope_px = float(LAW.slope_px(np.array([distance_mm]))[0]) + SHIFT_PX
    assert RUN.optics.axis_px is not None
    return Measurement(slope_px=slope_px, plane=(slope_px, 0.0, 0.0), centre_px=RUN.optics.axis_px)


def test_both_curves_are_told_what_the_board_says():
    samples = [sample(0, 900.0), sample(0, 900.0, 1), sample(1, 500.0), sample(2, 700.0)]
    measurements = {s.key: measured(s.reached_mm) for s in samples[:3]}
    measurements[samples[3].key] = Measurement()
    near, far = compare_curves(RUN, swept(), samples, measurements)
    assert (near.distance_mm, far.distance_mm) == (500.0, 900.0)
    assert [near.swept_mm, far.swept_mm] == pytest.approx([0.0, 0.0], abs=1e-3)
    alone = curve_alone(RUN).curve
    for at in (near, far):
        parallax_px = LAW.params()["a_px_mm"] / at.distance_mm
        off_mm = at.distance_mm * (parallax_px / (parallax_px + SHIFT_PX) - 1.0)
        assert at.alone_mm == pytest.approx(off_mm, abs=0.01)
        slope_px = np.array([measured(at.distance_mm).plane[0]])  # pyright: ignore[reportOptionalSubscript]
        sigma_mm = float(alone.depth_sigma_mm(slope_px, np.zeros(1))[0])
        assert at.alone_k2_mm == pytest.approx(2.0 * sigma_mm)


def test_there_is_nothing_beside_a_sweep_without_a_calibration_that_knows_depth():
    samples = [sample(0, 900.0)]
    measurements = {samples[0].key: measured(900.0)}
    bare = Run(SMALL.profile, nominal_optics(SMALL.profile))
    assert compare_curves(bare, swept(), samples, measurements) == ()
    of_lenslets = replace(bare, calibration=STORED)
    assert compare_curves(of_lenslets, swept(), samples, measurements) == ()
    strict = SMALL.profile.model_copy(
        update={"quality": SMALL.profile.quality.model_copy(update={"depth_sigma_pct": 1e-6})}
    )
    assert compare_curves(replace(RUN, profile=strict), swept(), samples, measurements) == ()
