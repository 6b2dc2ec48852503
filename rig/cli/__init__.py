"""The command line: each verb parses, calls and prints; nothing is decided here."""

import os
import sys


def main() -> None:
    """Run the program; our own errors become one line and exit code 1, or 2 for an option's."""
    from rig.cli.way_out import INTERRUPTED, WayOut, interrupted_line
    from rig.terminal_text import harmless

    with WayOut() as way_out:
        try:
            if sys.stdout is None:  # closed by who called: nobody wants the words
                sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
            code = _flushed(_run())
        except KeyboardInterrupt as error:
            sys.stderr.write(f"{harmless(interrupted_line(error))}\n")
            code = INTERRUPTED
        way_out.code = code
    raise SystemExit(code)


def _run() -> int:
    from rig.cli.output import tell  # inside: signals are minded while these are read
    from rig.cli.verbs import app
    from rig.cli.way_out import INTERRUPTED, interrupted_line
    from rig.errors import OptionError, RigError
    from rig.interrupts import received
    from rig.secrets import without_secrets

    try:
        app(prog_name="rig")
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 0
        return INTERRUPTED if received and code == 1 else code
    except RigError as error:
        text = " ".join(without_secrets(str(error)).split())
        if received:  # what went wrong on the way out
            tell(f"{interrupted_line(error)}; {text}")
            return INTERRUPTED
        tell(f"rig: {text}")
        return 2 if isinstance(error, OptionError) else 1
    except OSError as error:
        if error.filename is not None:  # of a file, which the verb should have explained
            raise
        return _lost(error)
    except Exception as error:
        if not received:
            raise
        # Made of the interrupt by a library, or on the way out.
        tell(interrupted_line(error))
        return INTERRUPTED
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
