"""What `rig sweep` and `rig fit` print at their end."""

from typing import TYPE_CHECKING

import typer

from rig.cli.output import show, show_json, tell

if TYPE_CHECKING:
    from rig.sweep.conclude import SweepResult


def show_result(result: "SweepResult", *, as_json: bool) -> None:
    """Print a sweep's result; end with exit code 3 where it misses a gate."""
    if as_json:
        show_json(result.as_dict())
    else:
        for line in result.lines():
            show(line)
    for failed in result.failed_gates:
        tell(f"rig: quality gate missed: {failed}")
    if result.failed_gates:
        raise typer.Exit(3)
