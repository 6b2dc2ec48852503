"""Who may read what a rig stores: only its user, unless `RIG_FILE_MODE` says otherwise."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.errors import ConfigError

VARIABLE = "RIG_FILE_MODE"
_READ_BITS = 0o444
_OWNER = 0o600
"""Without these the program could not go on with its own files."""
_MOST = 0o666


@dataclass(frozen=True, slots=True)
class FileModes:
    """Permission bits of files, and of folders: those may be entered by who may read."""

    file: int = 0o600

    @property
    def folder(self) -> int:
        """Bits of a folder."""
        return self.file | (self.file & _READ_BITS) >> 2

    @classmethod
    def of(cls, environment: Mapping[str, str]) -> "FileModes":
        """Return what `RIG_FILE_MODE` asks for, as in chmod(1): 0640 lets the group read.

        Args:
            environment: variables, as in `os.environ`.

        Raises:
            ConfigError: it is no such number, lets the user not read and write, or makes files
                that can be run.
        """
        text = environment.get(VARIABLE, "")
        if not text:
            return cls()
        digits = text.removeprefix("0o")
        is_octal = digits.isascii() and digits.isdecimal() and not set("89") & set(digits)
        mode = int(digits, 8) if is_octal and len(digits) <= len("0666") else -1
        if mode & _OWNER != _OWNER or not 0 <= mode <= _MOST or mode & ~_MOST:
            raise ConfigError(
                f"{VARIABLE} is {text!r}, wanted are permission bits of files from 0600 to 0666",
                advice="0600 keeps everything private, 0640 lets the group read, 0660 also write",
            )
        return cls(mode)
