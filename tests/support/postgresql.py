"""A PostgreSQL server of its own for a test, from Debian's package."""

import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

_NOBODY = ("setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups")
"""The server refuses to run as root."""


@contextmanager
def postgresql_server() -> Generator[str]:
    """Start a server that listens on a socket in a folder of its own; yields a URL."""
    homes = sorted(Path("/usr/lib/postgresql").glob("*/bin/pg_ctl"))
    if not homes or importlib.util.find_spec("psycopg") is None:
        pytest.skip("needs Debian's package postgresql and psycopg 3")
    programs = homes[-1].parent
    begin = _NOBODY if os.geteuid() == 0 else ()
    folder = Path(tempfile.mkdtemp(prefix="rig-pg-"))
    if begin:
        shutil.chown(folder, "nobody", "nogroup")

    def run(name: str, *words: str | Path) -> None:
        command = [*begin, str(programs / name), *map(str, words)]
        subprocess.run(command, check=True, capture_output=True, cwd=folder, timeout=120)

    data = folder / "data"
    try:
        run("initdb", "-D", data, "-U", "rig", "-A", "trust", "--no-sync")
        options = f"-k {folder} -c listen_addresses= -c fsync=off"
        run("pg_ctl", "-D", data, "-o", options, "-l", folder / "log", "-w", "start")
        try:
            run("createdb", "-h", folder, "-U", "rig", "rig")
            yield f"postgresql+psycopg://rig@/rig?host={folder}"
        finally:
            run("pg_ctl", "-D", data, "-m", "immediate", "-w", "stop")
    finally:
        shutil.rmtree(folder)
