"""Which program works on something that only one may work on, and whether it still lives.

A process is told from a later one with its number by when it was started, and from one of another
machine or container by the boot of the machine and the namespace of its process numbers (proc(5)).
"""

import json
import os
import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from uuid import uuid4

from rig.errors import OwnedError

_PROC = Path("/proc")
_STARTED = 19
"""Place of the start time in /proc/PID/stat, counted behind the name; the state is at 0."""
_LONGEST = 200
"""Letters of a word."""
_DEAD = ("Z", "X")
"""States of processes that only wait for their parent to look."""


@dataclass(frozen=True, slots=True)
class Owner:
    """One program at work on one thing."""

    token: str
    """Of this very ownership; no other has it."""
    host: str
    pid: int
    process: str
    """What tells the process from every other: see `process_identity`; empty where nothing does."""
    since: datetime

    @classmethod
    def this_program(cls, since: datetime | None = None) -> "Owner":
        """Return a new ownership of this process; `since` is now where nobody says otherwise."""
        pid = os.getpid()
        identity = process_identity(pid) or ""
        return cls(uuid4().hex, platform.node(), pid, identity, since or datetime.now(UTC))

    @property
    def is_gone(self) -> bool | None:
        """Whether its process has ended; None where this machine cannot know."""
        here = process_identity(os.getpid())
        if not self.process or here is None or _machine(self.process) != _machine(here):
            return None
        found = process_identity(self.pid)
        if found is not None:
            return found != self.process
        try:
            os.kill(self.pid, 0)
        except PermissionError:  # of another user, whose processes this system hides
            return False
        except ProcessLookupError:
            return True
        return True  # ended, and its parent has not looked yet

    def __str__(self) -> str:
        since = self.since.astimezone(UTC)
        return f"process {self.pid} on {self.host}, since {since:%Y-%m-%d %H:%M:%S} UTC"

    def to_json(self) -> str:
        """Write it as one line, for a file that people may read as well."""
        return json.dumps(
            {
                "host": self.host,
                "pid": self.pid,
                "since": self.since.isoformat(),
                "process": self.process,
                "token": self.token,
            }
        )

    @classmethod
    def from_json(cls, text: str) -> "Owner | None":
        """Read what `to_json` wrote; None for anything else, as of a file that was cut off."""
        try:
            content = json.loads(text)
            words = [_shown(content[name]) for name in ("token", "host", "process")]
            since = datetime.fromisoformat(content["since"])
            pid = int(content["pid"])
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            return None
        if since.tzinfo is None:
            return None
        return cls(words[0], words[1], pid, words[2], since)


def owned(asked: str, owner: object, advice: str = "let it end, or stop it there") -> OwnedError:
    """Return the refusal of what another program works on."""
    return OwnedError(f"{asked}, it belongs to {owner}", advice=advice)


def process_identity(pid: int) -> str | None:
    """Return boot, namespace and start of a process.

    Returns:
        Three words; None where there is no such process, or the system does not tell.
    """
    try:
        boot = (_PROC / "sys/kernel/random/boot_id").read_text().strip()
        space = str((_PROC / "self/ns/pid").readlink()).strip("pid:[]")
        fields = (_PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
        state, started = fields[0], fields[_STARTED]
    except (OSError, IndexError, UnicodeError):
        return None
    return None if state in _DEAD else f"{boot} {space} {started}"


def _machine(identity: str) -> list[str]:
    return identity.split()[:2]


def _shown(text: object) -> str:
    """Return a word of a file that a terminal may be given."""
    if not isinstance(text, str):
        raise TypeError
    return "".join(letter for letter in text if letter.isprintable())[:_LONGEST]
