"""The simulated Zaber chain at its borders: limits, speeds, addresses, what a knob and a lie do."""

import pytest
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.firmware.zaber import ZaberFirmware
from rig_sim.firmware.zaber.messages import Command, message, read_command, sum_of

from rig.profile import CarriageConfig, FirmwareConfig, ZaberFirmwareConfig

FIRMWARE = FirmwareConfig(
    travel_mm=120.0,
    homing_mm_s=50.0,
    homing_locate_mm_s=20.0,
    max_rate_mm_s=100.0,
    acceleration_mm_s2=400.0,
    pull_off_mm=2.0,
    boot_s=2.0,
)


class Chain:
    """Devices spoken to over time; their carriage stands 40 mm away from its sensor."""

    def __init__(self, *, has_switch: bool = True, **zaber: object) -> None:
        self.clock = VirtualClock(10.0)
        mechanics = CarriageConfig(
            board_at_machine_zero_mm=210.0, power_up_mm=-40.0, has_switch=has_switch
        )
        self.carriage = Carriage(mechanics, self.clock)
        more = ZaberFirmwareConfig.model_validate({"checksum": False, **zaber})
        config = FIRMWARE.model_copy(update={"zaber": more})
        self.firmware = ZaberFirmware(config, self.carriage, self.clock)

    def say(self, line: str) -> str:
        self.firmware.receive(line.encode() + b"\n")
        return self.firmware.transmit().decode().strip()

    def data(self, line: str) -> str:
        return self.say(line).split(" ", 5)[-1]

    def wait(self, duration_s: float = 20.0) -> None:
        self.clock.sleep_s(duration_s)
        self.firmware.transmit()

    def true_mm(self) -> float:
        return self.carriage.travelled_mm(self.clock.now_s())


@pytest.fixture
def homed() -> Chain:
    chain = Chain()
    chain.say("/1 1 home")
    chain.wait()
    assert chain.say("/1 1") == "@01 1 OK IDLE -- 0"
    return chain


@pytest.mark.parametrize(
    ("name", "text"),
    [
        # 400 microsteps per mm; speeds count 1.6384, accelerations 1.6384e-4 per microstep.
        ("limit.min", "0"), ("limit.max", "48000"), ("limit.home.preset", "0"),
        ("maxspeed", "65536"), ("limit.approach.maxspeed", "32768"),
        ("limit.detect.maxspeed", "13107"), ("motion.accelonly", "26"),
        ("motion.decelonly", "26"), ("resolution", "64"), ("driver.temperature", "38.5"),
        ("knob.enable", "1"), ("pos", "0"), ("system.axiscount", "1"), ("deviceid", "50081"),
        ("device.id", "50081"), ("version.build", "1"), ("system.access", "1"),
        ("system.voltage", "48.0"), ("comm.address", "1"), ("comm.alert", "0"),
        ("comm.checksum", "0"), ("sing", "BADCOMMAND"),
    ],
)  # fmt: skip
def test_settings_are_told_in_the_devices_units(name: str, text: str):
    assert Chain().data(f"/1 1 get {name}") == text


def test_a_setting_of_every_axis_is_told_by_the_whole_device():
    chain = Chain(addresses=(1, 4), axes=3, serial_number=7000)
    assert chain.data("/1 0 get resolution") == "64 64 64"
    assert chain.data("/1 2 get resolution") == "64"
    assert chain.data("/1 0 get system.axiscount") == "3"
    assert chain.data("/1 3 set maxspeed 5") == "0"
    assert chain.data("/1 0 get maxspeed") == "65536 65536 5"
    assert (chain.data("/1 get system.serial"), chain.data("/4 get system.serial")) == (
        "7001",
        "7004",
    )
    assert chain.data("/1 3") == "0"
    assert chain.say("/1 4").split()[2:] == ["RJ", "IDLE", "--", "BADAXIS"]


@pytest.mark.parametrize(
    ("words", "end"),
    [
        ("move abs 48000", 48000), ("move abs 48001", None), ("move abs -1", None),
        ("move abs 400", 400), ("move max", 48000), ("move min", 0), ("move rel 800", 800),
        ("move rel 48001", None), ("move rel -1", None), ("move vel 65536", 48000),
        ("move vel -1000", 0), ("move vel 0", None), ("move vel 65537", None),
        ("move abs 4000 65536", 4000), ("move abs 4000 65537", None), ("move abs 4000 0", None),
        ("move abs 4000 -5", None), ("move abs x", None), ("move vel x", None),
    ],
)  # fmt: skip
def test_a_move_ends_within_the_limits_or_is_not_made(homed: Chain, words: str, end: int | None):
    said = homed.say(f"/1 1 {words}")
    homed.wait(60.0)
    assert ("BADDATA" in said) == (end is None)
    assert int(homed.data("/1 1 get pos")) == (end or 0)
    assert homed.true_mm() == pytest.approx(-(end or 0) / 400.0, abs=0.003)


@pytest.mark.parametrize("words", ["move", "move sideways", "move abs", "sing", "driver", "home x"])
def test_odd_commands_are_refused(homed: Chain, words: str):
    assert homed.say(f"/1 1 {words}") == "@01 1 RJ IDLE -- BADCOMMAND"
    assert homed.say("/1 1 warnings twice") == "@01 1 RJ IDLE -- BADCOMMAND"
    assert homed.say("/1 1 set sing 5") == "@01 1 RJ IDLE -- BADCOMMAND"
    assert homed.say("/1 1 set maxspeed x") == "@01 1 RJ IDLE -- BADDATA"


