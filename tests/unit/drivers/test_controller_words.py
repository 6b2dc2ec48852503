"""Codes of controllers and their meaning: each number has its own words."""

import pytest
from rig_drivers.grbl.dialect import AXES, Dialect, alarm, refusal
from rig_drivers.grbl.settings import FLUIDNC_KEYS, GrblAxis, check_axis, read_fluidnc_axis
from rig_drivers.marlin.settings import MarlinAxis, read_axis, travel_time_s
from rig_drivers.stage.travel import check_speed, check_travel

from rig.errors import ConfigError
from tests.support.stages import STAGE

GRBL_ALARMS = {
    1: "limit switch was hit", 2: "soft limits", 3: "reset while in motion", 4: "wrong state",
    5: "probe found nothing", 6: "interrupted by a reset", 7: "safety door",
    8: "did not open again", 9: "no limit switch was found", 0: "unknown", 10: "unknown",
}  # fmt: skip
GRBLHAL_ALARMS = {
    10: "emergency stop", 11: "homing is required", 12: "a limit switch is closed",
    13: "probe protection", 14: "did not reach its speed", 15: "second motor", 16: "self-test",
    17: "motor driver", 18: "homing is not configured", 19: "Modbus", 20: "expander",
    21: "settings memory", 22: "unknown",
}  # fmt: skip
FLUIDNC_ALARMS = {
    10: "spindle", 11: "active at the start", 12: "both limit switches", 13: "hard stop",
    14: "not homed", 15: "just started", 16: "expander was reset", 17: "line of G-code",
    18: "the probe hit", 19: "unknown",
}  # fmt: skip
REFUSALS = {
    1: "begin with a letter", 2: "number could not be read", 3: r"unknown \$ command",
    4: "unknown error", 5: "homing is off", 6: "unknown error", 8: "not idle", 9: "locked",
    10: "soft limits need homing", 11: "too long", 12: "unknown error", 13: "safety door",
    14: "unknown error", 15: "outside the controller's travel", 16: "not a valid jog",
    17: "unknown error", 20: "unknown G-code word", 21: "unknown error", 22: "no feed rate",
    33: "not a valid target", 34: "unknown error", 152: "unknown error",
}  # fmt: skip
GRBLHAL_REFUSALS = {
    5: "homing is off", 17: "unknown error", 18: "reset input", 19: "unknown error",
    45: "limit switch is closed", 46: "homing is required", 47: "unknown error",
    48: "unknown error", 49: "self-test", 50: "emergency stop", 51: "motor driver",
    52: "unknown error", 55: "homing is not configured", 79: "an emergency has stopped everything",
}  # fmt: skip
FLUIDNC_REFUSALS = {
    3: r"unknown \$ command", 5: "no axis homes", 18: "no axis has a homing cycle",
    19: "may not be homed alone", 40: "pin is active", 41: "unknown error",
    130: "jog was cancelled", 152: "configuration is invalid", 162: "configuration file only",
}  # fmt: skip


@pytest.mark.parametrize(
    ("dialect", "alarms"),
    [
        (Dialect.GRBL, GRBL_ALARMS),
        (Dialect.GRBLHAL, GRBLHAL_ALARMS | {9: GRBL_ALARMS[9]}),
        (Dialect.FLUIDNC, FLUIDNC_ALARMS | {9: GRBL_ALARMS[9]}),
    ],
)
def test_every_alarm_has_the_words_of_its_number(dialect: Dialect, alarms: dict[int, str]):
    found = {code: alarm("stage", code, dialect).found for code in alarms}
    assert {code: words in found[code] for code, words in alarms.items()} == dict.fromkeys(
        alarms, True
    )


@pytest.mark.parametrize(
    ("dialect", "code", "words"),
    [
        (dialect, code, words)
        for dialect, refusals in (
            (Dialect.GRBL, REFUSALS),
            (Dialect.GRBLHAL, GRBLHAL_REFUSALS),
            (Dialect.FLUIDNC, FLUIDNC_REFUSALS),
        )
        for code, words in refusals.items()
    ],
)
def test_every_refusal_has_the_words_of_its_number(dialect: Dialect, code: int, words: str):
    error = refusal("stage", "G0", code, dialect)
    assert error.found.startswith("stage: G0 was refused, error:")
    assert words != "unknown error" or dialect.value in error.advice
    with pytest.raises(Exception, match=f"error:{code}: .*{words}"):
        raise error


FLUIDNC = dict(zip(FLUIDNC_KEYS, ("true", "1200.0", "50.0", "300.0", "5.0", "true"), strict=True))


def fluidnc(**changes: str) -> GrblAxis:
    return read_fluidnc_axis(FLUIDNC | changes, STAGE, device="stage")


