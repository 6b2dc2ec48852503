"""Column types that keep what went in: canonical JSON, and times that know their zone."""

import json
from datetime import UTC, datetime
from typing import cast

from sqlalchemy import String, Text
from sqlalchemy.engine import Dialect
from sqlalchemy.types import TypeDecorator

from rig.errors import StoreError


def canonical_json(value: object) -> str:
    """Return JSON that is equal whenever the value is equal; numbers keep every digit.

    Raises:
        ValueError: a number is not finite.
        TypeError: something in it has no JSON form.
    """
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )


class CanonicalJson(TypeDecorator[dict[str, object]]):
    """A JSON object as text."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: dict[str, object] | None, dialect: Dialect) -> str | None:
        """Write canonical JSON."""
        return None if value is None else canonical_json(value)

    def process_result_value(self, value: str | None, dialect: Dialect) -> dict[str, object] | None:
        """Read it back.

        Raises:
            StoreError: the cell holds no JSON object.
        """
        if value is None:
            return None
        try:
            found = json.loads(value)
        except (ValueError, TypeError, RecursionError) as error:
            raise _damaged("a JSON object", value) from error
        if not isinstance(found, dict):
            raise _damaged("a JSON object", value)
        return cast("dict[str, object]", found)

    @property
    def python_type(self) -> type[dict[str, object]]:
        """What a loaded cell is."""
        return dict


class UtcTime(TypeDecorator[datetime]):
    """A moment as ISO 8601 text in UTC, with its offset; texts sort as the moments do."""

    impl = String(32)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> str | None:
        """Write it in UTC; a time without zone is refused."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value.isoformat()} has no time zone")
        return value.astimezone(UTC).isoformat(timespec="microseconds")

    def process_result_value(self, value: str | None, dialect: Dialect) -> datetime | None:
        """Read it back, with its zone.

        Raises:
            StoreError: the cell holds no moment, or one without a zone.
        """
        if value is None:
            return None
        try:
            found = datetime.fromisoformat(value)
        except (ValueError, TypeError) as error:
            raise _damaged("a moment", value) from error
        if found.tzinfo is None:
            raise _damaged("a moment with its zone", value)
        return found

    @property
    def python_type(self) -> type[datetime]:
        """What a loaded cell is."""
        return datetime


def _damaged(wanted: str, found: object) -> StoreError:
    text = repr(found)
    shown = text if len(text) <= 40 else f"{text[:37]}..."
    return StoreError(
        f"the database is damaged: {wanted} belongs where {shown} is",
        advice="bring it back from a copy",
    )
