"""How well an old distance must be found again when a sweep goes on."""

import pytest

from rig.curve import CurvePoint
from rig.profile import ManualStageConfig
from rig.profile.load import load_profile
from rig.sweep.resume import allowed_change_px

BEFORE = CurvePoint(400.0, 120.0, 0.01, 0.15, 5, "fit", "forward")


@pytest.mark.parametrize("has_stage", [True, False])
def test_a_stage_comes_back_by_itself(has_stage: bool) -> None:
    profile = load_profile("sim")
    if not has_stage:
        profile = profile.model_copy(update={"stage": None})
    assert allowed_change_px(profile, BEFORE, 0.1) == 0.1


def test_a_hand_comes_back_within_three_sigmas_of_two_readings() -> None:
    hand = ManualStageConfig(kind="manual", travel_mm=(400.0, 1200.0))
    profile = load_profile("sim").model_copy(update={"stage": hand})
    assert allowed_change_px(profile, BEFORE, 0.1) == pytest.approx(0.1 + 3.0 * 0.15 * 2.0**0.5)
