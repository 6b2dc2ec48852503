"""One take as two files: a picture, and the line that makes it count.

take_003.png    the picture, as it came from the camera
take_003.json   where and when, and the SHA-256 of the picture
"""

import hashlib
import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import put_on_disk
from rig.frames import Frame, GreyImage
from rig.json_codec import Codec
from rig_drivers.scan.kept import Kept
from rig_drivers.scan.route import Halt

TAKES = "take_[0-9][0-9][0-9].json"
"""The lines of a folder."""


@dataclass(frozen=True, slots=True)
class _Line:
    """What `take_NNN.json` tells."""

    view: str
    role: str
    places_mm: tuple[float, ...]
    reached_mm: tuple[float, ...]
    session: int
    temperature_degc: float | None
    timestamp_s: float
    utc: str
    sequence: int
    exposure_s: float | None
    bits: int | None
    uncertainty_s: float
    sha256: str


_TAKEN_AGAIN = "take this file away: the view is taken again"
_LINE = Codec(_Line, name="take", error=StoreError, advice=_TAKEN_AGAIN)


def write_take(file: Path, take: Kept, mode: int) -> None:
    """Write a take: the picture first, then the line that makes it count.

    Args:
        file: of the picture.
        take: what was taken.
        mode: permission bits of both files.

    Raises:
        StoreError: it cannot be written.
    """
    frame = take.frame
    done, encoded = cv2.imencode(".png", frame.image)
    if not done:
        raise StoreError(
            f"{file}: the take could not be turned into a PNG",
            advice="report it with the type and shape of the frame",
        )
    content = encoded.tobytes()
    line = _Line(
        view=take.halt.view,
        role=take.halt.role,
        places_mm=take.halt.places_mm,
        reached_mm=take.reached_mm,
        session=take.session,
        temperature_degc=take.temperature_degc,
        timestamp_s=frame.timestamp_s,
        utc=datetime.now(UTC).isoformat(),
        sequence=frame.sequence,
        exposure_s=frame.exposure_s,
        bits=frame.bits,
        uncertainty_s=frame.uncertainty_s,
        sha256=hashlib.sha256(content).hexdigest(),
    )
    text = json.dumps(_LINE.to_json(line), indent=1)
    with disk_explained("keep a take", file):
        put_on_disk(file, content, mode)
        put_on_disk(file.with_suffix(".json"), text.encode(), mode)


def read_takes(folder: Path, now_s: float) -> list[Kept]:
    """Read every take that counts, with its times on the clock of this session.

    A clock that began anew says nothing of before: the wall clock tells how long ago the last take
    of a session was, and the others keep their distance from it.
    """
    found = [_read(file) for file in sorted(folder.glob(TAKES))]
    moved: list[Kept] = []
    for take, _ in found:
        last, utc = [one for one in found if one[0].session == take.session][-1]
        ago_s = (datetime.now(UTC) - utc).total_seconds()
        shift_s = now_s - ago_s - last.frame.timestamp_s
        frame = replace(take.frame, timestamp_s=take.frame.timestamp_s + shift_s)
        moved.append(replace(take, frame=frame))
    return moved


def _read(file: Path) -> tuple[Kept, datetime]:
    picture = file.with_suffix(".png")
    with disk_explained("read a take", file):
        text, content = file.read_bytes(), picture.read_bytes()
    try:
        line = _LINE.from_text(text.decode(errors="replace"))
        utc = datetime.fromisoformat(line.utc).astimezone(UTC)
    except (StoreError, ValueError) as error:
        raise StoreError(
            f"{file}: does not describe a take of a scan", advice=_TAKEN_AGAIN
        ) from error
    if hashlib.sha256(content).hexdigest() != line.sha256:
        raise StoreError(
            f"{picture}: the take is damaged or was changed after it was stored "
            f"({len(content)} bytes, wrong SHA-256)",
            advice=f"take {file.name} away: the view is taken again",
        )
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    frame = Frame(
        view=line.view,
        image=cast("GreyImage", image),
        timestamp_s=line.timestamp_s,
        sequence=line.sequence,
        exposure_s=line.exposure_s,
        bits=line.bits,
        uncertainty_s=line.uncertainty_s,
    )
    halt = Halt(line.view, line.role, line.places_mm)
    take = Kept(halt, line.reached_mm, frame, line.session, line.temperature_degc)
    return take, utc
