"""The verdict of a calibration on its way through other people's files.

A weak one says so in a comment of each file that can hold one. What such a comment says comes back
with the file: a calibration does not become good by being copied.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from rig.errors import StoreError
from rig.files import read_bytes, write_bytes

_LONGEST = 2_000
"""Of a verdict that comes from a file."""
_MOST_BYTES = 4_000_000
_MARK = "# rig: "
_COMMENT = re.compile(rb"^# rig: (weak[^\r\n]*)", re.MULTILINE)
_HEAD = re.compile(r"(?:%YAML[^\n]*\n(?:---[^\n]*\n)?)?")
_UNKNOWN = "weak because of reasons that were not kept"


def weakness(quality: Mapping[str, object]) -> str | None:
    """Return why a stored calibration is weak; None for a good one.

    Args:
        quality: what is stored of its worth.
    """
    if quality.get("good", True) is not False:
        return None
    said = quality.get("verdict")
    return said if isinstance(said, str) and said else _UNKNOWN


def quality_of_import(source: str, path: Path, weak: str | None) -> dict[str, object]:
    """Return what is stored of the worth of an imported calibration."""
    known = {} if weak is None else {"good": False, "verdict": weak}
    return {"imported": source, "from": str(path), **known}


def write_weakness(files: Iterable[Path], weak: str) -> None:
    """Put a comment at the head of files that were written.

    Args:
        files: text that takes lines beginning with #.
        weak: the verdict.

    Raises:
        StoreError: a file cannot be read or written.
    """
    line = _MARK + " ".join(weak.split()) + "\n"
    for file in files:
        text = read_bytes(file).decode()
        head = _HEAD.match(text)
        at = head.end() if head else 0  # a directive of YAML comes first, whatever follows
        write_bytes(file, (text[:at] + line + text[at:]).encode())


def read_weakness(path: Path, names: Iterable[str]) -> str | None:
    """Return the verdict that a file, or a file of a folder, carries; None where none does.

    Args:
        path: what was read.
        names: of the files in a folder that carry it, `{view}` for any view; none for a format
            without comments.
    """
    patterns = [name.replace("{view}", "*") for name in names]
    files = [file for pattern in patterns for file in sorted(path.glob(pattern))]
    for file in [path] if patterns and path.is_file() else files:
        try:
            found = _COMMENT.search(read_bytes(file, most=_MOST_BYTES))
        except StoreError:  # a folder called like a file
            continue
        if found is not None:
            return found[1].decode(errors="replace").strip()[:_LONGEST]
    return None
