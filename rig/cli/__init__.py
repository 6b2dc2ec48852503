"""The command line: each verb parses, calls and prints; nothing is decided here."""

import os
import sys

INTERRUPTED = 130


def main() -> None:
    """Run the program; our own errors become one line and exit code 1, or 2 for an option's."""
    try:
        if sys.stdout is None:  # closed by who called: nobody wants the words
            sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
        code = _flushed(_run())
    except KeyboardInterrupt:
        sys.stderr.write("rig: interrupted\n")
        code = INTERRUPTED
    raise SystemExit(code)


def _run() -> int:
    from rig.cli.output import tell  # inside: Ctrl-C may come while these are read
    from rig.cli.verbs import app
    from rig.errors import OptionError, RigError

    try:
        app(prog_name="rig")
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    except RigError as error:
        tell(f"rig: {' '.join(str(error).split())}")
        return 2 if isinstance(error, OptionError) else 1
    except OSError as error:
        if error.filename is not None:  # of a file, which the verb should have explained
            raise
        return _lost(error)
    return 0


def _flushed(code: int) -> int:
    """Hand the last words to whoever reads stdout; a reader that left early is told nothing."""
    try:
        sys.stdout.flush()
    except OSError as error:
        return code or _lost(error)
    return code


def _lost(error: OSError) -> int:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more
    if not isinstance(error, BrokenPipeError):
        sys.stderr.write(f"rig: cannot write to stdout: {error.strerror}; send it elsewhere\n")
    return 1
