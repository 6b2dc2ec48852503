"""Multi-views in MCAP files: whole, lossless, and open to other programs.

Per view one topic `/<view>/image` with `foxglove.RawImage` messages as JSON, which Foxglove and its
relatives show; then one `/multi_view` message that names the frames, with everything that an image
message cannot hold. A multi-view counts only with that last message, and each message is written
through, so that a file that was cut off ends with the last whole multi-view.

Sources: the MCAP specification; Foxglove's schema `RawImage`.
"""

import base64
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final, Self, cast

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import NonSeekingReader
from mcap.writer import Writer

from rig.errors import StoreError
from rig.folder_lock import FolderLock
from rig.frames import Frame, GreyImage, MultiView

_NS: Final = 1_000_000_000
_PROFILE: Final = "epirig"
_INDEX: Final = "/multi_view"
_ENCODINGS: Final = {"uint8": ("mono8", 1), "uint16": ("mono16", 2)}
_TIME: Final = {
    "type": "object",
    "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
}
_RAW_IMAGE: Final = {
    "title": "foxglove.RawImage",
    "type": "object",
    "properties": {
        "timestamp": _TIME,
        "frame_id": {"type": "string"},
        "width": {"type": "integer"},
        "height": {"type": "integer"},
        "encoding": {"type": "string"},
        "step": {"type": "integer"},
        "data": {"type": "string", "contentEncoding": "base64"},
    },
}
_MULTIVIEW: Final = {
    "title": "rig.MultiView",
    "type": "object",
    "properties": {
        "temperature_degc": {"type": ["number", "null"]},
        "frames": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {
                    "view": {"type": "string"},
                    "timestamp_s": {"type": "number"},
                    "sequence": {"type": "integer"},
                    "exposure_s": {"type": ["number", "null"]},
                    "bits": {"type": ["integer", "null"]},
                    "uncertainty_s": {"type": "number"},
                },
            },
        },
    },
}


class RecordingWriter:
    """Writes multi-views into a new file; a context manager.

    Args:
        path: must not exist.
        views: names of the views, in the order of every multi-view.
        identity: what the camera says of itself; kept in the file.

    Raises:
        OwnedError: another program is writing this file.
        StoreError: the file exists or cannot be written.
    """

    def __init__(self, path: Path, views: Sequence[str], identity: Mapping[str, str]) -> None:
        self._path = path
        try:
            self._file = path.open("xb")
        except FileExistsError as error:
            FolderLock.beside(path).release()  # names the program that is writing it, if one is
            raise StoreError(
                f"{path}: exists already", advice="name another file or remove it"
            ) from error
        except OSError as error:
            raise StoreError(
                f"{path}: cannot be written: {error.strerror}", advice="choose another place"
            ) from error
        self._lock = FolderLock.beside(path)
        self._writer = Writer(self._file, chunk_size=1)  # a chunk per message: nothing is held back
        self._writer.start(profile=_PROFILE, library="rig")
        image = self._writer.register_schema(
            "foxglove.RawImage", "jsonschema", json.dumps(_RAW_IMAGE).encode()
        )
        index = self._writer.register_schema(
            "rig.MultiView", "jsonschema", json.dumps(_MULTIVIEW).encode()
        )
        self._images = {
            view: self._writer.register_channel(f"/{view}/image", "json", image) for view in views
        }
        self._index = self._writer.register_channel(_INDEX, "json", index)
        self._writer.add_metadata("views", {str(i): view for i, view in enumerate(views)})
        self._writer.add_metadata("camera", dict(identity))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._writer.finish()
        except OSError as failure:
            raise self._trouble(failure) from failure
        finally:
            self._file.close()
            self._lock.release()

    def write(self, multiview: MultiView) -> None:
        """Append one multi-view.

        Raises:
            StoreError: the disk is full or gone.
        """
        try:
            for frame in multiview.frames:
                self._add(self._images[frame.view], frame.timestamp_s, _image_message(frame))
            last_s = max(frame.timestamp_s for frame in multiview.frames)
            self._add(self._index, last_s, _index_message(multiview))
            self._file.flush()
        except OSError as error:
            raise self._trouble(error) from error

    def _add(self, channel: int, time_s: float, message: Mapping[str, object]) -> None:
        time_ns = max(0, round(time_s * _NS))
        data = json.dumps(message).encode()
        self._writer.add_message(channel, log_time=time_ns, publish_time=time_ns, data=data)

    def _trouble(self, error: OSError) -> StoreError:
        return StoreError(
            f"{self._path}: cannot be written: {error.strerror}", advice="is the disk full?"
        )