def test_fluidncs_tree_gives_rates_per_second_and_a_range_on_the_far_side_of_the_switch():
    assert fluidnc() == GrblAxis(20.0, 50.0, (-295.0, 5.0), 5.0)
    down = fluidnc(**{"homing/positive_direction": "false"})
    assert down == GrblAxis(20.0, 50.0, (5.0, 305.0), 5.0)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"soft_limits": "false"}, "/axes/x/soft_limits false"),
        ({"max_travel_mm": "far"}, "/axes/x holds what is no number"),
    ],
)
def test_a_tree_that_is_not_safe_is_refused(changes: dict[str, str], says: str):
    with pytest.raises(ConfigError, match=says):
        fluidnc(**changes)


@pytest.mark.parametrize("key", FLUIDNC_KEYS)
def test_a_tree_without_a_value_is_refused_by_its_name(key: str):
    values = {name: value for name, value in FLUIDNC.items() if name != key}
    with pytest.raises(ConfigError, match=f"has no /axes/x/{key}"):
        read_fluidnc_axis(values, STAGE, device="stage")


WIDE = GrblAxis(STAGE.speed_mm_s, 400.0, (-820.0, 0.0), -2.0)


@pytest.mark.parametrize(("axis", "number"), [("X", 0), ("Y", 1), ("Z", 2)])
def test_what_does_not_fit_is_named_by_the_setting_of_the_axis(axis: str, number: int):
    assert AXES[number] == axis
    config = STAGE.model_copy(update={"axis": axis})
    check_axis(config, WIDE, device="stage")
    for bad, setting in (
        (GrblAxis(80.0, 0.0, (-820.0, 0.0), -2.0), 120),
        (GrblAxis(79.9, 400.0, (-820.0, 0.0), -2.0), 110),
        (GrblAxis(80.0, 400.0, (-90.0, 0.0), -2.0), 130),
    ):
        with pytest.raises(ConfigError, match=rf"\${setting + number} "):
            check_axis(config, bad, device="stage")


def test_a_controller_that_is_just_fast_enough_is_taken():
    check_speed(STAGE, STAGE.speed_mm_s, setting="$110", device="stage")
    with pytest.raises(ConfigError, match=r"80\.0, the controller's \$110 allows 80\.0 mm/s"):
        check_speed(STAGE, 0.9999 * STAGE.speed_mm_s, setting="$110", device="stage")


@pytest.mark.parametrize("off_mm", [0.5e-6, 3e-6])
def test_travel_may_miss_by_the_rounding_of_sums_and_no_more(off_mm: float):
    # The board goes from 108 to 200 mm, which are -102 and -10 mm of the controller.
    config = STAGE.model_copy(update={"approach_mm": 2.0})
    for range_mm in ((-102.0 + off_mm, 0.0), (-820.0, -10.0 - off_mm)):
        if off_mm < 1e-6:
            check_travel(config, range_mm, setting="$130", device="stage")
            continue
        with pytest.raises(ConfigError, match=r"needs 108\.0\.\.200\.0 mm, the controller's \$130"):
            check_travel(config, range_mm, setting="$130", device="stage")


M503 = {
    "M92": "echo:  M92 X400.00 Y80.00 Z400.00 E500.00",
    "M203": "echo:  M203 X100.00 Y300.00 Z5.00 E25.00",
    "M201": "echo:  M201 X500.00 Y3000.00 Z100.00 E10000.00",
    "M204": "echo:  M204 P3000.00 R3000.00 T400.00",
    "M211": "echo:  M211 S1 ; ON",
    "ends": "echo:  Min:  X-1.50 Y2.00 Z0.00   Max:  X820.00 Y200.00 Z180.00",
}


def test_each_axis_of_a_marlin_has_numbers_of_its_own():
    found = {axis: read_axis(M503.values(), axis, device="stage") for axis in "XYZ"}
    assert found == {
        "X": MarlinAxis(100.0, 400.0, 400.0, (-1.5, 820.0)),
        "Y": MarlinAxis(300.0, 400.0, 80.0, (2.0, 200.0)),
        "Z": MarlinAxis(5.0, 100.0, 400.0, (0.0, 180.0)),
    }


@pytest.mark.parametrize(
    "line",
    [
        {"M92": "echo:  M92 X0.00 Y80.00"},
        {"M201": "echo:  M201 X0.00 Y80.00"},
        {"M204": "echo:  M204 P1.00 R1.00 T0.00"},
    ],
)
def test_a_marlin_that_cannot_move_is_refused(line: dict[str, str]):
    with pytest.raises(ConfigError, match="set M201, M204 T and M92 above 0"):
        read_axis((M503 | line).values(), "X", device="stage")


@pytest.mark.parametrize(
    ("way_mm", "time_s"), [(16.0, 0.4), (15.21, 0.39), (96.0, 1.4), (0.0, 0.0), (4.0, 0.2)]
)
def test_a_move_takes_a_ramp_up_a_cruise_and_a_ramp_down(way_mm: float, time_s: float):
    # 80 mm/s at 400 mm/s2: each ramp takes 0.2 s and 8 mm.
    assert travel_time_s(way_mm, 80.0, 400.0) == pytest.approx(time_s, abs=1e-12)
