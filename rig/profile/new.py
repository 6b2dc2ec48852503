"""Write a new profile, and never over an old one."""

import json
import re
import tomllib
from pathlib import Path

from rig.errors import ConfigError
from rig.profile.load import find_profile, parse_profile

_NAME_LINE = re.compile(r'(?m)^name\s*=\s*"[^"\n]*"')


def copied_text(source: str, name: str) -> str:
    """Return the text of a profile, comments and all, under another name.

    Args:
        source: name or path of the profile to copy.
        name: of the new rig.

    Raises:
        ConfigError: there is no such profile, or its name is not on a line of its own.
    """
    path = find_profile(source)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"{path}: cannot be read: {error}", advice="check the path and its permissions"
        ) from error
    first_table = text.find("\n[")
    head, rest = (text, "") if first_table < 0 else (text[:first_table], text[first_table:])
    line = f"name = {json.dumps(name)}"
    head, count = _NAME_LINE.subn(lambda _: line, head)
    if count != 1:
        raise ConfigError(
            f'{path}: has no single line name = "..." at its head', advice="copy it by hand"
        )
    return head + rest


def write_new(path: Path, text: str) -> None:
    """Write a profile that can be used to a file that is not there yet.

    Args:
        path: the file; its folder is made.
        text: TOML.

    Raises:
        ConfigError: the file is there, cannot be written, or the text is no profile.
    """
    try:
        parse_profile(tomllib.loads(text), source=str(path))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(
            f"{path}: would not be valid TOML: {error}", advice="choose plain names"
        ) from error
    if path.exists():
        raise ConfigError(
            f"{path}: is there already and is left alone",
            advice="choose another name, or --out FILE",
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:  # whatever came there meanwhile is kept too
            file.write(text)
    except OSError as error:
        raise ConfigError(
            f"{path}: cannot be written: {error.strerror}", advice="choose another place with --out"
        ) from error
