"""Calibrated cameras beside a hand: what is told of a reading, by closed form."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from rig.frames import Frame, MultiView
from rig.measurement import Failure, Measurement
from rig.optics.calibrated import CalibratedOptics
from rig.optics.nominal import nominal_optics
from rig.optics.optics import Optics
from rig.plan import Stop
from rig.profile import ManualStageConfig
from rig.profile.load import load_profile
from rig.stored import Run
from rig.sweep.job import SweepJob
from rig.sweep.second_opinion import SecondOpinion
from rig.sweep.take import NewSample
from tests.unit.test_optics_axis import optics

IMAGE = np.zeros((2, 2), np.uint8)
HAND = ManualStageConfig(kind="manual", travel_mm=(400.0, 900.0), reading_sigma_mm=0.5)


def job_with(found: Optics, stage: object) -> SweepJob:
    profile = load_profile("sim").model_copy(update={"stage": stage})
    return SweepJob(Run(profile, found), (), 1)


def told_of(found: Optics, stage: object, read_mm: float, measurement: Measurement) -> list[str]:
    told: list[str] = []
    opinion = SecondOpinion(told.append)
    opinion.begins(job_with(found, stage), 0)
    stop = Stop(3, read_mm, "fit", "forward")
    for sample in range(2):  # the second sample of a stop says nothing new
        multiview = MultiView((Frame("a", IMAGE, 0.0, 0),))
        opinion.took(NewSample(stop, sample, read_mm, multiview), (3, sample))
        opinion.measured(MappingProxyType({(3, sample): measurement}))
    return told


def at(depth_mm: float, calibrated: CalibratedOptics) -> Measurement:
    """A board square to the axis, at the middle of the picture where the camera looks."""
    rectification = calibrated.rectification
    slope_px = rectification.inverse_law_px_mm / depth_mm - rectification.infinity_px
    return Measurement(slope_px=slope_px, sigma_px=0.01)


@pytest.mark.parametrize(
    ("read_mm", "words", "is_doubted"),
    [
        (500.0, "1.0 mm farther", False),
        (502.5, "1.5 mm nearer", False),
        (511.0, "10.0 mm nearer: more than 4 times reading_sigma_mm; was it misread?", True),
    ],
)
def test_a_reading_is_told_beside_what_the_cameras_see(
    read_mm: float, words: str, is_doubted: bool
):
    calibrated = optics()
    (line,) = told_of(calibrated, HAND, read_mm, at(501.0, calibrated))
    assert line.startswith(f"read {read_mm:.1f} mm, the calibrated cameras see the board {words}")
    assert ("misread" in line) == is_doubted


def test_nothing_is_told_of_a_stage_that_reads_its_own_place_or_of_plain_cameras():
    calibrated = optics()
    measurement = at(501.0, calibrated)
    assert told_of(calibrated, load_profile("sim").stage, 500.0, measurement) == []
    plain = nominal_optics(load_profile("sim"))
    assert told_of(plain, HAND, 500.0, measurement) == []


def test_a_board_that_was_not_measured_has_no_opinion():
    missing = Measurement(failure=Failure("not-found", "no board"))
    assert told_of(optics(), HAND, 500.0, missing) == []
    unsure = replace(missing, failure=None)
    assert told_of(optics(), HAND, 500.0, unsure) == []
