"""Single values of a profile replaced from outside the file: `--set key.path=value`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, cast

from rig.bounded_text import parse_toml
from rig.errors import OptionError
from rig.terminal_text import one_line

_ALTERNATIVES: Mapping[tuple[str, ...], str] = {
    ("slopes", "range_px"): "range_mm",
    ("slopes", "range_mm"): "range_px",
}
"""Keys that replace another one: exactly one of the two may be given."""


class KeysOfKind(Protocol):
    """What a section of another kind may hold."""

    def __call__(self, section: str, kind: str) -> Iterable[str] | None:
        """Return its keys, None where there is no such kind."""
        ...


class Override(NamedTuple):
    """One `key.path=value`."""

    text: str
    """As it was written, in one harmless line."""
    path: tuple[str, ...]
    """Key by key; an entry of a list by its `name` or its index."""
    value: Any


def read_override(text: str) -> Override:
    """Read `key.path=value`; the value is TOML, or else plain text.

    Raises:
        OptionError: it is not written so.
    """
    key, equals, value = text.partition("=")
    path = tuple(part.strip() for part in key.split("."))
    shown = one_line(text)
    if not equals or not all(part and part.isprintable() for part in path):
        raise OptionError(
            f"--set {shown}: names no key and value", advice="write it as key.path=value"
        )
    return Override(shown, path, _toml_value(value.strip()))


def apply_overrides(
    data: dict[str, Any], overrides: Sequence[Override], keys_of: KeysOfKind
) -> None:
    """Put values into the plain data of a profile.

    A new `kind` comes first, wherever it stands: it replaces its section, of which only those keys
    stay that the new kind knows as well.

    Raises:
        OptionError: there is no such place in the data.
    """
    for override in sorted(overrides, key=lambda o: o.path[-1] != "kind" or len(o.path) != 2):
        _apply(data, override, keys_of)


def plain_path(data: Mapping[str, Any], path: Sequence[str]) -> tuple[str, ...]:
    """Return a path with the index of an entry of a list where it had the name."""
    node: Any = data
    plain: list[str] = []
    for part in path:
        if isinstance(node, list):
            names = _names(cast("list[Any]", node))
            part = str(names.index(part)) if part in names else part
            node = node[int(part)] if part.isdecimal() and int(part) < len(names) else None
        else:
            node = node.get(part) if isinstance(node, dict) else None
        plain.append(part)
    return tuple(plain)


def _apply(data: dict[str, Any], override: Override, keys_of: KeysOfKind) -> None:
    *above, last = override.path
    node: Any = data
    for depth, part in enumerate(above):
        index = _index(node, part, override, depth)
        if isinstance(node, dict):
            node.setdefault(part, {})
        node = node[index]
    index = _index(node, last, override, len(above))
    if last == "kind" and len(above) == 1 and isinstance(node, dict):
        _make_room(cast("dict[str, Any]", node), keys_of(above[0], str(override.value)))
    if override.path in _ALTERNATIVES and isinstance(node, dict):
        cast("dict[str, Any]", node).pop(_ALTERNATIVES[override.path], None)
    node[index] = override.value


def _make_room(section: dict[str, Any], known: Iterable[str] | None) -> None:
    for key in set(section) - set(section if known is None else known):
        del section[key]


def _index(node: Any, part: str, override: Override, depth: int) -> str | int:
    where = ".".join(override.path[:depth])
    if isinstance(node, dict):
        return part
    if not isinstance(node, list):
        raise OptionError(
            f"--set {override.text}: {where} has no keys below it", advice="shorten the path"
        )
    names = _names(cast("list[Any]", node))
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(names):
        return int(part)
    known = ", ".join(name for name in names if name) or f"0..{len(names) - 1}"
    raise OptionError(f"--set {override.text}: {where} has no {part}", advice=f"there are: {known}")


def _names(entries: Sequence[Any]) -> list[str]:
    return [str(entry.get("name", "")) if isinstance(entry, dict) else "" for entry in entries]


def _toml_value(text: str) -> Any:
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:
        return text
