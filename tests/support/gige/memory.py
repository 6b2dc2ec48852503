"""The registers of the camera, by address: GigE Vision's own, its features, its description."""

import ipaddress
import struct
from typing import Final

from tests.support.gige.features import ADDRESSES, FEATURES, PIXEL_FORMATS, description

XML_ADDRESS: Final = 0x20000
HEARTBEAT: Final = 0x938
TICKS_LOW: Final = 0x940
CONTROL: Final = 0xA00
STREAM_PORT: Final = 0xD00
PACKET_SIZE: Final = 0xD04
STREAM_ADDRESS: Final = 0xD18
_FLOATS: Final = {feature.name for feature in FEATURES if feature.is_float}


class Memory:
    """Bytes by address."""

    def __init__(
        self,
        address: str,
        model: str,
        serial: str,
        user_name: str,
        tick_hz: int,
        without: tuple[str, ...],
    ) -> None:
        self._bytes = bytearray(0x40000)
        xml = description(without)
        self._bytes[XML_ADDRESS : XML_ADDRESS + len(xml)] = xml
        self._words(
            {
                0x0: 0x00010002,
                0x4: 0x80000001,
                0x8: 0x00000200,
                0xC: int(ipaddress.IPv4Address(address)),
                0x14: 5,
                0x24: int(ipaddress.IPv4Address(address)),
                0x34: 0xFF000000,
                0x600: 1,
                0x904: 1,
                0x934: 1 << 31 | 1 << 30 | 7,
                HEARTBEAT: 3000,
                TICKS_LOW: tick_hz,
                PACKET_SIZE: 1500,
            }
        )
        texts = {0x48: "Rig", 0x68: model, 0x88: "7.2", 0xD8: serial, 0xE8: user_name}
        texts[0x200] = f"Local:wire.xml;{XML_ADDRESS:x};{len(xml):x}"
        for place, text in texts.items():
            self._bytes[place : place + len(text)] = text.encode()
        for name, value in {"Width": 640, "Height": 480, "OffsetX": 64, "ExposureAuto": 1}.items():
            self[name] = value
        self["PixelFormat"] = PIXEL_FORMATS["RGB8"]
        self["ExposureTime"], self["AcquisitionFrameRate"] = 5000.0, 30.0
        self["TriggerMode"], self["GainAuto"] = 1, 1  # as another program left it

    def _words(self, values: dict[int, int]) -> None:
        for address, value in values.items():
            self.write(address, struct.pack(">I", value))

    def read(self, address: int, size: int) -> bytes:
        return bytes(self._bytes[address : address + size])

    def write(self, address: int, data: bytes) -> None:
        self._bytes[address : address + len(data)] = data

    def word(self, address: int) -> int:
        return int.from_bytes(self.read(address, 4))

    def __getitem__(self, name: str) -> float:
        if name in _FLOATS:
            return struct.unpack(">d", self.read(ADDRESSES[name], 8))[0]
        return self.word(ADDRESSES[name])

    def __setitem__(self, name: str, value: float) -> None:
        data = struct.pack(">d", value) if name in _FLOATS else struct.pack(">I", int(value))
        self.write(ADDRESSES[name], data)
