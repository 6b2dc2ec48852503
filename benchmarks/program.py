"""`rig` in a process of its own that was forked here, so that its modules need not be read again.

See `benchmarks.warm` for what is there before the fork: no thread, no device and no file.
"""

import os
import select
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.failing_disk import calls
from benchmarks.warm import make_ready, warm_up
from rig.calibrate.album import Album
from rig.cli import main
from rig.database import Store
from tests.support.signalled import watched_carriages, way_they_go

_PATIENCE_S = 240.0
__all__ = ["Ended", "run_program", "warm_up"]


@dataclass(frozen=True, slots=True)
class Ended:
    """How the program ended, and what it said."""

    code: int
    """Negative for the signal that ended it."""
    out: str
    err: str
    stage: str
    """Where the simulated stage was at its end; empty where it did not come to say so."""
    stored: tuple[str, ...]
    """Samples and pictures that the store has acknowledged, each by its key."""
    calls: int
    """That a library of `benchmarks.failing_disk` has counted, where the program came to say so."""


def run_program(
    words: Sequence[str | Path],
    folder: Path,
    *,
    kill_after_s: float | None = None,
    number: int = signal.SIGKILL,
    first: Callable[[], object] | None = None,
) -> Ended:
    """Run `rig WORDS`, and disturb it after a while.

    Args:
        words: of the command line.
        folder: for its journal.
        kill_after_s: when to send the signal; None lets it end.
        number: the signal.
        first: called in the new process before anything else.
    """
    make_ready()
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix="rig-said-") as name:
        said = Path(name)
        pid = os.fork()
        if pid == 0:
            _child([str(word) for word in words], said, first or (lambda: None))
        code = _waited(pid, kill_after_s, number)
        texts = [_text(said / stream) for stream in ("out", "err", "stage", "stored", "calls")]
    stored = tuple(texts[3].splitlines())
    return Ended(code, texts[0], texts[1], texts[2], stored, int(texts[4] or 0))


def _text(file: Path) -> str:
    return file.read_text(errors="replace") if file.exists() else ""


def _waited(pid: int, kill_after_s: float | None, number: int) -> int:
    handle = os.pidfd_open(pid)
    try:
        wait_s = _PATIENCE_S if kill_after_s is None else kill_after_s
        is_over = bool(select.select([handle], [], [], wait_s)[0])
        if not is_over:
            signal.pidfd_send_signal(handle, signal.SIGKILL if kill_after_s is None else number)
            is_over = bool(select.select([handle], [], [], _PATIENCE_S)[0])
        if not is_over:  # it does not end when it is told to
            signal.pidfd_send_signal(handle, signal.SIGKILL)
    finally:
        os.close(handle)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def _child(words: list[str], said: Path, first: Callable[[], object]) -> None:
    code = 1
    try:
        for stream, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(said / name, os.O_WRONLY | os.O_CREAT), stream)
        sys.stdout, sys.stderr = (os.fdopen(os.dup(stream), "w") for stream in (1, 2))
        for one in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(one, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        first()
        code = _run(words, said)
    except BaseException as error:  # whatever it is, the parent is told
        sys.stderr.write(f"Traceback of the program: {type(error).__name__}: {error}\n")
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        (said / "calls").write_text(str(calls()))
        os._exit(code)


def _run(words: list[str], said: Path) -> int:
    sys.argv = ["rig", *words]
    _keep_a_journal(said / "stored")
    carriages = watched_carriages()
    try:
        main()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else 0
    finally:
        (said / "stage").write_text(", ".join(way_they_go(carriages)))
    return 0


def _keep_a_journal(file: Path) -> None:
    """Write down what was acknowledged, as soon as it was."""
    handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    add_sample: Any = Store.add_sample
    keep: Any = Album.keep

    def added(self: Store, sweep_id: int, **named: Any) -> Any:
        sample = add_sample(self, sweep_id, **named)
        os.write(handle, f"{sweep_id} {named['stop']} {named['number']}\n".encode())
        return sample

    def kept(self: Album, picture: Any) -> None:
        keep(self, picture)
        os.write(handle, f"{self.folder.name} {picture.number}\n".encode())

    Store.add_sample = added
    Album.keep = kept
