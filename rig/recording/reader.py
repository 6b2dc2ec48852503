"""From recordings, of now and of old, back to multi-views."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from rig.errors import StoreError
from rig.frames import ColourImage, Frame, MultiView
from rig.recording.foxglove_messages import COLOUR
from rig.recording.images import colour_of, image_of, in_short
from rig.recording.index_message import TOPIC, MultiViewFacts
from rig.recording.mcap_reader import McapReader, StoredMessage

_MOST_UNPACKED: Final = 64 << 20
"""So much more than the file has may the pictures of one multi-view have that it packs."""


@dataclass(frozen=True, eq=False, slots=True)
class Recorded:
    """One multi-view of a recording."""

    views: MultiView
    """As it was taken."""
    time_ns: int | None
    """Mid-exposure by the wall clock of the computer that recorded, UTC, ns since 1970-01-01; None
    in recordings of old, which hold none."""


def recorded_views(path: Path) -> tuple[str, ...]:
    """Return the views of a recording, in order, from its first multi-view.

    Raises:
        StoreError: no such file, not a recording, or without a multi-view.
    """
    found = next(recorded(path))
    return tuple(frame.view for frame in found.views.frames)


def recorded(path: Path) -> Iterator[Recorded]:
    """Yield every whole multi-view of a recording, as it was taken.

    A file that was cut off (power failure, kill) ends with its last whole multi-view.

    Raises:
        StoreError: no such file, not a recording, damaged in the middle, or without one whole
            multi-view.
    """
    try:
        with path.open("rb") as file:
            yield from _multiviews(McapReader(file, path), path)
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be read: {error.strerror}", advice="check the path"
        ) from error


def _multiviews(reader: McapReader, path: Path) -> Iterator[Recorded]:
    images: dict[str, StoredMessage] = {}
    first: tuple[str, ...] | None = None
    most = _MOST_UNPACKED + path.stat().st_size
    for message in reader.messages():
        if message.topic.endswith(("/image", f"/{COLOUR}")):
            images[message.topic] = message
            held = sum(len(image.data) for image in images.values())
            if held > most:
                raise StoreError(
                    f"{path}: is damaged: pictures of one multi-view of {held} bytes, most are "
                    f"{most}",
                    advice="record it again",
                )
        if message.topic != TOPIC:
            continue
        try:
            found = _multiview(bytes(message.data), images, first)
        except ValueError as error:
            raise StoreError(
                f"{path}: is damaged: {_told(error)}", advice="record it again"
            ) from error
        first = tuple(frame.view for frame in found.views.frames)
        images = {}
        yield found
    if first is None:
        raise StoreError(f"{path}: holds no whole multi-view", advice="record it again")


def _multiview(
    content: bytes, images: dict[str, StoredMessage], first: tuple[str, ...] | None
) -> Recorded:
    facts = MultiViewFacts.model_validate_json(content)
    if not facts.is_one_instant:
        raise ValueError(f"frames of one multi-view {facts.span_s:g} s apart, or a view twice")
    if first not in (None, facts.views):
        raise ValueError(f"views {', '.join(facts.views)} after {', '.join(first or ())}")
    missing = [view for view in facts.views if f"/{view}/image" not in images]
    if missing:
        raise ValueError(f"no picture of {', '.join(missing)}")
    frames = tuple(
        Frame(
            image=image_of(images[f"/{frame.view}/image"]),
            colour=_colour(images.get(f"/{frame.view}/{COLOUR}")),
            **frame.model_dump(),
        )
        for frame in facts.frames
    )
    for frame in frames:
        if frame.colour is not None and frame.colour.shape[:2] != frame.image.shape:
            raise ValueError(f"colour of another size than the picture of {frame.view}")
        if frame.bits is not None and frame.bits > 8 * frame.image.dtype.itemsize:
            raise ValueError(f"{frame.bits} bits in a picture of {frame.image.dtype}")
    return Recorded(MultiView(frames, facts.temperature_degc), facts.time_ns)


def _colour(message: StoredMessage | None) -> ColourImage | None:
    return None if message is None else colour_of(message)


def _told(error: ValueError) -> str:
    return in_short(error) if isinstance(error, ValidationError) else str(error)
