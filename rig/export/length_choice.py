"""Units that the lengths of a file may be said to be in."""

MM_PER = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
BY_PROFILE = "profile"
"""Choice that makes the views stand as far apart as the profile says."""
CHOICES = (*MM_PER, BY_PROFILE)
