"""The words on the wire of a Zaber chain, from the devices' side."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Command:
    """One line for one device, or for all."""

    address: int
    axis: int
    number: str
    """Message id as it goes into the answer, with a blank after it; empty for none."""
    words: tuple[str, ...]


def sum_of(text: str) -> int:
    """Return the longitudinal redundancy check of a message without its first character."""
    return (256 - sum(map(ord, text)) % 256) % 256


def read_command(line: str) -> Command | None:
    """Return the command in a line; None for what a device passes over in silence."""
    _, slash, text = line.partition("/")
    if not slash:
        return None
    body, colon, check = text.rpartition(":")
    if colon:
        if len(check) != 2 or check.upper() != f"{sum_of(body):02X}":
            return None
        text = body
    words = text.split()
    heads: list[int] = []
    while words and words[0].isdigit() and len(heads) < 3:
        heads.append(int(words.pop(0)))
    number = ""
    if len(heads) == 3:
        number = f"{heads[2]:02d} "
    elif words and words[0] == "--":
        words.pop(0)
    address, axis = (*heads[:2], 0, 0)[:2]
    return Command(address, axis, number, tuple(words))


def message(kind: str, address: int, axis: int, text: str, *, with_checksum: bool) -> bytes:
    """Return one line from a device."""
    body = f"{address:02d} {axis} {text}"
    end = f":{sum_of(body):02X}" if with_checksum else ""
    return f"{kind}{body}{end}\r\n".encode()
