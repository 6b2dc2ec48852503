"""A profile as TOML that can be saved and used: the standard library only reads it."""

import json
import re
from collections.abc import Mapping

from rig.profile.model import Model
from rig.profile.models import Profile

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(profile: Profile) -> str:
    """Return a profile as TOML with all defaults filled in; it loads as an equal one."""
    return "\n".join(_section("", profile.model_dump(mode="json"))).lstrip("\n") + "\n"


def section_text(name: str, config: Model) -> str:
    """Return one section of a profile as TOML, with all defaults filled in."""
    return "\n".join(_section(name, config.model_dump(mode="json"))).lstrip("\n") + "\n"


def _section(path: str, values: Mapping[str, object]) -> list[str]:
    below = {key: value for key, value in values.items() if isinstance(value, dict) and value}
    plain = {key: value for key, value in values.items() if key not in below and value is not None}
    lines = ["", f"[{path}]"] if path and (plain or not below) else []
    lines += [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in below.items():
        lines += _section(f"{path}.{_key(key)}" if path else _key(key), value)
    return lines


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _value(value: object) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return _text(value)
        case dict():
            pairs = (f"{_key(str(k))} = {_value(v)}" for k, v in value.items() if v is not None)
            return f"{{{', '.join(pairs)}}}"
        case list() if value and isinstance(value[0], dict):
            return "\n".join(["[", *(f"    {_value(entry)}," for entry in value), "]"])
        case list():
            return f"[{', '.join(_value(entry) for entry in value)}]"
        case _:
            return repr(value)


def _text(text: str) -> str:
    """Quote; JSON's escapes are TOML's, but for one character that TOML wants escaped."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
