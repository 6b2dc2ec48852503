"""Column types that keep what went in: canonical JSON, and times that know their zone."""

import json
from datetime import UTC, datetime
from typing import cast

from sqlalchemy import String, Text
from sqlalchemy.engine import Dialect
from sqlalchemy.types import TypeDecorator


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
        """Read it back."""
        return None if value is None else cast("dict[str, object]", json.loads(value))


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
        """Read it back, with its zone."""
        return None if value is None else datetime.fromisoformat(value)
