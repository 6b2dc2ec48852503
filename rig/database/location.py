"""Where the database and its frames are."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from rig.errors import StoreError


@dataclass(frozen=True, slots=True)
class Location:
    """A database and the folder of its frames."""

    url: URL
    frames: Path

    def __str__(self) -> str:
        """Return the address as it may be shown: without a password."""
        return self.url.render_as_string(hide_password=True)

    @property
    def file(self) -> Path | None:
        """The SQLite file, where it is one."""
        if self.url.get_backend_name() != "sqlite" or self.url.database is None:
            return None
        return Path(self.url.database)


def locate(url: str | None, environment: Mapping[str, str]) -> Location:
    """Decide where to store.

    The database is `url`, else `RIG_DATABASE`, else `rig.sqlite` in the user's data directory. The
    frames are in `RIG_FRAMES`, else beside a SQLite file, else in the user's data directory.

    Args:
        url: SQLAlchemy URL.
        environment: variables, as in `os.environ`.

    Raises:
        StoreError: it is no URL, or a database that forgets everything at the end.
    """
    home = user_data_dir(sys.platform, environment) / "epirig"
    given = url or environment.get("RIG_DATABASE")
    parsed = _parse(given) if given else URL.create("sqlite", database=str(home / "rig.sqlite"))
    beside = home
    if parsed.get_backend_name() == "sqlite":
        if parsed.database in {None, "", ":memory:"}:
            raise StoreError(
                f"asked for the database {given}, which is forgotten when the program ends",
                advice="give a file: sqlite:///rig.sqlite",
            )
        file = Path(str(parsed.database)).absolute()
        parsed, beside = parsed.set(database=str(file)), file.parent
    frames = environment.get("RIG_FRAMES")
    return Location(parsed, Path(frames).absolute() if frames else beside / "frames")


def user_data_dir(platform: str, environment: Mapping[str, str]) -> Path:
    """Return where programs of this user keep their data, by the customs of the platform.

    Linux and the like: XDG Base Directory Specification, `$XDG_DATA_HOME` (absolute only) or
    `~/.local/share`.

    Args:
        platform: as `sys.platform`.
        environment: variables, as in `os.environ`.
    """
    match platform:
        case "win32":
            local = environment.get("LOCALAPPDATA")
            return Path(local) if local else Path.home() / "AppData" / "Local"
        case "darwin":
            return Path.home() / "Library" / "Application Support"
        case _:
            xdg = Path(environment.get("XDG_DATA_HOME", ""))
            return xdg if xdg.is_absolute() else Path.home() / ".local" / "share"


def _parse(text: str) -> URL:
    try:
        return make_url(text)
    except (ArgumentError, ValueError) as error:
        # The text itself is not shown: it may hold a password.
        raise StoreError(
            "the database given by --db or RIG_DATABASE is no URL",
            advice="for a file write sqlite:///relative.sqlite or sqlite:////absolute/path.sqlite",
        ) from error
