"""The simulated port: found by pyserial, exclusive, and on the clock of its firmware."""

import json
import queue
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import serial
from rig_drivers.grbl.controller import grbl_stage
from rig_sim.carriage import Carriage
from rig_sim.firmware.grbl import GrblFirmware
from rig_sim.wire import plug
from rig_sim.wire.faults import (
    Delay,
    Drop,
    Duplicate,
    FaultyWire,
    Garble,
    HangUp,
    Lie,
    Silence,
    Split,
    Trip,
)
from rig_sim.wire.serve import serve_on_pty

from rig.devices import SystemClock
from rig.errors import ConfigError
from rig.profile import CarriageConfig, FirmwareConfig
from tests.support.stages import STAGE, URL, simulated_bench


def test_pyserial_finds_it_by_url() -> None:
    url = URL.upper().replace("SIM", "sim")
    with simulated_bench() as bench, serial.serial_for_url(url, timeout=3.0) as port:
        assert port.read_until(b"]\r\n") == b"\r\nGrbl 1.1h ['$' for help]\r\n"
        assert bench.clock.now_s() == pytest.approx(101.6, abs=1e-3), "no time was lost"
        port.write(b"$I\n")
        assert port.in_waiting > 0


def test_nothing_plugged_in_is_an_error() -> None:
    with simulated_bench(), pytest.raises(serial.SerialException, match="no simulated firmware"):
        serial.serial_for_url("sim://elsewhere")


def test_only_one_program_may_open_it() -> None:
    with simulated_bench():
        used = pytest.raises(serial.SerialException, match="used by another program")
        with serial.serial_for_url(URL), used:
            serial.serial_for_url(URL)
        serial.serial_for_url(URL).close()


def test_one_name_is_one_firmware() -> None:
    with simulated_bench() as bench:
        with pytest.raises(ConfigError, match="already plugged in"), plug(URL, bench.wire):
            pass
        with pytest.raises(ConfigError, match="is no simulated port"), plug("tcp://x", bench.wire):
            pass


def test_a_read_waits_on_the_clock_of_the_firmware() -> None:
    with simulated_bench() as bench, serial.serial_for_url(URL, timeout=0.0) as port:
        start_s = bench.clock.now_s()
        assert port.read(10) == b""
        assert bench.clock.now_s() == start_s
        port.timeout = 0.5
        assert port.read(10) == b""
        assert bench.clock.now_s() == pytest.approx(start_s + 0.5)
        port.reset_input_buffer()
        port.close()
        with pytest.raises(serial.PortNotOpenError):
            port.read()


class Echo:
    """A firmware that repeats what it hears."""

    def __init__(self, clock: SystemClock) -> None:
        self.clock = clock
        self._said = b""

    def receive(self, data: bytes) -> None:
        self._said += data

    def transmit(self) -> bytes:
        said, self._said = self._said, b""
        return said

    def next_event_s(self) -> float | None:
        return None

    def port_opened(self) -> None:
        self._said = b""

    def hard_reset(self) -> None:
        self._said = b""

    def trip(self) -> None:
        self._said += b"ALARM"

    def lie(self, reports: int) -> None:
        self._said += b"there" * reports


class Still(SystemClock):
    """A clock that a test moves."""

    time_s = 0.0

    def now_s(self) -> float:
        return self.time_s


def test_faults_do_what_they_say() -> None:
    clock = Still()
    wires = [
        FaultyWire(Echo(clock), fault)
        for fault in (
            Drop(2, "device", 2),
            Duplicate(2, "device"),
            Silence(3),
            Garble(1, "device", seed=5),
        )
    ]
    for wire in wires:
        wire.receive(b"abcdef")
    heard = [wire.transmit() for wire in wires]
    assert heard[:3] == [b"abef", b"abccdef", b""]
    assert len(heard[3]) == 6
    assert heard[3][0:1] + heard[3][2:] == b"acdef"
    assert heard[3] != b"abcdef"


