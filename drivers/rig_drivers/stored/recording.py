"""A recording as a camera: every stored multi-view once, in order."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rig.devices import Clock
from rig.errors import DeviceLostError, DeviceNotFoundError, StoreError
from rig.frames import MultiView
from rig.profile import RecordingCameraConfig, ViewConfig
from rig.recording import Recorded, recorded, recorded_views
from rig_drivers.stored.camera import StoredCamera

_NAME = "camera recording"


class ReplayCamera(StoredCamera):
    """Plays a recording back, as fast as it is asked; keeps `Camera`.

    Times are moved to the present, and the differences between the views stay as they were.

    Args:
        config: the file.
        views: views of the profile; the recording must have the same names.
        clock: gives the present.
    """

    def __init__(
        self, config: RecordingCameraConfig, views: Sequence[ViewConfig], clock: Clock
    ) -> None:
        super().__init__(_NAME, Path(config.file), views)
        self._clock = clock
        self._left: Iterator[Recorded] = iter(())

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`."""
        return {"kind": "recording", "model": "recorded images", "serial": str(self._place)}

    def _open(self) -> None:
        try:
            found = recorded_views(self._place)
        except StoreError as error:
            raise DeviceNotFoundError(_NAME, error.found, advice=error.advice) from error
        if sorted(found) != sorted(self._views):
            raise DeviceNotFoundError(
                _NAME,
                f"{self._place} holds the views {', '.join(found)}, the profile has "
                f"{', '.join(self._views)}",
                advice="name the profile that it was recorded with",
            )
        self._left = recorded(self._place)

    def _close(self) -> None:
        if isinstance(self._left, Generator):
            self._left.close()  # and with it the file
        self._left = iter(())

    def _read(self, number: int) -> MultiView | None:
        try:
            stored = next(self._left, None)
        except StoreError as error:
            raise DeviceLostError(_NAME, error.found, advice=error.advice) from error
        return None if stored is None else self._of_the_present(stored.views)

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
