"""One picture that holds several views, taken apart."""

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Self, TypeVar, cast

import numpy as np

from rig.devices import Camera
from rig.errors import CaptureTimeoutError
from rig.frames import ColourImage, GreyImage, MultiView
from rig.profile import Region
from rig_drivers.together import Startable

Image = TypeVar("Image", GreyImage, ColourImage)


def cut(image: Image, region: Region) -> Image:
    """Return the pixels of one view as an image of its own.

    Args:
        image: of the device, (H, W) or (H, W, 3).
        region: within that image.
    """
    columns, rows = region.columns, region.rows
    part = image[rows.start : rows.stop, columns.start : columns.stop : columns.step]
    return cast("Image", np.ascontiguousarray(part))


class SplitCamera:
    """A camera of one view whose picture holds several; keeps `Camera`.

    All views of a multi-view have the time and the number of the one frame that they are cut from:
    their skew is 0.

    Args:
        camera: with one view, closed; it is opened and closed with this one.
        regions: by view: its pixels in the picture of `camera`; their order is that of the views.
    """

    def __init__(self, camera: Camera, regions: Mapping[str, Region]) -> None:
        self._camera = camera
        self._regions = dict(regions)

    def __enter__(self) -> Self:
        self._camera.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._camera.__exit__(None, None, None)

    def start(self) -> None:
        """Start the camera where it can be started by itself."""
        if isinstance(self._camera, Startable):
            self._camera.start()

    @property
    def identity(self) -> Mapping[str, str]:
        """See `Device.identity`; with the places of the views in the picture."""
        places = "; ".join(f"{view} {region}" for view, region in self._regions.items())
        return {**self._camera.identity, "parts": places}

    @property
    def views(self) -> tuple[str, ...]:
        """See `Camera.views`."""
        return tuple(self._regions)

    @property
    def dropped(self) -> Mapping[str, int]:
        """See `Camera.dropped`."""
        return self._camera.dropped

    def grab(self, timeout_s: float) -> MultiView:
        """See `Camera.grab`."""
        with self._naming_all(timeout_s):
            return self._apart(self._camera.grab(timeout_s))

    def stream(self) -> Iterator[MultiView]:
        """See `Camera.stream`."""
        for multiview in self._camera.stream():
            yield self._apart(multiview)

    def _apart(self, multiview: MultiView) -> MultiView:
        (whole,) = multiview.frames
        colour = whole.colour
        frames = tuple(
            replace(
                whole,
                view=view,
                image=cut(whole.image, region),
                colour=None if colour is None else cut(colour, region),
            )
            for view, region in self._regions.items()
        )
        return replace(multiview, frames=frames)

    @contextmanager
    def _naming_all(self, timeout_s: float) -> Generator[None]:
        """Let a timeout name the views, and not the one picture that did not come."""
        try:
            yield
        except CaptureTimeoutError as error:
            raise CaptureTimeoutError(
                error.device, missing=self.views, timeout_s=timeout_s
            ) from error
