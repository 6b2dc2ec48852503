"""The option that names one format of a table."""

from typing import Any

import typer


def choice_of(option: str, names: tuple[str, ...], text: str) -> Any:
    """Return an option that takes one of some names; another one is a usage error."""

    def known(given: str) -> str:
        if given not in names:
            raise typer.BadParameter(f"{given}: choose one of {', '.join(names)}")
        return given

    def matching(incomplete: str) -> list[str]:
        return [name for name in names if name.startswith(incomplete)]

    return typer.Option(
        option,
        metavar=f"[{'|'.join(names)}]",
        help=text,
        parser=known,
        autocompletion=matching,
        show_default=False,
    )
