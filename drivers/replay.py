"""A recording as a camera: every stored multi-view once, in order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

from rig.devices import Clock
from rig.errors import DeviceLostError, DeviceNotFoundError, StoreError
from rig.frames import MultiView
from rig.profile import RecordingCameraConfig, ViewConfig
from rig.recording import recorded, recorded_views

_NAME = "camera recording"


class ReplayCamera:
    """Plays a recording back, as fast as it is asked; keeps `Camera`.

    Recorded frames have no freshness: `grab` gives the next multi-view whenever it is called. Its
    times are moved to the present, and the differences between its views stay as they were. After
    the last multi-view `grab` raises `DeviceLostError` and `stream` ends; opening starts again.

    Args:
        config: the file.
        views: views of the profile; the recording must have the same names.
        clock: gives the present.
    """

    def __init__(
        self, config: RecordingCameraConfig, views: Sequence[ViewConfig], clock: Clock
    ) -> None:
        self._path = Path(config.file)
        self._config = config
        self._views = tuple(view.name for view in views)
        self._clock = clock
        self._left: Iterator[MultiView] | None = None
        self._taken = 0

    def __enter__(self) -> Self:
        """Open the file.

        Raises:
            DeviceNotFoundError: no such file, not a recording, or one of other views.
        """
        try:
            found = recorded_views(self._path)
        except StoreError as error:
            raise DeviceNotFoundError(_NAME, str(error)) from error
        if sorted(found) != sorted(self._views):
            raise DeviceNotFoundError(
                _NAME,
                f"{self._path} holds the views {', '.join(found)}, the profile has "
                f"{', '.join(self._views)}; name the profile that it was recorded with",
            )
        self._left = recorded(self._path)
        self._taken = 0
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._left = None

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "recording", "model": "recorded images", "serial": str(self._path)}

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return self._views

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`; recorded images are never dropped."""
        return {}

    def grab(self, timeout_s: float) -> MultiView:
        """Return the next recorded multi-view; `timeout_s` does not matter.

        Raises:
            DeviceLostError: there is no further one, or the file is damaged.
        """
        multi_view = self._next()
        if multi_view is None:
            raise DeviceLostError(
                _NAME,
                f"asked for multi-view {self._taken + 1}, {self._path} holds {self._taken}; "
                "ask for fewer frames or open it again",
            )
        return multi_view

    def stream(self) -> Iterator[MultiView]:
        """Yield every multi-view that is left, once, and end."""
        while (multi_view := self._next()) is not None:
            yield multi_view

    def _next(self) -> MultiView | None:
        if self._left is None:
            raise DeviceLostError(_NAME, 'asked for frames, but it is not open; use "with camera:"')
        try:
            stored = next(self._left, None)
        except StoreError as error:
            raise DeviceLostError(_NAME, str(error)) from error
        if stored is None:
            return None
        self._taken += 1
        return self._of_the_present(stored)

    def _of_the_present(self, stored: MultiView) -> MultiView:
        later_s = self._clock.now_s() - min(frame.began_s for frame in stored.frames)
        by_view = {
            frame.view: replace(frame, timestamp_s=frame.timestamp_s + later_s)
            for frame in stored.frames
        }
        frames = tuple(by_view[view] for view in self._views)
        ends_s = max(frame.timestamp_s for frame in frames)
        self._clock.sleep_s(ends_s - self._clock.now_s())
        return replace(stored, frames=frames)
