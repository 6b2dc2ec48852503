"""Options of the form NAME=NAME."""

from collections.abc import Sequence

import typer


def pairs(option: str, given: Sequence[str] | None) -> dict[str, str]:
    """Return the pairs of a repeated option, or end with a usage error."""
    found: dict[str, str] = {}
    for text in given or ():
        left, equals, right = text.partition("=")
        if not (left and equals and right) or left in found:
            raise typer.BadParameter(f"{option} {text}: give NAME=NAME, each name once")
        found[left] = right
    return found
