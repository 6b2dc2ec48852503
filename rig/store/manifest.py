"""`backup.json`: what a backup holds; written last, so that one without it is unfinished."""

import json
from dataclasses import dataclass
from pathlib import Path

from rig.errors import StoreError
from rig.files import put_on_disk, read_bytes
from rig.json_codec import Codec

FILE = "backup.json"
DATABASE = "rig.sqlite"
FRAMES = "frames"
_MOST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a backup is of, and what it holds."""

    version: int
    source: str
    """Address of the database that it is of, without secrets."""
    made_at: str
    """UTC."""
    sha256: tuple[str, ...]
    """Of the file of the database; while it is being replaced, also of the one before."""
    sweeps: int
    samples: int
    files: int
    bad: tuple[str, ...]
    """What was missing or damaged when it was made."""
    is_whole: bool = True
    """False until the first one in this folder has ended."""


_JSON = Codec(Manifest, name="backup", error=StoreError, advice="choose the folder of a backup")


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest of a backup; None where there is none.

    Raises:
        StoreError: it is none, or cannot be read.
    """
    file = folder / FILE
    if not file.is_file():
        return None
    content = read_bytes(file, _MOST_BYTES)
    if len(content) > _MOST_BYTES:
        raise StoreError(
            f"{file}: is larger than {_MOST_BYTES} bytes, no manifest is",
            advice="choose the folder of a backup",
        )
    return _JSON.from_text(content.decode(errors="replace"))


def write_manifest(folder: Path, manifest: Manifest, mode: int) -> None:
    """Write the manifest of a backup: there completely or not at all.

    Raises:
        OSError: it cannot be written.
    """
    text = json.dumps(_JSON.to_json(manifest), indent=2, ensure_ascii=False)
    put_on_disk(folder / FILE, f"{text}\n".encode(), mode)
