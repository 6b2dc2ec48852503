"""Faults of a serial line, each as a value; `FaultyWire` puts one before a firmware.

Every fault strikes once `after_bytes` bytes have passed in both directions together.
"""

import errno
import random
from collections import deque
from dataclasses import dataclass
from typing import Literal

from rig.devices import Clock
from rig_sim.wire.sockets import Firmware

Toward = Literal["host", "device"]


@dataclass(frozen=True, slots=True)
class Drop:
    """Some bytes do not arrive."""

    after_bytes: int
    toward: Toward
    count: int = 1


@dataclass(frozen=True, slots=True)
class Duplicate:
    """Some bytes arrive, and then once more."""

    after_bytes: int
    toward: Toward
    count: int = 1


@dataclass(frozen=True, slots=True)
class Garble:
    """Some bytes arrive as others."""

    after_bytes: int
    toward: Toward
    count: int = 1
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Delay:
    """Everything in one direction is held up, and then comes all at once."""

    after_bytes: int
    toward: Toward
    duration_s: float


@dataclass(frozen=True, slots=True)
class Split:
    """From then on bytes come one by one."""

    after_bytes: int
    toward: Toward
    gap_s: float


@dataclass(frozen=True, slots=True)
class Silence:
    """From then on nothing passes; the port itself stays."""

    after_bytes: int


@dataclass(frozen=True, slots=True)
class HangUp:
    """The port vanishes, as an unplugged adapter does."""

    after_bytes: int


@dataclass(frozen=True, slots=True)
class BrownOut:
    """The controller's supply breaks down for a moment, and it starts again."""

    after_bytes: int


@dataclass(frozen=True, slots=True)
class Trip:
    """Something goes wrong in the machine, and the controller raises its alarm."""

    after_bytes: int


@dataclass(frozen=True, slots=True)
class Lie:
    """The controller claims in its next reports that the board has arrived."""

    after_bytes: int
    reports: int = 1


Fault = Drop | Duplicate | Garble | Delay | Split | Silence | HangUp | BrownOut | Trip | Lie


class FaultyWire:
    """A firmware behind a line with one fault; keeps `rig_sim.wire.Firmware`."""

    def __init__(self, firmware: Firmware, fault: Fault) -> None:
        self._firmware = firmware
        self._fault = fault
        self._lanes: dict[Toward, _Lane] = {"host": _Lane(), "device": _Lane()}
        self._passed = 0
        self._struck = 0
        self._is_mended = False
        self._random = random.Random(fault.seed if isinstance(fault, Garble) else 0)  # noqa: S311

    @property
    def clock(self) -> Clock:
        """See `Firmware.clock`."""
        return self._firmware.clock

    @property
    def passed_bytes(self) -> int:
        """How many bytes have been sent by both sides."""
        return self._passed

    @property
    def has_struck(self) -> bool:
        """Whether the fault has happened."""
        return self._struck > 0

    def mend(self) -> None:
        """Make the line good from now on; what is on its way is lost."""
        self._is_mended = True
        self._lanes = {"host": _Lane(), "device": _Lane()}

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`."""
        self._send("device", data)
        self._deliver()

    def transmit(self) -> bytes:
        """See `Firmware.transmit`."""
        self._deliver()
        self._send("host", self._firmware.transmit())
        return self._lanes["host"].arrived(self.clock.now_s())

    def next_event_s(self) -> float | None:
        """See `Firmware.next_event_s`."""
        self._deliver()
        times_s = [self._firmware.next_event_s(), *(lane.due_s for lane in self._lanes.values())]
        return min((t for t in times_s if t is not None), default=None)

    def port_opened(self) -> None:
        """See `Firmware.port_opened`."""
        self._firmware.port_opened()

    def hard_reset(self) -> None:
        """See `Firmware.hard_reset`."""
        self._firmware.hard_reset()

    def trip(self) -> None:
        """See `Firmware.trip`."""
        self._firmware.trip()

    def lie(self, reports: int) -> None:
        """See `Firmware.lie`."""
        self._firmware.lie(reports)

    @property
    def _is_due(self) -> bool:
        return self._passed > self._fault.after_bytes and not self._is_mended

    def _deliver(self) -> None:
        data = self._lanes["device"].arrived(self.clock.now_s())
        if data:
            self._firmware.receive(data)

    def _send(self, toward: Toward, data: bytes) -> None:
        """Put bytes on their way, one by one past the fault."""
        lane, now_s = self._lanes[toward], self.clock.now_s()
        for byte in data:
            self._passed += 1
            for copy in self._strike(toward, byte, lane, now_s) if self._is_due else (byte,):
                lane.put(copy, now_s)
        if isinstance(self._fault, HangUp) and self._is_due:
            self._struck += 1
            raise OSError(errno.EIO, "Input/output error")

    def _strike(self, toward: Toward, byte: int, lane: "_Lane", now_s: float) -> tuple[int, ...]:
        """Return what becomes of a byte."""
        match self._fault:
            case Silence():
                self._struck += 1
                return ()
            case BrownOut() if not self._struck:
                self._struck += 1
                self._firmware.hard_reset()
                return ()
            case Trip() | Lie() if not self._struck:
                self._struck += 1
                self._upset()
                return (byte,)
            case HangUp() | BrownOut() | Trip() | Lie():
                return (byte,)
            case fault if fault.toward != toward:
                return (byte,)
            case Split(gap_s=gap_s):
                self._struck += 1
                lane.hold_until(max(now_s, lane.free_s) + gap_s)
                return (byte,)
            case Delay(duration_s=duration_s):
                if not self._struck:
                    lane.hold_until(now_s + duration_s)
                self._struck += 1
                return (byte,)
            case fault:
                return self._spoil(fault, byte)

    def _upset(self) -> None:
        match self._fault:
            case Trip():
                self._firmware.trip()
            case Lie(reports=reports):
                self._firmware.lie(reports)
            case _:
                pass

    def _spoil(self, fault: Drop | Duplicate | Garble, byte: int) -> tuple[int, ...]:
        if self._struck >= fault.count:
            return (byte,)
        self._struck += 1
        match fault:
            case Drop():
                return ()
            case Duplicate():
                return byte, byte
            case Garble():
                return (byte ^ self._random.randrange(1, 256),)


class _Lane:
    """Bytes on their way in one direction; they never overtake each other."""

    def __init__(self) -> None:
        self._bytes: deque[tuple[float, int]] = deque()
        self.free_s = 0.0
        """When the last byte arrives."""

    @property
    def due_s(self) -> float | None:
        return self._bytes[0][0] if self._bytes else None

    def hold_until(self, time_s: float) -> None:
        self.free_s = time_s

    def put(self, byte: int, now_s: float) -> None:
        self.free_s = max(self.free_s, now_s)
        self._bytes.append((self.free_s, byte))

    def arrived(self, now_s: float) -> bytes:
        data = bytearray()
        while self._bytes and self._bytes[0][0] <= now_s:
            data.append(self._bytes.popleft()[1])
        return bytes(data)