def test_the_machine_itself_can_fail_once() -> None:
    tripped, lying = (FaultyWire(Echo(Still()), fault) for fault in (Trip(2), Lie(2, reports=2)))
    for wire in (tripped, lying):
        wire.receive(b"abcd")
    assert tripped.transmit() == b"ALARMabcd"
    assert lying.transmit() == b"theretherebabcd".replace(b"b", b"", 1)
    assert tripped.has_struck


def test_a_hang_up_is_an_operating_system_error() -> None:
    wire = FaultyWire(Echo(Still()), HangUp(2))
    wire.receive(b"ab")
    with pytest.raises(OSError, match="Input/output"):
        wire.transmit()


def test_delays_keep_the_order() -> None:
    clock = Still()
    delayed = FaultyWire(Echo(clock), Delay(0, "device", 1.0))
    split = FaultyWire(Echo(clock), Split(0, "device", 0.1))
    delayed.receive(b"abc")
    split.receive(b"abc")
    assert delayed.next_event_s() == 1.0
    assert (delayed.transmit(), split.transmit()) == (b"", b"")
    clock.time_s = 0.25
    assert (delayed.transmit(), split.transmit()) == (b"", b"ab")
    clock.time_s = 1.0
    delayed.receive(b"d")
    assert (delayed.transmit(), split.transmit()) == (b"abcd", b"c")


class Interrupted(GrblFirmware):
    """A firmware in whose service somebody presses Ctrl-C."""

    is_enough = False

    def next_event_s(self) -> float | None:
        if self.is_enough:
            raise KeyboardInterrupt
        return super().next_event_s()


FAST = FirmwareConfig(
    boot_s=0.02,
    travel_mm=120.0,
    max_rate_mm_s=500.0,
    acceleration_mm_s2=5000.0,
    homing_mm_s=200.0,
    homing_locate_mm_s=50.0,
    homing_pause_s=0.0,
)


@pytest.mark.skipif(not Path("/dev/ptmx").exists(), reason="no pseudo-terminals here")
def test_the_driver_reaches_it_over_a_pty_in_real_time() -> None:
    clock = SystemClock()
    carriage = Carriage(CarriageConfig(board_at_machine_zero_mm=210.0, power_up_mm=-3.0), clock)
    firmware = Interrupted(FAST, carriage, clock)
    ready: queue.Queue[str] = queue.Queue()
    ends: list[str] = []

    def serve() -> None:
        try:
            serve_on_pty(firmware, on_ready=ready.put)
        except KeyboardInterrupt:
            ends.append("interrupted")

    server = threading.Thread(target=serve)
    server.start()
    path = ready.get(timeout=5.0)
    config = STAGE.model_copy(update={"port": path, "speed_mm_s": 500.0})
    try:
        with grbl_stage(config, clock) as stage:
            stage.home()
            assert stage.move_to(190.0, 5.0) == pytest.approx(190.0)
            assert carriage.travelled_mm(clock.now_s()) == pytest.approx(-20.0, abs=0.01)
    finally:
        firmware.is_enough = True
        server.join(5.0)
    assert ends == ["interrupted"]
    assert not Path(path).exists(), "the terminal is gone"


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/ptmx").exists(), reason="no pseudo-terminals here")
def test_the_verb_prints_its_port_and_ends_on_an_interrupt() -> None:
    command = [sys.executable, "-c", "from rig.cli import main; main()", "sim", "stage", "--json"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        text = "".join(iter(server.stdout.readline, "}\n")) + "}"
        told = json.loads(text)
        with serial.Serial(told["port"], told["baud"], timeout=5.0, exclusive=True) as port:
            assert port.read_until(b"help]\r\n").endswith(b"Grbl 1.1h ['$' for help]\r\n")
        server.send_signal(signal.SIGINT)
        assert server.wait(10.0) == 130
