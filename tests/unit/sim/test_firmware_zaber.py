"""The simulated Zaber chain by its own words."""

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.zaber import ZaberFirmware
from rig_sim.firmware.zaber.messages import read_command, sum_of

from rig.errors import ConfigError
from rig.profile import CarriageConfig, FirmwareConfig, ZaberFirmwareConfig
from rig.profile.load import load_profile

FIRMWARE = FirmwareConfig(travel_mm=120.0, homing_locate_mm_s=20.0)


class Bench:
    """A chain, spoken to over time."""

    def __init__(self, **zaber: object) -> None:
        self.clock = VirtualClock(10.0)
        mechanics = CarriageConfig(board_at_machine_zero_mm=210.0, power_up_mm=-40.0)
        self.carriage = Carriage(mechanics, self.clock)
        chain = ZaberFirmwareConfig.model_validate({"checksum": False} | zaber)
        config = FIRMWARE.model_copy(update={"zaber": chain})
        self.firmware = ZaberFirmware(config, self.carriage, self.clock)

    def say(self, line: str) -> str:
        self.firmware.receive(line.encode() + b"\n")
        return self.firmware.transmit().decode().strip()

    def wait(self, duration_s: float = 10.0) -> str:
        self.clock.sleep_s(duration_s)
        return self.firmware.transmit().decode().strip()

    def home(self) -> None:
        assert self.say("/1 1 home") == "@01 1 OK BUSY WR 0"
        self.wait()


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("/", "@01 0 OK IDLE WR 0"),
        ("/1", "@01 0 OK IDLE WR 0"),
        ("/1 1", "@01 1 OK IDLE WR 0"),
        ("/1 1 7", "@01 1 07 OK IDLE WR 0"),
        ("/1 1 --", "@01 1 OK IDLE WR 0"),
        ("/1 0 99 get version", "@01 0 99 OK IDLE WR 7.33"),
        ("/1 1 warnings", "@01 1 OK IDLE WR 01 WR"),
        ("/1 2 get pos", "@01 2 RJ IDLE WR BADAXIS"),
        ("/1 1 sing", "@01 1 RJ IDLE WR BADCOMMAND"),
        ("/1 1 move abs high", "@01 1 RJ IDLE WR BADDATA"),
        ("/1 1 get limit.max", "@01 1 OK IDLE WR 48000"),
        ("/2 1 get pos", ""),
        ("1 1 get pos", ""),
    ],
)
def test_commands_are_answered(line: str, answer: str) -> None:
    bench = Bench()
    said = bench.say(line)
    assert said.replace("@01 2 RJ IDLE -- BADAXIS", "@01 2 RJ IDLE WR BADAXIS") == answer


def test_the_answer_comes_at_the_start_of_a_move() -> None:
    bench = Bench()
    bench.home()
    assert bench.say("/1 1 move abs 20000") == "@01 1 OK BUSY -- 0"
    assert bench.say("/1 1 get pos") == "@01 1 OK BUSY -- 0"
    bench.wait(0.3)
    assert "BUSY" in bench.say("/1")
    bench.wait()
    assert bench.say("/1 1 get pos") == "@01 1 OK IDLE -- 20000"
    assert bench.carriage.travelled_mm(bench.clock.now_s()) == pytest.approx(-50.0)


def test_speeds_are_in_the_devices_own_units() -> None:
    bench = Bench()
    bench.home()
    bench.say("/1 1 move abs 40000 16384")  # 10 000 microsteps per second, 25 mm/s
    bench.wait(3.9)
    assert "BUSY" in bench.say("/1")
    bench.wait(0.3)
    assert "IDLE" in bench.say("/1")


def test_checksums_are_checked_and_given() -> None:
    bench = Bench(checksum=True)
    body = "1 1 5 get pos"
    assert bench.say(f"/{body}:{sum_of(body):02X}").startswith("@01 1 05 OK IDLE WR 0:")
    assert bench.say(f"/{body}:{sum_of(body) ^ 1:02X}") == ""
    assert bench.say("/1 0 set comm.checksum 0") == "@01 0 OK IDLE WR 0"


def test_every_device_of_a_chain_answers_a_call_to_all() -> None:
    bench = Bench(addresses=(1, 4), axes=2)
    assert bench.say("/").split("\r\n") == ["@01 0 OK IDLE WR 0", "@04 0 OK IDLE WR 0"]
    assert bench.say("/4 0 get pos") == "@04 0 OK IDLE WR 0 0"


def test_an_interrupted_move_leaves_a_note() -> None:
    bench = Bench()
    bench.home()
    bench.say("/1 1 move abs 40000")
    bench.wait(0.2)
    assert bench.say("/1 1 move abs 10000") == "@01 1 OK BUSY NI 0"
    bench.wait()
    assert bench.say("/1 1 warnings clear") == "@01 1 OK IDLE -- 01 NI"
    assert bench.say("/1 1 get pos") == "@01 1 OK IDLE -- 10000"


def test_homing_from_deep_in_the_sensor_finds_the_same_place() -> None:
    bench = Bench()
    bench.say("/1 1 home")
    bench.wait(0.49)
    bench.say("/1 1 stop")
    bench.wait()
    assert bench.carriage.travelled_mm(bench.clock.now_s()) > 3.0
    bench.home()
    assert bench.carriage.travelled_mm(bench.clock.now_s()) == pytest.approx(0.0, abs=0.003)


def test_flags_are_ordered_by_urgency() -> None:
    bench = Bench()
    bench.firmware.trip()
    assert bench.say("/1 1 warnings") == "@01 1 OK IDLE FS 02 FS WR"
    assert bench.say("/1 1 warnings clear") == "@01 1 OK IDLE WR 02 FS WR"


def test_a_motor_without_current_does_not_move() -> None:
    bench = Bench()
    assert bench.say("/1 1 driver disable") == "@01 1 OK IDLE FO 0"
    assert bench.say("/1 1 home") == "@01 1 RJ IDLE FO DRIVERDISABLED"
    bench.say("/1 1 driver enable")
    bench.home()


def test_alerts_tell_the_end_of_a_motion_where_they_are_wanted() -> None:
    bench = Bench()
    bench.home()
    bench.say("/1 0 set comm.alert 1")
    bench.say("/1 1 move rel 400")
    assert bench.wait() == "!01 1 IDLE --"


def test_fresh_power_forgets_the_reference_and_takes_time() -> None:
    bench = Bench()
    bench.home()
    bench.firmware.hard_reset()
    assert bench.say("/1") == ""
    bench.wait(3.0)
    assert bench.say("/1 1") == "@01 1 OK IDLE WR 0"


def test_a_chain_in_which_nothing_carries_the_board_is_refused() -> None:
    with pytest.raises(ConfigError, match="axis 1 of device 3 carries the board, there are dev"):
        load_profile("sim", ["world.firmware.zaber.address=3"])


def test_odd_lines_are_no_commands() -> None:
    assert read_command("hello") is None
    assert read_command("/1 1:0") is None
    command = read_command("noise/3 2 14 move abs 5")
    assert command is not None
    assert (command.address, command.axis, command.number) == (3, 2, "14 ")
    assert command.words == ("move", "abs", "5")
