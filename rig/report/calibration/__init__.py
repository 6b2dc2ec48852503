"""The page of a geometric calibration: what it is worth, and the pictures that show why."""