def recorded_views(path: Path) -> tuple[str, ...]:
    """Return the views of a recording, in order, from its first multi-view.

    Raises:
        StoreError: no such file, not a recording, or without a multi-view.
    """
    for multiview in recorded(path):
        return tuple(frame.view for frame in multiview.frames)
    raise StoreError(f"{path}: holds no whole multi-view", advice="record it again")


def recorded(path: Path) -> Iterator[MultiView]:
    """Yield every whole multi-view of a recording, as it was taken.

    A file that was cut off (power failure, kill) ends with its last whole multi-view.

    Raises:
        StoreError: no such file, not a recording, or damaged in the middle.
    """
    try:
        with path.open("rb") as file:
            yield from _read(file, path)
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be read: {error.strerror}", advice="check the path"
        ) from error


def _read(file: IO[bytes], path: Path) -> Iterator[MultiView]:
    images: dict[str, dict[str, Any]] = {}
    try:
        messages = NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)
        for _, channel, message in messages:
            content = json.loads(message.data)
            if channel.topic == _INDEX:
                yield _multiview(content, images)
                images = {}
            else:
                images[channel.topic] = content
    except EndOfFile:
        return
    except (GeneratorExit, OSError, StoreError):
        raise
    except McapError as error:
        raise StoreError(
            f"{path}: is no MCAP file, or damaged: {error}", advice="record it again"
        ) from error
    except Exception as error:  # the library lets struct.error, zstd's errors and more through
        raise StoreError(f"{path}: is damaged: {error!r}", advice="record it again") from error


def _image_message(frame: Frame) -> dict[str, object]:
    encoding, bytes_per_px = _ENCODINGS[frame.image.dtype.name]
    height, width = frame.image.shape
    seconds = math.floor(frame.timestamp_s)
    little_endian = frame.image.astype(frame.image.dtype.newbyteorder("<"), copy=False)
    return {
        "timestamp": {"sec": seconds, "nsec": int((frame.timestamp_s - seconds) * _NS)},
        "frame_id": frame.view,
        "width": width,
        "height": height,
        "encoding": encoding,
        "step": width * bytes_per_px,
        "data": base64.b64encode(little_endian.tobytes()).decode("ascii"),
    }


def _index_message(multiview: MultiView) -> dict[str, object]:
    return {
        "temperature_degc": multiview.temperature_degc,
        "frames": [
            {
                "view": frame.view,
                "timestamp_s": frame.timestamp_s,
                "sequence": frame.sequence,
                "exposure_s": frame.exposure_s,
                "bits": frame.bits,
                "uncertainty_s": frame.uncertainty_s,
            }
            for frame in multiview.frames
        ],
    }


def _multiview(index: dict[str, Any], images: Mapping[str, dict[str, Any]]) -> MultiView:
    frames = tuple(
        Frame(image=_image(images[f"/{entry['view']}/image"]), **entry) for entry in index["frames"]
    )
    return MultiView(frames, index["temperature_degc"])


def _image(message: dict[str, Any]) -> GreyImage:
    kinds = {encoding: kind for kind, (encoding, _) in _ENCODINGS.items()}
    kind = np.dtype(kinds[message["encoding"]])
    raw = np.frombuffer(base64.b64decode(message["data"], validate=True), kind.newbyteorder("<"))
    shape = (message["height"], message["width"])
    return cast("GreyImage", raw.reshape(shape).astype(kind, copy=False))
