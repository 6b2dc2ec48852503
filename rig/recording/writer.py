"""The writer of recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Self

from rig.errors import StoreError
from rig.frames import MultiView
from rig.recording.foxglove_messages import DEPTH, FoxgloveMessage, messages_of, schema_of
from rig.recording.index_message import NAME, TOPIC, index_message, index_schema
from rig.recording.mcap_writer import McapWriter, Payload
from rig.recording.scene import DepthImages, Scene

_PROFILE: Final = "epirig"


class RecordingWriter:
    """Writes multi-views into a new file; a context manager.

    Args:
        path: must not exist.
        views: names of the views, in the order of every multi-view.
        identity: what the camera says of itself; kept in the file.

    Raises:
        StoreError: the file exists or cannot be written, or a view has a name that is taken.
    """

    def __init__(self, path: Path, views: Sequence[str], identity: Mapping[str, str]) -> None:
        if DEPTH in views:
            raise StoreError(
                f"{path}: a view is called {DEPTH}, which is the name of the depth map in a "
                "recording",
                advice="give this view another name in the profile",
            )
        self._bare = Scene({view: view for view in views}, views[0], (), {}, None)
        self._file = McapWriter(path, _PROFILE)
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._file.add_metadata("views", {str(i): view for i, view in enumerate(views)})
        self._file.add_metadata("camera", identity)
        schema = self._file.add_schema(NAME, "jsonschema", index_schema())
        self._index = self._file.add_channel(TOPIC, "json", schema)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(
        self,
        multiview: MultiView,
        time_ns: int,
        depth: DepthImages | None = None,
        scene: Scene | None = None,
    ) -> None:
        """Append one multi-view.

        Args:
            multiview: as it was taken.
            time_ns: mid-exposure by the wall clock, UTC, since 1970-01-01.
            depth: of it, for other programs; it is not played back.
            scene: cameras and their places, for other programs; None where they are unknown.

        Raises:
            StoreError: the disk is full or gone; earlier multi-views are kept.
        """
        chunk: list[tuple[int, Payload]] = [
            (self._channel(message), message.payload)
            for message in messages_of(multiview, time_ns, depth, scene or self._bare)
        ]
        chunk.append((self._index, (index_message(multiview, time_ns),)))
        self._file.write(chunk, time_ns)

    def close(self) -> None:
        """Write the index and close the file; safe to call again.

        Raises:
            StoreError: the index cannot be written; the multi-views are kept.
        """
        self._file.close()

    def _channel(self, message: FoxgloveMessage) -> int:
        """Return the channel of a topic, which is written when it is first used."""
        topic, name = message.topic, message.schema_name
        if topic not in self._channels:
            if name not in self._schemas:
                described = schema_of(message.schema)
                self._schemas[name] = self._file.add_schema(name, "protobuf", described)
            self._channels[topic] = self._file.add_channel(topic, "protobuf", self._schemas[name])
        return self._channels[topic]
