"""The axes of a controller; one of them carries the board, the others turn no motor."""

AXES = "XYZ"
Vector = tuple[float, float, float]
"""One coordinate per axis, mm."""
