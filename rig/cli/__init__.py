"""The command line: each verb parses, calls and prints; nothing is decided here."""

import os
import sys

from rig.cli.output import tell
from rig.errors import OptionError, RigError

INTERRUPTED = 130


def main() -> None:
    """Run the program; our own errors become one line and exit code 1, or 2 for an option's."""
    try:
        code = _run()
    except KeyboardInterrupt:
        tell("rig: interrupted")
        code = INTERRUPTED
    raise SystemExit(_flushed(code))


def _run() -> int:
    from rig.cli.verbs import app  # inside: Ctrl-C may come while this is read

    try:
        app(prog_name="rig")
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    except RigError as error:
        tell(f"rig: {' '.join(str(error).split())}")
        return 2 if isinstance(error, OptionError) else 1
    return 0


def _flushed(code: int) -> int:
    """Hand the last words to whoever reads stdout; a reader that left early is told nothing."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more
        if not isinstance(error, BrokenPipeError):
            tell(f"rig: cannot write to stdout: {error.strerror}; choose another place for it")
        return code or 1
    return code
