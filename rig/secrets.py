"""Texts that may be shown, logged and stored: whatever looks like a secret is three stars."""

import re
from collections.abc import Mapping, Sequence
from typing import cast

HIDDEN = "***"
_NAMES = r"(?:pass(?:word|wd|phrase)?|pwd|secret|token|credentials?|api[-_]?key|access[-_]?key)"
_IS_SECRET = re.compile(rf"(?:^|[\W_]|ssl|pg){_NAMES}$", re.IGNORECASE)
_USER_INFO = re.compile(r"([a-z][a-z0-9+.-]*://[^\s:/@?#]*):\S*@", re.IGNORECASE)
"""A password may hold any letter but a space, also `@`: the last one ends it."""
_NAMED = re.compile(
    rf"(?<![a-z0-9])((?:[\w.-]*[\W_])?(?:ssl|pg)?{_NAMES}[\"']?\s*[=:]\s*)"
    r"(\"[^\"]*\"|'[^']*'|[^\s&;]+)",
    re.IGNORECASE,
)
_USER = re.compile(r"([a-z][a-z0-9+.-]*://)[^\s/@?#\"']+@", re.IGNORECASE)
_USER_NAMED = re.compile(r"([?&;]user(?:name)?=)[^\s&;\"']+", re.IGNORECASE)


def is_secret(name: str) -> bool:
    """Tell whether what has this name is not to be shown: `password`, `sslpassword`, `api_key`."""
    return _IS_SECRET.search(name) is not None


def without_secrets(text: str) -> str:
    """Return a text in which passwords of URLs and of `name=value` are hidden.

    Rather too much is hidden than too little.
    """
    return _NAMED.sub(rf"\1{HIDDEN}", _USER_INFO.sub(rf"\1:{HIDDEN}@", text))


def without_people(text: str, home: str) -> str:
    """Return a text for others: without secrets, users in URLs, and the folder of who runs this.

    Args:
        text: any.
        home: folder of the user, which then is `~`; empty leaves folders as they are.
    """
    shown = _USER.sub(rf"\1{HIDDEN}@", without_secrets(text))
    shown = _USER_NAMED.sub(rf"\1{HIDDEN}", shown)
    return re.sub(rf"{re.escape(home)}(?=[/\\\"'\s]|$)", "~", shown) if home else shown


def words_without_secrets(words: Sequence[str]) -> list[str]:
    """Return the words of a command line; also what follows an option that names a secret."""
    shown: list[str] = []
    is_next = False
    for word in words:
        shown.append(HIDDEN if is_next else without_secrets(word))
        is_next = word.startswith("-") and "=" not in word and is_secret(word.lstrip("-"))
    return shown


def value_without_secrets(value: object) -> object:
    """Return JSON data, as of a profile, without what its names or texts give away."""
    if isinstance(value, str):
        return without_secrets(value)
    if isinstance(value, Mapping):
        content = cast("Mapping[str, object]", value)
        return {
            key: HIDDEN if is_secret(key) and item else value_without_secrets(item)
            for key, item in content.items()
        }
    if isinstance(value, Sequence):
        return [value_without_secrets(item) for item in cast("Sequence[object]", value)]
    return value
