"""The camera itself: one thread that answers commands and sends pictures, and what goes wrong."""

import ipaddress
import select
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Self

import numpy as np

from tests.support.gige.features import ADDRESSES, CHUNK_IDS, PIXEL_FORMATS
from tests.support.gige.memory import CONTROL, PACKET_SIZE, STREAM_ADDRESS, STREAM_PORT, Memory

PORT: Final = 3956
_STEP_S: Final = 0.002
_NAMES: Final = {address: name for name, address in ADDRESSES.items()}


@dataclass
class Faults:
    """What goes wrong; frames are counted from 0, packets of a picture from 1."""

    dropped_once: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    """(frame, packet) that is sent only when it is asked for again."""
    dropped: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    """(frame, packet) that never comes."""
    lost: set[int] = field(default_factory=set[int])
    """Frames that are counted and never sent."""
    lower: set[int] = field(default_factory=set[int])
    """Frames that come with half of their lines."""
    stored: dict[str, Callable[[float], float]] = field(
        default_factory=dict[str, Callable[[float], float]]
    )
    """By feature: what the camera makes of a value."""
    is_silent: bool = False
    """Whether it sends no pictures."""
    is_gone: bool = False
    """Whether it answers nothing."""


class GigeCamera:
    """A camera at an address of the loopback interface, between `__enter__` and `__exit__`.

    Every pixel of frame n has the value n (and of a mosaic and of colours as well), unless
    something is painted.
    """

    def __init__(
        self,
        address: str,
        *,
        model: str = "Wire",
        serial: str = "W1",
        user_name: str = "",
        faults: Faults | None = None,
        first_frame_id: int = 1,
        tick_hz: int = 1_000_000_000,
        without: tuple[str, ...] = (),
        paint: Callable[[], bytes] | None = None,
    ) -> None:
        self.address, self.serial = address, serial
        self.faults = faults or Faults()
        self.memory = Memory(address, model, serial, user_name, tick_hz, without)
        self.writes: list[tuple[str, float]] = []
        self.sent = 0
        self._paint = paint
        self._first_frame_id, self._tick_hz = first_frame_id, tick_hz
        self._pulses: deque[float] = deque()
        self._selected = {"TriggerMode": [1.0, 0.0], "ChunkEnable": [0.0, 0.0, 0.0]}
        self._owner: tuple[str, int] | None = None
        self._is_running = False
        self._next_s = 0.0
        self._exposed_s = 0.0
        self._kept: deque[tuple[int, tuple[int, list[bytes]]]] = deque(maxlen=16)
        self._stop = threading.Event()

    def __enter__(self) -> Self:
        self._control = self._socket(self.address)
        self._others = [self._socket(a) for a in ("255.255.255.255", "127.255.255.255")]
        self._stream = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._stream.bind((self.address, 0))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    @staticmethod
    def _socket(address: str) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        made.bind((address, PORT))
        return made

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        for made in (self._control, self._stream, *self._others):
            made.close()

    def pulse(self, exposed_s: float) -> None:
        """An edge on Line1; the picture is taken at a time, however late this thread is."""
        self._pulses.append(exposed_s)

    def _run(self) -> None:
        while not self._stop.is_set():
            readable, _, _ = select.select([self._control, *self._others], [], [], _STEP_S)
            for one in readable:
                packet, sender = one.recvfrom(2048)
                if not self.faults.is_gone:
                    self._answer(packet, sender)
            if self.faults.is_gone:
                self._owner, self._is_running = None, False  # as when its power is cut
            if self._is_running and self._is_time():
                self._send_picture()

    def _is_time(self) -> bool:
        if self._selected["TriggerMode"][0]:
            if self.memory["TriggerSource"] == 1 or not self._pulses:
                return False
            self._exposed_s = self._pulses.popleft()
            return True
        if time.monotonic() < self._next_s:
            return False
        self._exposed_s = self._next_s
        self._next_s += 1.0 / self.memory["AcquisitionFrameRate"]
        return True

    def _answer(self, packet: bytes, sender: tuple[str, int]) -> None:
        _, _, command, size, number = struct.unpack(">BBHHH", packet[:8])
        data = packet[8 : 8 + size]
        if command == 0x0040:
            self._send_again(data)
            return
        if command in (0x0082, 0x0086) and self._owner not in (None, sender):
            refused = struct.pack(">BBHHH", 0x80, 0x06, command + 1, 0, number)  # access denied
            self._control.sendto(refused, sender)
            return
        kinds = {
            0x0002: lambda: self.memory.read(0, 0xF8),
            0x0080: lambda: b"".join(
                self.memory.read(a, 4) for (a,) in struct.iter_unpack(">I", data)
            ),
            0x0082: lambda: self._write_words(data),
            0x0084: lambda: data[:4] + self.memory.read(*struct.unpack(">IHH", data)[::2]),
            0x0086: lambda: self._write(int.from_bytes(data[:4]), data[4:]),
        }
        result = kinds[command]()
        if command == 0x0082 and self.memory.word(CONTROL):
            self._owner = sender
        elif not self.memory.word(CONTROL):
            self._owner = None
        head = struct.pack(">BBHHH", 0, 0, command + 1, len(result), number)
        self._control.sendto(head + result, sender)

    def _write_words(self, data: bytes) -> bytes:
        for address, value in struct.iter_unpack(">I4s", data):
            self._write(address, value)
        return struct.pack(">HH", 0, len(data) // 8)

    def _write(self, address: int, data: bytes) -> bytes:
        self.memory.write(address, data)
        name = _NAMES.get(address)
        if name is not None:
            self._changed(name)
        if address == CONTROL and not int.from_bytes(data):
            self._is_running = False
        return struct.pack(">HH", 0, len(data))

    def _changed(self, name: str) -> None:
        value = self.memory[name]
        self.writes.append((name, value))
        if name in self.faults.stored:
            self.memory[name] = self.faults.stored[name](value)
        selectors = {"TriggerMode": "TriggerSelector", "ChunkEnable": "ChunkSelector"}
        for selected, selector in selectors.items():
            place = int(self.memory[selector])
            if name == selected:
                self._selected[selected][place] = value
            elif name == selector:
                self.memory[selected] = self._selected[selected][place]
        if name in ("AcquisitionStart", "AcquisitionStop"):
            period_s = 1.0 / self.memory["AcquisitionFrameRate"]
            self._is_running = name == "AcquisitionStart"
            # As if all free cameras had one clock: pictures at whole multiples of the period.
            self._next_s = time.monotonic() + period_s - time.time() % period_s
        if name == "TriggerSoftware" and self._is_running and self._selected["TriggerMode"][0]:
            self._exposed_s = time.monotonic()
            self._send_picture()
        self.memory["PayloadSize"] = len(self._payload(0, 0))

    def _payload(self, frame: int, ticks: int) -> bytes:
        width, height = int(self.memory["Width"]), int(self.memory["Height"])
        code = int(self.memory["PixelFormat"])
        count = width * height
        if self._paint is not None and code == PIXEL_FORMATS["Mono8"]:
            picture = self._paint()
        elif code == PIXEL_FORMATS["Mono12"]:
            picture = np.full(count, frame % 4096, "<u2").tobytes()
        elif code == PIXEL_FORMATS["Mono12p"]:
            value = frame % 4096
            group = [value & 255, value >> 8 | (value & 15) << 4, value >> 4]
            picture = bytes(group) * (count // 2)
        else:
            picture = bytes([frame % 256]) * (count * (3 if code == PIXEL_FORMATS["RGB8"] else 1))
        if not self.memory["ChunkModeActive"]:
            return picture
        exposure = self.memory["ExposureTime"]
        values = {
            "Timestamp": struct.pack(">Q", ticks),
            "FrameID": struct.pack(">Q", 1000 + frame),
            "ExposureTime": struct.pack(">d", exposure),
        }
        chunks = [picture + struct.pack(">II", 0x1, len(picture))]
        for is_on, (name, data) in zip(self._selected["ChunkEnable"], values.items(), strict=True):
            if is_on:
                chunks.append(data + struct.pack(">II", CHUNK_IDS[name], len(data)))
        return b"".join(chunks)

    def _send_picture(self) -> None:
        frame, self.sent = self.sent, self.sent + 1
        if self.faults.is_silent or frame in self.faults.lost:
            return
        block = (self._first_frame_id - 1 + frame) % 65535 + 1
        packets = self._packets(frame, block)
        self._kept.append((block, (frame, packets)))
        for number, packet in enumerate(packets):
            key = (frame, number)
            if key not in self.faults.dropped_once and key not in self.faults.dropped:
                self._send(packet)

    def _packets(self, frame: int, block: int) -> list[bytes]:
        ticks = round(self._exposed_s * self._tick_hz)
        payload = self._payload(frame, ticks)
        width, height = int(self.memory["Width"]), int(self.memory["Height"])
        if frame in self.faults.lower:
            height //= 2
        kind = 0x4001 if self.memory["ChunkModeActive"] else 0x0001
        leader = struct.pack(
            ">HHQIIIIIHH",
            0,
            kind,
            ticks,
            int(self.memory["PixelFormat"]),
            width,
            height,
            0,
            0,
            0,
            0,
        )
        room = (self.memory.word(PACKET_SIZE) & 0xFFFF) - 20 - 8 - 8
        parts = [payload[i : i + room] for i in range(0, len(payload), room)]
        trailer = struct.pack(">HHI", 0, kind, height)
        bodies = [(1, leader), *((3, part) for part in parts), (2, trailer)]
        return [
            struct.pack(">HHI", 0, block, form << 24 | number) + body
            for number, (form, body) in enumerate(bodies)
        ]

    def _send(self, packet: bytes) -> None:
        host = str(ipaddress.IPv4Address(self.memory.word(STREAM_ADDRESS)))
        port = self.memory.word(STREAM_PORT) & 0xFFFF
        if port:
            self._stream.sendto(packet, (host, port))

    def _send_again(self, data: bytes) -> None:
        block, first, last = struct.unpack(">III", data[:12])
        frame, packets = dict(self._kept).get(block & 0xFFFF, (0, []))
        for number in range(first & 0xFFFFFF, (last & 0xFFFFFF) + 1):
            if number < len(packets) and (frame, number) not in self.faults.dropped:
                self._send(packets[number])
