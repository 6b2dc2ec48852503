"""What a controller's settings mean for the axis of the board."""

import pytest
from rig_drivers.grbl.settings import check_axis, read_axis
from rig_drivers.stage.travel import distance_mm, machine_mm

from rig.errors import ConfigError
from rig.profile import GrblStageConfig
from tests.support.stages import STAGE

SETTINGS: dict[int, float] = {
    13: 0, 20: 1, 22: 1, 23: 0, 27: 2.0,
    110: 6000, 111: 1200, 112: 600, 120: 400, 121: 50, 122: 10, 130: 820, 131: 200, 132: 100,
}  # fmt: skip


@pytest.mark.parametrize(
    ("axis", "homes_down", "options", "range_mm", "home_mm"),
    [
        ("X", 0, "V", (-820.0, 0.0), -2.0),
        ("Z", 0, "V", (-100.0, 0.0), -2.0),
        ("X", 1, "V", (-820.0, 0.0), -818.0),
        ("Y", 1, "V", (-200.0, 0.0), -2.0),
        ("Y", 2, "V", (-200.0, 0.0), -198.0),
        ("X", 0, "VZ", (-820.0, 0.0), 0.0),
        ("X", 1, "VZ", (0.0, 820.0), 0.0),
    ],
)
def test_range_and_home_follow_the_homing_direction(
    axis: str, homes_down: int, options: str, range_mm: tuple[float, float], home_mm: float
) -> None:
    config = STAGE.model_copy(update={"axis": axis})
    read = read_axis(SETTINGS | {23: homes_down}, options, config, device="stage")
    assert read.range_mm == range_mm
    assert read.home_mm == home_mm


def test_rates_are_per_second() -> None:
    read = read_axis(SETTINGS, "V", STAGE.model_copy(update={"axis": "Y"}), device="stage")
    assert (read.rate_mm_s, read.acceleration_mm_s2) == (20.0, 50.0)


def test_missing_settings_are_named() -> None:
    settings = {n: v for n, v in SETTINGS.items() if n not in {27, 130}}
    with pytest.raises(ConfigError, match=r"has no setting \$27, \$130"):
        read_axis(settings, "V", STAGE, device="stage")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({22: 0.0}, r"\$22=0, homing must be on"),
        ({20: 0.0}, r"\$20=0, soft limits must be on"),
        ({13: 1.0}, r"\$13=1, reports must be in mm"),
    ],
)
def test_unsafe_settings_are_refused(changes: dict[int, float], expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        read_axis(SETTINGS | changes, "V", STAGE, device="stage")


def test_no_acceleration_is_refused() -> None:
    axis = read_axis(SETTINGS | {120: 0.0}, "V", STAGE, device="stage")
    with pytest.raises(ConfigError, match=r"\$120 is 0\.0 mm/s2"):
        check_axis(STAGE, axis, device="stage")


def config_with(direction: int, zero_mm: float) -> GrblStageConfig:
    return STAGE.model_copy(
        update={"direction": direction, "distance_at_machine_zero_mm": zero_mm, "approach_mm": 2.0}
    )


@pytest.mark.parametrize(
    ("direction", "zero_mm", "fits"),
    [
        (1, 200.0, True),
        (1, 199.9, False),
        (1, 928.0, True),
        (1, 928.1, False),
        (-1, 108.0, True),
        (-1, 108.1, False),
        (-1, -620.0, True),
        (-1, -620.1, False),
    ],
)
def test_the_travel_and_its_approach_must_fit(direction: int, zero_mm: float, fits: bool) -> None:
    """Travel 110..200 mm from 108 mm on; the axis has 820 mm."""
    config = config_with(direction, zero_mm)
    axis = read_axis(SETTINGS, "V", config, device="stage")
    if fits:
        check_axis(config, axis, device="stage")
        return
    with pytest.raises(ConfigError, match=r"needs 108\.0\.\.200\.0 mm"):
        check_axis(config, axis, device="stage")


@pytest.mark.parametrize("direction", [1, -1])
def test_coordinates_go_there_and_back(direction: int) -> None:
    config = config_with(direction, 203.0)
    assert distance_mm(config, -3.0) == 203.0 - 3.0 * direction
    assert machine_mm(config, distance_mm(config, -3.0)) == -3.0
