"""`rig setup`: a guided first run, by the verbs that everybody uses."""

import sys
import termios
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, cast

import typer

from rig.cli.options import AsJson, DatabaseUrl, Overrides
from rig.cli.output import show, show_json, tell, tell_raw
from rig.cli.setup_steps import Step, Wish, steps_of
from rig.cli.way_out import INTERRUPTED
from rig.cli.words import profile_names

_LEAVE, _SKIP = ("q", "quit"), ("s", "skip")


def setup(
    profile_name: Annotated[
        str,
        typer.Argument(
            metavar="PROFILE",
            help="The rig: a profile that is there, or the name of one to be written.",
            autocompletion=profile_names,
        ),
    ],
    *,
    overrides: Overrides = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Lead through a first run: devices, profile, printed target, check, calibrate, sweep.

    Every step is one of the other verbs, shown before it runs: Enter runs it, s skips it, q leaves.
    Files and database tell what is done, so the same command goes on later. Without a terminal, or
    with --json, nothing runs: it says which step comes next.
    """
    wish = Wish(profile_name, tuple(overrides or ()), database)
    if as_json or not sys.stdin.isatty():
        _say(wish, as_json=as_json)
        return
    behind: dict[str, str] = {}
    while (step := _next(_shown(wish, behind), behind)) is not None:
        try:
            answer = _asked(
                f"\n{step.name}: {step.why}\n  {step.command}\n[Enter] run, s skip, q leave: "
            )
            if answer is None or answer in _LEAVE:
                _tell_how_to_go_on(profile_name, step)
                return
            _answered(step, answer, behind)
        except KeyboardInterrupt as error:  # at a question: a verb ends by itself
            tell("")
            _tell_how_to_go_on(profile_name, step)
            raise typer.Exit(INTERRUPTED) from error
    skipped = next((s for s in steps_of(wish, Path()) if _is_missing(s, behind)), None)
    if skipped is None:
        tell(f"next: rig capture {profile_name}")
    else:
        _tell_how_to_go_on(profile_name, skipped)


def _answered(step: Step, answer: str, behind: dict[str, str]) -> None:
    """Do what was answered, and note what is behind us."""
    if answer in _SKIP:
        behind[step.name] = "skip"
    elif answer:
        tell(f"{answer!r} is no answer: press Enter alone to run it, s to skip it, q to leave")
    elif _is_done(step):
        behind[step.name] = "done"


def _tell_how_to_go_on(profile_name: str, step: Step) -> None:
    tell(f"next: rig setup {profile_name} goes on with {step.command}")


def _is_missing(step: Step, behind: Mapping[str, str]) -> bool:
    return step.found is None and behind.get(step.name) == "skip"


def _say(wish: Wish, *, as_json: bool) -> None:
    steps = steps_of(wish, Path())
    step = _next(steps, {})
    command = f"rig capture {wish.profile_name}" if step is None else step.command
    if as_json:
        show_json(
            {
                "profile": wish.profile_name,
                "steps": [
                    {
                        "step": s.name,
                        "done": s.found is not None,
                        "found": s.found,
                        "run": s.command,
                    }
                    for s in steps
                ],
                "next": command,
            }
        )
        return
    _show(steps, {})
    tell(f"next: {command}")


def _shown(wish: Wish, behind: Mapping[str, str]) -> tuple[Step, ...]:
    steps = steps_of(wish, Path())
    show()
    _show(steps, behind)
    return steps


def _show(steps: Sequence[Step], behind: Mapping[str, str]) -> None:
    for step in steps:
        state = behind.get(step.name, "") if step.found is None else "done"
        show(f"{state:<4}  {step.name:<10} {step.found or step.why}")


def _next(steps: Sequence[Step], behind: Mapping[str, str]) -> Step | None:
    return next((s for s in steps if s.found is None and s.name not in behind), None)


def _is_done(step: Step) -> bool:
    """Run the verb, and whatever a person does then; says whether it ended well."""
    from rig.cli.verbs import app
    from rig.errors import RigError

    try:
        code = cast("int | None", app(list(step.words), prog_name="rig", standalone_mode=False))
    except RigError as error:
        tell(f"rig: {' '.join(str(error).split())}")
        return False
    if code == INTERRUPTED:
        raise typer.Exit(INTERRUPTED)
    if code:
        return False
    if step.afterwards is not None:
        _asked(f"\n{step.afterwards}\n[Enter] when that is done: ")
    return step.name != "profile"  # whether it holds no guesses any more its file tells


def _asked(question: str) -> str | None:
    """Ask a person; None where nobody can answer any more.

    What was typed before the question is no answer to it: the next step may move a carriage.
    """
    termios.tcflush(sys.stdin, termios.TCIFLUSH)
    tell_raw(question)
    line = sys.stdin.readline()
    return line.strip().lower() if line else None
