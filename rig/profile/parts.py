"""Parts of a picture: where the views of a device lie that gives several of them in one picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

from pydantic import ConfigDict, Field, model_validator

from rig.profile.model import Model

Layout = Literal[
    "whole", "side-by-side", "four-side-by-side", "top-bottom", "two-by-two", "interleaved"
]
"""How equal places lie in a picture: `interleaved` by columns in turn, all others as tiles."""

_TILES: Final[Mapping[str, tuple[int, int]]] = {
    "whole": (1, 1),
    "side-by-side": (2, 1),
    "four-side-by-side": (4, 1),
    "top-bottom": (1, 2),
    "two-by-two": (2, 2),
    "interleaved": (2, 1),
}
"""By layout: how many places lie across and down."""
IN_TURN: Final = ("Y8I", "Y12I")
"""Pixel formats in which two sensors give every pixel in turn: the picture is twice as wide."""
_TWO_WIDE, _FOUR_WIDE, _TWO_HIGH = 2.4, 4.8, 0.95
"""Width over height: from 2 x 5:4 and 4 x 5:4 on there are two or four in a row, with a little
room; a picture that is higher than wide is two, one above the other."""
SHORTHAND: Final = rf"^({'|'.join(get_args(Layout))}):[1-9][0-9]*$"
"""`side-by-side:2` for the second place."""


@dataclass(frozen=True, slots=True)
class Region:
    """The pixels of one view in the picture of its device."""

    x_px: int
    """Column of the first pixel."""
    y_px: int
    """Row of the first pixel."""
    width_px: int
    """Columns that belong to it,"""
    height_px: int
    """and rows."""
    column_step_px: int = 1
    """From one of its columns to the next."""

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return self.width_px, self.height_px

    @property
    def rows(self) -> range:
        """Its rows in the picture."""
        return range(self.y_px, self.y_px + self.height_px)

    @property
    def columns(self) -> range:
        """Its columns in the picture."""
        step_px = self.column_step_px
        return range(self.x_px, self.x_px + step_px * self.width_px, step_px)

    def shared_px(self, other: "Region") -> tuple[int, int]:
        """Return how many columns and rows another one has as well; 0 x 0 where they are apart."""
        columns = len(set(self.columns) & set(other.columns))
        rows = len(set(self.rows) & set(other.rows))
        return (columns, rows) if columns and rows else (0, 0)

    def __str__(self) -> str:
        """Return it in words."""
        turn = "" if self.column_step_px == 1 else f", every {self.column_step_px}nd column"
        columns, rows = self.columns, self.rows
        return (
            f"{self.width_px} x {self.height_px} px "
            f"(x {columns[0]}..{columns[-1]}{turn}, y {rows[0]}..{rows[-1]})"
        )


def _with_shorthand(schema: dict[str, Any]) -> None:
    table = dict(schema)
    schema.clear()
    schema["anyOf"] = [{"type": "string", "pattern": SHORTHAND}, table]


class PartConfig(Model):
    """Which part of its device's picture a view is: a place of a layout, or a rectangle of it.

    `"side-by-side:2"` is short for `{ layout = "side-by-side", place = 2 }`.
    """

    model_config = ConfigDict(json_schema_extra=_with_shorthand)

    layout: Layout = "whole"
    """`side-by-side` and `four-side-by-side`: two or four places in a row; `top-bottom`: two, one
    above the other; `two-by-two`: four, row by row; `interleaved`: two, whose columns take turns
    (`Y8I` and `Y12I`); `whole`: the picture itself."""
    place: int = Field(default=1, ge=1)
    """Which place, from 1: from left to right, then from top to bottom."""
    x_px: int = Field(default=0, ge=0)
    """First column within the place."""
    y_px: int = Field(default=0, ge=0)
    """First row within the place."""
    width_px: int | None = Field(default=None, ge=16)
    """Columns; None for all that are left of the place."""
    height_px: int | None = Field(default=None, ge=16)
    """Rows; None for all that are left of the place."""

    @model_validator(mode="before")
    @classmethod
    def _read_shorthand(cls, given: object) -> object:
        if not isinstance(given, str):
            return given
        layout, colon, place = given.partition(":")
        if not (colon and place.isdecimal() and layout in _TILES):
            raise ValueError(
                f'{given!r} is no part of a picture; write "LAYOUT:PLACE" as "side-by-side:2" '
                f"(layouts: {', '.join(_TILES)}), or a table with x_px, y_px, width_px, height_px"
            )
        return {"layout": layout, "place": int(place)}

    @model_validator(mode="after")
    def _place_is_there(self) -> "PartConfig":
        places = places_of(self.layout)
        if self.place > places:
            raise ValueError(f"layout {self.layout} has places 1 to {places}, found {self.place}")
        return self

    @property
    def is_in_turn(self) -> bool:
        """Whether its columns alternate with those of another view."""
        return self.layout == "interleaved"

    def region(self, picture_px: tuple[int, int]) -> Region:
        """Return its pixels.

        Args:
            picture_px: width and height of the device's picture.

        Raises:
            ValueError: the picture has no such places, or the part leaves its place.
        """
        across, down = _TILES[self.layout]
        width_px, height_px = picture_px
        if width_px % across or height_px % down:
            raise ValueError(
                f"layout {self.layout} needs a picture of {across} x {down} equal places, found "
                f"{width_px} x {height_px} px"
            )
        room_px = (width_px // across, height_px // down)
        own_px = (
            self.width_px or room_px[0] - self.x_px,
            self.height_px or room_px[1] - self.y_px,
        )
        ends_px = (self.x_px + own_px[0], self.y_px + own_px[1])
        if min(own_px) < 1 or ends_px[0] > room_px[0] or ends_px[1] > room_px[1]:
            raise ValueError(
                f"asked for x {self.x_px}..{ends_px[0] - 1}, y {self.y_px}..{ends_px[1] - 1}, "
                f"{'the picture' if self.layout == 'whole' else f'a place of {self.layout}'} has "
                f"{room_px[0]} x {room_px[1]} px"
            )
        row, column = divmod(self.place - 1, across)
        if self.is_in_turn:
            return Region(2 * self.x_px + column, self.y_px, *own_px, column_step_px=2)
        x_px, y_px = column * room_px[0] + self.x_px, row * room_px[1] + self.y_px
        return Region(x_px, y_px, *own_px)


def places_of(layout: str) -> int:
    """Return how many views a picture of this layout holds."""
    across, down = _TILES[layout]
    return across * down


def picture_of(layout: str, view_px: tuple[int, int]) -> tuple[int, int]:
    """Return width and height of a picture whose places have this width and height."""
    across, down = _TILES[layout]
    return across * view_px[0], down * view_px[1]


def layouts() -> tuple[str, ...]:
    """Return the layouts that hold more than one view."""
    return tuple(layout for layout in _TILES if places_of(layout) > 1)


def regions_in(parts: Mapping[str, PartConfig], picture_px: tuple[int, int]) -> dict[str, Region]:
    """Return the pixels of all views of one device, which share none.

    Args:
        parts: of each view of the device.
        picture_px: width and height of the device's picture.

    Raises:
        ValueError: a part is not in the picture, or two overlap; names views and numbers.
    """
    found: dict[str, Region] = {}
    for view, part in parts.items():
        try:
            region = part.region(picture_px)
        except ValueError as error:
            raise ValueError(f"parts.{view}: {error}") from error
        for other, taken in found.items():
            columns, rows = region.shared_px(taken)
            if columns:
                raise ValueError(
                    f"parts.{other} and parts.{view} overlap in {columns} x {rows} px: {taken} and "
                    f"{region}; give each view pixels of its own"
                )
        found[view] = region
    return found


def require_parts(sources: Mapping[str, str], parts: Mapping[str, PartConfig], key: str) -> None:
    """Refuse views that have the same picture, and do not say which part of it.

    Args:
        sources: by view: what gives its picture.
        parts: by view, where it is not the whole picture.
        key: names the sources in messages.

    Raises:
        ValueError: a view has no part of its own, or a part belongs to no view.
    """
    unknown = sorted(set(parts) - set(sources))
    if unknown:
        raise ValueError(f"parts names no view: {', '.join(unknown)}")
    for source, views in by_source(sources).items():
        without = [view for view in views if view not in parts]
        if len(views) > 1 and without:
            raise ValueError(
                f"{key} names {source} for {len(views)} views, {', '.join(views)}; where its "
                f"picture holds them all, say in parts where {', '.join(without)} lies, as in "
                'parts = { left = "side-by-side:1", right = "side-by-side:2" }'
            )


def by_source(sources: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the views of each source, in order."""
    found: dict[str, tuple[str, ...]] = {}
    for view, source in sources.items():
        found[source] = (*found.get(source, ()), view)
    return found


def likely_layout(picture_px: tuple[int, int] | None, pixel_formats: Sequence[str]) -> str | None:
    """Guess how many views a device's pictures hold, by their shape; None for a single one.

    Sensors are between 5:4 and 16:9. What is much wider or higher is more than one of them; four
    in two rows have the shape of one and cannot be told. Only ever an offer.

    Args:
        picture_px: width and height.
        pixel_formats: what the device offers; some hold two views by their nature.
    """
    if any(name in IN_TURN for name in pixel_formats):
        return "interleaved"
    if picture_px is None or min(picture_px) < 1:
        return None
    ratio = picture_px[0] / picture_px[1]
    if ratio >= _FOUR_WIDE:
        return "four-side-by-side"
    if ratio >= _TWO_WIDE:
        return "side-by-side"
    return "top-bottom" if ratio < _TWO_HIGH else None
