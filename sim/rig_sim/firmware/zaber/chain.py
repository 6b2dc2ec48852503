"""The simulated Zaber chain as its serial line sees it."""

from rig.devices import Clock
from rig.profile import CarriageConfig, FirmwareConfig
from rig_sim.carriage import Carriage
from rig_sim.firmware.zaber.axis import Axis
from rig_sim.firmware.zaber.device import Device
from rig_sim.firmware.zaber.messages import message, read_command

LONGEST_LINE = 80
BINARY_BYTES, BINARY_WHO, BINARY_ERROR, BINARY_BAD_COMMAND = 6, 50, 255, 64
BINARY_PAUSE_S = 0.01
DEVICE_ID = "50081"
"""An X-MCB1 controller."""


class ZaberFirmware:
    """Keeps `rig_sim.wire.Firmware`: devices in a chain; one axis of one of them carries the board.

    Opening the port changes nothing. Every other axis has a carriage of its own.
    """

    def __init__(self, config: FirmwareConfig, carriage: Carriage, clock: Clock) -> None:
        self._clock = clock
        self._boot_s = config.boot_s
        self._ready_s = clock.now_s()
        self._line = bytearray()
        self._printed = bytearray()
        self._was_busy: set[tuple[int, int]] = set()
        zaber = config.zaber
        self._is_binary = zaber.is_binary
        self._heard_s = clock.now_s()
        values = {"deviceid": DEVICE_ID, "device.id": DEVICE_ID, "version": zaber.version}
        values |= {"version.build": "1", "system.access": "1", "system.voltage": "48.0"}
        spare = CarriageConfig(board_at_machine_zero_mm=1.0, power_up_mm=-30.0)
        self.axis = Axis(config, carriage, clock.now_s())
        self._devices: list[Device] = []
        for address in zaber.addresses:
            axes = [Axis(config, Carriage(spare, clock), clock.now_s()) for _ in range(zaber.axes)]
            if address == zaber.address:
                axes[zaber.axis - 1] = self.axis
            serial = {"system.serial": str(zaber.serial_number + address)}
            device = Device(address, axes, values | serial, zaber.lacks)
            device.settings["comm.checksum"] = str(int(zaber.checksum))
            self._devices.append(device)

    @property
    def clock(self) -> Clock:
        """See `Firmware.clock`."""
        return self._clock

    def receive(self, data: bytes) -> None:
        """See `Firmware.receive`."""
        self._catch_up()
        for byte in data:
            if self._clock.now_s() < self._ready_s:
                continue
            if self._is_binary:
                self._take_binary(byte)
            elif byte in b"\r\n":
                self._take(self._line.decode("ascii", errors="replace"))
                self._line.clear()
            elif len(self._line) < LONGEST_LINE:
                self._line.append(byte)

    def transmit(self) -> bytes:
        """See `Firmware.transmit`."""
        self._catch_up()
        data = bytes(self._printed)
        self._printed.clear()
        return data

    def next_event_s(self) -> float | None:
        """See `Firmware.next_event_s`."""
        self._catch_up()
        times_s = [axis.next_event_s() for device in self._devices for axis in device.axes]
        return min((t for t in times_s if t is not None), default=None)

    def port_opened(self) -> None:
        """See `Firmware.port_opened`; a device does not notice."""

    def hard_reset(self) -> None:
        """See `Firmware.hard_reset`."""
        self._catch_up()
        for device in self._devices:
            for axis in device.axes:
                axis.power_up()
        self._line.clear()
        self._printed.clear()
        self._ready_s = self._clock.now_s() + self._boot_s

    def trip(self) -> None:
        """See `Firmware.trip`: the carriage runs into something and stalls."""
        self._catch_up()
        self.axis.trip()

    def lie(self, reports: int) -> None:
        """See `Firmware.lie`."""
        self.axis.lies = reports

    def _take(self, line: str) -> None:
        command = read_command(line)
        if command is None:
            return
        for device in self._devices:
            if command.address not in {0, device.address}:
                continue
            address = device.address
            is_taken, data = device.execute(command)
            axes = device.axes[command.axis - 1 : command.axis] if command.axis else device.axes
            busy = "BUSY" if any(axis.is_busy for axis in axes) else "IDLE"
            flags = [flag for axis in axes for flag in axis.sorted_flags()]
            text = f"{command.number}{'OK' if is_taken else 'RJ'} {busy} {(*flags, '--')[0]} {data}"
            self._say("@", device, address, command.axis, text)
            for axis in axes:
                axis.lies = max(0, axis.lies - 1)

    def _take_binary(self, byte: int) -> None:
        """Take one byte of a binary command; a pause ends what was left incomplete."""
        now_s = self._clock.now_s()
        if now_s - self._heard_s > BINARY_PAUSE_S:
            self._line.clear()
        self._heard_s = now_s
        self._line.append(byte)
        if len(self._line) == BINARY_BYTES:
            to, command = self._line[:2]
            self._line.clear()
            for device in self._devices:
                if to in {0, device.address}:
                    kind = int(DEVICE_ID) if command == BINARY_WHO else BINARY_BAD_COMMAND
                    said = command if command == BINARY_WHO else BINARY_ERROR
                    self._printed += bytes((device.address, said)) + kind.to_bytes(4, "little")

    def _say(self, kind: str, device: Device, address: int, axis: int, text: str) -> None:
        with_checksum = device.settings["comm.checksum"] == "1"
        self._printed += message(kind, address, axis, text, with_checksum=with_checksum)

    def _catch_up(self) -> None:
        """Let every motion happen that was due until now, each axis in its own order."""
        now_s = self._clock.now_s()
        for device in self._devices:
            for number, axis in enumerate(device.axes, start=1):
                while (event_s := axis.next_event_s()) is not None and event_s <= now_s:
                    axis.now_s = max(axis.now_s, event_s)
                    axis.take_event()
                axis.now_s = max(axis.now_s, now_s)
                self._alert(device, number, axis)

    def _alert(self, device: Device, number: int, axis: Axis) -> None:
        """Tell the end of a motion where the setting wants it."""
        key = (device.address, number)
        if axis.is_busy:
            self._was_busy.add(key)
        elif key in self._was_busy:
            self._was_busy.discard(key)
            if device.settings["comm.alert"] == "1":
                flag = (*axis.sorted_flags(), "--")[0]
                self._say("!", device, device.address, number, f"IDLE {flag}")
