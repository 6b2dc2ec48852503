"""What verbs do where nothing is said: every switch is off, numbers are those of the manual."""

from collections.abc import Iterator
from typing import Any

import click
import pytest
import typer.main

from rig.cli.verbs import app


def verbs(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Every verb that does something, by its words."""
    names = getattr(command, "list_commands", None)
    if names is None:
        yield name, command
        return
    for word in names(click.Context(command)):
        yield from verbs(
            command.get_command(click.Context(command), word), f"{name} {word}".strip()
        )


EVERY = dict(verbs(typer.main.get_command(app)))


def test_no_switch_of_any_verb_is_on_by_itself():
    switches = {
        f"{name} --{option.name}": option.default
        for name, command in EVERY.items()
        for option in command.params
        if getattr(option, "is_flag", False)
    }
    assert len(switches) > 20
    assert {name for name, value in switches.items() if value is not False} == set()


def test_numbers_that_are_not_given_are_those_of_the_manual():
    numbers = {
        f"{name} {option.name}": option.default
        for name, command in EVERY.items()
        for option in command.params
        if isinstance(option.default, int | float) and not isinstance(option.default, bool)
    }
    wanted = {
        "calibrate pictures": 60,
        "compare frames": 1,
        "devices timeout_s": 1.6,
        "target border_mm": 5.0,
        "target dots_per_in": 300.0,
        "target square_mm": 25.0,
    }
    assert {name: numbers[name] for name in wanted} == wanted


@pytest.mark.parametrize("word", ["profile", "sim"])
def test_a_group_of_verbs_shows_its_help_where_no_verb_is_named(word: str):
    top: Any = typer.main.get_command(app)
    assert top.get_command(click.Context(top), word).no_args_is_help is True
