"""A PostgreSQL server of its own for a test, from Debian's package."""

import importlib.util
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

_NOBODY = ("setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups")
"""The server refuses to run as root."""


@dataclass(frozen=True)
class Server:
    """A server that listens on a socket in a folder of its own."""

    folder: Path
    programs: Path
    begin: tuple[str, ...]
    """What comes before every command."""

    @property
    def url(self) -> str:
        """Address of its database `rig`."""
        return f"postgresql+psycopg://rig@/rig?host={self.folder}"

    def run(self, name: str, *words: str | Path) -> None:
        """Run one of the server's programs."""
        command = [*self.begin, str(self.programs / name), *map(str, words)]
        subprocess.run(command, check=True, capture_output=True, cwd=self.folder, timeout=120)

    def start(self) -> None:
        """Start, and wait until it answers."""
        options = f"-k {self.folder} -c listen_addresses= -c fsync=off"
        self.run("pg_ctl", *self._data, "-o", options, "-l", self.folder / "log", "-w", "start")

    def stop(self) -> None:
        """Stop at once, as by a power cut of the server alone."""
        self.run("pg_ctl", *self._data, "-m", "immediate", "-w", "stop")

    def restart(self) -> None:
        """Stop and start."""
        self.stop()
        self.start()

    def make_database(self, name: str) -> str:
        """Make a database; returns its URL."""
        self.run("createdb", "-h", self.folder, "-U", "rig", name)
        return f"postgresql+psycopg://rig@/{name}?host={self.folder}"

    @contextmanager
    def frozen(self) -> Generator[None]:
        """Let the server and all of its processes stand still: reached, and silent."""
        first = int((self.folder / "data" / "postmaster.pid").read_text().split()[0])
        children = Path(f"/proc/{first}/task/{first}/children").read_text().split()
        everybody = [first, *map(int, children)]
        for process in everybody:
            os.kill(process, signal.SIGSTOP)
        try:
            yield
        finally:
            for process in everybody:
                os.kill(process, signal.SIGCONT)

    @property
    def _data(self) -> tuple[str, Path]:
        return ("-D", self.folder / "data")


@contextmanager
def running_server() -> Generator[Server]:
    """Start a server with an empty database `rig`."""
    homes = sorted(Path("/usr/lib/postgresql").glob("*/bin/pg_ctl"))
    if not homes or importlib.util.find_spec("psycopg") is None:
        pytest.skip("needs Debian's package postgresql and psycopg 3")
    begin = _NOBODY if os.geteuid() == 0 else ()
    folder = Path(tempfile.mkdtemp(prefix="rig-pg-"))
    if begin:
        shutil.chown(folder, "nobody", "nogroup")
    server = Server(folder, homes[-1].parent, begin)
    try:
        server.run("initdb", "-D", folder / "data", "-U", "rig", "-A", "trust", "--no-sync")
        server.start()
        try:
            server.make_database("rig")
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(folder)


@contextmanager
def postgresql_server() -> Generator[str]:
    """Start a server that listens on a socket in a folder of its own; yields a URL."""
    with running_server() as server:
        yield server.url
