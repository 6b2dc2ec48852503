"""Where files of a user are: profiles that can be named, and the database that nobody named."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path


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


def default_database(environment: Mapping[str, str]) -> Path:
    """Return the SQLite file that is used where neither `--db` nor `RIG_DATABASE` names one."""
    return user_data_dir(sys.platform, environment) / "epirig" / "rig.sqlite"


def profile_folders() -> tuple[Path, ...]:
    """Return where profile names are looked up: the working folder first, then the shipped ones."""
    package = Path(__file__).resolve().parent
    candidates = (Path.cwd(), package, package.parent)
    folders = (folder / "calib_profiles" for folder in candidates)
    return tuple(dict.fromkeys(folder.resolve() for folder in folders if folder.is_dir()))


def profile_files() -> Iterator[Path]:
    """Yield every profile that can be named; of two with one name only the first found."""
    seen: set[str] = set()
    for folder in profile_folders():
        for path in sorted(folder.glob("*.toml")):
            if path.stem not in seen:
                seen.add(path.stem)
                yield path
