"""How large a picture may be that somebody hands in."""

from typing import Final

MOST_BYTES: Final = 150_000_000
"""Of one decoded picture: 50 Mpx in colour, 75 Mpx in 16 bit, 150 Mpx in 8 bit. No camera of a
bench has more, and a file of a few bytes can claim any size."""
MOST_SIDE_PX: Final = 65_535


class PictureError(ValueError):
    """Why the bytes of a file are no picture that is read; the caller knows the file's name."""


def require_size(width_px: int, height_px: int, pixel_bytes: int) -> None:
    """Refuse a picture before memory is taken for it.

    Args:
        width_px: as the file claims.
        height_px: as the file claims.
        pixel_bytes: what a decoder needs for one pixel.

    Raises:
        PictureError: no pixels, or too many.
    """
    if not (1 <= width_px <= MOST_SIDE_PX and 1 <= height_px <= MOST_SIDE_PX):
        raise PictureError(f"claims {width_px} x {height_px} px, a side has 1 to {MOST_SIDE_PX} px")
    asked = width_px * height_px * pixel_bytes
    if asked > MOST_BYTES:
        raise PictureError(
            f"claims {width_px} x {height_px} px, which take {asked / 1e6:.0f} MB, most are "
            f"{MOST_BYTES / 1e6:.0f} MB"
        )
