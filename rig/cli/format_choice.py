"""The option that names one format of a table."""

from typing import Any

import typer

_LONGEST = 60
"""Of a list of names in the margin of a help of 80 columns."""


def choice_of(option: str, names: tuple[str, ...], text: str) -> Any:
    """Return an option that takes one of some names; another one is a usage error."""

    def known(given: str) -> str:
        if given not in names:
            raise typer.BadParameter(f"{given}: choose one of {', '.join(names)}")
        return given

    def matching(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    metavar = f"[{'|'.join(names)}]"
    if len(metavar) > _LONGEST:
        metavar, text = "FORMAT", f"{text} One of {', '.join(names)}."
    return typer.Option(
        option,
        metavar=metavar,
        help=text,
        parser=known,
        autocompletion=matching,
        show_default=False,
    )
