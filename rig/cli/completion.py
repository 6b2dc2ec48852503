"""`rig completion`: a shell that knows verbs, names and numbers."""

from enum import StrEnum
from typing import Annotated

import typer


class Shell(StrEnum):
    """Shells that can be told."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(
    shell: Annotated[Shell, typer.Argument(help="Shell that the script is for.")],
) -> None:
    """Print the script by which a shell completes verbs, options, profiles, formats and numbers.

    bash, in ~/.bashrc: eval "$(rig completion bash)"

    zsh, in ~/.zshrc after compinit: eval "$(rig completion zsh)"

    fish: rig completion fish > ~/.config/fish/completions/rig.fish
    """
    from typer.completion import get_completion_inspect_parameters, shell_complete

    from rig.cli.verbs import app

    get_completion_inspect_parameters()  # makes the shells known
    verbs = typer.main.get_command(app)
    shell_complete(verbs, {}, "rig", "_RIG_COMPLETE", f"source_{shell.value}")
