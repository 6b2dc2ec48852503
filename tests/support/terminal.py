"""A program at a pseudo-terminal, and somebody who types."""

import os
import pty
import select
import time
from collections.abc import Sequence
from pathlib import Path

LONGEST_S = 300.0
CTRL_C, CTRL_D = "\x03", "\x04"


def typed(
    command: Sequence[str], prompts: Sequence[str], answers: Sequence[str] | None, folder: Path
) -> tuple[str, int]:
    """Run a program on a pseudo-terminal and answer its prompts; returns output and code.

    Args:
        command: program and arguments.
        prompts: what of its output asks for an answer.
        answers: in their order, each a line, or one control character (`CTRL_C`, `CTRL_D`); None
            presses Enter at every prompt.
        folder: where it runs.
    """
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(folder)
        os.execv(command[0], list(command))  # noqa: S606
    said, given, deadline_s = b"", 0, time.monotonic() + LONGEST_S
    while time.monotonic() < deadline_s:
        if not select.select([terminal], [], [], 1.0)[0]:
            continue
        try:
            came = os.read(terminal, 4096)
        except OSError:  # the other end is closed
            break
        said += came
        asked = sum(said.count(prompt.encode()) for prompt in prompts)
        while given < (asked if answers is None else min(len(answers), asked)):
            answer = "" if answers is None else answers[given]
            os.write(terminal, answer.encode() + (b"" if answer in (CTRL_C, CTRL_D) else b"\n"))
            given += 1
    os.close(terminal)
    return said.decode(errors="replace"), os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
