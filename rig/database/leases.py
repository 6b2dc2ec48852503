"""The part of the store that knows who works on what: one program at a time.

A lease is a row with a token that no other has. It is taken, kept alive and given back by single
statements that name the token they found, so that of several programs exactly one succeeds, on
SQLite and PostgreSQL, on one machine or several. Whoever writes names its own token in the same
transaction: a program that was taken for dead, and was not, stores nothing any more.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import Engine, delete, func, select, text, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from rig.database.heartbeat import Heartbeat
from rig.database.location import Location
from rig.database.tables import LeaseRow
from rig.database.transactions import Transactions
from rig.errors import StoreError
from rig.folder_lock import FolderLock
from rig.owner import Owner, owned

BEAT_S = 10.0
"""An owner says so often that it lives."""
STALE_S = 120.0
"""An owner on another machine that was not heard of for so long is taken for dead."""
_TRIES = 20
"""So often another program may be quicker."""

STORE = "store"
"""The lease of whoever works on all of it at once: nobody else owns anything beside."""
FRAMES = "frames"
"""The lease of whoever reads or removes frames of many sweeps."""

Now = Callable[[Session], datetime]


def database_now(session: Session) -> datetime:
    """Return the time of the server, so that the clocks of two benches need not agree."""
    if session.get_bind().dialect.name == "postgresql":
        return session.scalars(select(func.clock_timestamp())).one().astimezone(UTC)
    return datetime.now(UTC)


def sweep_lease(sweep_id: int) -> str:
    """Return what the lease of a sweep is called."""
    return f"sweep {sweep_id}"


class LeaseShelf(Transactions):
    """Who works on what."""

    def __init__(self, location: Location, engine: Engine, now: Now = database_now) -> None:
        super().__init__(location, engine)
        self._now = now
        self._held: dict[str, tuple[Owner, FolderLock]] = {}

    @contextmanager
    def owned(self, what: str, folder: Path, asked: str) -> Generator[None]:
        """Be the only program that works on something, from here to the end of the block.

        Inside a block for the same thing this does nothing.

        Args:
            what: name of the lease; `sweep_lease` for a sweep.
            folder: of its frames; a lock is put beside them.
            asked: what for, as in "asked to resume sweep 3".

        Raises:
            OwnedError: another program works on it; names that one, and nothing was changed.
            StoreError: the folder is gone, or database or folder may only be read.
        """
        if what in self._held:
            yield
            return
        me = self._take(what, asked)
        with ExitStack() as stack:
            stack.callback(self._give_back, what, me)
            lock = stack.enter_context(FolderLock(folder, owner=me, mode=self.modes.file))
            stack.callback(self._held.pop, what)
            self._held[what] = (me, lock)
            stack.enter_context(Heartbeat(lambda: self._beat(what, me), BEAT_S))
            yield

    def holds(self, what: str) -> bool:
        """Tell whether this program owns something."""
        return what in self._held

    def owner(self, what: str) -> Owner | None:
        """Return who works on something; None where nobody does who lives."""
        with self._reading(f"look who works on {what}") as session:
            row = session.get(LeaseRow, what)
            return None if row is None or self._is_dead(session, row) else _owner(row)

    def owners(self) -> dict[str, Owner]:
        """Return everybody who works and lives, by what they work on."""
        with self._reading("look who works") as session:
            rows = session.scalars(select(LeaseRow)).all()
            return {row.what: _owner(row) for row in rows if not self._is_dead(session, row)}

    def _require_owned(self, session: Session, what: str) -> None:
        """Let nobody write into what another program works on; part of every such transaction.

        Raises:
            OwnedError: another program works on it, or has taken it over.
            StoreError: the folder of its frames is gone.
        """
        if what not in self._held:
            row = session.get(LeaseRow, what)
            if row is not None and not self._is_dead(session, row):
                raise owned(f"asked to change {what}", _owner(row))
            return
        me, lock = self._held[what]
        if not self._says_it_lives(session, what, me):
            row = session.get(LeaseRow, what)
            raise owned(
                f"asked to go on with {what}",
                "nobody: its lease was taken away" if row is None else _owner(row),
                "this program was not heard of for too long; look at rig history",
            )
        lock.require()

    def _take(self, what: str, asked: str) -> Owner:
        for _ in range(_TRIES):
            with self._reading(f"look who works on {what}") as session:
                # Who is refused never takes the lock by which the owner stores its samples.
                self._require_free(session, what, asked)
                self._require_alone(session, what, asked)
            with self._writing(f"become the owner of {what}") as session:
                me = Owner.this_program(self._now(session))
                if self._is_taken_now(session, what, me, asked):
                    return me
        raise owned(asked, "programs that take turns", "try again")

    def _is_taken_now(self, session: Session, what: str, me: Owner, asked: str) -> bool:
        """Try once; False where another program was quicker."""
        if session.get_bind().dialect.name == "postgresql":  # or two would not see each other
            session.execute(text("LOCK TABLE leases IN SHARE ROW EXCLUSIVE MODE"))
        row = self._require_free(session, what, asked)
        self._require_alone(session, what, asked)
        if row is None:
            with suppress(IntegrityError), session.begin_nested():
                session.add(LeaseRow(what=what, **_columns(me), heartbeat=me.since))
                session.flush()
                return True
            return False
        found = (LeaseRow.token == row.token, LeaseRow.heartbeat == row.heartbeat)
        taken = session.execute(
            update(LeaseRow)
            .where(LeaseRow.what == what, *found)
            .values(**_columns(me), heartbeat=me.since)
        )
        return _count(taken) == 1

    def _require_free(self, session: Session, what: str, asked: str) -> LeaseRow | None:
        """Return the lease of an owner that is dead, None where there is none at all.

        Raises:
            OwnedError: its owner lives.
        """
        row = session.get(LeaseRow, what)
        if row is not None and not self._is_dead(session, row):
            raise owned(asked, _owner(row), self._when_to_come_back(row))
        return row

    def _require_alone(self, session: Session, what: str, asked: str) -> None:
        """Let nobody own a part while somebody owns the whole, nor the other way round.

        Raises:
            OwnedError: somebody does.
        """
        others = LeaseRow.what != what if what == STORE else LeaseRow.what == STORE
        for row in session.scalars(select(LeaseRow).where(others)):
            if row.what != what and row.what not in self._held and not self._is_dead(session, row):
                raise owned(
                    f"{asked}, but {row.what} is at work" if what == STORE else asked,
                    _owner(row),
                    self._when_to_come_back(row),
                )

    def clear_dead_leases(self) -> int:
        """Remove what ended programs left behind; returns how many."""
        with self._writing("clear the leases of ended programs") as session:
            rows = [row for row in session.scalars(select(LeaseRow)) if self._is_dead(session, row)]
            for row in rows:
                session.delete(row)
            return len(rows)

    def dead_leases(self) -> tuple[str, ...]:
        """Return what belongs to programs that have ended."""
        with self._reading("look who works") as session:
            rows = session.scalars(select(LeaseRow).order_by(LeaseRow.what)).all()
            return tuple(row.what for row in rows if self._is_dead(session, row))

    def _beat(self, what: str, me: Owner) -> bool:
        with self._writing(f"say that {what} is being worked on") as session:
            return self._says_it_lives(session, what, me)

    def _says_it_lives(self, session: Session, what: str, me: Owner) -> bool:
        mine = (LeaseRow.what == what, LeaseRow.token == me.token)
        beat = update(LeaseRow).where(*mine).values(heartbeat=self._now(session))
        return _count(session.execute(beat)) == 1

    def _give_back(self, what: str, me: Owner) -> None:
        # Where the database is gone the lease stays; that its owner has ended is seen by the next.
        with suppress(StoreError), self._writing(f"give {what} back") as session:
            mine = (LeaseRow.what == what, LeaseRow.token == me.token)
            session.execute(delete(LeaseRow).where(*mine))

    def _is_dead(self, session: Session, row: LeaseRow) -> bool:
        is_gone = _owner(row).is_gone
        if is_gone is not None:
            return is_gone
        return (self._now(session) - row.heartbeat).total_seconds() > STALE_S

    def _when_to_come_back(self, row: LeaseRow) -> str:
        if _owner(row).is_gone is not None:
            return "let it end, or stop it there"
        return (
            f"let it end, or stop it there; if that machine is off, try again {STALE_S:.0f} s after"
            f" {row.heartbeat:%H:%M:%S} UTC, when it was last heard of"
        )


def _columns(owner: Owner) -> dict[str, object]:
    return {
        "token": owner.token,
        "host": owner.host,
        "pid": owner.pid,
        "process": owner.process,
        "since": owner.since,
    }


def _owner(row: LeaseRow) -> Owner:
    return Owner(row.token, row.host, row.pid, row.process, row.since)


def _count(result: object) -> int:
    """Return how many rows a statement changed."""
    count = getattr(result, "rowcount", 0)
    return count if isinstance(count, int) else 0
