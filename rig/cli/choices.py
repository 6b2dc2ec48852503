"""Options whose words are listed elsewhere, and asked for only when they are needed."""

from collections.abc import Callable

import typer


def one_of(words: Callable[[], tuple[str, ...]]) -> Callable[[str], str]:
    """Return a parser that takes one of some words; anything else is a usage error that lists them.

    Args:
        words: gives the list; imports what it takes only when it is called.
    """

    def parse(text: str) -> str:
        known = words()
        if text not in known:
            raise typer.BadParameter(f"{text!r} is not one of {', '.join(known)}")
        return text

    return parse
