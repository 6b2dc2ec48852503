"""Lines as Marlin takes them from the wire: numbers and checksums."""

import re
from dataclasses import dataclass

_NUMBER = re.compile(r"\d+", re.ASCII)


@dataclass(frozen=True, slots=True)
class Damaged:
    """A line that is asked for again; `error` is what Marlin prints."""

    error: str


@dataclass(frozen=True, slots=True)
class Taken:
    """A line for the queue."""

    text: str
    number: int | None


def check_line(line: str, last_number: int) -> Taken | Damaged:
    """Return what becomes of a line.

    Args:
        line: without its end, not empty.
        last_number: of the last numbered line that was taken.
    """
    line = line.lstrip(" ")
    body, star, check = line.rpartition("*")
    if not line.startswith("N"):
        return Damaged("No Line Number with checksum") if star else Taken(line.strip(), None)
    text = body if star else line
    number, rest = _split_number(text[1:])
    is_setting = "M110" in text
    if is_setting:
        _, _, wanted = rest.partition("N")
        number, _ = _split_number(wanted) if wanted else (number, "")
    if number != last_number + 1 and not is_setting:
        return Damaged("Line Number is not Last Line Number+1")
    if not star:
        return Damaged("No Checksum with line number")
    sum_of_bytes = 0
    for character in body:
        sum_of_bytes ^= ord(character) & 0xFF
    found = _NUMBER.match(check)
    if found is None or int(found[0]) != sum_of_bytes:
        return Damaged("checksum mismatch")
    return Taken(rest.strip() or "M110", number)


def _split_number(text: str) -> tuple[int, str]:
    """Read a number as C does: what is none counts as 0."""
    stripped = text.lstrip(" ")
    found = _NUMBER.match(stripped)
    if found is None:
        return 0, stripped
    return int(found[0]), stripped[found.end() :]
