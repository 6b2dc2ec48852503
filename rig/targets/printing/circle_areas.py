"""The ink of a grid of circles."""

from rig.targets.circles.grid import CircleGrid
from rig.targets.printing.drawing import Area, Disc


def circles_size_mm(grid: CircleGrid) -> tuple[float, float]:
    """Return width and height from the edges of the outermost circles."""
    wide_mm, high_mm = grid.points_mm.reshape(-1, 3)[:, :2].max(axis=0).tolist()
    return wide_mm + grid.diameter_mm, high_mm + grid.diameter_mm


def circle_areas(grid: CircleGrid, x_mm: float, y_mm: float) -> tuple[Area, ...]:
    """Return what to paint on white paper for a grid whose outermost edges begin at a place."""
    radius_mm = grid.diameter_mm / 2
    discs = tuple(
        Disc(x_mm + radius_mm + x, y_mm + radius_mm + y, radius_mm)
        for x, y, _ in grid.points_mm.reshape(-1, 3).tolist()
    )
    return (Area("black", (), discs),)
