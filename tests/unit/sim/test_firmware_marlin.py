"""The simulated Marlin by its own words."""

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.marlin import MarlinFirmware
from rig_sim.firmware.marlin.lines import Damaged, Taken, check_line

from rig.profile import CarriageConfig, FirmwareConfig, MarlinFirmwareConfig

FIRMWARE = FirmwareConfig(travel_mm=120.0, homing_locate_mm_s=20.0, boot_s=1.0)


class Bench:
    """A controller that has just started, spoken to over time."""

    def __init__(self, **marlin: object) -> None:
        self.clock = VirtualClock(10.0)
        mechanics = CarriageConfig(board_at_machine_zero_mm=210.0, power_up_mm=-40.0)
        self.carriage = Carriage(mechanics, self.clock)
        extra = MarlinFirmwareConfig.model_validate(marlin)
        config = FIRMWARE.model_copy(update={"marlin": extra})
        self.firmware = MarlinFirmware(config, self.carriage, self.clock)
        self.banner = self.wait(1.1)

    def say(self, line: str) -> list[str]:
        self.firmware.receive(line.encode() + b"\n")
        return self.wait(0.0)

    def wait(self, duration_s: float = 10.0) -> list[str]:
        self.clock.sleep_s(duration_s)
        return self.firmware.transmit().decode().splitlines()

    def true_mm(self) -> float:
        return self.carriage.travelled_mm(self.clock.now_s())


def test_the_start_is_announced_with_the_settings() -> None:
    bench = Bench()
    assert bench.banner[0] == "start"
    assert any("M92 X400.00" in line for line in bench.banner)


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("M114", ["X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0", "ok"]),
        ("M118 hello there", ["hello there", "ok"]),
        ("G99", ['echo:Unknown command: "G99"', "ok"]),
        ("", []),
        ("; only a comment", []),
        ("N1 M400*38", ["ok"]),
        ("N2 M400*37", [
            "Error:Line Number is not Last Line Number+1, Last Line: 0", "Resend: 1", "ok"]),
        ("N1 M400*37", ["Error:checksum mismatch, Last Line: 0", "Resend: 1", "ok"]),
        ("N1 M400", ["Error:No Checksum with line number, Last Line: 0", "Resend: 1", "ok"]),
        ("M400*38", ["Error:No Line Number with checksum, Last Line: 0", "Resend: 1", "ok"]),
    ],
)  # fmt: skip
def test_lines_are_answered(line: str, answer: list[str]) -> None:
    assert Bench().say(line) == answer


def test_numbers_may_be_set_anew() -> None:
    assert check_line("N9 M110 N4*112", 77) == Taken("M110 N4", 4)
    assert isinstance(check_line("N9 M114*0", 77), Damaged)
    assert check_line("M114", 77) == Taken("M114", None)


def test_ok_means_queued_and_the_position_is_the_planned_one() -> None:
    bench = Bench()
    bench.say("G28 X")
    bench.wait()
    assert bench.say("G1 X50 F3000") == ["ok"]
    assert bench.say("M114")[0].startswith("X:50.00 ")
    assert bench.true_mm() == pytest.approx(0.0, abs=0.01)
    assert bench.say("M400") == []
    assert bench.wait(1.1) == []
    assert bench.wait(0.1) == ["ok"]
    assert bench.true_mm() == pytest.approx(-50.0, abs=0.01)


def test_a_long_wait_is_told_as_busy() -> None:
    bench = Bench(busy_s=2.0)
    bench.say("G28 X")
    bench.wait()
    bench.say("G1 X50 F600")
    bench.say("M400")
    assert [bench.wait(2.0) for _ in range(3)] == [
        ["echo:busy: processing"], ["echo:busy: processing"], ["ok"]
    ]  # fmt: skip


def test_soft_end_stops_clamp_in_silence_once_homed() -> None:
    bench = Bench()
    bench.say("G28 X")
    bench.wait()
    assert bench.say("G1 X500 F6000") == ["ok"]
    assert bench.say("M114")[0].startswith("X:120.00 ")


@pytest.mark.parametrize("emergency_parser", [True, False])
def test_a_quick_stop_does_not_wait_its_turn(emergency_parser: bool) -> None:
    bench = Bench(emergency_parser=emergency_parser)
    bench.say("G28 X")
    bench.wait()
    bench.say("G1 X100 F3000")
    bench.say("M400")
    bench.wait(1.0)
    said = bench.say("M410")
    assert said == ["ok", "ok"], "M400 has ended, and so has M410"
    stopped_mm = bench.true_mm()
    assert bench.wait(1.0) == []
    assert bench.true_mm() == stopped_mm
    assert -100.0 < stopped_mm < -20.0


def test_after_a_kill_only_fresh_power_helps() -> None:
    bench = Bench()
    assert bench.say("M112") == ["Error:Printer halted. kill() called!"]
    assert bench.say("M114") == []
    bench.firmware.hard_reset()
    assert bench.wait(1.1)[0] == "start"
    assert len(bench.say("M114")) == 2


def test_without_a_switch_homing_kills() -> None:
    bench = Bench()
    bench.carriage = Carriage(
        CarriageConfig(board_at_machine_zero_mm=210.0, has_switch=False), bench.clock
    )
    bench.firmware = MarlinFirmware(FIRMWARE, bench.carriage, bench.clock)
    bench.wait(1.1)
    bench.say("G28 X")
    assert bench.wait(30.0)[-1] == "Error:Printer halted. kill() called!"


def test_an_advanced_ok_names_its_line() -> None:
    bench = Bench(advanced_ok=True)
    assert bench.say("N1 M400*38") == ["ok N1 P15 B4"]
    assert bench.say("M400") == ["ok"]
