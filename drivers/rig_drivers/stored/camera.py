"""What all cameras have in common whose pictures are already there."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Self

from rig.devices import not_open
from rig.errors import DeviceLostError
from rig.frames import MultiView
from rig.profile import ViewConfig


class StoredCamera(ABC):
    """Gives every stored multi-view once, in order; keeps `Camera`.

    Stored pictures have no freshness: `grab` gives the next multi-view whenever it is called. After
    the last one `grab` raises `DeviceLostError` and `stream` ends; opening starts again.

    Args:
        name: of the camera in messages.
        place: file or folder of the pictures.
        views: views of the profile.
    """

    def __init__(self, name: str, place: Path, views: Sequence[ViewConfig]) -> None:
        self._name = name
        self._place = place
        self._views = tuple(view.name for view in views)
        self._taken: int | None = None

    def __enter__(self) -> Self:
        """Find the pictures.

        Raises:
            DeviceNotFoundError: they are not there, or not those of these views.
        """
        try:
            self._open()
        except BaseException:
            self._close()
            raise
        self._taken = 0
        return self

    def __exit__(self, *_: object) -> None:
        self._taken = None
        self._close()

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; stored pictures are never dropped."""
        return {}

    def grab(self, timeout_s: float) -> MultiView:
        """Return the next stored multi-view; `timeout_s` does not matter.

        Raises:
            DeviceLostError: there is no further one, or it is damaged.
        """
        multiview = self._following()
        if multiview is None:
            raise DeviceLostError(
                self._name,
                f"asked for multi-view {(self._taken or 0) + 1}, {self._place} holds {self._taken}",
                advice="ask for fewer frames or open it again",
            )
        return multiview

    def stream(self) -> Iterator[MultiView]:
        """Yield every multi-view that is left, once, and end."""
        while (multiview := self._following()) is not None:
            yield multiview

    def _following(self) -> MultiView | None:
        if self._taken is None:
            raise not_open(self._name)
        multiview = self._read(self._taken)
        if multiview is not None:
            self._taken += 1
        return multiview

    @abstractmethod
    def _open(self) -> None:
        """Find the pictures and begin with the first; what was opened `_close` closes."""

    @abstractmethod
    def _close(self) -> None:
        """Let go of all that `_open` opened; safe at any time."""

    @abstractmethod
    def _read(self, number: int) -> MultiView | None:
        """Read a multi-view, one after the other from 0; None after the last one."""
