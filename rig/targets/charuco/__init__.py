"""ChArUco boards: their layout, their markers and their corners."""
