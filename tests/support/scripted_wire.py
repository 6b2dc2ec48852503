"""A wire on which a test looks at, answers or changes what passes."""

from collections.abc import Callable

from rig_sim.wire import Firmware

from rig.devices import Clock
from tests.support.stages import Bench

MOVES = (b"$J=", b"move abs", b"G1 ")


class Scripted:
    """A firmware that lets a test look at, answer or change what passes."""

    def __init__(self, firmware: Firmware) -> None:
        self.firmware = firmware
        self.sent = b""
        self.on_receive: Callable[[bytes], bytes] = lambda data: data
        self.on_transmit: Callable[[bytes], bytes] = lambda data: data

    @property
    def clock(self) -> Clock:
        return self.firmware.clock

    def receive(self, data: bytes) -> None:
        self.sent += data
        self.firmware.receive(self.on_receive(data))

    def transmit(self) -> bytes:
        return self.on_transmit(self.firmware.transmit())

    def next_event_s(self) -> float | None:
        return self.firmware.next_event_s()

    def port_opened(self) -> None:
        self.firmware.port_opened()

    def hard_reset(self) -> None:
        self.firmware.hard_reset()

    def trip(self) -> None:
        self.firmware.trip()

    def lie(self, reports: int) -> None:
        self.firmware.lie(reports)


def scripted(bench: Bench) -> Scripted:
    assert isinstance(bench.wire, Scripted)
    return bench.wire


def during_the_move(bench: Bench, act: Callable[[], None], after_s: float = 0.2) -> None:
    """Let something happen once, a while after the next move was sent."""
    wire = scripted(bench)
    due_s: list[float] = []

    def receive(data: bytes) -> bytes:
        if any(word in data for word in MOVES) and not due_s:
            due_s.append(wire.clock.now_s() + after_s)
        elif due_s and wire.clock.now_s() >= due_s[0]:
            due_s[0] = float("inf")
            act()
        return data

    wire.on_receive = receive
