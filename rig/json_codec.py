"""Stored values as JSON and back: closed, typed, and equal to the last digit when they return."""

import json
from functools import cached_property
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, create_model
from pydantic_core import ErrorDetails

from rig.errors import RigError

T = TypeVar("T")

_MOST_ERRORS_SHOWN = 3
_WANTED = {
    "float_type": "a finite number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "an object",
    "dataclass_type": "an object",
    "too_long": "a shorter list",
}


class Codec(Generic[T]):
    """One kind of stored value.

    The value is a frozen dataclass of numbers, texts, tuples, arrays of `rig.arrays` and others of
    its kind. Unknown fields, missing fields and other types are refused; a field with a default may
    be missing, so that older JSON reads on.
    """

    def __init__(
        self,
        kind: type[T],
        *,
        name: str,
        error: type[RigError],
        advice: str,
        finite: bool = True,
    ) -> None:
        """Describe a kind.

        Args:
            kind: the dataclass.
            name: what it is called in messages, to follow "a stored".
            error: raised for JSON that makes no such value.
            advice: what to do then.
            finite: whether arrays must be finite.
        """
        self._kind, self._name, self._error, self._advice = kind, name, error, advice
        self._finite = finite

    def to_json(self, value: T) -> dict[str, Any]:
        """Return a plain dict of numbers, texts and lists; `from_json` takes it back."""
        whole = self._envelope.model_construct(value=value)
        return whole.model_dump(mode="json")["value"]

    def from_json(self, content: object) -> T:
        """Build the value that `to_json` wrote.

        Args:
            content: what `json` read.

        Raises:
            RigError: of the class given: unknown or missing fields, other types, or numbers that
                make no such value.
        """
        # As text, because only there pydantic tells a list for a tuple from a wrong type.
        return self._read(json.dumps({"value": content}))

    def from_text(self, text: str) -> T:
        """Build the value from the text of `to_json`.

        Raises:
            RigError: of the class given: see `from_json`; or the text is no JSON.
        """
        return self._read(f'{{"value": {text}}}')

    def _read(self, text: str) -> T:
        try:
            return self._envelope.model_validate_json(text).value  # pyright: ignore
        except ValidationError as error:
            errors = error.errors(include_url=False)
            self._refuse_as_values_do(errors, error)
            shown = ", ".join(_describe(item) for item in errors[:_MOST_ERRORS_SHOWN])
            more = len(errors) - _MOST_ERRORS_SHOWN
            found = shown + (f" and {more} more" if more > 0 else "")
            raise self._error(
                f"a stored {self._name} is ill-formed: {found}; {self._advice}"
            ) from error

    def _refuse_as_values_do(self, errors: list[ErrorDetails], cause: ValidationError) -> None:
        """What a value itself refuses it tells better, with its own advice."""
        for item in errors:
            told = item.get("ctx", {}).get("error")
            if isinstance(told, RigError):
                place = _place(item["loc"][1:])
                raise self._error(
                    f"a stored {self._name} is ill-formed: {place}: {told}"
                ) from cause

    @cached_property
    def _envelope(self) -> type[BaseModel]:
        # Dataclasses take the strictness of the model that they are part of.
        closed = ConfigDict(extra="forbid", strict=True, allow_inf_nan=not self._finite)
        return create_model("Stored", __config__=closed, value=(self._kind, ...))


def _describe(item: ErrorDetails) -> str:
    place = _place(item["loc"][1:])
    kind = item["type"]
    if kind in ("missing", "missing_argument"):
        return f"{place} is missing"
    if kind in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"{place} is unknown"
    if kind == "json_invalid":
        return "it is no JSON"
    context = item.get("ctx", {})
    if kind == "value_error":
        wanted = str(context["error"])
    elif kind == "literal_error":
        wanted = str(context["expected"])
    else:
        wanted = _WANTED.get(kind, "another value")
    found = repr(item["input"])
    return f"{place}: {wanted} wanted, found {found if len(found) <= 40 else found[:37] + '...'}"


def _place(location: tuple[int | str, ...]) -> str:
    path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in location)
    return path.removeprefix(".") or "all of it"
