"""Every verb: where it is, what it is for, and how the help shows them."""

import importlib
import os
import re
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, NamedTuple

import typer
from typer.completion import get_completion_inspect_parameters
from typer.core import TyperGroup

from rig import __version__
from rig.cli.output import tell
from rig.cli.way_out import INTERRUPTED, interrupted_line

_SUMMARY = "Turn a multi-view camera into a calibrated depth camera."
_LOOK: dict[str, Any] = {
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,  # plain help wraps paragraphs, and starts twice as fast
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


class Verb(NamedTuple):
    """A verb that is imported when it is used."""

    place: str
    """`module:function` below `rig.cli`; of a group of verbs the function is its `app`."""
    summary: str
    """At most 64 characters: it stands beside its name on one line of a terminal."""


VERBS: dict[str, dict[str, Verb]] = {
    "Set up": {
        "setup": Verb("setup:setup", "Lead through a first run, from what is plugged in to depth."),
        "devices": Verb(
            "devices:devices", "List what is plugged in, with the names a profile needs."
        ),
        "profile": Verb("profile:app", "List, show, check and write profiles of rigs."),
        "target": Verb("target:target", "Draw a target to scale, to be printed at 100 %."),
        "check": Verb("check:check", "Look at everything that a sweep needs, before it begins."),
        "sim": Verb("sim:app", "Offer simulated devices to other programs."),
        "completion": Verb("completion:completion", "Print what lets the shell complete words."),
    },
    "Calibrate": {
        "calibrate": Verb("calibrate:calibrate", "Find lenses and places of all cameras of a rig."),
        "sweep": Verb("sweep:sweep", "Move the board, and measure slope against distance."),
        "fit": Verb("fit:fit", "Compute a sweep's slopes and curve again from its frames."),
        "import": Verb("import_calibration:import_calibration", "Take another tool's calibration."),
    },
    "Measure": {
        "capture": Verb("capture:capture", "Measure depth live with the curve of this rig."),
        "compare": Verb("compare:compare", "Set our depth beside that of stereo matchers."),
    },
    "Look back": {
        "history": Verb("history:history", "List the sweeps and calibrations in the database."),
        "report": Verb("report:report", "Write the report of a sweep again."),
        "store": Verb("store:app", "Check, copy, thin out and move all that is stored."),
        "export": Verb("export:export", "Write calibrations, samples or depth in other formats."),
    },
}
"""By what one wants to do."""

_WORDS = (
    (r"^Value error, ", ""),
    (r"^Input should be a valid integer.*", "needs a whole number"),
    (r"^Input should be a valid number.*", "needs a number"),
    (r"^Input should be (greater|less) than or equal to ", r"must be \1 than or equal to "),
    (r"^must be greater than or equal to ", "must be at least "),
    (r"^must be less than or equal to ", "must be at most "),
    (r"^Input should be ", "must be "),
)

_BEGIN = (
    ("rig sweep sim", "a whole sweep, without hardware"),
    ("rig capture sim", "depth with the curve of that sweep; Ctrl-C ends it"),
    ("rig devices", "what is plugged in here, for a profile of your own"),
)


class Summaries(TyperGroup):
    """A group whose help cuts no summary short."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the verbs, each with the first sentence of its help."""
        verbs = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [(name, _first_sentence(verb)) for name, verb in verbs if verb is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


class _Imports(Mapping[str, Any]):
    """All verbs by name; only one that is asked for is imported."""

    def __init__(self) -> None:
        self._verbs = {name: verb for verbs in VERBS.values() for name, verb in verbs.items()}

    def __getitem__(self, name: str) -> Any:
        return _imported(name, self._verbs[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._verbs)

    def __len__(self) -> int:
        return len(self._verbs)


class _Verbs(TyperGroup):
    """The program."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: Any = _Imports()

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the verbs by what one wants to do, and the first commands of a newcomer."""
        del ctx
        widest = max(len(name) for verbs in VERBS.values() for name in verbs)
        for title, verbs in VERBS.items():
            with formatter.section(title):
                formatter.write_dl(
                    [(name.ljust(widest), verb.summary) for name, verb in verbs.items()]
                )
        with formatter.section("Begin with"):
            formatter.write_dl(_BEGIN)

    def make_context(self, *args: Any, **settings: Any) -> Any:
        """Read the words of the command line."""
        with _one_line():
            return super().make_context(*args, **settings)

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        with _one_line():
            return super().invoke(ctx)


@contextmanager
def _one_line() -> Generator[None]:
    """Say what ended a verb: Ctrl-C, or a value that its option cannot have."""
    try:
        yield
    except typer.BadParameter as error:
        error.message = _in_our_words(error.message)
        raise
    except KeyboardInterrupt as error:
        tell(interrupted_line(error))
        raise typer.Exit(INTERRUPTED) from None


def _in_our_words(message: str) -> str:
    """Say it without the words of the library that reads the values of options."""
    for theirs, ours in _WORDS:
        message = re.sub(theirs, ours, message)
    return message


def _imported(name: str, verb: Verb) -> Any:
    module, _, function = verb.place.partition(":")
    found = getattr(importlib.import_module(f"rig.cli.{module}"), function)
    alone = typer.Typer(**_LOOK)
    if isinstance(found, typer.Typer):
        alone.add_typer(found, name=name, cls=Summaries)
        around: Any = typer.main.get_command(alone)
        return around.commands[name]
    alone.command(name)(found)
    return typer.main.get_command(alone)


def _first_sentence(verb: Any) -> str:
    paragraph = " ".join((verb.help or "").partition("\n\n")[0].split())
    return paragraph.partition(": ")[0].partition("; ")[0].rstrip(".") + "."


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rig {__version__}")
        raise typer.Exit


app = typer.Typer(name="rig", help=_SUMMARY, no_args_is_help=True, cls=_Verbs, **_LOOK)


@app.callback(help=_SUMMARY)
def _options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


if "_RIG_COMPLETE" in os.environ:  # a shell asks for words
    get_completion_inspect_parameters()
