"""Whether a row holds what its table says: SQLite keeps any value in any column.

A file from elsewhere, or a damaged one, opens like any other; what its cells hold is looked at when
a row is loaded, so that nothing behind has to ask.
"""

from sqlalchemy import inspect

from rig.database.tables import Row
from rig.errors import StoreError

_ONE_OF = {
    "sweeps.state": ("taking", "taken", "concluded", "failed"),
    "stops.role": ("fit", "holdout"),
    "stops.direction": ("forward", "backward"),
}


def require_sound(row: Row) -> None:
    """Look at every loaded cell of a row.

    Raises:
        StoreError: one is empty that must not be, or holds another kind of value.
    """
    state = inspect(row)
    loaded = state.dict
    for place in state.mapper.column_attrs:
        column = place.columns[0]
        if place.key not in loaded:
            continue
        cell = loaded[place.key]
        name = f"{column.table}.{column.name}"
        if not _fits(cell, column.type.python_type, is_nullable=bool(column.nullable)) or (
            name in _ONE_OF and cell not in _ONE_OF[name]
        ):
            keys = ", ".join(str(key)[:20] for key in state.mapper.primary_key_from_instance(row))
            raise StoreError(
                f"the database is damaged: {name} of row {keys} is {_shown(cell)}",
                advice="bring it back from a copy",
            )


def _fits(cell: object, kind: type, *, is_nullable: bool) -> bool:
    if cell is None:
        return is_nullable
    if kind is float:
        return isinstance(cell, float | int) and not isinstance(cell, bool)
    if kind is int:
        return isinstance(cell, int) and not isinstance(cell, bool)
    return isinstance(cell, kind)


def _shown(cell: object) -> str:
    text = repr(cell)
    return "empty" if cell is None else text if len(text) <= 40 else f"{text[:37]}..."
