"""Firmware that is one program on one chip: it blocks where the real one does, by yielding."""

from collections.abc import Callable, Generator
from typing import Protocol

from rig.devices import Clock

Program = Generator[None, None, None]
"""A part of the firmware that may wait; it yields while it does."""


class Chip(Protocol):
    """The state that a program works on, and the interrupts that change it."""

    now_s: float
    printed: bytearray
    is_booting: bool

    def take_byte(self, byte: int) -> None:
        """Take one received byte."""
        ...

    def next_event_s(self) -> float | None:
        """Return when the next interrupt comes by itself; None if none does."""
        ...

    def take_event(self) -> None:
        """Let happen what is due."""
        ...

    def power_up(self) -> None:
        """Start with fresh power; in motion the motor is stopped dead and slips."""
        ...

    def trip(self) -> None:
        """Let go wrong what this kind of controller answers with an alarm."""
        ...

    def lie(self, reports: int) -> None:
        """Claim in the next reports that the board has arrived."""
        ...


class ChipFirmware:
    """Keeps `rig_sim.wire.Firmware`; nothing in it runs by itself, every call catches up first."""

    def __init__(self, chip: Chip, program: Callable[[], Program], clock: Clock) -> None:
        self._clock = clock
        self._chip = chip
        self._start = program
        self._program = program()

    @property
    def clock(self) -> Clock:
        """See `Firmware.clock`."""
        return self._clock

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`; a booting board loses what it is sent."""
        self._catch_up()
        for byte in data:
            if not self._chip.is_booting:
                self._chip.take_byte(byte)
                next(self._program)

    def transmit(self) -> bytes:
        """See `Firmware.transmit`."""
        self._catch_up()
        data = bytes(self._chip.printed)
        self._chip.printed.clear()
        return data

    def next_event_s(self) -> float | None:
        """See `Firmware.next_event_s`."""
        self._catch_up()
        return self._chip.next_event_s()

    def port_opened(self) -> None:
        """See `Firmware.port_opened`; DTR resets the board."""
        self.hard_reset()

    def hard_reset(self) -> None:
        """See `Firmware.hard_reset`."""
        self._catch_up()
        self._chip.power_up()
        self._program = self._start()

    def trip(self) -> None:
        """See `Firmware.trip`."""
        self._catch_up()
        self._chip.trip()
        next(self._program)

    def lie(self, reports: int) -> None:
        """See `Firmware.lie`."""
        self._chip.lie(reports)

    def _catch_up(self) -> None:
        """Let everything happen that was due until now, in order."""
        chip = self._chip
        now_s = self._clock.now_s()
        next(self._program)
        while (event_s := chip.next_event_s()) is not None and event_s <= now_s:
            chip.now_s = max(chip.now_s, event_s)
            chip.take_event()
            next(self._program)
        chip.now_s = max(chip.now_s, now_s)
