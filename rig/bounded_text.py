"""Text from outside, bounded before it is parsed: a small file can ask for gigabytes."""

import re
import tomllib
from pathlib import Path
from typing import Any

from rig.errors import FormatError
from rig.files import read_bytes

MOST_BYTES = 4_000_000
"""Of a file that people or other programs write; the largest real ones have a tenth of it."""
_MOST_VALUES = 20_000
"""Of a TOML text; a profile of forty views has some hundreds. Reading them takes half a second."""
_LONG_KEY = re.compile(r"(?<![\w'\"-])(?:[\w'\"-]++[ \t]*+\.[ \t]*+){20}")
"""Every part of a dotted key is a table in a table."""


def read_text(path: Path, most: int = MOST_BYTES) -> str:
    """Return the text of a file.

    Args:
        path: of the file.
        most: bytes that any such file has.

    Raises:
        StoreError: it cannot be read.
        FormatError: it is no text, or larger than any such file is.
    """
    content = read_bytes(path, most=most)
    if len(content) > most:
        raise FormatError(
            f"{path}: larger than {most / 1e6:g} MB, which no such file is",
            advice="give a file of the named format",
        )
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: is no text file", advice="give a file of the named format"
        ) from error


def parse_toml(text: str) -> dict[str, Any]:
    """Return what a TOML text says.

    Raises:
        ValueError: it is no TOML, or nested deeper than any file of people is.
    """
    if _LONG_KEY.search(text):
        raise ValueError("a key of more than 20 parts")
    if sum(map(text.count, "=[,")) > _MOST_VALUES:
        raise ValueError(f"more than {_MOST_VALUES} keys and values")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("lists or tables nested too deep") from error
