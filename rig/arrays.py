"""Arrays and numbers as fields of values: one type each, which also says how it is stored.

In JSON an array is its nested lists, and a number that is not finite its name.
"""

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, ValidationInfo
    from pydantic_core import CoreSchema

_BY_NAME = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}


class _StoredArray(NamedTuple):
    """How pydantic reads and writes an array."""

    scalar: type[np.generic]
    leaves: tuple[type, ...]
    """What JSON may hold in its place, besides names."""
    wanted: str

    def __repr__(self) -> str:
        return f"stored as {self.wanted}"

    def __get_pydantic_core_schema__(
        self, source: object, handler: "GetCoreSchemaHandler"
    ) -> "CoreSchema":
        # Only pydantic asks: mathematics must not wait for its import.
        from pydantic_core import core_schema  # noqa: PLC0415

        return core_schema.with_info_plain_validator_function(
            self._read,
            serialization=core_schema.plain_serializer_function_ser_schema(_to_names),
        )

    def _read(self, data: object, info: "ValidationInfo") -> NDArray[Any]:
        if isinstance(data, np.ndarray):
            return cast("NDArray[Any]", data)
        if not isinstance(data, list):
            return self._refuse()
        try:
            array = np.array(self._leaf(cast("object", data)), self.scalar)
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(self.wanted) from error
        finite = (info.config or {}).get("allow_inf_nan") is False
        if finite and not np.isfinite(array).all():
            raise ValueError(f"{self.wanted}, finite ones")
        return array

    def _leaf(self, data: object) -> object:
        if isinstance(data, list):
            return [self._leaf(item) for item in cast("list[object]", data)]
        if float in self.leaves and isinstance(data, str):
            return _BY_NAME[data] if data in _BY_NAME else self._refuse()
        # Exact types, because a bool is an int to Python.
        return data if type(data) in self.leaves else self._refuse()

    def _refuse(self) -> Any:
        raise ValueError(self.wanted)


class _NamedNumber:
    """How pydantic reads and writes a number that may be infinite or none at all."""

    def __repr__(self) -> str:
        return "stored as a number or its name"

    def __get_pydantic_core_schema__(
        self, source: object, handler: "GetCoreSchemaHandler"
    ) -> "CoreSchema":
        from pydantic_core import core_schema  # noqa: PLC0415

        def read(data: object) -> object:
            return _BY_NAME.get(data, data) if isinstance(data, str) else data

        return core_schema.no_info_before_validator_function(
            read,
            core_schema.float_schema(strict=True, allow_inf_nan=True),
            serialization=core_schema.plain_serializer_function_ser_schema(_to_name),
        )


def _to_names(array: NDArray[Any]) -> object:
    lists: object = array.tolist()
    if array.dtype.kind != "f" or np.isfinite(array).all():
        return lists
    return _named(lists)


def _named(data: object) -> object:
    if isinstance(data, list):
        return [_named(item) for item in cast("list[object]", data)]
    return _to_name(cast("float", data))


def _to_name(number: float) -> float | str:
    return number if np.isfinite(number) else str(float(number))


Float = Annotated[NDArray[np.float64], _StoredArray(np.float64, (float, int), "lists of numbers")]
"""An array of numbers; each field tells its shape and unit."""
Index = Annotated[NDArray[np.intp], _StoredArray(np.intp, (int,), "lists of whole numbers")]
"""An array of numbers that count or name."""
Flags = Annotated[NDArray[np.bool_], _StoredArray(np.bool_, (bool,), "lists of true and false")]
"""An array of yes and no."""
Number = Annotated[float, _NamedNumber()]
"""A number that may be NaN or infinite, where no data speak."""
