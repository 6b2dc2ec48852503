"""How a long run tells how far it is, and what else there is to say."""

from collections.abc import Callable

Progress = Callable[[int, str], None]
"""Told how many parts of a run are done, and where it is."""
Tell = Callable[[str], None]
"""Told one line beside the progress: what begins, what a person should do, how a run ended."""
