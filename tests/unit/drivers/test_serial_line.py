"""Lines over a real pseudo-terminal: what pyserial does on a real port, translated."""

import os
import tty
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from rig_drivers.stage.serial_line import LONGEST_LINE, SerialLine
from rig_sim.bench import make_firmware
from rig_sim.carriage import Carriage
from rig_sim.clock import VirtualClock
from rig_sim.wire import plug, protocol_sim
from rig_sim.wire.protocol_sim import Serial

from rig.devices import SystemClock
from rig.errors import DeviceLostError, DeviceNotFoundError
from tests.support.stages import CARRIAGE, FIRMWARE, URL


@dataclass
class Pty:
    """Both ends of a pseudo-terminal."""

    server: int
    path: str

    def hang_up(self) -> None:
        if self.server >= 0:
            os.close(self.server)
        self.server = -1


@pytest.fixture
def pty() -> Iterator[Pty]:
    server, client = os.openpty()
    tty.setraw(client)
    made = Pty(server, os.ttyname(client))
    yield made
    os.close(client)
    made.hang_up()


def make_line(path: str) -> SerialLine:
    return SerialLine(path, 115200, clock=SystemClock(), device="stage")


def test_lines_come_whole_and_in_order(pty: Pty) -> None:
    with make_line(pty.path) as line:
        os.write(pty.server, b"\r\nGrbl 1.1h\r\n\r\nok\r\nhal")
        assert line.read_line(1.0) == "Grbl 1.1h"
        assert line.read_line(1.0) == "ok"
        assert line.read_line(0.0) is None
        os.write(pty.server, b"f\n")
        assert line.read_line(1.0) == "half"


def test_what_is_written_arrives(pty: Pty) -> None:
    with make_line(pty.path) as line:
        line.write(b"$I\n")
        assert os.read(pty.server, 100) == b"$I\n"


def test_garbage_is_tolerated_and_counted(pty: Pty) -> None:
    with make_line(pty.path) as line:
        os.write(pty.server, b"\xff\xfeok\r\n")
        assert line.read_line(1.0) == "\ufffd\ufffdok"
        assert line.noise_bytes == 2


def test_a_flood_without_line_ends_is_bounded(pty: Pty) -> None:
    with make_line(pty.path) as line:
        for _ in range(8):
            os.write(pty.server, b"x" * LONGEST_LINE)
            assert line.read_line(0.0) is None
        os.write(pty.server, b"\nok\n")
        assert line.read_line(1.0) == "ok"
        assert line.noise_bytes == 8 * LONGEST_LINE


def test_a_missing_port_is_told(tmp_path: object) -> None:
    with pytest.raises(DeviceNotFoundError, match=r"no port .*gone; check cable and name"):
        make_line(f"{tmp_path}/gone").open()


def test_a_port_in_use_is_told(pty: Pty) -> None:
    with make_line(pty.path), pytest.raises(DeviceNotFoundError, match="used by another program"):
        make_line(pty.path).open()


def test_something_that_is_no_port_is_told(tmp_path: object) -> None:
    with pytest.raises(DeviceNotFoundError, match="cannot be opened"):
        make_line("nonsense://port").open()


def test_a_forbidden_port_names_the_group() -> None:
    error = PermissionError(13, "Permission denied")
    line = make_line("/dev/ttyUSB0")
    assert "dialout" in line._not_opened(error).advice  # pyright: ignore[reportPrivateUsage]


def test_a_vanished_port_is_lost_for_reading(pty: Pty) -> None:
    with make_line(pty.path) as line:
        pty.hang_up()
        with pytest.raises(DeviceLostError, match="does not answer any more"):
            line.read_line(1.0)


def test_a_vanished_port_is_lost_for_writing(pty: Pty) -> None:
    with make_line(pty.path) as line:
        pty.hang_up()
        with pytest.raises(DeviceLostError, match="does not answer any more"):
            line.write(b"?")


def test_a_closed_line_is_refused(pty: Pty) -> None:
    line = make_line(pty.path)
    with pytest.raises(DeviceLostError, match="is not open"):
        line.read_line(1.0)
    with line:
        assert line.is_open
    line.close()
    with pytest.raises(DeviceLostError, match="is not open"):
        line.write(b"?")


@pytest.mark.parametrize("level", [True, False])
def test_the_levels_of_dtr_and_rts_are_set_before_the_port_opens(level: bool) -> None:
    levels: list[tuple[bool, bool, bool]] = []

    class Wired(Serial):
        def open(self) -> None:
            levels.append((self.dtr, self.rts, self.is_open))
            super().open()

    clock = VirtualClock()
    wire = make_firmware("grbl", FIRMWARE, Carriage(CARRIAGE, clock), clock)
    line = SerialLine(URL, 115200, clock=clock, device="stage", dtr=level, rts=not level)
    with plug(URL, wire), pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol_sim, "Serial", Wired)
        with line:
            assert levels == [(level, not level, False)]