def test_a_move_takes_the_time_of_its_speed(homed: Chain):
    # 16384 units are 25 mm/s; 50 mm take 2 s and, at 26 units (396.7 mm/s2), 63 ms of ramps.
    homed.say("/1 1 move abs 20000 16384")
    homed.wait(2.05)
    assert "BUSY" in homed.say("/1 1")
    homed.wait(0.03)
    assert "IDLE" in homed.say("/1 1")


def test_a_position_can_be_given_and_turns_nothing(homed: Chain):
    homed.say("/1 1 move abs 4000")
    homed.wait()
    before_mm = homed.true_mm()
    assert homed.say("/1 1 set pos 1000") == "@01 1 OK IDLE -- 0"
    assert homed.data("/1 1 get pos") == "1000"
    homed.say("/1 1 move abs 2000")
    homed.wait()
    assert homed.true_mm() - before_mm == pytest.approx(-2.5, abs=0.003)


def test_homing_counts_from_the_preset_and_clears_flags():
    chain = Chain()
    chain.say("/1 1 set limit.home.preset 800")
    chain.firmware.trip()
    assert chain.say("/1 1 warnings") == "@01 1 OK IDLE FS 02 FS WR"
    chain.say("/1 1 home")
    chain.wait(0.5)
    # 50 mm/s for 0.5 s, less half of the 126 ms that the ramp takes.
    assert chain.true_mm() == pytest.approx(-40.0 + 25.0 - 3.15, abs=0.1)
    chain.wait()
    assert chain.say("/1 1 warnings") == "@01 1 OK IDLE -- 00"
    assert chain.data("/1 1 get pos") == "800"
    assert chain.true_mm() == pytest.approx(0.0, abs=0.003)


def test_without_a_sensor_homing_ends_after_one_and_a_half_travels():
    chain = Chain(has_switch=False)
    chain.say("/1 1 home")
    chain.wait()
    assert chain.say("/1 1 warnings") == "@01 1 OK IDLE FS 02 FS WR"
    assert chain.true_mm() == pytest.approx(-40.0 + 1.5 * 120.0, abs=0.003)


def test_a_hand_at_the_knob_is_told_while_it_turns_and_after(homed: Chain):
    homed.firmware.axis.turn_knob(5.0)
    assert homed.say("/1 1 warnings") == "@01 1 OK BUSY NC 02 NC NI"
    homed.wait()
    assert homed.say("/1 1 warnings") == "@01 1 OK IDLE NI 01 NI"
    assert homed.data("/1 1 get pos") == "2000"


def test_a_stop_brakes_and_a_dead_stop_does_not(homed: Chain):
    for word, further_mm in (("stop", 100.0**2 / 2.0 / 396.7), ("estop", 0.0)):
        homed.say("/1 1 move abs 0")
        homed.wait()
        homed.say("/1 1 move abs 40000")
        homed.wait(0.6)
        before_mm = homed.true_mm()
        assert homed.say(f"/1 1 {word}").split()[2:5] == [
            "OK", "BUSY" if further_mm else "IDLE", "--"
        ]  # fmt: skip
        homed.wait()
        way_mm = before_mm - homed.true_mm()
        assert way_mm == pytest.approx(further_mm, abs=1.0 if word == "estop" else 0.1)
        assert homed.say("/1 1 warnings") == "@01 1 OK IDLE -- 00"


def test_a_lie_lasts_so_many_answers(homed: Chain):
    homed.say("/1 1 move abs 40000")
    homed.wait(0.1)
    homed.firmware.lie(2)
    assert homed.say("/1 1 get pos") == "@01 1 OK IDLE -- 40000"
    assert "IDLE" in homed.say("/1 1")
    assert "BUSY" in homed.say("/1 1")
    assert 0 < int(homed.data("/1 1 get pos")) < 4000


def test_power_comes_back_after_its_time():
    chain = Chain()
    chain.firmware.hard_reset()
    chain.wait(1.999)
    assert chain.say("/1 1") == ""
    chain.wait(0.002)
    assert chain.say("/1 1") == "@01 1 OK IDLE WR 0"


def test_a_line_keeps_its_first_eighty_characters():
    chain = Chain()
    blanks = " " * (80 - len("/1 1 get pos"))
    assert chain.say(f"/1 1 get{blanks} pos") == "@01 1 OK IDLE WR 0"
    assert chain.say(f"/1 1 get {blanks} pos") == "@01 1 RJ IDLE WR BADCOMMAND"


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("/", Command(0, 0, "", ())),
        ("/3", Command(3, 0, "", ())),
        ("/3 2", Command(3, 2, "", ())),
        ("/3 2 5", Command(3, 2, "05 ", ())),
        ("/3 2 5 8 x", Command(3, 2, "05 ", ("8", "x"))),
        ("/3 2 -- home", Command(3, 2, "", ("home",))),
        ("/home", Command(0, 0, "", ("home",))),
        ("/1 1 5 get pos:4A", None),
        ("/1 1 get pos:4", None),
        ("home", None),
    ],
)
def test_a_line_is_address_axis_number_and_words(line: str, command: Command | None):
    assert read_command(line) == command


def test_the_sum_of_a_line_and_its_check_is_a_whole_byte():
    body = "01 0 OK IDLE -- 0"
    assert (sum(body.encode()) + sum_of(body)) % 256 == 0
    assert 0 <= sum_of(body) < 256
    assert sum_of("") == 0
    assert sum_of("\x80\x80") == 0
    checked = message("@", 1, 0, "OK IDLE -- 0", with_checksum=True)
    assert checked == f"@{body}:{sum_of(body):02X}\r\n".encode()
    assert message("!", 12, 3, "IDLE --", with_checksum=False) == b"!12 3 IDLE --\r\n"
    for case in (str.upper, str.lower):
        assert read_command(f"/{body}:{case(f'{sum_of(body):02x}')}") is not None
