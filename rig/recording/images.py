"""Pictures out of messages `foxglove.RawImage`: protobuf, and the JSON of recordings of old."""

import base64
import math
from typing import Annotated, Final, cast

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError
from pydantic import BaseModel, Field, ValidationError

from rig.frames import ColourImage, GreyImage
from rig.recording.mcap_reader import StoredMessage

_KINDS: Final = {"mono8": np.dtype("<u1"), "mono16": np.dtype("<u2"), "rgb8": np.dtype("<u1")}
_Side = Annotated[int, Field(ge=1, le=1 << 16, strict=True)]


class _JsonImage(BaseModel):
    encoding: str
    width: _Side
    height: _Side
    data: str


def image_of(message: StoredMessage) -> GreyImage:
    """Return the picture (H, W) of a message.

    Raises:
        ValueError: it holds none, or one in colour.
    """
    image = _picture_of(message)
    if image.ndim != 2:
        raise ValueError("a picture in colour where a grey one belongs")
    return image


def colour_of(message: StoredMessage) -> ColourImage:
    """Return the picture (H, W, 3) of a message.

    Raises:
        ValueError: it holds none, or a grey one.
    """
    image = _picture_of(message)
    if image.ndim != 3:
        raise ValueError("a grey picture where one in colour belongs")
    return np.asarray(image, np.uint8)


def _picture_of(message: StoredMessage) -> GreyImage:
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
    whole = (*shape, 3) if encoding == "rgb8" else shape
    if min(shape) < 1 or len(data) != math.prod(whole) * kind.itemsize:
        raise ValueError(f"{len(data)} bytes for {width} x {height} px, {encoding}")
    pixels = np.frombuffer(data, kind).reshape(whole)
    return cast("GreyImage", pixels.astype(kind.newbyteorder("="), copy=False))


def in_short(error: ValidationError) -> str:
    """Return the first fault that pydantic found, in one line."""
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    where = ".".join(str(step) for step in first["loc"])
    return f"{where}: {first['msg']}" if where else str(first["msg"])
