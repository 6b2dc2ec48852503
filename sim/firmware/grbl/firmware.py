"""The simulated GRBL as its serial line sees it."""

from rig.devices import Clock
from rig.profile import FirmwareConfig
from sim.carriage import Carriage
from sim.firmware.grbl.machine import Machine
from sim.firmware.grbl.program import run


class GrblFirmware:
    """Keeps `sim.wire.Firmware`; nothing in it runs by itself, every call catches up first."""

    def __init__(self, config: FirmwareConfig, carriage: Carriage, clock: Clock) -> None:
        self._clock = clock
        self._boot_s = config.boot_s
        self._machine = Machine(config, carriage, clock.now_s())
        self._program = run(self._machine, config.boot_s)

    @property
    def clock(self) -> Clock:
        """See `Firmware.clock`."""
        return self._clock

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`; a booting board loses what it is sent."""
        self._catch_up()
        for byte in data:
            if not self._machine.is_booting:
                self._machine.take_byte(byte)
                next(self._program)

    def transmit(self) -> bytes:
        """See `Firmware.transmit`."""
        self._catch_up()
        data = bytes(self._machine.printed)
        self._machine.printed.clear()
        return data

    def next_event_s(self) -> float | None:
        """See `Firmware.next_event_s`."""
        self._catch_up()
        return self._machine.next_event_s()

    def hard_reset(self) -> None:
        """See `Firmware.hard_reset`; in motion the motor is stopped dead and slips."""
        self._catch_up()
        self._machine.steppers.kill(self._machine.now_s, slips=True)
        self._machine.power_up()
        self._program = run(self._machine, self._boot_s)

    def _catch_up(self) -> None:
        """Let everything happen that was due until now, in order."""
        machine = self._machine
        now_s = self._clock.now_s()
        next(self._program)
        while (event_s := machine.next_event_s()) is not None and event_s <= now_s:
            machine.now_s = max(machine.now_s, event_s)
            machine.take_event()
            next(self._program)
        machine.now_s = max(machine.now_s, now_s)
