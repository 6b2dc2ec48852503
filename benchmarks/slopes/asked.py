"""What the command line asked of a part of the benchmark."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Asked:
    """`NAME:WORD` narrows a part to the lines whose name contains the word."""

    word: str = ""
    pictures: Path | None = None
    """Folder for pictures to look at; None for none."""

    def wants(self, name: str) -> bool:
        """Whether a line of this name is asked for."""
        return self.word.lower() in name.lower()
