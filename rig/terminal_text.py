"""Texts as a terminal may be given them: what a stored text holds must not steer it."""

import re

_STEERS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # escapes of ECMA-48, in 7 and in 8 bits
    "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"  # the direction and the end of lines
    "\ud800-\udfff]"  # no letters at all: a stream refuses them
)


def harmless(text: str) -> str:
    r"""Return a text in which every letter that steers a terminal is spelled, as in `\x1b[2J`.

    Ends of lines and tabs stay.
    """
    return _STEERS.sub(lambda found: ascii(found[0])[1:-1], text)


def harmless_json(text: str) -> str:
    """Return JSON of the same content in which those letters are spelled as JSON spells them."""
    return _STEERS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def one_line(text: str) -> str:
    """Return a harmless text without ends of lines, as for a cell of a table."""
    return harmless(" ".join(text.split()) if "\n" in text or "\t" in text else text)
