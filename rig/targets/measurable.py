"""How large and how sharp squares must be for their corners to be measured."""

from rig.errors import TargetError

MIN_SIDE_PX = 6.0
"""Smaller squares leave no room between one edge and the next."""
MAX_BLUR_RATIO = 0.2
"""Sigma of an edge over the side of a square, above which neighbouring edges run together."""
_SHARP_PX = 1.5
"""Edges in focus have a smaller sigma: where even they run together, squares are small."""


def check_measurable(board: str, side_px: float, blur_px: float) -> None:
    """Refuse corners that are there but too small or too blurred to measure.

    Args:
        board: what it is called, such as "9 x 6 board".
        side_px: side of its squares.
        blur_px: sigma of their edges.

    Raises:
        TargetError: with reason too-small or blurred.
    """
    if side_px < MIN_SIDE_PX:
        raise TargetError(
            f"{board} found with squares of {side_px:.1f} px, at least {MIN_SIDE_PX:.0f} px are "
            "needed",
            advice="bring the board nearer or use larger squares",
            reason="too-small",
        )
    if blur_px <= MAX_BLUR_RATIO * side_px:
        return
    if blur_px < _SHARP_PX:
        raise TargetError(
            f"{board} found with squares of {side_px:.1f} px, whose edges of {blur_px:.1f} px run "
            "together",
            advice="bring the board nearer or use larger squares",
            reason="too-small",
        )
    raise TargetError(
        f"{board} found with edges blurred by {blur_px:.1f} px on squares of {side_px:.1f} px, at "
        f"most {MAX_BLUR_RATIO * side_px:.1f} px can be measured",
        advice="focus the lens, or hold the board still",
        reason="blurred",
    )
