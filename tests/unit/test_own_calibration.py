"""A device that holds a calibration of its own, and changed it since the curve was made."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from rig.calibration_alone import require_same_calibration
from rig.errors import CurveError, TargetError
from rig.factory import CALIBRATION_SHA256 as HASH
from rig.factory import changed_calibration
from rig.optics.nominal import nominal_optics
from rig.profile.load import load_profile
from rig.run import Run, RunCurve
from rig.sweep.resume import measure_old_distance_again

NO_CURVE: Any = None


@pytest.mark.parametrize(
    ("before", "now", "changed"),
    [
        ({HASH: "a1"}, {HASH: "a1"}, None),
        ({HASH: "a1"}, {HASH: "b2"}, HASH),
        ({f"left+right.{HASH}": "a1"}, {f"left+right.{HASH}": "b2"}, f"left+right.{HASH}"),
        ({HASH: "a1"}, {"kind": "recording"}, None),
        ({"kind": "v4l2", "serial": "1"}, {HASH: "b2", "serial": "2"}, None),
        ({}, {}, None),
    ],
)
def test_a_calibration_of_a_devices_own_is_compared_where_both_tell_it(
    before: dict[str, object], now: dict[str, object], changed: str | None
) -> None:
    assert changed_calibration(before, now) == changed


def test_a_curve_under_which_the_device_was_calibrated_anew_is_refused() -> None:
    profile = load_profile("sim")
    curve = RunCurve(4, NO_CURVE, 7, camera={HASH: 8 * "a1"})
    run = Run(profile, nominal_optics(profile), curve)
    require_same_calibration(run, {HASH: 8 * "a1"})
    require_same_calibration(replace(run, curve=None), {HASH: 8 * "b2"})
    said = r"curve 4 was made while the device held the calibration a1a1a1a1\.\.\., it holds b2b2b2"
    with pytest.raises(CurveError, match=said) as told:
        require_same_calibration(run, {HASH: 8 * "b2"})
    assert "`rig sweep sim`" in told.value.advice


def test_a_sweep_does_not_go_on_with_a_device_that_was_calibrated_anew() -> None:
    profile = load_profile("sim")
    run = Run(profile, nominal_optics(profile))
    job: Any = SimpleNamespace(run=run, samples=1)
    hardware: Any = SimpleNamespace(camera=SimpleNamespace(identity={HASH: "b2"}))
    store: Any = SimpleNamespace(sweep=lambda _: SimpleNamespace(devices={"camera": {HASH: "a1"}}))
    with pytest.raises(TargetError, match="sweep 5 was begun while the device held") as told:
        measure_old_distance_again(job, 5, hardware, store, lambda _: None)
    assert told.value.reason == "changed"
