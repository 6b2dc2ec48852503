"""What the camera can do: registers, and the GenICam description that names them."""

from dataclasses import dataclass
from typing import Final

PIXEL_FORMATS: Final = {
    "Mono8": 0x01080001,
    "Mono12": 0x01100005,
    "Mono12p": 0x010C0047,
    "BayerRG8": 0x01080009,
    "RGB8": 0x02180014,
}


@dataclass(frozen=True)
class Feature:
    """A feature with a register of its own."""

    name: str
    address: int
    xml: str
    is_float: bool = False


def _integer(name: str, address: int, bounds: str, access: str = "RW") -> Feature:
    xml = (
        f'<Integer Name="{name}"><pValue>{name}Reg</pValue>{bounds}</Integer>'
        f'<IntReg Name="{name}Reg"><Address>{address}</Address><Length>4</Length>'
        f"<AccessMode>{access}</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></IntReg>"
    )
    return Feature(name, address, xml)


def _float(name: str, address: int, least: float, most: float, unit: str) -> Feature:
    xml = (
        f'<Float Name="{name}"><pValue>{name}Reg</pValue><Min>{least}</Min><Max>{most}</Max>'
        f"<Unit>{unit}</Unit></Float>"
        f'<FloatReg Name="{name}Reg"><Address>{address}</Address><Length>8</Length>'
        "<AccessMode>RW</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess>"
        "</FloatReg>"
    )
    return Feature(name, address, xml, is_float=True)


def _choice(name: str, address: int, entries: dict[str, int]) -> Feature:
    listed = "".join(
        f'<EnumEntry Name="{entry}"><Value>{value}</Value></EnumEntry>'
        for entry, value in entries.items()
    )
    xml = (
        f'<Enumeration Name="{name}">{listed}<pValue>{name}Reg</pValue></Enumeration>'
        f'<IntReg Name="{name}Reg"><Address>{address}</Address><Length>4</Length>'
        "<AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></IntReg>"
    )
    return Feature(name, address, xml)


def _command(name: str, address: int) -> Feature:
    xml = (
        f'<Command Name="{name}"><pValue>{name}Reg</pValue><CommandValue>1</CommandValue></Command>'
        f'<IntReg Name="{name}Reg"><Address>{address}</Address><Length>4</Length>'
        "<AccessMode>WO</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></IntReg>"
    )
    return Feature(name, address, xml)


def _switch(name: str, address: int) -> Feature:
    xml = (
        f'<Boolean Name="{name}"><pValue>{name}Reg</pValue></Boolean>'
        f'<IntReg Name="{name}Reg"><Address>{address}</Address><Length>4</Length>'
        "<AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></IntReg>"
    )
    return Feature(name, address, xml)


def _text(name: str, address: int, length: int) -> str:
    return (
        f'<StringReg Name="{name}"><Address>{address}</Address><Length>{length}</Length>'
        "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>"
    )


ONOFF: Final = {"Off": 0, "On": 1}
CHUNK_IDS: Final = {"Timestamp": 0xA1, "FrameID": 0xA2, "ExposureTime": 0xA3}
FEATURES: Final = (
    _integer("Width", 0x10000, "<Min>16</Min><Max>640</Max><Inc>8</Inc>"),
    _integer("Height", 0x10004, "<Min>16</Min><Max>480</Max><Inc>2</Inc>"),
    _integer("OffsetX", 0x10008, "<Min>0</Min><Max>576</Max><Inc>8</Inc>"),
    _integer("OffsetY", 0x1000C, "<Min>0</Min><Max>432</Max><Inc>2</Inc>"),
    _integer("PayloadSize", 0x10010, "", "RO"),
    _choice("PixelFormat", 0x10014, PIXEL_FORMATS),
    _choice("AcquisitionMode", 0x10018, {"SingleFrame": 1, "Continuous": 0}),
    _command("AcquisitionStart", 0x1001C),
    _command("AcquisitionStop", 0x10020),
    _choice("TriggerSelector", 0x10024, {"FrameStart": 0, "AcquisitionStart": 1}),
    _choice("TriggerMode", 0x10028, ONOFF),
    _choice("TriggerSource", 0x1002C, {"Line1": 0, "Software": 1}),
    _choice("TriggerActivation", 0x10030, {"RisingEdge": 0, "FallingEdge": 1}),
    _command("TriggerSoftware", 0x10034),
    _choice("ExposureAuto", 0x10038, {"Off": 0, "Continuous": 1}),
    _choice("GainAuto", 0x1003C, {"Off": 0, "Continuous": 1}),
    _switch("AcquisitionFrameRateEnable", 0x10040),
    _switch("ChunkModeActive", 0x10044),
    _choice("ChunkSelector", 0x10048, {name: i for i, name in enumerate(CHUNK_IDS)}),
    _switch("ChunkEnable", 0x1004C),
    _integer("TestPattern", 0x10050, "<Min>0</Min><Max>3</Max>"),
    _float("ExposureTime", 0x10100, 20.0, 100000.0, "us"),
    _float("Gain", 0x10108, 0.0, 24.0, "dB"),
    _float("AcquisitionFrameRate", 0x10110, 1.0, 250.0, "Hz"),
)
ADDRESSES: Final = {feature.name: feature.address for feature in FEATURES}


def _chunk(name: str, kind: str) -> str:
    port = f'<Port Name="Chunk{name}Port"><ChunkID>{CHUNK_IDS[name]:x}</ChunkID></Port>'
    register = (
        "<Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode>"
        f"<pPort>Chunk{name}Port</pPort>"
    )
    if kind == "Float":
        return (
            f'{port}<FloatReg Name="Chunk{name}">{register}<Endianess>BigEndian</Endianess>'
            "</FloatReg>"
        )
    return (
        f'{port}<IntReg Name="Chunk{name}">{register}<Sign>Unsigned</Sign>'
        "<Endianess>BigEndian</Endianess></IntReg>"
    )


def description(without: tuple[str, ...]) -> bytes:
    """The GenICam description, without some features."""
    there = [feature for feature in FEATURES if feature.name not in without]
    listed = "".join(f"<pFeature>{feature.name}</pFeature>" for feature in there)
    chunks = _chunk("Timestamp", "Int") + _chunk("FrameID", "Int") + _chunk("ExposureTime", "Float")
    texts = (
        _text("DeviceVendorName", 0x48, 32)
        + _text("DeviceModelName", 0x68, 32)
        + _text("DeviceVersion", 0x88, 32)
        + _text("DeviceSerialNumber", 0xD8, 16)
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>'
        '<RegisterDescription ModelName="Wire" VendorName="Rig" ToolTip="" '
        'StandardNameSpace="GEV" SchemaMajorVersion="1" SchemaMinorVersion="1" '
        'SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0" '
        'ProductGuid="0" VersionGuid="0" xmlns="http://www.genicam.org/GenApi/Version_1_1">'
        f'<Category Name="Root" NameSpace="Standard">{listed}<pFeature>DeviceVendorName</pFeature>'
        "<pFeature>DeviceModelName</pFeature><pFeature>DeviceVersion</pFeature>"
        "<pFeature>DeviceSerialNumber</pFeature></Category>"
        f"{texts}{''.join(feature.xml for feature in there)}{chunks}"
        '<Port Name="Device"/></RegisterDescription>'
    ).encode()
