"""Where the database and its frames are."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from rig.errors import StoreError
from rig.file_modes import FileModes
from rig.places import default_database
from rig.secrets import HIDDEN, is_secret


@dataclass(frozen=True, slots=True)
class Location:
    """A database and the folder of its frames."""

    url: URL
    frames: Path
    modes: FileModes = FileModes()  # noqa: RUF009  (a value)

    def __str__(self) -> str:
        """Return the address as it may be shown: without a password, wherever it stands."""
        query = {key: HIDDEN if is_secret(key) else value for key, value in self.url.query.items()}
        shown = self.url.set(query=query).render_as_string(hide_password=True)
        return shown.replace(quote(HIDDEN), HIDDEN)

    @property
    def file(self) -> Path | None:
        """The SQLite file, where it is one."""
        if self.url.get_backend_name() != "sqlite" or self.url.database is None:
            return None
        return Path(self.url.database)

    @property
    def is_server(self) -> bool:
        """Whether it is a PostgreSQL server."""
        return self.url.get_backend_name() == "postgresql"


def locate(url: str | None, environment: Mapping[str, str]) -> Location:
    """Decide where to store.

    The database is `url`, else `RIG_DATABASE`, else `rig.sqlite` in the user's data directory. The
    frames are in `RIG_FRAMES`, else beside a SQLite file, else in the user's data directory.

    Args:
        url: SQLAlchemy URL.
        environment: variables, as in `os.environ`.

    Raises:
        ConfigError: `RIG_FILE_MODE` makes no permission bits.
        StoreError: it is no URL, or a database that forgets everything at the end.
    """
    default = default_database(environment)
    given = url or environment.get("RIG_DATABASE")
    parsed = _parse(given) if given else URL.create("sqlite", database=str(default))
    beside = default.parent
    if parsed.get_backend_name() == "sqlite":
        if parsed.database in {None, "", ":memory:"}:
            raise StoreError(
                f"asked for the database {given}, which is forgotten when the program ends",
                advice="give a file: sqlite:///rig.sqlite",
            )
        file = Path(str(parsed.database)).absolute()
        parsed, beside = parsed.set(database=str(file)), file.parent
    frames = environment.get("RIG_FRAMES")
    where = Path(frames).absolute() if frames else beside / "frames"
    return Location(parsed, where, FileModes.of(environment))


def _parse(text: str) -> URL:
    # A password may hold an @ that nobody has escaped: the last one ends it.
    scheme, marks, rest = text.partition("://")
    authority, slash, path = rest.partition("/")
    before, at, host = authority.rpartition("@")
    try:
        url = make_url(f"{scheme}{marks}{before.replace('@', '%40')}{at}{host}{slash}{path}")
        # Without a driver SQLAlchemy takes an older one, which is none of the extra `postgres`.
        is_plain = url.drivername in {"postgresql", "postgres"}
        return url.set(drivername="postgresql+psycopg") if is_plain else url
    except (ArgumentError, ValueError) as error:
        # The text itself is not shown: it may hold a password.
        raise StoreError(
            "the database given by --db or RIG_DATABASE is no URL",
            advice="for a file write sqlite:///relative.sqlite or sqlite:////absolute/path.sqlite",
        ) from error
