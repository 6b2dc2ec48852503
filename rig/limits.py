"""How much a sweep may be asked for: a slip of a few zeros would take all memory or all week."""

from typing import Final

MOST_STOPS: Final = 10_000
MOST_SAMPLES: Final = 1_000
"""At one stop."""
