"""AprilGrids: their layout, their tags and their corners."""
