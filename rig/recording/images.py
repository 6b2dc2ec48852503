"""Pictures out of messages `foxglove.RawImage`: protobuf, and the JSON of recordings of old."""

import base64
from typing import Annotated, Final, cast

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError
from pydantic import BaseModel, Field, ValidationError

from rig.frames import GreyImage
from rig.recording.mcap_reader import StoredMessage

_KINDS: Final = {"mono8": np.dtype("<u1"), "mono16": np.dtype("<u2")}
_Side = Annotated[int, Field(ge=1, le=1 << 16, strict=True)]


class _JsonImage(BaseModel):
    encoding: str
    width: _Side
    height: _Side
    data: str


def image_of(message: StoredMessage) -> GreyImage:
    """Return the picture (H, W) of a message.

    Raises:
        ValueError: it holds none.
    """
    if message.encoding == "json":
        return _of_json(bytes(message.data))
    if message.encoding != "protobuf" or message.schema != "foxglove.RawImage":
        raise ValueError(f"{message.schema!r} as {message.encoding!r} is no picture")
    try:
        told = RawImage.FromString(bytes(message.data))
    except DecodeError as error:
        raise ValueError("no foxglove.RawImage") from error
    return _image(told.encoding, (told.height, told.width), told.data)


def _of_json(content: bytes) -> GreyImage:
    try:
        told = _JsonImage.model_validate_json(content)
    except ValidationError as error:
        raise ValueError(f"no picture: {in_short(error)}") from error
    data = base64.b64decode(told.data, validate=True)
    return _image(told.encoding, (told.height, told.width), data)


def _image(encoding: str, shape: tuple[int, int], data: bytes) -> GreyImage:
    if encoding not in _KINDS:
        raise ValueError(f"pictures of encoding {encoding[:20]!r} are not read")
    kind = _KINDS[encoding]
    height, width = shape
    if min(shape) < 1 or len(data) != height * width * kind.itemsize:
        raise ValueError(f"{len(data)} bytes for {width} x {height} px, {encoding}")
    pixels = np.frombuffer(data, kind).reshape(shape)
    return cast("GreyImage", pixels.astype(kind.newbyteorder("="), copy=False))


def in_short(error: ValidationError) -> str:
    """Return the first fault that pydantic found, in one line."""
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    where = ".".join(str(step) for step in first["loc"])
    return f"{where}: {first['msg']}" if where else str(first["msg"])
