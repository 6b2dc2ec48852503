"""What the server hands to pages."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from rig.view.wire import encode


class Message(Protocol):
    """One instant of a run. The server numbers it; a page gets the newest, or none."""

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        """Return it as `rig.view.wire` writes it.

        Args:
            number: goes into the header as `number`; a page acknowledges by it.
            wants: names of the arrays that a page asks for beside the map itself.
        """
        ...


@dataclass(frozen=True, slots=True)
class PlainMessage:
    """A header and arrays that everybody gets."""

    mode: str
    """What kind of run it is: capture, sweep, calibrate. The page shows what belongs to it."""
    header: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict[str, NDArray[Any]])

    def encoded(self, number: int, wants: frozenset[str]) -> bytes:
        """Return the message; what a page wants changes nothing."""
        del wants
        return encode({"mode": self.mode, "number": number, **self.header}, self.arrays)
