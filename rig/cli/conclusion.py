"""What `rig sweep` and `rig fit` print at their end."""

from typing import TYPE_CHECKING

import typer

from rig.cli.next_verb import tell_next
from rig.cli.output import show, show_json, tell
from rig.cli.sweep_result import result_as_dict, result_lines

if TYPE_CHECKING:
    from rig.sweep.conclude import SweepResult


def show_result(result: "SweepResult", *, as_json: bool, profile_name: str | None = None) -> None:
    """Print a sweep's result; end with exit code 3 where it misses a gate.

    Args:
        result: what the sweep came to.
        as_json: whether a program reads it.
        profile_name: what the user calls the profile; by default the rig's name.
    """
    known = {"profile": profile_name or result.rig, "sweep": result.sweep_id}
    if as_json:
        show_json(result_as_dict(result))
    else:
        for line in result_lines(result):
            show(line)
    for failed in result.failed_gates:
        tell(f"rig: quality gate missed: {failed}")
    if result.failed_gates:
        tell_next("sweep, gate", as_json=as_json, **known)
        raise typer.Exit(3)
    tell_next("sweep", as_json=as_json, **known)
