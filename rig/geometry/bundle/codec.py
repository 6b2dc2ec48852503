"""Frozen dataclasses of numbers, arrays and each other, as JSON and back; closed both ways."""

import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from rig.errors import ConfigError

Json = dict[str, "Json"] | list["Json"] | str | float | int | bool | None

_ADVICE = "the file was changed or written by another version"


def encode(value: object) -> Json:
    """Turn a value into what `json` writes; numbers that are not finite become their names."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: encode(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return encode(cast("object", value.tolist()))
    if isinstance(value, tuple | list):
        return [encode(item) for item in cast("list[object]", value)]
    if isinstance(value, np.generic):
        return encode(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"{type(value).__name__} has no JSON form here")


def decode(kind: Any, data: Json, place: str) -> Any:
    """Turn JSON back into a value of a type.

    Args:
        kind: the type, a dataclass at the top.
        data: what `json` read.
        place: name of the value, for messages.

    Raises:
        ConfigError: something is missing, unknown or of another type.
    """
    origin, arguments = get_origin(kind), get_args(kind)
    if is_dataclass(kind):
        return _decode_fields(kind, data, place)
    if origin in (Union, types.UnionType):
        inner = next(item for item in arguments if item is not type(None))
        return None if data is None else decode(inner, data, place)
    if origin is np.ndarray:
        return _decode_array(arguments, data, place)
    if origin is tuple:
        return _decode_tuple(arguments, data, place)
    if origin is Literal:
        return data if data in arguments else _refuse(place, " or ".join(map(str, arguments)), data)
    if kind is float:
        return _number(data, place)
    if type(data) is kind:
        return data
    return _refuse(place, kind.__name__, data)


def _decode_fields(kind: Any, data: Json, place: str) -> Any:
    if not isinstance(data, Mapping):
        return _refuse(place, kind.__name__, data)
    hints = get_type_hints(kind)
    wanted = {field.name for field in fields(kind)}
    if wanted != set(data):
        missing, unknown = sorted(wanted - set(data)), sorted(set(data) - wanted)
        raise ConfigError(
            f"{place}: fields missing {missing}, fields unknown {unknown}",
            advice=_ADVICE,
        )
    return kind(**{name: decode(hints[name], data[name], f"{place}.{name}") for name in data})


def _decode_array(arguments: tuple[Any, ...], data: Json, place: str) -> Any:
    scalar = get_args(arguments[1])[0]
    try:
        return np.array(data, scalar)
    except (TypeError, ValueError) as error:
        raise ConfigError(
            f"{place}: an array of {scalar.__name__} wanted, {error}", advice=_ADVICE
        ) from error


def _decode_tuple(arguments: tuple[Any, ...], data: Json, place: str) -> Any:
    if not isinstance(data, list):
        return _refuse(place, "a list", data)
    kinds = [arguments[0]] * len(data) if arguments[-1] is Ellipsis else list(arguments)
    if len(kinds) != len(data):
        return _refuse(place, f"a list of {len(kinds)}", data)
    return tuple(
        decode(kind, item, f"{place}[{index}]")
        for index, (kind, item) in enumerate(zip(kinds, data, strict=True))
    )


def _number(data: Json, place: str) -> float:
    if data in ("nan", "inf", "-inf"):
        return float(cast("str", data))
    if isinstance(data, bool) or not isinstance(data, int | float):
        return _refuse(place, "a number", data)
    return float(data)


def _refuse(place: str, wanted: str, found: Json) -> Any:
    raise ConfigError(f"{place}: {wanted} wanted, found {str(found)[:40]}", advice=_ADVICE)
