"""The ink of a grid of circles."""

from rig.targets.circles.grid import CircleGrid
from rig.targets.printing.drawing import Area, Disc


def circles_size_mm(grid: CircleGrid) -> tuple[float, float]:
    """Return width and height with the white that must be around the circles: a gap of it."""
    wide_mm, high_mm = grid.points_mm.reshape(-1, 3)[:, :2].max(axis=0).tolist()
    around_mm = grid.diameter_mm + 2.0 * grid.gap_mm
    return wide_mm + around_mm, high_mm + around_mm


def circle_areas(grid: CircleGrid, x_mm: float, y_mm: float) -> tuple[Area, ...]:
    """Return what to paint on white paper for a grid whose white begins at a place."""
    radius_mm = grid.diameter_mm / 2
    inside_mm = radius_mm + grid.gap_mm
    discs = tuple(
        Disc(x_mm + inside_mm + x, y_mm + inside_mm + y, radius_mm)
        for x, y, _ in grid.points_mm.reshape(-1, 3).tolist()
    )
    return (Area("black", (), discs),)
